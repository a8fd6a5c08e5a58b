"""What a folder of files holds: the classes defined in them, so that a new file is all that a new class takes."""

from __future__ import annotations

import importlib
import pkgutil
import sys
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TypeVar

T = TypeVar("T")


def classes_beside(package: str, base: type[T], name: Callable[[type[T]], str | None]) -> Mapping[str, type[T]]:
    """Classes derived from a base in the files of a package, in the order of the files.

    name: what a class is called, None for one that is only a base of others.  Raises TypeError for two of one name.
    """
    found: dict[str, type[T]] = {}
    for file in sorted(pkgutil.iter_modules(sys.modules[package].__path__), key=lambda one: one.name):
        module = importlib.import_module(f"{package}.{file.name}")
        for one in vars(module).values():
            if not isinstance(one, type) or not issubclass(one, base) or one.__module__ != module.__name__:
                continue
            called = name(one)
            if called in found:
                raise TypeError(f"{one.__module__}: '{called}' is in {found[called].__module__} already")
            if called is not None:
                found[called] = one
    return MappingProxyType(found)
