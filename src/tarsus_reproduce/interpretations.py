"""How the model of the millipede fares over random interpretations of what the dissertation does not print.

So much of the walking model is unprinted that the score of any one device says little: the fair score is a
distribution. 500 interpretations come with the package; `docs/package_interpretations.py` draws and judges them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from tarsus.files.rows import parse_rows
from tarsus.fit.unknowns import Unknown
from tarsus_reproduce.millipede import COUNTS, Score
from tarsus_reproduce.packaged import data_table, data_text

FILE = "millipede_interpretations.csv"
"""The packaged interpretations."""

SEED, PERIODS = 1, 10
"""What they are drawn with, and the drive periods of each run: the packaged studies' 0.2 s at 50 Hz."""


def _unprinted() -> tuple[tuple[Unknown, ...], tuple[Mapping[str, Any], ...]]:
    """Numbers and choices of `data/unprinted.toml`."""
    table = data_table("unprinted.toml")
    return tuple(Unknown(**one, scale="log") for one in table["number"]), tuple(table["choice"])


UNPRINTED, CHOICES = _unprinted()
"""Numbers that the dissertation does not print for its walking model, and choices that it does not state: their names,
options, drawn with equal chance, and why these."""


@lru_cache
def packaged_interpretations() -> tuple[Score, ...]:
    """Scores of the interpretations that come with the package."""
    rows = parse_rows(data_text(FILE), FILE).rows
    return tuple({name: int(row[name]) for name in COUNTS} for row in rows)


def distribution(scores: Sequence[Score]) -> dict[str, dict[str, float]]:
    """Mean and 95 % quantile of every count of scores but the last, which all have alike."""
    counts = {name: [score[name] for score in scores] for name in COUNTS[:-1]}
    return {
        name: {"mean": float(np.mean(one)), "quantile_95": float(np.quantile(one, 0.95))}
        for name, one in counts.items()
    }
