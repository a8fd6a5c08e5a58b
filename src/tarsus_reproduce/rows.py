"""Rows of the printed tables (A.1 of the cantilever, 3.2 of the hexapod), packaged and from files of their format."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tarsus.calibrate.compared import relative_error
from tarsus.files.rows import Cell, typed_rows
from tarsus.files.tables import read_text
from tarsus_reproduce.packaged import data_text

WAVE = Cell(required=True, words=("square", "sine"))
DRIVE = Cell(required=True, positive=True)


@dataclass(frozen=True)
class PrintedQuantity:
    """A measured quantity: its key in the table's unit, words, SI unit, the factor from SI to the table's unit, and its
    name in the calibration's study.

    count: a number of bounces, the error of which is a difference, as in Table 2.3.
    """

    key: str
    words: str
    unit: str
    factor: float
    studied: str
    count: bool = False

    def error(self, reference: float | None, simulated: float | None) -> float | None:
        """Of the simulated number, None where there is none: relative, or the size of the difference of counts."""
        if not self.count:
            return relative_error(reference, simulated)
        if reference is None or simulated is None or not math.isfinite(simulated):
            return None
        return abs(reference - simulated)

    def column(self, who: str) -> str:
        """Its column of "exp" (measured) or "sim" (the source's model): `peak_um` -> `peak_exp_um`."""
        name, _, unit = self.key.partition("_")
        return "_".join(filter(None, (name, who, unit)))


@dataclass(frozen=True)
class PrintedTable:
    """A table of the dissertation: the file of its packaged rows, its quantities, its columns in their usual order."""

    file: str
    quantities: tuple[PrintedQuantity, ...]
    columns: Mapping[str, Cell]


_BOUNCES = PrintedQuantity("bounces", "bounces per period", "1", 1.0, "bounces", count=True)
_CONTACTS = (
    _BOUNCES,
    PrintedQuantity("peak_um", "peak after break-off", "m", 1e6, "peak"),
    PrintedQuantity("contact_ms", "contact per period", "s", 1e3, "contact"),
)
_HEIGHTS = (
    PrintedQuantity("bounces_per_s", "bounces in a second", "1", 1.0, "bounces"),
    PrintedQuantity("peak_um", "peak height", "m", 1e6, "peak"),
    PrintedQuantity("mean_um", "mean height", "m", 1e6, "mean"),
)

CANTILEVER = PrintedTable(
    "table_a1_cantilever.csv",
    _CONTACTS,
    {
        "freq_hz": DRIVE,
        "volt_v": DRIVE,
        "wave": WAVE,
        **{one.column(who): Cell(ranges=one is _BOUNCES) for one in _CONTACTS for who in ("sim", "exp")},
    },
)
"""Table A.1, all per drive period: bounces, peak oscillation amplitude after break-off, contact duration."""

HEIGHTS = PrintedTable(
    "table_3_2_hexapod.csv",
    _HEIGHTS,
    {
        "wave": WAVE,
        "volt_v": DRIVE,
        "gap_um": DRIVE,
        **{one.column(who): Cell() for who in ("exp", "sim") for one in _HEIGHTS},
        "freq_hz": Cell(positive=True),
    },
)
"""Table 3.2: bounces, highest clearance of the bouncing foot in a drive period, its "average height"."""


@dataclass(frozen=True)
class PrintedRow:
    """One row: a drive, and what the source's model and the measurement say, by key of the table's quantities.

    freq_hz, gap_um: None where the table does not say; source, measured: numbers in the table's units, None where a
    cell is empty; origin: `packaged`, or the name of the file the row came from.
    """

    wave: str
    volt_v: float
    freq_hz: float | None = None
    gap_um: float | None = None
    source: Mapping[str, float | None] | None = None
    measured: Mapping[str, float | None] | None = None
    origin: str = "packaged"

    def seen(self, who: str, one: PrintedQuantity) -> float | None:
        """What was "measured", or is said by the "source", of a quantity."""
        return (getattr(self, who) or {}).get(one.key)

    def si(self, who: str, one: PrintedQuantity) -> float | None:
        """The same in SI."""
        value = self.seen(who, one)
        return None if value is None else value / one.factor

    @property
    def words(self) -> str:
        """Its drive without the frequency."""
        gap = "" if self.gap_um is None else f", gap {self.gap_um:g} µm"
        return f"{self.volt_v:g} V, {self.wave}{gap}"

    @property
    def conditions(self) -> dict[str, Any]:
        """What was done, by column; what the table does not say is left out."""
        every = {"wave": self.wave, "volt_v": self.volt_v, "freq_hz": self.freq_hz, "gap_um": self.gap_um}
        return {name: value for name, value in every.items() if value is not None}


def packaged_rows(table: PrintedTable) -> list[PrintedRow]:
    """The rows of a table that come with the package."""
    return parse_rows(data_text(table.file), table, where=table.file, origin="packaged")


def read_rows(path: str | Path, table: PrintedTable) -> list[PrintedRow]:
    """Rows from a file in the format of a packaged table.

    Lines that begin with `#` and empty lines are skipped. The first other line may name the columns (those of the drive
    must be among them); without names the usual order is assumed. Empty cells mean "not known".

    Raises
    ------
    InputError
        naming every bad line at once; also when the file is missing, unreadable, or has no rows.
    """
    return parse_rows(read_text(path), table, where=str(path), origin=Path(path).name)


def parse_rows(text: str, table: PrintedTable, *, where: str, origin: str) -> list[PrintedRow]:
    """Rows from the text of such a table; `where` names it in error sentences, `origin` in the rows.

    Raises
    ------
    InputError
        naming every bad line at once.
    """
    return [_row(line, table, origin) for line in typed_rows(text, where, table.columns)]


def _row(line: Mapping[str, Any], table: PrintedTable, origin: str) -> PrintedRow:
    parts = []
    for who in ("sim", "exp"):
        numbers = {one.key: line[one.column(who)] for one in table.quantities}
        parts.append(numbers if any(value is not None for value in numbers.values()) else None)
    source, measured = parts
    return PrintedRow(line["wave"], line["volt_v"], line["freq_hz"], line.get("gap_um"), source, measured, origin)
