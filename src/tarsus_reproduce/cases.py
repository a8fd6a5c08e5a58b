"""Cases of a periodic-drive experiment, read from a table in the format of Table A.1 of the source."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from tarsus.files.rows import Cell, read_text, typed_rows

WAVES = ("square", "sine")
"""Drives of the tables."""

COLUMNS = {
    "freq_hz": Cell(required=True, positive=True),
    "volt_v": Cell(required=True, positive=True),
    "wave": Cell(required=True, words=WAVES),
    "bounces_sim": Cell(ranges=True),
    "bounces_exp": Cell(ranges=True),
    "peak_sim_um": Cell(),
    "peak_exp_um": Cell(),
    "contact_sim_ms": Cell(),
    "contact_exp_ms": Cell(),
}


@dataclass(frozen=True)
class Observation:
    """What one case shows per drive period; None where the table is empty.

    `bounces` [-], `peak_um` peak oscillation amplitude after break-off [um], `contact_ms` contact
    duration [ms].
    """

    bounces: float | None = None
    peak_um: float | None = None
    contact_ms: float | None = None

    def __bool__(self) -> bool:
        return any(value is not None for value in (self.bounces, self.peak_um, self.contact_ms))


@dataclass(frozen=True)
class Case:
    """One row: a periodic drive, and what the source's model and the measurement say about it."""

    freq_hz: float
    volt_v: float
    wave: str
    source: Observation
    measured: Observation
    origin: str
    """`packaged`, or the name of the file the row came from."""


def packaged_cases() -> list[Case]:
    """The rows of Table A.1 that come with the package (12 of the source's 16)."""
    text = files("tarsus_reproduce").joinpath("data", "table_a1_cantilever.csv").read_text(encoding="utf-8")
    return parse_cases(text, where="table_a1_cantilever.csv", origin="packaged")


def read_cases(path: str | Path) -> list[Case]:
    """Rows from a file in the format of the packaged table.

    Lines that begin with `#` and empty lines are skipped. The first other line may name the columns
    (`freq_hz`, `volt_v` and `wave` must be among them; the six result columns may be missing);
    without names the order of the packaged table is assumed. Empty cells mean "not known"; bounces may
    be fractions (`1.5`, or `1~2`).

    Raises
    ------
    InputError
        naming every bad line at once; also when the file is missing, unreadable, or has no rows.
    """
    return parse_cases(read_text(path), where=str(path), origin=Path(path).name)


def parse_cases(text: str, *, where: str, origin: str) -> list[Case]:
    """Rows from the text of such a table; `where` names it in error sentences, `origin` in the rows.

    Raises
    ------
    InputError
        naming every bad line at once.
    """
    cases = []
    for line in typed_rows(text, where, COLUMNS):
        source, measured = (
            Observation(line[f"bounces_{who}"], line[f"peak_{who}_um"], line[f"contact_{who}_ms"])
            for who in ("sim", "exp")
        )
        cases.append(Case(line["freq_hz"], line["volt_v"], line["wave"], source, measured, origin))
    return cases
