"""The function of a study file: Python of a user's that is called for each row of a table."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.pythonfile import execute, line_of, said

PURPOSE = "a study file only defines functions"


@dataclass(frozen=True)
class RowFunction:
    """A function of a file, its name, the module that the file is, and its text."""

    file: Path
    name: str
    module: ModuleType
    source: bytes

    @classmethod
    def read(cls, file: Path, name: str, arguments: str) -> RowFunction:
        """The function ``name`` of a file, which takes ``arguments``.

        Raises InputError where the file cannot be executed, or defines no such function.
        """
        if not file.is_file():
            raise InputError(f"{file}: no such file; a study file defines {name}({arguments})")
        found = cls.executed(file, name, file.read_bytes())
        if not callable(found.function):
            raise InputError(f"{file}: defines no function {name}({arguments})")
        return found

    @classmethod
    def executed(cls, file: Path, name: str, source: bytes) -> RowFunction:
        """That of a text, which is executed. Raises InputError where it cannot be."""
        return cls(file, name, execute(file, PURPOSE, source), source)

    def __reduce__(self) -> tuple[Any, ...]:
        """By its text: other processes and machines have no such module."""
        return RowFunction.executed, (self.file, self.name, self.source)

    @property
    def function(self) -> Callable[..., Any]:
        """The function itself."""
        return getattr(self.module, self.name, None)  # type: ignore[return-value]

    @contextmanager
    def at_row(self, where: str) -> Iterator[None]:
        """What goes wrong in the file is said with where the row stands, and with the line of the file."""
        try:
            yield
        except InputError as error:
            raise InputError(f"{where}: {problem}" for problem in error.problems) from None
        except Exception as error:
            raise InputError(f"{where}: {self.file}{line_of(error, self.file)}: {said(error)}") from error
