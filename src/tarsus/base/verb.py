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
    """The function, which answers a word that it does not take with the nearest one that it does."""

    @wraps(function)
    def asked(*args: P.args, **options: P.kwargs) -> R:
        try:
            return function(*args, **options)
        except TypeError as error:
            from inspect import signature

            from tarsus.base.messages import nearest

            taken = signature(function).parameters
            unknown = [word for word in options if word not in taken]
            within = error.__traceback__ is None or error.__traceback__.tb_next is not None
            if within or not unknown:
                raise
            raise TypeError(f"{error}{nearest(unknown[0], taken)}") from None

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
