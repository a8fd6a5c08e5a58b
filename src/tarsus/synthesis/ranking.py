"""What to record next: which records tell most about a number, or about all, for the time they take."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations_with_replacement

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.progress import Progress
from tarsus.base.spec import float_paths
from tarsus.base.workers import Workers, spread
from tarsus.model.scene import Scene
from tarsus.synthesis.belief import Belief
from tarsus.synthesis.information import RecordInformation, Sensing, deviations, expected_information, gains_of
from tarsus.synthesis.recordings import Recording

MOST_REPEATS = 10
"""Records of one kind that a plan takes at most."""
LEAST_GAIN = 0.02
"""Gain of a record below which a plan ends."""
TRUST = 0.03
"""Share of a number to which model and calibration are trusted: closer, a number gains nothing by more records, and the
time is better spent on another."""
DRAWS = 2
"""Devices of what is believed at which information is found, that of the values among them."""


@dataclass(frozen=True)
class Ranked:
    """One record alone.

    gain: logarithm of the factor by which the standard deviation of the number in question shrinks, or the mean of all
    (0 for none); repeats: how often it is in the plan; bounds (np,): standard deviations of the logarithms that no
    estimate from it alone goes below, at the believed values; note: why it cannot be used, else empty.
    """

    recording: Recording
    gain: float
    repeats: int
    bounds: tuple[float, ...]
    note: str = ""


@dataclass(frozen=True)
class RecordingPlan:
    """Records chosen within a budget, in the order of choice, with the gain after each; cost [s]; gain of all."""

    steps: tuple[tuple[Recording, float], ...]
    cost: float
    gain: float


@dataclass(frozen=True)
class Ranking:
    """Records by what they tell about a parameter [unit], or about all numbers, best first.

    paths (np,); before (np,): standard deviations of the logarithms now; after (np,): with the plan's records, or with
    the best one where the plan is empty; bounds (np,): what these records alone leave; budget [s].
    """

    parameter: str | None
    unit: str
    paths: tuple[str, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]
    bounds: tuple[float, ...]
    budget: float
    ranked: tuple[Ranked, ...]
    plan: RecordingPlan

    @property
    def std(self) -> float | None:
        """Standard deviation of the logarithm of the parameter now; none of all."""
        return None if self.parameter is None else self.before[self.paths.index(self.parameter)]


def rank(
    scene: Scene,
    candidates: Sequence[Recording],
    belief: Belief,
    parameter: str | None,
    budget: float,
    *,
    sensing: Sensing | None = None,
    seed: int = 0,
    threads: Workers = None,
    progress: Progress | None = None,
) -> Ranking:
    """Rank records by expected information, and choose some within a budget.

    At draws of what is believed every record is simulated once with derivatives, and adds its information
    (`tarsus.synthesis.information`) to what is believed; the gains of the channels are unknown in all records alike.
    The gain is ``log(std before / std after)`` of the parameter, all others being unknown as believed, in the mean over
    draws; without a parameter the mean over all numbers. No number is taken to be known more closely than `TRUST`.

    The plan is greedy: the record with the largest gain per second, given those before, as long as it fits the budget
    (two at once, where no single one gains 2 %); or the best single record, where that shows more.

    Parameters
    ----------
    scene, candidates, belief
        The device, what could be recorded of it, and what is not known of it.
    parameter
        Name of the number in question; None: all.
    budget
        Time of recording [s].
    sensing
        The instruments.
    seed
        Of the draws.
    progress
        Called as ``progress(done, total, what)``.

    Raises
    ------
    InputError
        For no candidates, a parameter that is none of the unknown numbers, a budget that is not positive, and where no
        candidate can be recorded.
    """
    _check(candidates, belief, parameter, budget)
    shown = _information(scene, candidates, belief, sensing or Sensing(), belief.draws(DRAWS, seed), threads, progress)
    gained = _Gained(shown, belief, sensing or Sensing(), parameter)
    alone = [gained.gain({k: 1}) for k in range(len(candidates))]
    counts, steps, cost = _greedy(candidates, gained.gain, alone, budget)
    ranked = [
        Ranked(c, alone[k], counts.get(k, 0), gained.bounds({k: 1}), _note(shown[k], c, budget))
        for k, c in enumerate(candidates)
    ]
    chosen = counts or {int(np.argmax(alone)): 1}
    plan = RecordingPlan(tuple((candidates[k], gain) for k, gain in steps), cost, gained.gain(counts))
    paths = tuple(belief.unknown)
    unit = "" if parameter not in float_paths(scene) else float_paths(scene)[parameter].unit
    return Ranking(
        parameter,
        unit,
        paths,
        tuple(belief.std.tolist()),
        gained.after(chosen),
        gained.bounds(chosen),
        budget,
        tuple(sorted(ranked, key=lambda one: -one.gain)),
        plan,
    )


class _Gained:
    """Information of candidates at draws (nc, nd, N, N) about all numbers, gains of channels behind them."""

    def __init__(
        self,
        shown: Sequence[Sequence[RecordInformation | str]],
        belief: Belief,
        sensing: Sensing,
        parameter: str | None,
    ) -> None:
        self.paths, self.std = tuple(belief.unknown), belief.std
        gains = gains_of(one for row in shown for one in row if isinstance(one, RecordInformation))
        names, count = (*self.paths, *gains), len(self.paths)
        nothing = np.zeros((len(names), len(names)))
        self.each = np.array(
            [[one.about(names) if isinstance(one, RecordInformation) else nothing for one in row] for row in shown]
        )
        # gains that are known exactly have no spread left to find
        self.known = np.diag(np.full(len(names), max(sensing.gain, 1e-9) ** -2.0))
        self.known[:count, :count] = 0.0
        self.believed = self.known.copy()
        self.believed[:count, :count] = np.linalg.inv(belief.covariance)
        self.target = None if parameter is None else self.paths.index(parameter)
        self.first = self._size(self.believed[None])

    def _sum(self, counts: Mapping[int, int], first: Floats) -> Floats:
        return first + sum((n * self.each[k] for k, n in counts.items()), np.zeros_like(self.each[0]))

    def _size(self, information: Floats) -> Floats:
        """Logarithm of what is left (nd,) of the number in question, or the mean of all."""
        left = self._trusted(deviations(information)[:, : len(self.paths)])
        return np.log(left).mean(axis=1) if self.target is None else np.log(left[:, self.target])

    def _trusted(self, left: Floats) -> Floats:
        """Standard deviations with what the model is trusted to, as far as records set them, not what is believed."""
        trust = np.minimum(TRUST, self.std)
        return np.sqrt(left**2 + trust**2 * (1.0 - np.minimum(left / self.std, 1.0) ** 2))

    def gain(self, counts: Mapping[int, int]) -> float:
        """Expected gain of records, so many of each candidate."""
        return float(np.mean(self.first - self._size(self._sum(counts, self.believed))))

    def after(self, counts: Mapping[int, int]) -> tuple[float, ...]:
        """Standard deviations (np,) of the logarithms after records, at the believed values."""
        return self._left(counts, self.believed)

    def bounds(self, counts: Mapping[int, int]) -> tuple[float, ...]:
        """The same of records alone."""
        return self._left(counts, self.known)

    def _left(self, counts: Mapping[int, int], first: Floats) -> tuple[float, ...]:
        return tuple(deviations(self._sum(counts, first)[0])[: len(self.paths)].tolist())


def _information(
    scene: Scene,
    candidates: Sequence[Recording],
    belief: Belief,
    sensing: Sensing,
    logs: Floats,
    threads: Workers,
    progress: Progress | None,
) -> list[list[RecordInformation | str]]:
    """Of every candidate its information at every draw, or why it has none."""
    drive = next(iter(scene.signals), next(iter(scene.robot.drives), ""))
    work = partial(_of_draw, scene, belief, sensing, drive)
    jobs = [(candidate, row) for candidate in candidates for row in logs]
    out: list[list[RecordInformation | str]] = []
    for i, one in enumerate(spread(work, jobs, threads)):
        if i % len(logs) == 0:
            out.append([])
            if progress is not None:
                progress(len(out) - 1, len(candidates), candidates[len(out) - 1].name)
        out[-1].append(one)
    if not any(isinstance(one, RecordInformation) for row in out for one in row):
        raise InputError(list(dict.fromkeys(str(row[0]) for row in out)))
    return out


def _of_draw(
    scene: Scene, belief: Belief, sensing: Sensing, drive: str, job: tuple[Recording, Floats]
) -> RecordInformation | str:
    recording, logs = job
    try:
        drawn = belief.scene(scene, logs)
        return expected_information(drawn, recording, belief.directions(drawn), sensing, drive=drive)
    except InputError as error:
        return str(error)


def _greedy(
    candidates: Sequence[Recording], gain: Callable[[Mapping[int, int]], float], alone: Sequence[float], budget: float
) -> tuple[dict[int, int], list[tuple[int, float]], float]:
    """Records of each candidate, the order they were chosen in with the gain after each, and their cost [s]."""
    counts: Counter[int] = Counter()
    steps: list[tuple[int, float]] = []
    cost, reached, most = 0.0, 0.0, budget * (1.0 + 1e-9)
    while True:
        best: tuple[float, tuple[int, ...], float] | None = None
        for size in (1, 2):  # two that show nothing apart may show much together
            for chosen in combinations_with_replacement(range(len(candidates)), size):
                length = sum(candidates[k].duration for k in chosen)
                then = counts + Counter(chosen)
                if cost + length > most or max(then.values()) > MOST_REPEATS:
                    continue
                after = gain(then)
                rate = (after - reached) / length
                if after - reached >= LEAST_GAIN and (best is None or rate > best[0]):
                    best = (rate, chosen, after)
            if best is not None:
                break
        if best is None:
            break
        for k in best[1]:
            counts[k] += 1
            cost += candidates[k].duration
            steps.append((k, gain(counts)))
        reached = best[2]
    fitting = [k for k, one in enumerate(candidates) if one.duration <= most]
    single = max(fitting, key=lambda k: alone[k], default=None)
    if single is not None and alone[single] > reached + LEAST_GAIN:
        return {single: 1}, [(single, alone[single])], candidates[single].duration
    return dict(counts), steps, cost


def _note(shown: Sequence[RecordInformation | str], candidate: Recording, budget: float) -> str:
    if candidate.duration > budget * (1.0 + 1e-9):
        return "longer than the budget"
    failed = [one for one in shown if isinstance(one, str)]
    return f"of {len(shown)} simulations {len(failed)} cannot be had" if len(failed) > 0.5 * len(shown) else ""


def _check(candidates: Sequence[Recording], belief: Belief, parameter: str | None, budget: float) -> None:
    problems = []
    if not candidates:
        problems.append("there is no record to rank")
    if parameter is not None and parameter not in belief.unknown:
        problems.append(f"{parameter}: is none of the unknown parameters{nearest(parameter, belief.unknown)}")
    if not (np.isfinite(budget) and budget > 0.0):
        problems.append(f"budget: expected a time above 0 s, got {budget:g} s")
    if problems:
        raise InputError(problems)
