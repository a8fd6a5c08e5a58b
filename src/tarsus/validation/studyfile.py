"""The study of an experiment: a Python file with one function from a row to what is run and what is read of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.files.rowfunction import RowFunction
from tarsus.model.scene import Scene

if TYPE_CHECKING:
    from tarsus.validation.selection import Row

FUNCTION = "case"


@dataclass(frozen=True)
class RowCase:
    """What is run for a row, and what is read of the runs.

    runs: changes of the device by path, a whole scene, or several of these; read: a function of the runs, in their
    order, that gives the computed numbers by measured column [SI]; a number that a run does not give is left out, or
    NaN. formula: reference numbers by measured column [SI], of those that the table does not hold.
    """

    runs: Mapping[str, Any] | Scene | Sequence[Mapping[str, Any] | Scene]
    read: Callable[..., Mapping[str, float]]
    formula: Mapping[str, float] = field(default_factory=dict)

    def scenes(self, device: Scene) -> list[Scene]:
        """What is simulated. Raises InputError for unknown paths and refused values."""
        several = [self.runs] if isinstance(self.runs, Scene | Mapping) else list(self.runs)
        return [one if isinstance(one, Scene) else with_values(device, dict(one)) for one in several]


@dataclass(frozen=True)
class RowStudy:
    """The function of a study file, which makes the case of a row."""

    defined: RowFunction

    def case(self, row: Row, device: Scene, line: int) -> RowCase:
        """The case of a row, which stands on a line of the table. Raises InputError where the function fails."""
        with self.at_row(line):
            found = self.defined.function(row, device)
        if not isinstance(found, RowCase):
            raise InputError(f"{self.defined.file}: '{FUNCTION}' must give a RowCase, got {type(found).__name__}")
        return found

    def at_row(self, line: int) -> AbstractContextManager[None]:
        """What goes wrong in a function of the file is said with the row's line of the table, and its own."""
        return self.defined.at_row(f"measured.csv, line {line}")


def read_study(file: Path) -> RowStudy:
    """The study of a file.

    Raises InputError where it cannot be executed, or defines no function ``case(row, device)``.
    """
    return RowStudy(RowFunction.read(file, FUNCTION, "row, device"))
