"""Reference problems P1 and P2: loading, contact decisions, and the check of a whole impact sequence.

Units of the files and of every peer: um, ms, uN, mg (so uN = mg um/ms^2).

P1 is a chain of n = 2, 6 or 32 masses whose tip (coordinate 0) falls on the ground through a squeeze
film while a square voltage of +-8 V at 50 Hz pulls at a drive node. P2 is the n = 2 chain over 4096 pairs of
(restitution, film scale), 200 ms each. `README.md` says where the sequences come from.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from tarsus.study import bench

FloatArray = NDArray[np.float64]

SIZES = (2, 6, 32)
AMPLITUDE_V = 8.0
HALF_PERIOD_MS = 10.0  # 50 Hz square wave, +8 V first
TIME_TOLERANCE = 1e-6  # relative, per impact time
P2_DURATION_MS = 200.0


@dataclass(frozen=True, eq=False)
class Problem:
    """One chain with its ground; ``eq=False`` so that a problem is a cache key by identity.

    ``mass`` (n,) mg, ``stiffness`` (n, n) uN/um, ``damping`` (n, n) uN ms/um, ``push`` uN is the drive
    node's force at +8 V.
    """

    n: int
    mass: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    tip: int
    drive: int
    push: float
    film: float
    offset: float
    ground: float
    adhesion0: float
    adhesion_rate: float
    restitution: float

    def held_force_row(self) -> FloatArray:
        """Row r (2n,) with F_s = r @ (x, v): the structure's force on the tip held at rest [uN].

        The tip's own velocity has weight 0 (the tip is held); the drive does not act on the tip.
        """
        damping = self.damping[self.tip].copy()
        damping[self.tip] = 0.0
        return np.concatenate([-self.stiffness[self.tip], -damping])

    def drive_force(self, half: int) -> float:
        """Drive node's force [uN] in half period number ``half``."""
        return self.push if half % 2 == 0 else -self.push


def strength(problem: Problem, age: float) -> float:
    """Adhesion [uN] after ``age`` ms of contact."""
    return problem.adhesion0 + problem.adhesion_rate * age


def half_periods(duration: float) -> Iterator[tuple[int, float]]:
    """(number, end time) of each half period of the square wave up to ``duration`` [ms]."""
    half = 0
    end = 0.0
    while end < duration:
        end = min((half + 1) * HALF_PERIOD_MS, duration)
        yield half, end
        half += 1


@cache
def load(n: int) -> Problem:
    """Problem P1 of size ``n`` (2, 6 or 32)."""
    data = json.loads((resources.files("tarsus") / "data" / "bench" / "chains.json").read_text())[str(n)]
    problem = Problem(
        n=n,
        mass=np.array(data["mass_mg"], dtype=float),
        stiffness=np.array(data["stiffness_uN_per_um"], dtype=float),
        damping=np.array(data["damping"], dtype=float),
        tip=data["tip_index"],
        drive=data["drive_index"],
        push=data["gain_uN_per_V"] * AMPLITUDE_V,
        film=data["film_C"],
        offset=data["film_offset_um"],
        ground=data["ground_um"],
        adhesion0=data["adhesion0_uN"],
        adhesion_rate=data["adhesion_rate_uN_per_ms"],
        restitution=data["restitution"],
    )
    if problem.tip == problem.drive:
        raise ValueError("the held tip's force would depend on the drive")
    return problem


@cache
def reference_times(n: int) -> FloatArray:
    """Agreed impact times [ms] of P1."""
    return bench.reference_impacts(n) * 1e3


def horizon(n: int) -> float:
    """Duration [ms] over which P1's sequence is known: 1000 for n = 2, about 185 otherwise."""
    if n == 2:
        return 1000.0
    return float(np.ceil(reference_times(n)[-1]))


@dataclass(frozen=True)
class SequenceCheck:
    """How a sequence of impact times compares with the reference up to ``until`` ms."""

    found: int
    expected: int
    wrong: int
    worst: float  # largest relative time error over the common indices
    until: float

    @property
    def right(self) -> bool:
        return self.wrong == 0


def check_sequence(times: FloatArray, n: int, duration: float) -> SequenceCheck:
    """Compare every impact time with the reference, index by index.

    An event is wrong when its relative error exceeds ``TIME_TOLERANCE``; missing and surplus events count
    as wrong. Compared up to ``duration``, or up to the last agreed impact where the reference stops before.
    """
    reference = reference_times(n)
    until = duration
    if duration > horizon(n) or n != 2:
        until = min(duration, float(reference[-1]) * (1.0 + 10 * TIME_TOLERANCE))
    reference = reference[reference <= until]
    times = np.asarray(times, dtype=float)
    times = times[times <= until]
    common = min(len(times), len(reference))
    errors = np.abs(times[:common] - reference[:common]) / reference[:common]
    wrong = int(np.sum(~(errors <= TIME_TOLERANCE))) + abs(len(times) - len(reference))
    worst = float(errors.max()) if common else float("inf")
    return SequenceCheck(len(times), len(reference), wrong, worst, until)


@dataclass(frozen=True)
class PairReference:
    """P2: pairs (m, 2) of (restitution, film scale), impact counts, first and tenth impact times [ms]."""

    pairs: FloatArray
    counts: NDArray[np.int64]
    first: FloatArray
    tenth: FloatArray

    def __len__(self) -> int:
        return len(self.counts)

    def take(self, index: NDArray[np.int64]) -> PairReference:
        return PairReference(self.pairs[index], self.counts[index], self.first[index], self.tenth[index])


@cache
def pair_reference() -> PairReference:
    """All 4096 members of P2."""
    own = bench.pairs()
    pairs = np.column_stack([own.restitution, own.film_scale])
    return PairReference(pairs, own.impacts, own.first * 1e3, own.tenth * 1e3)


def subset(size: int, block: int = 8) -> NDArray[np.int64]:
    """Indices of ``size`` members in blocks of ``block`` neighbours spread over the whole grid.

    Neighbours stay together because a solver in batch mode runs best on similar trajectories.
    """
    total = len(pair_reference())
    if size >= total:
        return np.arange(total)
    block = min(block, size)
    blocks = size // block
    slots = total // block
    # an odd multiplier walks through all film scales instead of always meeting the same ones
    starts = np.sort((np.arange(blocks) * (slots // blocks) + np.arange(blocks) % (slots // blocks)) * block)
    return (starts[:, None] + np.arange(block)).ravel()


@dataclass(frozen=True)
class PairCheck:
    """How P2 answers compare with the reference."""

    members: int
    wrong_counts: int
    wrong_times: int
    worst: float


def check_pairs(counts: NDArray[np.int64], first: FloatArray, tenth: FloatArray, reference: PairReference) -> PairCheck:
    """Wrong counts, and members whose first or tenth impact is off by more than ``TIME_TOLERANCE``."""
    if len(counts) != len(reference):
        raise ValueError(f"expected {len(reference)} members, got {len(counts)}")
    errors = np.maximum(
        np.abs(first - reference.first) / reference.first, np.abs(tenth - reference.tenth) / reference.tenth
    )
    return PairCheck(
        members=len(reference),
        wrong_counts=int(np.sum(np.asarray(counts) != reference.counts)),
        wrong_times=int(np.sum(~(errors <= TIME_TOLERANCE))),
        worst=float(np.max(errors)),
    )


def first_and_tenth(times: FloatArray) -> tuple[float, float]:
    """First and tenth impact time, NaN where there are fewer."""
    return (float(times[0]) if len(times) > 0 else float("nan"), float(times[9]) if len(times) > 9 else float("nan"))
