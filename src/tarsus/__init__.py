"""Tarsus: contact dynamics of legged piezoelectric micro-robots.

Names are listed in `__init__.pyi` and loaded when first used, so that ``import tarsus`` is light.
"""

TYPE_CHECKING = False  # not imported: `typing` is half of what this module would load
if TYPE_CHECKING:
    from typing import Any

_HOMES: "dict[str, tuple[str, str]]" = {}
"""Module and name there, of every name that is offered; filled at the first question.

`lazy_loader.attach_stub` reads such a file too, with `ast` and through relative imports alone: half of what importing
this package takes.
"""


_GUESSES = {
    "load": "'load_scene' (a device or a scene file) or 'load_run' (a run's folder)",
    "open": "'load_scene' (a device or a scene file) or 'load_run' (a run's folder)",
    "read": "'load_scene' (a device or a scene file) or 'load_run' (a run's folder)",
    "read_run": "'load_run'",
    "save": "run.write(folder), or 'write_scene'",
    "run": "'simulate'",
    "batch": "'simulate_batch'",
}
"""The right spelling of names that are guessed."""


def _homes() -> "dict[str, tuple[str, str]]":
    if not _HOMES:
        with open(__file__.removesuffix("c") + "i", encoding="utf-8") as stub:
            lines = [line.split() for line in stub if line.startswith(("from tarsus.", "from tarsus "))]
        for _, module, _, *words in lines:
            for name, _, offered in (" ".join(words).split(", ")[k].split() for k in range(words.count("as"))):
                _HOMES[offered] = (module, name)
    return _HOMES


def __getattr__(name: str) -> "Any":
    if name == "__all__":
        return sorted(_homes())
    if name == "__version__":
        from importlib.metadata import version

        return version("tarsus")
    from importlib import import_module

    if name not in _homes():
        found = None if name.startswith("_") else _added(name)
        if found is None:
            from tarsus.base.messages import no_attribute

            raise AttributeError(no_attribute("module 'tarsus'", name, _GUESSES, _HOMES))
        globals()[name] = found
        return found
    module, own = _HOMES[name]
    if module == __name__ or module.startswith(f"{__name__}.{name}."):  # a room; one of a verb's name can be called
        return import_module(f"{__name__}.{name}")
    found = import_module(module)
    value = getattr(found, own) if hasattr(found, own) else import_module(f"{module}.{own}")  # one of its files
    globals()[name] = value
    return value


def _added(name: str) -> "Any":
    """The function of a verb that an installed package adds (entry point group `tarsus.commands`): what its module's
    `FUNCTION` names, "package.module:function"; None where no package has such a verb, or its module no such name."""
    from importlib import import_module
    from importlib.metadata import entry_points

    for entry in entry_points(group="tarsus.commands", name=name):
        module, _, function = getattr(import_module(entry.module), "FUNCTION", "").partition(":")
        if module:
            return getattr(import_module(module), function)
    return None


def __dir__() -> "list[str]":
    from importlib.metadata import entry_points

    return sorted({*globals(), *_homes(), *entry_points(group="tarsus.commands").names, "__version__"})
