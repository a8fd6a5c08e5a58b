"""Cases of a periodic-drive experiment, read from a table in the format of Table A.1 of the source."""

from __future__ import annotations

import csv
import difflib
import math
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from tarsus.errors import InputError

COLUMNS = (
    "freq_hz",
    "volt_v",
    "wave",
    "bounces_sim",
    "bounces_exp",
    "peak_sim_um",
    "peak_exp_um",
    "contact_sim_ms",
    "contact_exp_ms",
)
REQUIRED = COLUMNS[:3]
WAVES = ("square", "sine")


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
    text = files("tarsus").joinpath("data", "table_a1_cantilever.csv").read_text(encoding="utf-8")
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
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(
            [f"cannot read the rows file '{path}': {(error.strerror or str(error)).lower()}."]
        ) from error
    except UnicodeDecodeError as error:
        raise InputError(
            [f"the rows file '{path}' is not text (UTF-8): byte {error.start} cannot be read."]
        ) from error
    return parse_cases(text, where=str(path), origin=path.name)


def parse_cases(text: str, *, where: str, origin: str) -> list[Case]:
    """Rows from the text of such a table; `where` names it in error sentences, `origin` in the rows.

    Raises
    ------
    InputError
        naming every bad line at once.
    """
    lines = [
        (number, [cell.strip() for cell in next(csv.reader([line]))])
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise InputError([f"{where} holds no rows."])
    columns: tuple[str, ...] = COLUMNS
    first_number, first = lines[0]
    if not _is_number(first[0]):
        columns = _columns(first, f"{where}, line {first_number}")
        lines = lines[1:]
        if not lines:
            raise InputError([f"{where} names its columns but holds no rows."])
    problems: list[str] = []
    cases = [_case(cells, columns, f"{where}, line {number}", origin, problems) for number, cells in lines]
    if problems:
        raise InputError(problems)
    return [case for case in cases if case is not None]


def _columns(cells: list[str], where: str) -> tuple[str, ...]:
    """Column names, checked."""
    problems = []
    for name in cells:
        if name not in COLUMNS:
            near = difflib.get_close_matches(name, COLUMNS, n=1)
            hint = f"; did you mean '{near[0]}'?" if near else f"; known are {', '.join(COLUMNS)}."
            problems.append(f"{where}: unknown column '{name}'{hint}")
    problems += [
        f"{where}: the column '{name}' appears twice." for name in sorted(set(cells)) if cells.count(name) > 1
    ]
    problems += [f"{where}: the column '{name}' is missing." for name in REQUIRED if name not in cells]
    if problems:
        raise InputError(problems)
    return tuple(cells)


def _case(
    cells: list[str], columns: tuple[str, ...], where: str, origin: str, problems: list[str]
) -> Case | None:
    """One row; what is wrong with it is added to `problems`, and then None is returned."""
    before = len(problems)
    if len(cells) > len(columns):
        problems.append(f"{where}: {len(cells)} cells, but there are {len(columns)} columns.")
        return None
    row = dict.fromkeys(COLUMNS, "") | dict(zip(columns, cells, strict=False))
    numbers: dict[str, float | None] = {}
    for name in COLUMNS:
        if name == "wave":
            continue
        try:
            numbers[name] = _number(row[name], ranges=name.startswith("bounces"))
        except ValueError:
            problems.append(f"{where}: '{name}' should be a number, got '{row[name]}'.")
            numbers[name] = math.nan
            continue
        value = numbers[name]
        if name in REQUIRED:
            if value is None:
                problems.append(f"{where}: '{name}' is empty.")
            elif not (math.isfinite(value) and value > 0.0):
                problems.append(f"{where}: '{name}' must be a number above zero, got '{row[name]}'.")
        elif value is not None and not (math.isfinite(value) and value >= 0.0):
            problems.append(f"{where}: '{name}' must be zero or more, got '{row[name]}'.")
    wave = row["wave"].lower()
    if wave not in WAVES:
        near = difflib.get_close_matches(wave, WAVES, n=1)
        hint = f"; did you mean '{near[0]}'?" if near else "."
        problems.append(f"{where}: 'wave' must be {' or '.join(WAVES)}, got '{row['wave']}'{hint}")
    freq, volt = numbers["freq_hz"], numbers["volt_v"]
    if len(problems) > before or freq is None or volt is None:
        return None
    observed = [
        Observation(numbers[f"bounces_{who}"], numbers[f"peak_{who}_um"], numbers[f"contact_{who}_ms"])
        for who in ("sim", "exp")
    ]
    return Case(freq, volt, wave, source=observed[0], measured=observed[1], origin=origin)


def _number(text: str, *, ranges: bool) -> float | None:
    """The number in a cell, None when it is empty; with `ranges`, `1~2` is its middle."""
    if not text:
        return None
    if ranges and "~" in text:
        low, high = text.split("~")
        return (float(low) + float(high)) / 2.0
    return float(text)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
