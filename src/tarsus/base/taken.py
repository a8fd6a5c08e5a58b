"""What a verb takes, by the types that its arguments are declared with (`tarsus.base.arguments`): anything else is
answered with a sentence, before any work."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from inspect import BoundArguments, Parameter
from numbers import Real
from typing import Any, get_args, get_origin

from tarsus.base.errors import InputError, InputProblem

LEAST = {"seed": 0, "threads": 1}
"""Least values of whole numbers that mean the same in every verb."""


def check_taken(function: Callable[..., Any], found: BoundArguments) -> None:
    """Check arguments against the types of a function, in place: a name where several are taken is one of them, and a
    float that is whole is a whole number. `InputError` with everything that is wrong."""
    problems = []
    for name, value in found.arguments.items():
        declared = found.signature.parameters[name]
        kind = str(declared.annotation).removesuffix(" | None")
        if value is None and declared.default is None:
            continue
        many = declared.kind is Parameter.VAR_POSITIONAL
        for one in found.arguments[name] if many else (value,):
            if said := _wrong(kind, name, one, vars(sys.modules[function.__module__])):
                problems.append(InputProblem.at(name, f"{said}, got {_shown(one)}"))
        if kind == "int" and isinstance(value, Real) and float(value).is_integer():
            found.arguments[name] = int(found.arguments[name])
        elif kind.startswith("Sequence[") and isinstance(value, str | os.PathLike):
            found.arguments[name] = (value,)
    if problems:
        raise InputError(problems)


def _wrong(kind: str, name: str, value: Any, names: Mapping[str, Any]) -> str:
    """What is expected, where a value is no such thing; "" where it may be one."""
    if kind == "int" or (kind == "Workers" and isinstance(value, str | Real)):
        least = LEAST.get(name)
        whole = isinstance(value, Real) and not isinstance(value, bool) and float(value).is_integer()
        fits = whole and (least is None or float(value) >= least)
        return "" if fits else "expected a whole number" + ("" if least is None else f" of {least} or more")
    if kind in ("Ranges", "Ranges | FilePath") and hasattr(value, "items"):
        return "" if all(_several(ends, 2) for ends in value.values()) else "expected both ends of every range"
    expected, fits = {
        "bool": ("expected True or False", isinstance(value, int) or type(value).__name__ in ("bool", "bool_")),
        "float": ("expected a number", isinstance(value, Real)),
        "str": ("expected a text", isinstance(value, str)),
        "Ranges": ('expected ranges by path, as {"robot.feet.tip.gap": ("66 um", "74 um")}', False),
        "Values": ("expected values by name, as {name: value}", hasattr(value, "items")),
        "Quantities": ("expected values by path, as {path: value}", hasattr(value, "items")),
        "Range": ('expected both ends of a range, as ("100 Hz", "2 kHz")', _several(value, 2)),
        "Counts": ("expected fewest and most, as (0, 1)", _several(value, 2)),
        "Axis": ('expected a path and both ends, as ("volts", 4, 8)', _several(value, 3, 4)),
    }.get(kind, ("", True))
    if kind.startswith("Mapping[") and " | " not in kind:
        expected, fits = "expected values by name, as {name: value}", hasattr(value, "items")
    if expected:
        return "" if fits else expected
    own = kind == "Study" or (name == "output" and isinstance(value, Mapping))  # `tarsus.sweep` says what to do
    return "" if own else _no_name(value, _classes(kind, names))


def _several(value: Any, *counts: int) -> bool:
    return hasattr(value, "__len__") and not isinstance(value, str | Mapping) and len(value) in counts


def _classes(kind: str, names: Mapping[str, Any]) -> tuple[type, ...]:
    """The classes of a type that a name or a path is one of; none of any other type."""
    known = {"str": str, "os.PathLike[str]": os.PathLike}
    parts: list[Any] = [known.get(one) or names.get(one) for one in kind.split(" | ")]
    if None in parts:
        return ()
    found: list[Any] = [get_origin(one) or one for part in parts for one in get_args(part) or (part,)]
    return tuple(found) if os.PathLike in found else ()


def _no_name(value: Any, classes: tuple[type, ...]) -> str:
    if not classes or isinstance(value, classes):
        return ""
    others = [f"{_a(one)}, " for one in classes if one not in (str, os.PathLike)]
    return f"expected {''.join(others)}a name or a path"


def _shown(value: Any) -> str:
    """A value of Python as it is typed; of anything else what it is."""
    return repr(value) if value is None or isinstance(value, str | Real | list | tuple | dict) else _a(type(value))


def _a(kind: type) -> str:
    return f"{'an' if kind.__name__[0] in 'AEIO' else 'a'} {kind.__name__}"
