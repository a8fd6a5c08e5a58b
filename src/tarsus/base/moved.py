"""Former homes of modules and former names: what has an old name is found, with a DeprecationWarning."""

from __future__ import annotations

import sys
import warnings
from importlib import import_module
from importlib.machinery import ModuleSpec

TYPE_CHECKING = False  # `typing` and `types` would take longer than all of this module
if TYPE_CHECKING:
    from types import ModuleType

MOVED = {
    "base": "spec units errors workers discover",
    "model": "laws structure drive robot ground scene standing",
    "plan": "slots channels",
    "records": "measurement",
}
_NEW = {f"tarsus.{name}": f"tarsus.{home}.{name}" for home, names in MOVED.items() for name in names.split()}
_NEW |= {"tarsus.explain": "tarsus.base.messages", "tarsus.files.readers": "tarsus.records.readers"}
_NEW |= {"tarsus.identify.belief": "tarsus.identify.prior"}


class FormerHomes:
    """Finds and loads modules by the names they had in Tarsus 0.1.

    It is asked first: the folder of a moved package would lead to its files once more, under the former name. Finders
    and loaders need not derive from those of `importlib.abc`, which load forty modules.
    """

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        return ModuleSpec(name, self) if name.startswith("tarsus.") and _now(name) else None  # type: ignore[arg-type]

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        new = _now(spec.name)
        warnings.warn(f"{spec.name} is now {new}", DeprecationWarning, stacklevel=2)
        found = import_module(new)
        spec.loader_state = found.__spec__, found.__loader__
        return found

    def exec_module(self, module: ModuleType) -> None:
        spec = module.__spec__
        assert spec is not None
        module.__spec__, module.__loader__ = spec.loader_state


def _now(name: str) -> str:
    """Where a module is that had this name; empty if none had it."""
    _, first, *rest = name.split(".")
    old = ".".join(["tarsus", first, *rest[:1]]) if first in ("files", "identify") else f"tarsus.{first}"
    return _NEW[old] + name.removeprefix(old) if old in _NEW else ""


def install() -> None:
    """Let imports by former names be found."""
    if not any(isinstance(one, FormerHomes) for one in sys.meta_path):
        sys.meta_path.insert(0, FormerHomes())


def renamed(module: str, old: str, new: str) -> object:
    """What a module has under a new name, asked for by the former one, with a warning at who asked."""
    warnings.warn(f"{module}.{old} is now {module}.{new}", DeprecationWarning, stacklevel=3)
    return getattr(import_module(module), new)
