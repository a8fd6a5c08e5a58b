"""Verbs: what a wrong word is answered with, and packages that are verbs too: `tarsus.calibrate` holds names, and
`tarsus.calibrate(study)` calls its verb."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import wraps
from importlib import import_module
from types import ModuleType
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def verb(function: Callable[P, R]) -> Callable[P, R]:
    """The function, which answers a word that it does not take with the nearest one that it does, and a value of
    another type with a sentence."""

    @wraps(function)
    def asked(*args: P.args, **options: P.kwargs) -> R:
        from inspect import signature

        from tarsus.base.taken import check_taken

        taken = signature(function)
        try:
            found = taken.bind(*args, **options)
        except TypeError as error:
            from tarsus.base.messages import nearest

            unknown = [word for word in options if word not in taken.parameters]
            near = nearest(unknown[0], taken.parameters) if unknown else ""
            raise TypeError(f"{function.__name__}() {error}{near}") from None
        check_taken(function, found)
        return function(*found.args, **found.kwargs)

    return asked


class _Callable(ModuleType):
    """A module that is called as the function that it names."""

    _called = ""

    def __call__(self, *args: Any, **options: Any) -> Any:
        return verb(self._function)(*args, **options)

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
