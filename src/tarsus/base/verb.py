"""Packages that are verbs too: `tarsus.calibrate` holds names, and `tarsus.calibrate(study)` calls its verb."""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    """A module that is called as the function that it names."""

    _called = ""

    def __call__(self, *args: Any, **options: Any) -> Any:
        return self._function(*args, **options)

    @property
    def _function(self) -> Any:
        """The function, which is loaded when it is first asked for."""
        module, _, function = self._called.partition(":")
        return getattr(import_module(module), function)

    @property
    def __signature__(self) -> Any:
        """Arguments of the function, for `help` and editors."""
        from inspect import signature  # not loaded before somebody asks

        return signature(self._function)

    @property
    def whole_doc(self) -> str:
        """What the package is, and below it what the function takes and returns."""
        from inspect import getdoc

        return f"{vars(self)['__doc__']}\n{getdoc(self._function)}"


def callable_package(name: str, function: str) -> None:
    """Let the module ``name`` be called as ``function``, "tarsus.calibrate.calibrating:calibrate", loaded when called.

    A submodule or package of a verb's name would otherwise hide the function of that name: whichever is imported
    first, both work. Python offers it through the class of a module, which may be replaced.
    """
    module = sys.modules[name]
    module.__class__ = type(_Callable.__name__, (_Callable,), {"_called": function, "__doc__": _Callable.whole_doc})
