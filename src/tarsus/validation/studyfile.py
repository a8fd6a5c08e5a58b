"""The study of an experiment: a Python file with one function from a row to what is run and what is read of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.base.errors import InputError
from tarsus.base.pythonfile import execute, line_of, said
from tarsus.base.spec import with_values
from tarsus.model.scene import Scene

if TYPE_CHECKING:
    from tarsus.validation.selection import Row

PURPOSE = "a study file only defines functions"
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
    """The function of a study file."""

    file: Path
    function: Callable[[Row, Scene], object]

    def case(self, row: Row, device: Scene, line: int) -> RowCase:
        """The case of a row, which stands on a line of the table. Raises InputError where the function fails."""
        with self.at_row(line):
            found = self.function(row, device)
        if not isinstance(found, RowCase):
            raise InputError(f"{self.file}: '{FUNCTION}' must give a RowCase, got {type(found).__name__}")
        return found

    @contextmanager
    def at_row(self, line: int) -> Iterator[None]:
        """What goes wrong in a function of the file is said with the row's line of the table, and its own."""
        where = f"measured.csv, line {line}"
        try:
            yield
        except InputError as error:
            raise InputError(f"{where}: {problem}" for problem in error.problems) from None
        except Exception as error:
            raise InputError(f"{where}: {self.file}{line_of(error, self.file)}: {said(error)}") from error


def read_study(file: Path) -> RowStudy:
    """The study of a file.

    Raises InputError where it cannot be executed, or defines no function ``case(row, device)``.
    """
    if not file.is_file():
        raise InputError(f"{file}: no such file; it defines {FUNCTION}(row, device), which gives a RowCase")
    function = getattr(execute(file, PURPOSE), FUNCTION, None)
    if not callable(function):
        raise InputError(f"{file}: defines no function {FUNCTION}(row, device)")
    return RowStudy(file, function)
