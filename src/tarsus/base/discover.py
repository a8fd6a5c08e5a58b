"""What a folder of files holds: the classes defined in them, so that a new file is all that a new class takes."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, TypeVar

from tarsus.base.errors import InputError
from tarsus.base.pythonfile import line_of, said

T = TypeVar("T")


def modules_of(package: str) -> Iterator[ModuleType]:
    """The files of a package in their order, loaded. Raises InputError with the line at which one cannot be."""
    found = {one.name: one.module_finder for one in pkgutil.iter_modules(sys.modules[package].__path__)}
    for name, finder in sorted(found.items()):
        try:
            module = importlib.import_module(f"{package}.{name}")
        except Exception as error:
            file = Path(getattr(finder, "path", ""), f"{name}.py")  # a package may lie in several folders
            raise InputError(f"{file}{line_of(error, file)}: {said(error)}") from error
        yield module


def kind_of_class(one: type[Any]) -> str | None:
    """The default of its field ``kind``, None of a class without one. Raises InputError where methods are missing."""
    if (field := one.model_fields.get("kind")) is None:
        return None
    if inspect.isabstract(one):
        lacking = ", ".join(sorted(one.__abstractmethods__))
        raise InputError(f"{inspect.getfile(one)}: '{field.default}' lacks {lacking}")
    return field.default


def classes_in_folder(package: str, base: type[T], name: Callable[[type[T]], str | None]) -> Mapping[str, type[T]]:
    """Classes derived from a base in the files of a package, in the order of the files.

    name: what a class is called, None for one that is only a base of others.  Raises InputError for two of one name.
    """
    found: dict[str, type[T]] = {}
    for module in modules_of(package):
        for one in vars(module).values():
            if not isinstance(one, type) or not issubclass(one, base) or one.__module__ != module.__name__:
                continue
            called = name(one)
            if called in found:
                raise InputError(f"{module.__file__}: '{called}' is in {found[called].__module__} already")
            if called is not None:
                found[called] = one
    return MappingProxyType(found)
