"""Examples, and scripts beside the library, as modules, for the tests that run them."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

EXAMPLES = Path(__file__).parents[1] / "examples"


def load(name: str) -> ModuleType:
    """An example as a module."""
    return load_file(EXAMPLES / f"{name}.py", f"example_{name}")


def load_file(file: Path, name: str | None = None) -> ModuleType:
    """A file of Python as a module, of its own name unless another is given."""
    spec = importlib.util.spec_from_file_location(name or file.stem, file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
