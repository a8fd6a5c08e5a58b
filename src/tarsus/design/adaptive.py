"""Gaits that adapt: a few gaits, and a rule that chooses among them by what the robot senses in its first steps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.design import shown
from tarsus.design.gait_request import GaitOptions, GaitRequest, gait_request
from tarsus.design.over import Box, Ensemble, even_points
from tarsus.design.risk import Mean
from tarsus.design.rules import Rule, grown
from tarsus.design.walk_objectives import OBJECTIVES, WalkObjective
from tarsus.design.walks import Walks
from tarsus.files.library import SceneLike, as_scene

__all__ = ["AdaptiveGait", "Sense", "adapt", "senses_of"]

Floats = NDArray[np.float64]
Progress = Callable[[int, int, str], None]

SPREAD_GROUNDS = 12
"""Grounds on which gaits are sought, one by one."""
DEPTH = 3
"""Comparisons at most before a gait is chosen."""
WORTH = 0.005
"""Share of the mean value that another gait must add to the few."""
REPEATS = 4
"""Draws of the noise on which the rule is grown."""
FOLDS = 5
"""Parts of the training grounds, each of which judges the rules grown on the others."""
SURE = 2.0
"""Standard errors by which a rule must save more than one gait for all grounds: of a dozen rules that are tried the
best one saves one of them by chance."""
YOUNG = 8
"""Gaits tried about the best of a ground in each step of its own search."""
STEP = 0.15
"""First step of such a search, in the unit cube; a third shorter each time."""
JITTER = 1e-3
"""Standard deviation, in the unit cube, of what repeated walks of a gait differ by: what no timer and no leg keeps, and
ten times what makes a walk that rings forget how it began."""


class Sense(Enum):
    """What a robot can sense of its own walk."""

    NOTHING = "nothing"
    """Nothing: one gait for all grounds."""
    CHARGE = "charge"
    """The charge of its actuators, which tells when a foot meets and leaves the ground: the share of the time on
    the ground, and touchdowns a step."""
    SLIP = "slip"
    """Its way over the ground: path that the feet slide, and stride."""


_SENSED = {
    Sense.NOTHING: (),
    Sense.CHARGE: (
        OBJECTIVES["support"],
        WalkObjective(
            "touchdowns", "1", True, "touchdowns a step", ("impacts",), lambda seen: seen["impacts"]
        ),
    ),
    Sense.SLIP: (
        OBJECTIVES["slip"],
        WalkObjective(
            "stride", "m", True, "way of the body a step", ("stride",), lambda seen: seen["stride"]
        ),
    ),
}


@dataclass(frozen=True, repr=False)
class AdaptiveGait:
    """A few gaits, a rule that chooses among them, and what that loses.

    gaits: values by path of each; probe: number of the one that is walked first; senses: names; rule: from senses
    to the number of a gait. costs (nh, k): of the gaits on the hidden grounds; known (nh,): of the best gait found
    for each ground by a search of its own; chosen (nh,): by the rule; grounds (nh,) by path. steps: walked before
    the gait is chosen, with the probe. runs: made in all. repeats: walks that each cost is the mean of; with several
    the gait that knows the ground is judged by other walks than those that it was found by, so that chance is nobody's
    merit, and losses may be below 0.
    """

    request: GaitRequest
    sense: tuple[Sense, ...]
    gaits: tuple[Mapping[str, float], ...]
    probe: int
    senses: tuple[str, ...]
    rule: Rule
    costs: Floats
    known: Floats
    chosen: NDArray[np.int64]
    grounds: Mapping[str, Floats]
    steps: int
    runs: int
    repeats: int = 1

    def __repr__(self) -> str:
        return shown.adapt_line(self)

    def _repr_html_(self) -> str:
        return shown.adapt_html(self)

    def _lost(self, costs: Floats) -> float:
        return float(np.mean(costs - self.known) / np.mean(np.abs(self.known)))

    @property
    def regret(self) -> float:
        """Mean loss on the hidden grounds against the gait that knows the ground, over its mean value."""
        return self._lost(self.costs[np.arange(len(self.chosen)), self.chosen])

    @property
    def fixed_regret(self) -> float:
        """The same of that one of the gaits which is best on the mean of the hidden grounds: the best of no
        sensing."""
        return self._lost(self.costs[:, int(np.argmin(self.costs.mean(axis=0)))])

    @property
    def choice_regret(self) -> float:
        """The same were the best of the gaits always chosen: what is lost by having only a few."""
        return self._lost(self.costs.min(axis=1))

    @property
    def table(self) -> list[tuple[str, int]]:
        """The rule: conditions in words, and numbers of gaits."""
        return self.rule.lines(self.senses)


def senses_of(given: str | Sequence[Sense]) -> tuple[Sense, ...]:
    """Senses of words with commas; raises InputError for unknown ones, and for nothing beside something."""
    if not isinstance(given, str):
        return tuple(given)
    words = [word.strip() for word in given.split(",")]
    known = [one.value for one in Sense]
    problems = [
        f"sense: there is none called '{word}'{nearest(word, known)}" for word in words if word not in known
    ]
    if not problems and len(set(words)) > 1 and Sense.NOTHING.value in words:
        problems.append("sense: 'nothing' stands alone")
    if problems:
        raise InputError(problems)
    return tuple(Sense(word) for word in dict.fromkeys(words))


def adapt(
    scene: SceneLike,
    free: Mapping[str, Any] | Iterable[str],
    over: Any,
    sense: str | Sequence[Sense] = "charge",
    objective: str | WalkObjective = "speed",
    *,
    steps: int = 20,
    gaits: int = 6,
    hidden: int = 200,
    training: int = 96,
    noise: float = 0.02,
    repeats: int = 1,
    progress: Progress | None = None,
    **options: Any,
) -> AdaptiveGait:
    """Design a rule from what a robot senses in its first steps to one of a few gaits.

    Gaits are sought on grounds spread over the box, each by itself; the few that together lose least are kept. The
    robot walks ``steps`` steps with one of them, the probe, and then takes the one that the rule says. Rule and
    probe are those that lose least on training grounds that they were not made on. What is lost is measured on hidden
    grounds, which nothing above has seen, against the best gait that a search finds for each of them alone. The chosen
    gait is judged by a walk of its own from the start of the scene.

    Parameters
    ----------
    scene, free, options
        As for `tarsus.design.gait`.
    over
        A mapping of paths to (low, high), or an `Ensemble`, of whose members the last ``hidden`` (at most half) are
        hidden.
    sense
        ``charge``, ``slip``, both with a comma, or ``nothing``.
    objective
        What the gait is for, one.
    steps, gaits, hidden, training
        Steps of the probe, gaits at most, number of hidden grounds, and of those in a box that the rule is grown on.
    noise
        Standard deviation of what is sensed, as a share of it.
    repeats
        Walks that each gait is judged by on each ground, whose values differ by a thousandth of their ranges. One is
        right where a walk settles; where it rings, its speed is a matter of digits, and the best of many single walks
        is luck.

    Raises
    ------
    InputError
        With every problem of the request.
    """
    scene = as_scene(scene)
    problems = [
        f"{name}: expected at least {least}, got {value}"
        for name, value, least in (
            ("steps", steps, 2),
            ("gaits", gaits, 1),
            ("hidden", hidden, 2),
            ("training", training, 2),
            ("repeats", repeats, 1),
        )
        if value < least
    ]
    if not 0.0 <= noise < 1.0:
        problems.append(f"noise: expected a share from 0 to below 1, got {noise:g}")
    if over is None:
        problems.append("over: say the grounds between which the robot cannot know, PATH=a:b")
    made: list[Any] = []
    for one in (
        lambda: senses_of(sense),
        lambda: gait_request(
            scene, free, [objective], over, None if over is None else Mean(), GaitOptions(**options)
        ),
    ):
        try:
            made.append(one())
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    found, request = made
    if len(request.objectives) != 1 or not request.objectives[0].grounded:
        raise InputError(
            "objective: a robot adapts to its ground for one objective that depends on it, such as speed"
        )
    adapter = _Adapter(request, found, noise, repeats, progress or (lambda done, total, what: None))
    return adapter.design(steps, gaits, (training, hidden))


class _Adapter:
    """The search of one request."""

    def __init__(
        self, request: GaitRequest, sense: tuple[Sense, ...], noise: float, repeats: int, progress: Progress
    ) -> None:
        self.request, self.sense, self.noise, self.progress = request, sense, noise, progress
        self.repeats = repeats
        options = request.options
        self.rng = np.random.default_rng([options.seed, 41])
        self.sensed = tuple(one for sense in self.sense for one in _SENSED[sense])
        self.walks = Walks(
            request.scene, request.unknowns, request.objectives, request.duration, options.threads
        )
        self.runs = 0

    def design(self, steps: int, most: int, counts: tuple[int, int]) -> AdaptiveGait:
        """The whole design."""
        training, hidden = self._grounds(*counts)
        pool = self._pool(training)
        self.progress(1, 4, "gaits on training grounds")
        costs = self._table(pool, training)
        few = _few(costs, most)
        library, costs = pool[few], costs[:, few]
        self.progress(2, 4, "what the robot senses")
        felt = [self._felt(one, training, steps) for one in library] if self.sensed else []
        probe, rule = self._rule(felt, costs)
        self.progress(3, 4, "hidden grounds")
        on_hidden = self._table(library, hidden)
        senses = self._felt(library[probe], hidden, steps) if self.sensed else np.zeros((len(on_hidden), 0))
        chosen = rule(self._noisy(senses))
        known = self._known(library, on_hidden, hidden)
        self.progress(4, 4, "done")
        return AdaptiveGait(
            self.request, self.sense, tuple(self.walks.changes(one) for one in library), probe,
            tuple(one.name for one in self.sensed), rule, on_hidden, known, chosen, hidden, steps,
            self.walks.runs + self.runs, self.repeats,
        )  # fmt: skip

    def _grounds(self, some: int, count: int) -> tuple[dict[str, Floats], dict[str, Floats]]:
        """Training and hidden grounds: values by path."""
        over = self.request.over
        if isinstance(over, Ensemble):
            size = len(next(iter(over.values.values())))
            count = min(count, size // 2)
            own = {path: np.asarray(values, dtype=float) for path, values in over.values.items()}
            return {p: v[:-count] for p, v in own.items()}, {p: v[-count:] for p, v in own.items()}
        assert isinstance(over, Box)
        train, test = (
            over.spread(some, self.request.options.seed),
            over.at(self.rng.random((count, len(over.paths)))),
        )
        return tuple({p: own[:, i] for i, p in enumerate(over.paths)} for own in (train, test))  # type: ignore

    def _pool(self, training: Mapping[str, Floats]) -> Floats:
        """Gaits (np, nu) worth having: the best on some ground, and the best on their mean."""
        every = len(next(iter(training.values())))
        some = np.linspace(0, every - 1, min(SPREAD_GROUNDS, every)).astype(int)
        grounds = {path: own[some] for path, own in training.items()}
        candidates = self.request.options.candidates
        scan = max(candidates // (2 * len(some)), 8)
        nu = len(self.request.unknowns)
        points = even_points(nu, scan, self.rng)
        costs = self._table(points, grounds)
        best = points[costs.argmin(axis=1)]
        generations = max((candidates - scan * len(some)) // (len(some) * YOUNG), 1)
        best, _ = self._sought(best, costs.min(axis=1), grounds, generations)
        middle = points[np.argsort(costs.mean(axis=0))[:4]]
        return np.concatenate([best, middle])

    def _sought(
        self, best: Floats, costs: Floats, grounds: Mapping[str, Floats], generations: int
    ) -> tuple[Floats, Floats]:
        """Gaits (ng, nu), each searched further on its own ground by steps that get shorter, and their costs
        (ng,)."""
        best, costs, step = best.copy(), costs.copy(), STEP
        n, nu = best.shape
        for _ in range(generations):
            moved = self._moved(np.repeat(best[:, None], YOUNG, axis=1), step)
            given = {path: np.repeat(own, YOUNG) for path, own in grounds.items()}
            found = self._judged(moved.reshape(-1, nu), given).reshape(n, YOUNG)
            at, rows = found.argmin(axis=1), np.arange(n)
            better = found[rows, at] < costs
            best[better], costs[better] = moved[rows, at][better], found[rows, at][better]
            step /= 1.5
        return best, costs

    def _moved(self, points: Floats, step: float) -> Floats:
        """Points (..., nu) moved by chance, and back into the unit cube."""
        moved = points + step * self.rng.standard_normal(points.shape)
        low = np.abs(moved)
        inside = np.clip(np.where(low > 1.0, 2.0 - low, low), 0.0, 1.0)
        return np.where(self.request.unknowns.around, np.remainder(moved, 1.0), inside)

    def _judged(self, points: Floats, grounds: Mapping[str, Floats]) -> Floats:
        """Costs (nr,) of gaits at points (nr, nu), each on its own ground: of one walk, or the mean of several."""
        if self.repeats == 1:
            return self.walks.each(points, grounds)[:, 0]
        given = {path: np.repeat(own, self.repeats) for path, own in grounds.items()}
        costs = self.walks.each(self._moved(np.repeat(points, self.repeats, axis=0), JITTER), given)[:, 0]
        return costs.reshape(len(points), self.repeats).mean(axis=1)

    def _table(self, points: Floats, grounds: Mapping[str, Floats]) -> Floats:
        """Costs (ng, n) of gaits on grounds; of a walk that did not reach its end those of standing still."""
        n, ng = len(points), len(next(iter(grounds.values())))
        given = {path: np.repeat(own, n) for path, own in grounds.items()}
        costs = self._judged(np.tile(points, (ng, 1)), given).reshape(ng, n)
        worst = float(np.max(costs, where=np.isfinite(costs), initial=0.0))
        return np.where(np.isfinite(costs), costs, worst)

    def _felt(self, point: Floats, grounds: Mapping[str, Floats], steps: int) -> Floats:
        """What is sensed (ng, ns) in the first steps of a gait at a point (nu,), without noise."""
        scene = self.walks.scene_of(point)
        period = max((wave.period or 0.0 for wave in scene.waveforms.values()), default=0.0)
        walks = Walks(
            self.request.scene,
            self.request.unknowns,
            self.sensed,
            steps * period,
            self.request.options.threads,
        )
        ng = len(next(iter(grounds.values())))
        costs = walks.each(np.repeat(point[None], ng, axis=0), grounds)
        self.runs += walks.runs
        values = np.stack([one.value(own) for one, own in zip(self.sensed, costs.T, strict=True)], axis=1)
        return np.where(np.isfinite(values), values, 0.0)

    def _noisy(self, senses: Floats) -> Floats:
        return senses * (1.0 + self.noise * self.rng.standard_normal(senses.shape))

    def _rule(self, felt: Sequence[Floats], costs: Floats) -> tuple[int, Rule]:
        """The probe and the rule, grown on all training grounds (ng), for the probe and the number of comparisons that
        lose least on grounds that a rule was not grown on; one gait always where that saves no more than chance."""
        fixed = int(np.argmin(costs.mean(axis=0)))
        if not felt:
            return fixed, Rule(fixed)
        fold = self.rng.permutation(len(costs)) % FOLDS
        tried = [
            (self._held_out(own, costs, fold, depth), depth, probe)
            for depth in range(1, DEPTH + 1)
            for probe, own in enumerate(felt)
        ]
        lost, depth, probe = min(tried, key=lambda one: float(one[0].mean()))
        saved = self._held_out(felt[fixed], costs, fold, 0) - lost
        if not saved.mean() > SURE * saved.std() / np.sqrt(len(saved)):
            return fixed, Rule(fixed)
        return probe, self._grown(felt[probe], costs, depth)

    def _grown(self, felt: Floats, costs: Floats, depth: int) -> Rule:
        """A rule from what is felt (ng, ns), with several draws of the noise, to costs (ng, n)."""
        senses = np.concatenate([self._noisy(felt) for _ in range(REPEATS)])
        return grown(senses, np.tile(costs, (REPEATS, 1)), depth)

    def _held_out(self, felt: Floats, costs: Floats, fold: NDArray[np.int64], depth: int) -> Floats:
        """Costs (ng,) on the grounds of each fold by a rule grown on all others."""
        lost = np.zeros(len(costs))
        for one in range(int(fold.max()) + 1):
            out = fold == one
            chosen = self._grown(felt[~out], costs[~out], depth)(self._noisy(felt[out]))
            lost[out] = costs[out][np.arange(int(out.sum())), chosen]
        return lost

    def _known(self, library: Floats, costs: Floats, hidden: Mapping[str, Floats]) -> Floats:
        """Costs (nh,) of the best gait for each hidden ground: the best of the few, searched further on this
        ground."""
        best, found = self._sought(library[costs.argmin(axis=1)], costs.min(axis=1), hidden, 3)
        if self.repeats == 1:
            return found
        again = self._judged(best, hidden)  # what it was chosen by was partly luck
        return np.where(np.isfinite(again), again, float(costs.max()))


def _few(costs: Floats, most: int) -> list[int]:
    """Columns of costs (ng, n) that together cost least, chosen one after the other."""
    chosen = [int(np.argmin(costs.mean(axis=0)))]
    while len(chosen) < most:
        own = costs[:, chosen].min(axis=1)
        totals = np.minimum(costs, own[:, None]).mean(axis=0)
        one = int(np.argmin(totals))
        if own.mean() - totals[one] <= WORTH * abs(own.mean()):
            break
        chosen.append(one)
    return chosen
