"""Bouncing-foot scenarios of a robot, read from a table in the format of Table 3.2 of the source."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.files.rows import Cell, read_text, typed_rows
from tarsus_reproduce.cases import WAVES

HEIGHTS = (("bounces", "per_s"), ("peak", "um"), ("mean", "um"))
"""What is measured and simulated of a scenario, with the units of its columns."""

COLUMNS = {
    "wave": Cell(required=True, words=WAVES),
    "volt_v": Cell(required=True, positive=True),
    "gap_um": Cell(required=True, positive=True),
    **{f"{what}_{who}_{unit}": Cell() for who in ("exp", "sim") for what, unit in HEIGHTS},
    "freq_hz": Cell(positive=True),
}

FASTEST = 1e5
"""Highest drive frequency of a scenario [Hz]: a hundred times the source's; faster ones take hours over many seeds."""

TABLES = {"hexapod": "table_3_2_hexapod.csv", "quadruped": None}
"""Packaged table of each robot; the source prints none for the quadruped."""


@dataclass(frozen=True)
class Heights:
    """What a scenario shows; None where the table is empty.

    `bounces_per_s` [1/s]; `peak_um` [um]: highest clearance of the bouncing foot in a drive period; `mean_um` [um]: its
    mean over time.
    """

    bounces_per_s: float | None = None
    peak_um: float | None = None
    mean_um: float | None = None

    def __bool__(self) -> bool:
        return any(value is not None for value in (self.bounces_per_s, self.peak_um, self.mean_um))


@dataclass(frozen=True)
class Scenario:
    """One row: wave and volts over a gap, and what the source's model and the measurement say.

    `freq_hz` is None where the table does not tell: the device's own drive frequency then holds.
    """

    wave: str
    volt_v: float
    gap_um: float
    freq_hz: float | None
    source: Heights
    measured: Heights
    origin: str
    """`packaged`, or the name of the file the row came from."""


def packaged_scenarios(robot: str) -> list[Scenario]:
    """The scenarios of Table 3.2 that come with the package; none for a robot without a table."""
    table = TABLES[robot]
    if table is None:
        return []
    text = files("tarsus_reproduce").joinpath("data", table).read_text(encoding="utf-8")
    return parse_scenarios(text, where=table, origin="packaged")


def read_scenarios(path: str | Path) -> list[Scenario]:
    """Scenarios from a file.

    Its columns are `wave,volt_v,gap_um,bounces_exp_per_s,peak_exp_um,mean_exp_um` in this order, or any columns of the
    packaged table and `freq_hz` under their names; empty cells mean "not known".

    Raises
    ------
    InputError
        naming every bad line at once; also when the file is missing, unreadable, or has no rows.
    """
    return parse_scenarios(read_text(path), where=str(path), origin=Path(path).name)


def parse_scenarios(text: str, *, where: str, origin: str) -> list[Scenario]:
    """Scenarios from the text of such a table; `where` names it in error sentences, `origin` in the rows.

    Raises
    ------
    InputError
        naming every bad line at once.
    """
    scenarios = []
    problems = []
    for line in typed_rows(text, where, COLUMNS):
        freq_hz = line["freq_hz"]
        if freq_hz is not None and freq_hz > FASTEST:
            problems.append(f"{where}: 'freq_hz' can be at most {FASTEST:g}, got {freq_hz:g}.")
        source, measured = (
            Heights(line[f"bounces_{who}_per_s"], line[f"peak_{who}_um"], line[f"mean_{who}_um"])
            for who in ("sim", "exp")
        )
        scenarios.append(
            Scenario(
                line["wave"],
                line["volt_v"],
                line["gap_um"],
                freq_hz,
                source,
                measured,
                origin,
            )
        )
    if problems:
        raise InputError(problems)
    return scenarios
