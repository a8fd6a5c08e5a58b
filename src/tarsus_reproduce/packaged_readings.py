"""The readings that come with the package, so that a page draws the distribution of the score without computing it.

``tarsus reproduce millipede --readings 500 --seed 1 -o DIR`` computes them again; `readings_text` of what it finds is
the file. It names the ranges that it was drawn from by a digest, so that one of other ranges is not taken for it.
"""

from __future__ import annotations

import csv
import hashlib
import io
from dataclasses import asdict
from importlib.resources import files

from tarsus.base.errors import InputError
from tarsus_reproduce.millipede import Score
from tarsus_reproduce.readings import CHOICES, RANGES, Reading, Readings, drawn

__all__ = ["packaged_readings", "parse_readings", "readings_text"]

COUNTS = ("agree", "contradict", "insensitive", "not_determined", "directional_agree", "directional_total")


def packaged_readings() -> Readings:
    """The packaged readings, `tarsus_reproduce/data/millipede_readings.csv`."""
    text = files("tarsus_reproduce").joinpath("data", "millipede_readings.csv").read_text(encoding="utf-8")
    return parse_readings(text)


def readings_text(readings: Readings) -> str:
    """Readings as such a file: seed and digest of the ranges, then a row each, empty where it could not be judged."""
    lines = io.StringIO()
    lines.write(f"# seed {readings.seed}, ranges {_digest()}\n")
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(["number", *COUNTS])
    for one in readings.readings:
        counts = ["" for _ in COUNTS] if one.score is None else [getattr(one.score, name) for name in COUNTS]
        writer.writerow([one.number, *counts])
    return lines.getvalue()


def parse_readings(text: str) -> Readings:
    """Readings from the text of such a file; what was drawn is drawn again.

    Raises
    ------
    InputError
        For a file that is none, and one of other ranges.
    """
    first, _, table = text.partition("\n")
    try:
        (_, _, seed_text, _, digest) = first.split()
        seed = int(seed_text.rstrip(","))
        rows = list(csv.DictReader(table.splitlines()))
        found = tuple(
            Reading(
                number := int(row["number"]),
                drawn(seed, number),
                Score(**{name: int(row[name]) for name in COUNTS}) if row["agree"] else None,
            )
            for row in rows
        )
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"this is no file of readings ({error})") from None
    if digest != _digest():
        raise InputError("these readings were drawn from other ranges; judge them again")
    return Readings(seed, found)


def _digest() -> str:
    """Of all ranges and choices, without the words that say why."""
    told = [{**asdict(one), "why": ""} for one in (*RANGES, *CHOICES)]
    return hashlib.sha256(repr(told).encode()).hexdigest()[:12]
