"""The scenes of a calibration: what a study's function changes in a row becomes a template, which many sets share, and
the floats of one set."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import float_paths, with_values
from tarsus.base.units import parse_quantity
from tarsus.files.rowfunction import RowFunction
from tarsus.model.scene import Scene

Cell = float | str
Key = tuple[object, ...]
"""What of a row's changes is no float."""

_AMOUNT = re.compile(r"\s*[-+]?[0-9.]+(e[-+]?[0-9]+)?(\s+\S.*)?", re.IGNORECASE)


class UnknownValues(SimpleNamespace):
    """What a study's function is given of a set: SI values of unknowns and options of choices, as attributes."""

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"there is no unknown '{name}'{nearest(name, vars(self))}")


@dataclass(frozen=True)
class Row:
    """One run: cells of its conditions, and changes that prevail over those of the function (a constraint's own).

    motion: its motion is read as well.
    """

    name: str
    cells: Mapping[str, Cell]
    last: Mapping[str, Any] = field(default_factory=dict)
    motion: bool = False


@dataclass(frozen=True)
class RowChanges:
    """What differs in a row from the study's scene: what is no number as it was given (wholes), and numbers by path,
    those inside of wholes too (texts with a unit not yet read); rest: what of all is no number, by path."""

    wholes: dict[str, Any]
    numbers: dict[str, float | str]
    rest: dict[str, object]

    @classmethod
    def of(cls, given: Mapping[str, Any], last: Mapping[str, Any]) -> RowChanges:
        """From values by path; what ``last`` gives at a path prevails over what was given there and inside it."""
        every = {one: value for one, value in given.items() if not any(f"{one}.".startswith(f"{p}.") for p in last)}
        every |= last
        wholes = {path: value for path, value in every.items() if not _is_amount(value)}
        leaves = dict(_leaves(wholes)) | {path: value for path, value in every.items() if path not in wholes}
        numbers = {path: value for path, value in leaves.items() if _is_amount(value)}
        return cls(wholes, numbers, {path: one for path, one in leaves.items() if path not in numbers})

    @property
    def key(self) -> Key:
        """What two sets have alike that may share a template: all but numbers."""
        return tuple((path, repr(value)) for path, value in self.rest.items()), tuple(self.numbers)

    def word(self, path: str) -> dict[str, object]:
        """What at a path and inside it is no number."""
        return {one: value for one, value in self.rest.items() if f"{one}.".startswith(f"{path}.")}


class Template(NamedTuple):
    """A scene whose floats differ between sets: units of those that do by path, and the numbers that are none."""

    scene: Scene
    units: Mapping[str, str]
    fixed: Mapping[str, float | str]


@dataclass(frozen=True)
class Variant:
    """Words that the study's function looks at, the rows that are run with them, and their templates so far.

    paths: those that take an unknown's value as it is, with its name; moving: whether draws set initial velocities.
    """

    scene: Scene
    defined: RowFunction
    options: Mapping[str, str]
    rows: tuple[Row, ...]
    paths: Mapping[str, str]
    moving: bool = False
    templates: dict[Key, tuple[Template, ...]] = field(init=False, default_factory=dict, compare=False, repr=False)

    def changes(self, unknowns: Mapping[str, float], row: Row) -> RowChanges | None:
        """Changes of a row for SI values of the unknowns; None where the arithmetic of the function has no value.

        Raises InputError where the function fails.
        """
        with self.defined.at_row(row.name):
            try:
                found = self._called(unknowns, row)
            except InputError:
                raise
            except (ArithmeticError, ValueError):
                return None
            if not isinstance(found, Mapping):
                raise TypeError(f"expected changes by path, got {type(found).__name__}")
        if twice := self.paths.keys() & found:
            raise InputError(f"unknowns.{self.paths[min(twice)]}: the function changes '{min(twice)}' too")
        return RowChanges.of({**{path: unknowns[name] for path, name in self.paths.items()}, **found}, row.last)

    def _called(self, unknowns: Mapping[str, float], row: Row) -> Any:
        """What the function gives for a row."""
        return self.defined.function(UnknownValues(**unknowns, **self.options), dict(row.cells))

    def run(self, unknowns: Mapping[str, float], row: Row) -> tuple[Scene, dict[str, float]] | None:
        """The template of a row for SI values of the unknowns, and its floats by path; None where it has none."""
        changes = self.changes(unknowns, row)
        try:
            return None if changes is None else self._templated(changes)
        except InputError:
            return None

    def _templated(self, changes: RowChanges) -> tuple[Scene, dict[str, float]]:
        """The template that serves changes, made where there is none, and their floats [SI]."""
        numbers, kept = changes.numbers, self.templates.get(changes.key, ())
        found = next((one for one in kept if all(numbers[path] == value for path, value in one.fixed.items())), None)
        if found is None:
            made = with_values(with_values(self.scene, changes.wholes), numbers)
            if self.moving and made.initial.velocity is None:
                made = with_values(made, {"initial.velocity": (0.0,) * made.robot.structure.size})
            known = float_paths(made)
            units = {path: known[path].unit for path in numbers if path in known}
            found = Template(made, units, {path: value for path, value in numbers.items() if path not in units})
            self.templates[changes.key] = (*kept, found)
        return found.scene, {path: in_si(numbers[path], unit) for path, unit in found.units.items()}

    def scene_of(self, unknowns: Mapping[str, float], row: Row) -> Scene:
        """The scene of a row for SI values of the unknowns. Raises InputError where there is none."""
        changes = self.changes(unknowns, row)
        with self.defined.at_row(row.name):
            if changes is None:
                self._called(unknowns, row)  # says at which line it has no value, and why
                raise InputError("the function has no value for these unknowns")
            return with_values(*self._templated(changes))


_read = cache(parse_quantity)


def in_si(value: float | str, unit: str) -> float:
    """SI value of a number, or of a text with a unit."""
    return _read(value, unit) if isinstance(value, str) else float(value)


def _is_amount(value: object) -> bool:
    if isinstance(value, str):
        return _AMOUNT.fullmatch(value) is not None
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def _leaves(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Values by path, those of tables and lists too."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
        elif isinstance(value, list | tuple | np.ndarray):
            yield from _leaves({str(n): one for n, one in enumerate(value)}, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
