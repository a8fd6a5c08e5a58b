"""Data that were not used, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from tarsus.base.errors import Fault, InputProblem

Item = TypeVar("Item")


@dataclass(frozen=True)
class Excluded:
    """Data that a step did not use: file, channel ("" for all of them) and the reason, a sentence.

    count: of how many of what the step counts (impacts, samples) that holds.
    """

    file: str
    channel: str
    reason: str
    count: int = 1

    def __str__(self) -> str:
        where = f"{self.file}, channel '{self.channel}'" if self.channel else self.file
        return f"{where}: {self.reason}" if where else self.reason


def evenly(items: Sequence[Item], most: int) -> list[Item]:
    """At most so many of some items, evenly from all."""
    if len(items) <= most:
        return list(items)
    return [items[k] for k in np.linspace(0, len(items) - 1, most).round().astype(int).tolist()]


def enough(items: Sequence[Item], most: int, what: str, file: str, channel: str) -> tuple[list[Item], list[Excluded]]:
    """At most so many of some items, evenly from all, and that the others are not used."""
    count = max(len(items) - most, 0)
    text = f"{count} of {len(items)} {what}, evenly from all: {most} are enough"
    return evenly(items, most), [Excluded(file, channel, text, count)] * (count > 0)


def excluded_of(file: str, problem: InputProblem) -> Excluded:
    """What is wrong with a file, as data that were not used."""
    if problem.path == file and problem.fault is not Fault.NO_CHANNEL:
        return Excluded(file, problem.channel, problem.said)
    return Excluded(file, "", problem.removeprefix(file).removeprefix(":").strip())
