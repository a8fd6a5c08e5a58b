"""Gaits that adapt: a few gaits, and a table by which one is chosen from what the robot senses in its first steps."""

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
from tarsus.design.posterior import Posterior, posterior_of
from tarsus.design.risk import Mean
from tarsus.design.walk_objectives import OBJECTIVES, WalkObjective
from tarsus.design.walks import Walks
from tarsus.files.library import SceneLike, as_scene

__all__ = ["AdaptiveGait", "Sense", "adapt", "senses_of"]

Floats = NDArray[np.float64]
Progress = Callable[[int, int, str], None]

SPREAD_GROUNDS = 32
"""Grounds on which gaits are sought."""
PROBES = 4
"""Probes at most; the steps are shared out evenly."""
PROBE_STEPS = 2
"""Steps of a probe at least: the first third tells of the start."""
WORTH = 0.005
"""Share of the mean value that another gait must add to the few."""
YOUNG = 8
"""Gaits tried about one in each step of a search."""
STEP = 0.15
"""First step of such a search, in the unit cube; a third shorter each time."""
DRAWS = 2000
"""Resamplings of the hidden grounds for the interval of the regret (Efron's bootstrap)."""
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
    """A few gaits, a table by which one of them is chosen, and what that loses.

    gaits: values by path of each; probes: numbers of those that are walked first, each from a stand; senses: names of
    what each probe tells; posterior: from what all probes tell to the number of a gait. costs (nh, k): of the gaits on
    the hidden grounds; known (nh,): of the best gait found for each ground by a search of its own; chosen (nh,): by the
    posterior; best (nh,): the best of the few, by other walks where there are several; grounds (nh,) by path.
    probe_steps: of each probe. runs: made in all. repeats: walks that each cost is the mean of; with several the gait
    that knows the ground is judged by other walks than those that it was found by, so that chance is nobody's merit,
    and losses may be below 0.
    """

    request: GaitRequest
    sense: tuple[Sense, ...]
    gaits: tuple[Mapping[str, float], ...]
    probes: tuple[int, ...]
    senses: tuple[str, ...]
    posterior: Posterior
    costs: Floats
    known: Floats
    chosen: NDArray[np.int64]
    best: NDArray[np.int64]
    grounds: Mapping[str, Floats]
    probe_steps: int
    runs: int
    repeats: int = 1

    def __repr__(self) -> str:
        return shown.adapt_line(self)

    def _repr_html_(self) -> str:
        return shown.adapt_html(self)

    def _of(self, gaits: NDArray[np.int64]) -> Floats:
        return self.costs[np.arange(len(gaits)), gaits]

    def _lost(self, costs: Floats) -> float:
        return float(np.mean(costs - self.known) / np.mean(np.abs(self.known)))

    @property
    def regret(self) -> float:
        """Mean loss on the hidden grounds against the gait that knows the ground, over its mean value."""
        return self._lost(self._of(self.chosen))

    @property
    def regret_interval(self) -> tuple[float, float]:
        """95 % interval of the regret by resampling of the hidden grounds."""
        rows = np.random.default_rng(17).integers(0, len(self.known), (DRAWS, len(self.known)))
        lost, known = (self._of(self.chosen) - self.known)[rows], np.abs(self.known)[rows]
        low, high = np.quantile(lost.mean(axis=1) / known.mean(axis=1), (0.025, 0.975))
        return float(low), float(high)

    @property
    def fixed_regret(self) -> float:
        """The same of that one of the gaits which is best on the mean of the hidden grounds: the best of no
        sensing."""
        return self._lost(self.costs[:, int(np.argmin(self.costs.mean(axis=0)))])

    @property
    def choice_regret(self) -> float:
        """The same were the best of the gaits always chosen: what is lost by having only a few, and what no sense
        takes away."""
        return self._lost(self._of(self.best))

    @property
    def table(self) -> list[tuple[str, int]]:
        """Gaits that the table chooses, and on how many of its grounds, in words."""
        if not self.probes:
            return [("always", int(np.argmax(self.posterior.shares)))]
        shares = self.posterior.shares
        order = np.argsort(-shares, kind="stable")
        return [(f"on {100.0 * shares[i]:.3g} % of the grounds", int(i)) for i in order if shares[i] > 0.0]


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
    gaits: int = 10,
    hidden: int = 200,
    training: int = 256,
    noise: float = 0.02,
    repeats: int = 1,
    progress: Progress | None = None,
    **options: Any,
) -> AdaptiveGait:
    """Design a table from what a robot senses in its first steps to one of a few gaits.

    Gaits are sought on grounds spread over the box: those that together lose least, each improved on the grounds that
    it is the best for. The robot walks ``steps`` steps in all with up to four of them, the probes, each from a stand;
    what it feels weighs the training grounds by Bayes' rule, and it takes the gait that is best in expectation. Probes
    are those that lose least on training grounds, each judged by all the others. What is lost is measured on hidden
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
        Steps of all probes, gaits at most, number of hidden grounds, and of those in a box that the table is of.
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

    def design(self, steps: int, most: int, counts: tuple[int, int]) -> AdaptiveGait:
        """The whole design."""
        training, hidden = self._grounds(*counts)
        self.progress(0, 4, "gaits on training grounds")
        library = self._library(training, most)
        costs = self._table(library, training)
        few = _few(costs, most)
        library, costs = library[few], costs[:, few]
        self.progress(1, 4, "what the robot senses")
        probes = max(min(PROBES, steps // PROBE_STEPS), 1)
        each = steps // probes
        chosen, posterior = self._posterior(library, training, costs, each, probes)
        self.progress(2, 4, "hidden grounds")
        on_hidden = self._table(library, hidden)
        felt = [self._felt(library[one], hidden, each) for one in chosen]
        taken = posterior(self._noisy(np.concatenate([np.zeros((len(on_hidden), 0)), *felt], axis=1)))
        judged = on_hidden if self.repeats == 1 else self._table(library, hidden)
        self.progress(3, 4, "the gait that knows its ground")
        known = self._known(library, judged, hidden)
        self.progress(4, 4, "done")
        return AdaptiveGait(
            self.request, self.sense, tuple(self.walks.changes(one) for one in library), chosen,
            tuple(one.name for one in self.sensed), posterior, on_hidden, known, taken, judged.argmin(axis=1), hidden,
            each, self.walks.runs, self.repeats,
        )  # fmt: skip

    def _posterior(
        self, library: Floats, training: Mapping[str, Floats], costs: Floats, steps: int, most: int
    ) -> tuple[tuple[int, ...], Posterior]:
        """Probes among the gaits of a library and the table, from two sets of walks on training grounds."""
        shape = (0, len(costs), 0)
        known, again = (
            np.array([self._felt(one, training, steps) for one in library]) if self.sensed else np.zeros(shape)
            for _ in range(2)
        )
        return posterior_of(known, again, self._noisy(again), costs, most)

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

    def _library(self, training: Mapping[str, Floats], most: int) -> Floats:
        """Gaits (k, nu) that together lose least on some of the grounds: the best few of an even spread, each then
        searched further on the grounds that it is the best for."""
        every = len(next(iter(training.values())))
        some = np.linspace(0, every - 1, min(SPREAD_GROUNDS, every)).astype(int)
        grounds = {path: own[some] for path, own in training.items()}
        candidates, nu = self.request.options.candidates, len(self.request.unknowns)
        scan = max(candidates // (2 * len(some)), 8)
        points = even_points(nu, scan, self.rng)
        costs = self._table(points, grounds)
        few = _few(costs, most, worth=0.0)
        library, costs, step = points[few], costs[:, few], STEP
        each = len(some) * (YOUNG + len(few))
        for _ in range(max((candidates - scan * len(some)) // each, 1)):
            changed = self._improved(library, costs, grounds, step)
            if changed:
                costs[:, changed] = self._table(library[changed], grounds)
            step /= 1.5
        return library

    def _improved(self, library: Floats, costs: Floats, grounds: Mapping[str, Floats], step: float) -> list[int]:
        """Move gaits (k, nu) of costs (ng, k) to what is better on the mean of the grounds that each is the best for;
        the numbers of those that moved."""
        nearest = costs.argmin(axis=1)
        young = self._moved(np.repeat(library[:, None], YOUNG, axis=1), step)
        given = {path: np.repeat(own, YOUNG) for path, own in grounds.items()}
        found = self._judged(young[nearest].reshape(-1, library.shape[1]), given).reshape(len(nearest), YOUNG)
        changed: list[int] = []
        for k in np.unique(nearest).tolist():
            own = nearest == k
            means = found[own].mean(axis=0)
            if means.min() < costs[own, k].mean():
                library[k] = young[k, int(means.argmin())]
                changed.append(k)
        return changed

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
        """What is sensed (ng, ns) in the first steps of a gait at a point (nu,), without noise; walks differ by chance
        as those that gaits are judged by."""
        scene = self.walks.scene_of(point)
        period = max((wave.period or 0.0 for wave in scene.waveforms.values()), default=0.0)
        ng = len(next(iter(grounds.values())))
        points = np.repeat(point[None], ng, axis=0)
        points = points if self.repeats == 1 else self._moved(points, JITTER)
        names = tuple(name for one in self.sensed for name in one.measures)
        seen = self.walks.measured(points, grounds, names, steps * period)
        values = np.stack([one.of(seen) for one in self.sensed], axis=1)
        return np.where(np.isfinite(values), values, 0.0)

    def _noisy(self, senses: Floats) -> Floats:
        return senses * (1.0 + self.noise * self.rng.standard_normal(senses.shape))

    def _known(self, library: Floats, costs: Floats, hidden: Mapping[str, Floats]) -> Floats:
        """Costs (nh,) of the best gait for each hidden ground: the best of the few, or what a further search on this
        ground finds."""
        few = library[costs.argmin(axis=1)]
        found, values = self._sought(few, costs.min(axis=1), hidden, 3)
        if self.repeats == 1:
            return values
        better = self._judged(found, hidden) < self._judged(few, hidden)  # what it was found by was partly luck
        again = self._judged(np.where(better[:, None], found, few), hidden)  # and so is what it was chosen by
        return np.where(np.isfinite(again), again, float(costs.max()))


def _few(costs: Floats, most: int, worth: float = WORTH) -> list[int]:
    """Columns of costs (ng, n) that together cost least, chosen one after the other, as long as another one saves more
    than a share of the mean."""
    chosen = [int(np.argmin(costs.mean(axis=0)))]
    while len(chosen) < most:
        own = costs[:, chosen].min(axis=1)
        totals = np.minimum(costs, own[:, None]).mean(axis=0)
        one = int(np.argmin(totals))
        if own.mean() - totals[one] <= worth * abs(own.mean()):
            break
        chosen.append(one)
    return chosen
