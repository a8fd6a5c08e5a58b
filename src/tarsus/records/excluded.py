"""Data that were not used, and why."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum


class Exclusion(Enum):
    """What is wrong with data that were not used."""

    UNUSABLE = "they do not have what the step needs"
    UNLIKE = "they have it, and are not as the model has them: evidence against the model, where they are many"
    ENOUGH = "nothing: others are enough"


@dataclass(frozen=True)
class Excluded:
    """Data that a step did not use: file, channel ("" for all of them) and the reason, a sentence.

    count: of how many of what the step counts (impacts, samples) that is told; kind: what is wrong with them.
    """

    file: str
    channel: str
    reason: str
    count: int = 1
    kind: Exclusion = Exclusion.UNUSABLE

    def __str__(self) -> str:
        where = f"{self.file}, channel '{self.channel}'" if self.channel else self.file
        return f"{where}: {self.reason}" if where else self.reason


def excluded_of(file: str, said: str) -> Excluded:
    """A reader's sentence, which may name its file and channel already, with both apart."""
    rest = said.removeprefix(file)
    named = re.match(r"(?:, |: )channel '([^']*)'(?:: | )", rest)
    if named is None or rest == said:
        return Excluded(file, "", rest.removeprefix(":").strip())
    return Excluded(file, named[1], rest[named.end() :].strip())
