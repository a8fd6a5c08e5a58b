"""Gaits that adapt: a few gaits, and a table by which one is chosen from what the robot senses in its first steps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tarsus.base.errors import InputError
from tarsus.base.progress import Progress, silent
from tarsus.base.spec import Amount, quantity
from tarsus.base.workers import Workers
from tarsus.design.adaptive_gait import AdaptiveGait, Sense
from tarsus.design.free import Symmetry
from tarsus.design.gait_choice import GaitChoice, gait_choice
from tarsus.design.grounds import Grounds, drawn, spread, started
from tarsus.design.judge import MEAN
from tarsus.design.measures import DesignObjective
from tarsus.design.problem import MOST, SEARCHED, DesignProblem, SearchSettings
from tarsus.design.problems import Problems
from tarsus.design.request import Count, Given, setting, settings_of
from tarsus.design.runs import Runs
from tarsus.design.walker_problem import DEAD, TIED, gait_problem
from tarsus.files.library import SceneLike, as_scene
from tarsus.fit.unknowns import even_points
from tarsus.fit.valleys import inside, shorter_steps

Floats = NDArray[np.float64]

SPREAD_GROUNDS = 32
"""Grounds on which gaits are sought: every gait tried walks on all of them."""
PROBES = 4
"""Probes at most, among which the steps are shared out evenly: four of five steps earned more than two of ten."""
PROBE_STEPS = 2
"""Steps of a probe at least: the first third depends on the start."""
WORTH = 0.005
"""Share of the mean value that another gait must add to the few: less is within the scatter of the grounds."""
YOUNG = 8
"""Gaits tried about one in each step of a search: some more than the two to four numbers that are usually free."""
STEP, SHORTER = 0.15, 1.5
"""First step of such a search, in the unit cube, and the divisor of the next ones."""
KNOWING = 3
"""Steps of the search on each hidden ground alone: from 0.15 to 0.07 of a range about the best of the few."""
JITTER = 1e-3
"""Standard deviation, in the unit cube, of what two probes of a gait differ by: what no timer and no leg keeps, and
ten times what makes a walk that rings forget how it began."""


_SENSED = {
    Sense.NOTHING: (),
    Sense.CHARGE: (DesignObjective("support", "duty_factor", True), DesignObjective("touchdowns", "impacts", True)),
    Sense.SLIP: (DesignObjective("slip", "foot_slip", False), DesignObjective("stride", "stride", True)),
}


class AdaptSettings(SearchSettings):
    """What an adaptive gait is designed for besides the scene, see `tarsus.design.adapt`."""

    SECTIONS: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "objective": ("objective", "gaits", "hidden"),
        "search": ("candidates", "training", "seed"),
        "runs": ("starts", "duration", "from_rest", "periods"),
        "sense": ("sense", "steps", "noise"),
    }

    objective: Any = setting("speed", "one of speed, transport, slip, contact, support, sway and hold")
    symmetry: Symmetry | None = setting(None, TIED)
    dead: tuple[str, ...] = setting((), DEAD)
    gaits: Count = setting(10, "how many gaits at most")
    hidden: Annotated[int, Field(ge=2)] = setting(200, "hidden grounds that the choice is judged on")
    training: Annotated[int, Field(ge=2)] = setting(256, "grounds that the table is of")
    sense: tuple[Sense, ...] = setting((Sense.CHARGE,), "charge, slip, both, or nothing")
    steps: Annotated[int, Field(ge=2)] = setting(20, "walked with up to four gaits before one is chosen")
    noise: Amount = quantity("1", "standard deviation of what is sensed, as a share of it", default=0.02, ge=0, lt=1)


def adapt(
    scene: SceneLike,
    free: Mapping[str, Any] | Iterable[str] | None = None,
    over: Any = None,
    sense: str | Sequence[Sense] | None = None,
    objective: str | DesignObjective | None = None,
    *,
    request: Given = None,
    threads: Workers = None,
    progress: Progress | None = None,
    **settings: Any,
) -> AdaptiveGait:
    """Design a table from what a robot senses in its first steps to one of a few gaits.

    Gaits are sought on grounds spread over the box: those that together lose least, each improved on the grounds that
    it is the best for. The robot walks ``steps`` steps in all with up to four of them, the probes, each from a stand;
    what it senses weighs the training grounds by Bayes' rule, and it takes the gait that is best in expectation. Probes
    are those that lose least on training grounds, each judged by all the others. What is lost is measured on hidden
    grounds, which nothing above has seen, against the best gait that a search finds for each of them alone. Gaits are
    judged by the settled motion, the mean of several starts: in searches by short walks, on hidden grounds by long ones
    from other starts.

    Parameters
    ----------
    scene
        A scene, or a device's name or a scene file's path. It is a walker.
    free
        As for `tarsus.design.gait`.
    over
        A mapping of paths to (low, high), or `tarsus.design.Grounds`, of whose members the last ``hidden`` (at most
        half) are hidden.
    sense
        ``charge``, ``slip``, both with a comma, or ``nothing``.
    objective
        What the gait is for, one; speed unless given.
    request, threads, progress
        As for `tarsus.design.landing`.
    settings
        Further ones: steps of all probes; gaits, how many at most; hidden and training, numbers of grounds; noise,
        standard deviation of what is sensed as a share of it; starts; duration of the long walks; from_rest [s], to
        judge by an episode of that length from the scene's own start instead; symmetry, dead, candidates, seed.

    Raises
    ------
    InputError
        With every problem of the request.
    """
    options = settings_of(AdaptSettings, request, free=free, over=over, sense=sense, objective=objective, **settings)
    problems = Problems()
    senses = tuple(dict.fromkeys(options.sense))
    if len(senses) > 1 and Sense.NOTHING in senses:
        problems.append("sense: 'nothing' stands alone")
    if not options.over:
        problems.append("over: name the grounds between which the robot cannot know, each with its range")
    asked = problems.tried(lambda: gait_problem(as_scene(scene), options, MEAN))
    if asked is not None and (len(asked.objectives) != 1 or not asked.objectives[0].grounded):
        problems.append("objective: a robot adapts to its ground for one objective that depends on it, such as speed")
    if problems or asked is None:
        raise InputError(problems)
    return _Adapter(replace(asked, threads=threads), options, senses, progress or silent).design()


class _Adapter:
    """The search of one request."""

    def __init__(
        self, request: DesignProblem, options: AdaptSettings, sense: tuple[Sense, ...], progress: Progress
    ) -> None:
        self.request, self.options, self.sense, self.progress = request, options, sense, progress
        self.asked = 0
        self.rng = np.random.default_rng([options.seed, 41])
        self.sensed = tuple(one for sense in self.sense for one in _SENSED[sense])
        self.quick, self.sure = request.runs(SEARCHED), request.runs()

    def design(self) -> AdaptiveGait:
        """The whole design."""
        training, hidden = self._grounds(self.options.training, self.options.hidden)
        self.progress(0, 4, "gaits on training grounds")
        library = self._library(training, self.options.gaits)
        costs = self._table(library, training)
        few = _few(costs, self.options.gaits)
        library, costs = library[few], costs[:, few]
        self.progress(1, 4, "what the robot senses")
        probes = max(min(PROBES, self.options.steps // PROBE_STEPS), 1)
        each = self.options.steps // probes
        chosen, posterior = self._choice(library, training, costs, each, probes)
        self.progress(2, 4, "hidden grounds")
        on_hidden = self._table(library, hidden, self.sure)
        sensed = [self._sensed(library[one], hidden, each) for one in chosen]
        taken = posterior(self._noisy(np.concatenate([np.zeros((len(on_hidden), 0)), *sensed], axis=1)))
        judged = on_hidden if self.request.starts is None else self._table(library, hidden, self.sure)
        self.progress(3, 4, "the gait that knows its ground")
        known = self._known(library, judged, taken, hidden)
        self.progress(4, 4, "done")
        return AdaptiveGait(
            self.request,
            self.sense,
            tuple(self.sure.changes(one) for one in self.request.free.values(library)),
            chosen,
            tuple(one.name for one in self.sensed),
            posterior,
            on_hidden,
            known,
            taken,
            judged.argmin(axis=1),
            hidden,
            each,
            self.quick.made + self.sure.made,
        )

    def _choice(
        self, library: Floats, training: Grounds, costs: Floats, steps: int, most: int
    ) -> tuple[tuple[int, ...], GaitChoice]:
        """Probes among the gaits of a library and the table, from two sets of walks on training grounds."""
        shape = (0, len(costs), 0)
        known, again = (
            np.array([self._sensed(one, training, steps) for one in library]) if self.sensed else np.zeros(shape)
            for _ in range(2)
        )
        return gait_choice(known, again, self._noisy(again), costs, most)

    def _grounds(self, some: int, count: int) -> tuple[Grounds, Grounds]:
        """Training and hidden grounds."""
        over = self.request.over
        assert over is not None
        if isinstance(over, Grounds):
            count = min(count, len(over) // 2)
            return Grounds(over.rows(np.s_[:-count])), Grounds(over.rows(np.s_[-count:]))
        training = Grounds.of_points(over.names, spread(over, some, self.options.seed))
        return training, drawn(over, count, self.rng)

    def _library(self, training: Grounds, most: int) -> Floats:
        """Gaits (k, nu) that together lose least on some of the grounds: the best few of an even spread, each then
        moved by steps that get shorter to what is better on the mean of the grounds that it is the best for."""
        some = np.linspace(0, len(training) - 1, min(SPREAD_GROUNDS, len(training))).astype(int)
        grounds = Grounds(training.rows(some))
        candidates, nu = self.options.candidates or MOST, len(self.request.free)
        scan = max(candidates // (2 * len(some)), 8)
        points = even_points(nu, scan, self.rng)
        costs = self._table(points, grounds)
        few = _few(costs, most, worth=0.0)
        library, costs, step = points[few], costs[:, few], STEP
        each = len(some) * (YOUNG + len(few))
        for _ in range(max((candidates - scan * len(some)) // each, 1)):
            nearest = costs.argmin(axis=1)
            own = nearest == np.arange(len(few))[:, None]  # (k, ng)
            given = grounds.rows(np.repeat(np.arange(len(grounds)), YOUNG))

            def means(moved: Floats, nearest: NDArray[np.int64] = nearest, own: NDArray[np.bool_] = own, given=given):
                found = self._judged(moved[nearest].reshape(-1, nu), given).reshape(len(nearest), YOUNG)
                return np.array([found[one].mean(axis=0) if one.any() else np.full(YOUNG, np.inf) for one in own])

            now = np.array([costs[one, k].mean() if one.any() else -np.inf for k, one in enumerate(own)])
            moved, after = shorter_steps(means, library, now, [step], YOUNG, self.rng, self._circular)
            changed = np.flatnonzero(after < now)
            library = moved
            if len(changed):
                costs[:, changed] = self._table(library[changed], grounds)
            step /= SHORTER
        return library

    @property
    def _circular(self) -> NDArray[np.bool_]:
        return self.request.free.circular

    def _moved(self, points: Floats) -> Floats:
        """Points (..., nu) as far from these as repeated walks differ."""
        return inside(points + JITTER * self.rng.standard_normal(points.shape), self._circular)

    def _judged(self, points: Floats, grounds: Mapping[str, Floats], walks: Runs | None = None) -> Floats:
        """Costs (nr,) of gaits at points (nr, nu), each on its own ground: of an episode, or the mean of the motions
        that several starts lead to, other ones each time; by short walks unless others are given."""
        walks, starts, count = walks or self.quick, self.request.starts, self.request.motion.starts
        if starts is None:
            return walks.each(self.request.free.values(points), grounds)[:, 0]
        self.asked += 1
        put = started(Grounds({}), starts, count, self.options.seed + self.asked)
        rows, own = put.crossed(np.column_stack([points, *grounds.values()]))
        nu = points.shape[1]
        own |= {path: np.ascontiguousarray(rows[:, nu + i]) for i, path in enumerate(grounds)}
        found = walks.each(self.request.free.values(rows[:, :nu]), own)[:, 0]
        return found.reshape(len(points), count).mean(axis=1)

    def _table(self, points: Floats, grounds: Grounds, walks: Runs | None = None) -> Floats:
        """Costs (ng, n) of gaits on grounds; of a walk that did not reach its end those of standing still."""
        n, ng = len(points), len(grounds)
        given = grounds.rows(np.repeat(np.arange(ng), n))
        costs = self._judged(np.tile(points, (ng, 1)), given, walks).reshape(ng, n)
        worst = float(np.max(costs, where=np.isfinite(costs), initial=0.0))
        return np.where(np.isfinite(costs), costs, worst)

    def _sensed(self, point: Floats, grounds: Grounds, steps: int) -> Floats:
        """What is sensed (ng, ns) in the first steps of a gait at a point (nu,), from a stand, without noise; where
        gaits are judged by settled motions, two probes of one gait are not quite alike."""
        values = self.request.free.values
        scene = self.quick.scene_of(values(point[None])[0])
        period = max((wave.period or 0.0 for wave in scene.waves.values()), default=0.0)
        points = np.repeat(point[None], len(grounds), axis=0)
        points = points if self.request.starts is None else self._moved(points)
        names = tuple(one.measure for one in self.sensed)
        seen = self.quick.measured(values(points), grounds.values, names, steps * period)
        sensed = np.stack([seen[name] for name in names], axis=1)
        return np.where(np.isfinite(sensed), sensed, 0.0)

    def _noisy(self, senses: Floats) -> Floats:
        return senses * (1.0 + self.options.noise * self.rng.standard_normal(senses.shape))

    def _known(self, library: Floats, costs: Floats, taken: NDArray[np.int64], hidden: Grounds) -> Floats:
        """Costs (nh,) of the best gait for each hidden ground: the best of the few, or what a further search on this
        ground finds. By settled motions what these were found by was partly luck: both, the gait that was taken and the
        best single one are judged anew by long walks, and the best of those once more, each from other starts."""
        few, nu = library[costs.argmin(axis=1)], library.shape[1]
        given = hidden.rows(np.repeat(np.arange(len(hidden)), YOUNG))
        found, values = shorter_steps(
            lambda moved: self._judged(moved.reshape(-1, nu), given).reshape(-1, YOUNG),
            few,
            costs.min(axis=1),
            [STEP / SHORTER**i for i in range(KNOWING)],
            YOUNG,
            self.rng,
            self._circular,
        )
        if self.request.starts is None:
            return values
        single = np.broadcast_to(library[int(costs.mean(axis=0).argmin())], few.shape)
        rivals = np.stack([found, few, library[taken], single], axis=1)  # (nh, 4, nu)
        given = hidden.rows(np.repeat(np.arange(len(hidden)), rivals.shape[1]))
        scores = self._judged(rivals.reshape(-1, nu), given, self.sure).reshape(rivals.shape[:2])
        surest = rivals[np.arange(len(few)), scores.argmin(axis=1)]
        again = self._judged(surest, hidden.values, self.sure)
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
