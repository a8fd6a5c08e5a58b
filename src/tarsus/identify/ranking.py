"""What to measure next: which drive signals tell most about a parameter, for the time they take."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.workers import Workers
from tarsus.identify.candidates import Candidate
from tarsus.identify.features import Features, Resolution, simulated
from tarsus.identify.limits import field_limits
from tarsus.identify.prior import LogNormalPrior
from tarsus.model.scene import Scene
from tarsus.solve import Accuracy

Floats = NDArray[np.float64]
Progress = Callable[[int, int, str], None]

RANKED = ("contact_duration", "peak", "impact_speed", "rebound")
"""Features that a signal is ranked by; counts are left out, for they have no slope."""

MOST_REPEATS = 10
"""Records of one signal that a plan takes at most."""


@dataclass(frozen=True)
class Ranked:
    """One candidate alone.

    std: expected standard deviation of the logarithm of the parameter after one record of it; gain: logarithm of the
    factor by which it shrinks (0 tells nothing); repeats: records of it in the plan; note: why it cannot be used, else
    empty.
    """

    candidate: Candidate
    std: float
    gain: float
    repeats: int
    note: str = ""


@dataclass(frozen=True)
class RecordingPlan:
    """Records chosen within a budget, in the order of choice; cost [s]; std: expected after all of them."""

    steps: tuple[tuple[Candidate, float], ...]
    cost: float
    std: float


@dataclass(frozen=True)
class Ranking:
    """Candidates by what they tell about a parameter, best first.

    parameter; std: standard deviation of its logarithm now; budget [s].
    """

    parameter: str
    std: float
    budget: float
    ranked: tuple[Ranked, ...]
    plan: RecordingPlan


def rank(
    scene: Scene,
    candidates: Sequence[Candidate],
    prior: LogNormalPrior,
    parameter: str,
    budget: float,
    *,
    kinds: Sequence[str] = RANKED,
    instrument: Resolution | None = None,
    draws: int = 8,
    step: float = 0.5,
    seed: int = 0,
    threads: Workers = None,
    accuracy: Accuracy | None = None,
    progress: Progress | None = None,
) -> Ranking:
    """Rank drive signals by expected information on one parameter, and choose some within a budget.

    At draws of the prior every candidate is simulated, and the slopes ``J`` of its features are taken by central
    differences of ``step`` standard deviations of each parameter. With features' variances ``R`` a record adds
    ``J^T R^-1 J`` to the prior's precision. The gain is ``log(std before / std after)`` of the parameter, all others
    being unknown as believed, in the mean over draws. ``R`` holds what the instrument resolves, the spread from period
    to period, and how far a feature is from linear over the step (half of the second differences): a jump, or a phase
    that goes round, tells where a parameter is, but not more closely than the step. Where motion is irregular, slopes
    have noise of their own; the part of them that it explains is taken away.

    The plan is greedy: the record with the largest gain per second, given those before, as long as it fits the budget
    (two at once, where no single one gains 2 %); or the best single record, where that tells more. A record costs its
    length; taken again, it is a repeat.

    Parameters
    ----------
    scene
        The device; its own signals are replaced.
    prior
        What is known; of every parameter that is not known exactly.
    parameter
        Path of the one in question.
    budget
        Time of recording [s].
    kinds
        Features (see `features_of`).
    draws, step
        Of the prior, see above.
    seed
        Of the draws.
    progress
        Called as ``progress(done, total, what)``.

    Raises
    ------
    InputError
        For no candidates, a parameter that the prior lacks, a budget that is not positive, or a candidate that the
        scene refuses.
    """
    _check(candidates, prior, parameter, budget, scene)
    target = prior.paths.index(parameter)
    tool = instrument or Resolution()
    slopes, drawn = [], prior.draws(draws, seed)
    for i, candidate in enumerate(candidates):
        if progress is not None:
            progress(i, len(candidates), candidate.name)
        slopes.append(_slopes(candidate, scene, prior, tool, kinds, drawn, step, threads, accuracy))
    precision = np.linalg.inv(prior.covariance)
    before = float(prior.std[target])

    @cache
    def information(k: int, repeats: int) -> Floats:
        return slopes[k].information(repeats, tool)

    def gain(counts: Mapping[int, int]) -> float:
        total = precision + sum(information(k, repeats) for k, repeats in counts.items())
        total = np.broadcast_to(total, (draws, *precision.shape))
        after = np.linalg.inv(total)[:, target, target]
        return float(np.mean(0.5 * np.log(before**2 / after)))

    alone = [gain({k: 1}) for k in range(len(candidates))]
    counts, steps, cost = _greedy(candidates, gain, alone, budget)
    ranked = [
        Ranked(c, before * float(np.exp(-alone[k])), alone[k], counts.get(k, 0), _note(slopes[k], c, budget))
        for k, c in enumerate(candidates)
    ]
    ranked.sort(key=lambda one: -one.gain)
    plan = RecordingPlan(
        tuple((c, before * float(np.exp(-g))) for c, g in steps), cost, before * float(np.exp(-gain(counts)))
    )
    return Ranking(parameter, before, budget, tuple(ranked), plan)


@dataclass(frozen=True)
class _FeatureSlopes:
    """Slopes (nd, nf, np) of a candidate's features at draws; values and spread (nd, nf) there; bent (nd, nf): how far
    each is from linear; ended: share of the runs that reached their end."""

    slopes: Floats
    values: Floats
    spread: Floats
    bent: Floats
    units: tuple[str, ...]
    names: tuple[str, ...]
    periods: int
    ended: float

    def information(self, repeats: int, instrument: Resolution) -> Floats:
        """Precision (nd, np, np) that some records add."""
        seen = [
            Features(self.names, self.units, v, s, self.periods * repeats)
            for v, s in zip(self.values, self.spread, strict=True)
        ]
        error = np.hypot([one.error(instrument) for one in seen], self.bent)
        scaled = self.slopes / error[:, :, None]
        return np.einsum("dfi,dfj->dij", scaled, scaled)


def _slopes(
    candidate: Candidate, scene: Scene, prior: LogNormalPrior, instrument: Resolution, kinds: Sequence[str],
    drawn: Floats, step: float, threads: Workers, accuracy: Accuracy | None,
) -> _FeatureSlopes:  # fmt: skip
    count = len(prior.paths)
    changed = candidate.on(scene)
    reach = step * prior.std
    offsets = np.vstack([np.zeros((1, count)), np.diag(reach), -np.diag(reach)])
    logs = (drawn[:, None, :] + offsets).reshape(-1, count)
    ends = np.array([field_limits(changed, path) for path in prior.paths])
    points = np.clip(prior.values * np.exp(logs), ends[:, 0], ends[:, 1])
    vary = {path: points[:, j] for j, path in enumerate(prior.paths)}
    found = simulated(changed, vary, candidate.record, kinds, resolution=instrument.rebound, threads=threads,
                      accuracy=accuracy)  # fmt: skip
    values = found.values.reshape(len(drawn), 2 * count + 1, -1)
    spread = np.nan_to_num(found.spread.reshape(values.shape))
    between = np.log(points).reshape(len(drawn), 2 * count + 1, count)
    up, down = np.arange(1, count + 1), np.arange(count + 1, 2 * count + 1)
    width = np.stack([between[:, up[j], j] - between[:, down[j], j] for j in range(count)], axis=1)[
        :, :, None
    ]
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (values[:, up] - values[:, down]) / width
        noise = (spread[:, up] ** 2 + spread[:, down] ** 2) / found.periods / width**2
        real = np.clip(1.0 - noise / slope**2, 0.0, 1.0)
    slope = np.where(np.isfinite(slope) & np.isfinite(real), slope * np.sqrt(np.nan_to_num(real)), 0.0)
    slope = np.where(np.isfinite(values[:, :1]), slope, 0.0)
    second = np.nan_to_num(values[:, up] + values[:, down] - 2.0 * values[:, :1])
    bent = 0.5 * np.sqrt(np.sum(second**2, axis=1))
    ended = float(np.mean(np.isfinite(found.values).any(axis=1)))
    return _FeatureSlopes(
        slope.transpose(0, 2, 1),
        values[:, 0],
        spread[:, 0],
        bent,
        found.units,
        found.names,
        found.periods,
        ended,
    )


def _greedy(
    candidates: Sequence[Candidate],
    gain: Callable[[Mapping[int, int]], float],
    alone: Sequence[float],
    budget: float,
) -> tuple[dict[int, int], list[tuple[Candidate, float]], float]:
    """Records of each candidate, the order they were chosen in with the gain after each, and their cost [s]."""
    counts: dict[int, int] = {}
    steps: list[tuple[Candidate, float]] = []
    cost, reached = 0.0, 0.0
    while True:
        best: tuple[float, tuple[int, ...], float] | None = None
        for size in (1, 2):  # two that tell nothing apart may tell much together
            for chosen in combinations_with_replacement(range(len(candidates)), size):
                length = sum(candidates[k].record for k in chosen)
                then = Counter(counts) + Counter(chosen)
                if cost + length > budget * (1.0 + 1e-9) or max(then.values()) > MOST_REPEATS:
                    continue
                after = gain(then)
                rate = (after - reached) / length
                if after - reached >= _LEAST_GAIN and (best is None or rate > best[0]):
                    best = (rate, chosen, after)
            if best is not None:
                break
        if best is None:
            break
        for k in best[1]:
            counts[k] = counts.get(k, 0) + 1
            cost += candidates[k].record
            steps.append((candidates[k], gain(counts)))
        reached = best[2]
    fitting = [k for k, candidate in enumerate(candidates) if candidate.record <= budget * (1.0 + 1e-9)]
    if fitting:
        single = max(fitting, key=lambda k: alone[k])
        if alone[single] > reached + _LEAST_GAIN:
            return {single: 1}, [(candidates[single], alone[single])], candidates[single].record
    return counts, steps, cost


_LEAST_GAIN = 0.02
"""Gain of a record below which a plan ends."""


def _note(slopes: _FeatureSlopes, candidate: Candidate, budget: float) -> str:
    if candidate.record > budget * (1.0 + 1e-9):
        return "longer than the budget"
    if slopes.ended < 0.5:
        return f"{1.0 - slopes.ended:.0%} of its simulations did not reach their end"
    return ""


def _check(
    candidates: Sequence[Candidate], prior: LogNormalPrior, parameter: str, budget: float, scene: Scene
) -> None:
    problems = []
    if not candidates:
        problems.append("there is no candidate signal to rank")
    if parameter not in prior.paths:
        problems.append(f"{parameter}: is none of the unknown parameters{nearest(parameter, prior.paths)}")
    if not (np.isfinite(budget) and budget > 0.0):
        problems.append(f"budget: expected a time above 0 s, got {budget:g} s")
    for candidate in candidates:
        try:
            candidate.on(scene)
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
