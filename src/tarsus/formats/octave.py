"""Octave's own text format, which it saves by default whatever the file's name."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.formats.format import Format
from tarsus.formats.mat import variables_of
from tarsus.formats.numerals import text_of
from tarsus.formats.raw import RawFile, parsing, truncated

_NAME, _TYPE = "# name: ", "# type: "
_COUNT = re.compile(r"# (rows|columns|ndims|length|elements): (\d+)")
_COMPLEX = re.compile(r"\(([^,()\s]+),([^,()\s]+)\)")


def is_octave(head: bytes) -> bool:
    """Whether a file begins like Octave's text format, or like its binary one."""
    return head.startswith((b"# Created by Octave", b"Octave-1-")) or (
        head.startswith(_NAME.encode()) and b"\n" + _TYPE.encode() in head
    )


def read_octave(path: Path, content: bytes) -> RawFile:
    """Scalars, matrices, ranges, texts, cells and structures of a file of Octave; named as those of MATLAB files.

    Raises
    ------
    InputError
        If a matrix is cut, or the file is in Octave's binary format.
    """
    if content.startswith(b"Octave-1-"):
        raise InputError(f"{path.name} is in Octave's binary format; save it with -v7 or -text")
    reader = _Reader(path.name, text_of(content).splitlines())
    found: dict[str, Any] = {}
    with parsing(path.name, "a file of Octave"):
        while (name := reader.name()) is not None:
            found[name] = reader.value(name)
    raw = variables_of(path.name, {name: value for name, value in found.items() if value is not None})
    left = [f"{path.name}: not used, of a kind that is not read: {', '.join(reader.left)}"] if reader.left else []
    return RawFile(raw.source, raw.series, raw.declared, (*raw.notes, *left))


@dataclass
class _Reader:
    """Lines of a file and the place that is read next; left: variables of other kinds."""

    source: str
    lines: list[str]
    place: int = 0
    left: list[str] = field(default_factory=list)

    def name(self) -> str | None:
        """Name of the next variable; None at the end."""
        while self.place < len(self.lines):
            line = self.lines[self.place]
            self.place += 1
            if line.startswith(_NAME):
                return line.removeprefix(_NAME).strip()
        return None

    def value(self, name: str) -> Any:
        """What stands below a name: an array, a text, an array of cells, a dict of fields; None of another kind."""
        line = self._line()
        kind = line.removeprefix(_TYPE).removeprefix("global ").strip()
        if not line.startswith(_TYPE):
            raise InputError(f"{self.source} is damaged: nothing says what kind '{name}' is")
        if kind.endswith("string"):
            return self._text()
        if kind.endswith("range"):
            return self._range()
        if kind.endswith("struct"):
            return self._structure(name)
        if kind == "cell":
            cells = np.empty(math.prod(self._shape()), dtype=object)
            for i in range(len(cells)):
                cells[i] = self.value(self.name() or name)
            return cells
        if kind == "bool" or kind.endswith("scalar"):
            return self._numbers(name, 1, kind)[0]
        if kind.endswith("matrix") and not kind.startswith(("sparse", "diagonal", "permutation")):
            by_rows = not self.lines[self.place].startswith("# ndims")
            shape = self._shape()
            values = self._numbers(name, math.prod(shape), kind)
            return values.reshape(shape, order="C" if by_rows else "F")
        self.left.append(f"'{name}' ({kind})")
        return None

    def _line(self) -> str:
        if self.place >= len(self.lines):
            raise InputError(f"{self.source} is truncated: its last variable does not end")
        self.place += 1
        return self.lines[self.place - 1]

    def _count(self) -> int:
        match = _COUNT.match(self._line())
        if match is None:
            raise InputError(f"{self.source}, line {self.place}: a number of values is expected")
        return int(match[2])

    def _shape(self) -> tuple[int, ...]:
        """Rows and columns, or the sizes below their number."""
        if self.place < len(self.lines) and self.lines[self.place].startswith("# ndims"):
            self.place += 1
            return tuple(int(size) for size in self._line().split())
        return self._count(), self._count()

    def _numbers(self, name: str, count: int, kind: str) -> np.ndarray:
        """Numbers until so many are there."""
        cells: list[str] = []
        while len(cells) < count and self.place < len(self.lines):
            line = self.lines[self.place]
            if line.startswith("#"):
                break
            cells += line.split()
            self.place += 1
        if len(cells) != count:
            raise InputError(truncated(self.source, name, len(cells), count))
        try:
            if "complex" in kind:
                parts = [_COMPLEX.fullmatch(cell) for cell in cells]
                return np.array([complex(float(one[1]), float(one[2])) for one in parts if one], dtype=complex)
            return np.array(["nan" if cell == "NA" else cell for cell in cells], dtype=str).astype(float)
        except ValueError as error:
            raise InputError(f"{self.source}: '{name}' is damaged: {error}") from None

    def _text(self) -> str:
        lines = []
        for _ in range(self._count()):
            self._count()
            lines.append(self._line())
        return "\n".join(lines)

    def _range(self) -> np.ndarray:
        self._line()  # base, limit, increment
        base, limit, step = (float(cell) for cell in self._line().split()[:3])
        count = math.floor((limit - base) / step * (1.0 + 1e-15) + 1e-9) + 1  # the limit itself, for all rounding
        return base + step * np.arange(max(count, 0))

    def _structure(self, name: str) -> dict[str, Any]:
        """Fields of a structure, each by its name; of an array of them, each a list."""
        self._shape()
        fields: dict[str, Any] = {}
        for _ in range(self._count()):
            field_name = self.name()
            if field_name is None:
                raise InputError(f"{self.source} is truncated: structure '{name}' does not end")
            fields[field_name] = self.value(field_name)
        return fields


FORMATS = (Format("Octave", is_octave, read_octave),)
