"""What measures are taken over: the motion that a robot settles to, from many starts, or an episode from its own start.

Contact makes several motions out of one drive, and a run begins with a transient: what is measured on a short run from
one start is a number of that start. A mean over evenly spread starts is one over the attractors by their share.
"""

from __future__ import annotations

from dataclasses import dataclass

from tarsus.base.errors import InputError, InputProblem
from tarsus.tables.numbers import amount

LEAST = 1.0
"""Shortest walk of a settled motion [s]: of 200 walks of `millipede` speeds after a third of 1 s differ from those of
2 s by 0.23 mm/s (root of the mean square), of 0.1 s by 1.15 mm/s, where the fastest goes 4.3 mm/s."""
PERIODS = 20
"""Drive periods of it at least, wherever a robot steps so slowly that they take longer: a deviation that halves in each
is below a percent after the third that is left out."""
ROUNDING = 1e-9
"""A duration is as long as another where it is so near to it: what division of frequencies leaves."""
STARTS = 4
"""Starts unless others are asked for."""
OVER_STARTS = ("over_starts", "settled")
"""What is known of the starts of a settled motion: what differs between them, and the share that repeats."""


@dataclass(frozen=True)
class FromRest:
    """An episode from the scene's own start; duration [s]. Statistics of drive periods leave the first third out."""

    duration: float

    starts = 0
    """Of none but the scene's own."""

    def __str__(self) -> str:
        return f"from rest, {amount(self.duration, 's')}"


@dataclass(frozen=True)
class SettledMotion:
    """The settled motion: runs of a duration [s], whose first third is left out, or less where they repeat before, from
    so many starts."""

    duration: float
    starts: int

    @classmethod
    def of(cls, starts: int, slowest: float, duration: float | None = None) -> SettledMotion:
        """Of so many starts, walks as long as drive periods of at most ``slowest`` [s] want, or as given [s].

        Raises InputError for walks that are shorter than a settled motion wants.
        """
        least = max(LEAST, PERIODS * slowest)
        if duration is not None and duration < least * (1.0 - ROUNDING):
            given = amount(duration, "s")
            short = (
                f"a settled motion takes runs of {amount(least, 's')} at least, got {given}; an episode of that length "
                f"from the scene's own start is from_rest = '{given}'"
            )
            raise InputError(InputProblem.at("duration", short))
        return cls(least if duration is None else duration, starts)

    def __str__(self) -> str:
        return f"settled motion, runs of {amount(self.duration, 's')} from {self.starts} starts"


Motion = SettledMotion | FromRest


def motion_asked(
    slowest: float, starts: int | None = None, duration: float | None = None, from_rest: float | None = None
) -> Motion:
    """What is asked for by these words, of drive periods of at most ``slowest`` [s]: a settled motion from so many
    starts, or an episode.

    Raises InputError for words that exclude each other, and for runs that are too short: they are measured by whole
    drive periods, and a motion settles in some.
    """
    if from_rest is None:
        return SettledMotion.of(STARTS if starts is None else starts, slowest, duration)
    if duration is not None:
        raise InputError(InputProblem.at("duration", "an episode is as long as from_rest says; give one of the two"))
    if starts is not None:
        alone = "an episode from rest has the scene's own start alone; leave one of the two out"
        raise InputError(InputProblem.at("starts", alone))
    if from_rest < slowest * (1.0 - ROUNDING):
        raise InputError(
            InputProblem.at(
                "from_rest",
                f"expected at least a drive period of the slowest gait, {slowest:.4g} s, got {from_rest:.4g} s",
            )
        )
    return FromRest(from_rest)
