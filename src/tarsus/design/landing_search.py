"""Searching soft landings: the best switching times on the scene's own ground, and on those grounds that hurt most."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.progress import Progress, silent
from tarsus.design.grounds import Grounds, corners
from tarsus.design.judge import NOMINAL, Judge, Look, Risk, Round
from tarsus.design.landing_request import LandingRequest
from tarsus.design.pulses import Family, families
from tarsus.design.target import Target
from tarsus.design.trials import Trials, settled_periods
from tarsus.fit.front import FrontSearch, search_front
from tarsus.fit.unknowns import Unknowns
from tarsus.fit.valleys import Budget, Visited, follow_down, search

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SAMPLE = 48
"""Signals that the time to settle is measured on: of so many 95 % are all but two."""
MEAN_GROUNDS = 48
"""Grounds that stand for a box where a risk averages over it."""
FEW = 4
"""Grounds beside the scene's own that a search begins with: what is best on many is found by what is good on these,
at a tenth of the runs. Of a box with two sides they are its corners."""
ON_ONE, ON_FEW = FrontSearch(3200, 96, 100), Budget(3000, 32, 144)
"""Searches on the scene's own ground, and on a few. There one population finds a landing of 1 mm/s in a quarter of the
runs that strategies side by side need; on a few it settles in the first valley, at three times their speed."""
TWICE = 2
"""Populations on the scene's own ground where nothing else is asked for: one of three ends in a valley of 0.03 m/s."""
OWN_VALLEYS, AFTER = 8, Budget(generations=96)
"""Valleys of each family that are followed down afterwards: a population gives up those that are soft in few places."""
AGAIN, AFTER_FEW = Budget(256, 8, 36), Budget(384, 16, 96)
"""The search on more grounds: of the last one's valleys the best so many are judged on all, the best of those followed
down. The first one after a search on few is as long as that of valleys that are new: most that were good on the few are
not on those that hurt, and what is best there needs all its unknowns at once."""
SETTLED = 72
"""Generations at least, however little the effort: fewer end before a valley's floor, which a small population reaches
as soon as a large one."""
NEAR, STEP = 0.03, 0.05
"""Points of so different valleys are judged anew, and the first step from them: a third and two thirds of a valley's
size, for what is best on more grounds lies beside what was best on fewer."""
BETWEEN, DENSE = Look(96, 5, 2), Look(384, 10, 3)
"""Attacks between rounds of cutting planes, and the last, dense one: ten steps uphill end below a thousandth of the
box's sides."""
COMPARED = Look(DENSE.count // 4, BETWEEN.steps, BETWEEN.islands)
"""The attack on the nominal design, which is compared by its worst."""
ROUNDS = 4
"""Rounds of cutting planes at most."""
ATTACKED = 3
"""Designs that are attacked in a round: the best, and two more for what hurts those that come after it."""


@dataclass(frozen=True)
class LandingSignal:
    """A candidate: a signal (2S,) as `Trials` take it, with its pairs of switchings."""

    row: Floats
    pairs: int

    @property
    def rows(self) -> Floats:
        return self.row[None]


class LandingSearch:
    """The searches of one request, and what candidates are judged by. visited: by pairs, the families and every point
    that the last search asked for.

    Raises InputError where the foot does not land with the plain step.
    """

    def __init__(self, request: LandingRequest, progress: Progress | None = None) -> None:
        self.request, self.progress = request, progress or silent
        options, step = request.options, request.step
        self.rng = np.random.default_rng([options.seed, 5])
        self.visited: dict[int, tuple[list[Family], Visited]] = {}
        self.trials = Trials(request.scene, request.drive, request.foot, step.period, threads=request.threads)
        self.nominal = Grounds.nominal(request.scene, () if request.over is None else request.over.names)
        self.plain = LandingSignal(step.plain()[0], 0)
        self.trials.periods = self._settled()
        before = self.trials.on(self.plain.rows, self.nominal)
        if not before.touchdowns[0, 0] > 0.0:
            where = "stays on the ground" if before.contact[0, 0] > 0.0 else "stays in the air"
            raise InputError(
                f"foot '{request.foot}' never lands: with the plain step between {step.lift:g} V and "
                f"{step.support:g} V it {where}"
            )
        self.target = Target(options.objective, before, options.contact, options.lift, options.ringing)
        self.judge = Judge(self._each, self.nominal, request.over, request.risk, options.seed, one=True)

    def _settled(self) -> int:
        choices = families(self.request.step, 1)
        rng = np.random.default_rng([self.request.options.seed, 7])
        numbers = rng.integers(0, len(choices), SAMPLE)
        points = rng.random((SAMPLE, self.request.step.unknowns(1)))
        return settled_periods(self.trials, self.request.step.place(choices, numbers, points), self.nominal)

    def _each(self, rows: Floats, grounds: Mapping[str, Floats]) -> Floats:
        return self.target.scores(self.trials.each(rows, grounds))[:, None]

    def _budget(self, whole: Budget) -> Budget:
        """A search's length by the effort of the request."""
        effort = self.request.options.effort
        return replace(
            whole,
            scan=max(int(whole.scan * effort), 64),
            islands=max(int(whole.islands * effort), 2),
            generations=max(int(whole.generations * min(effort, 1.0)), min(SETTLED, whole.generations)),
        )

    def scores(self, rows: Floats, grounds: Grounds, risk: Risk | None = None) -> Floats:
        """Scores (n,) of signals (n, 2S) by a risk, the request's unless given."""
        return self.judge.risked(self.judge.costs(rows, grounds), grounds, risk)[:, 0]

    def _cost(self, choices: list[Family], grounds: Grounds, risk: Risk) -> Callable[[Ints, Floats], Floats]:
        return lambda numbers, points: self.scores(self.request.step.place(choices, numbers, points), grounds, risk)

    def _signals(self, pairs: int, count: int) -> list[LandingSignal]:
        """The best signals that were visited."""
        choices, visited = self.visited[pairs]
        rows = visited.best(count)
        placed = self.request.step.place(choices, visited.numbers[rows], visited.points[rows])
        return [LandingSignal(row, pairs) for row in placed]

    def _told(self, pairs: int, grounds: Grounds) -> None:
        self.progress(len(self.visited), 2 * self.request.pairs, f"{pairs} pairs, {len(grounds)} grounds")

    def _on_one(self, pairs: int) -> LandingSignal:
        """The best signal with so many pairs on the scene's own ground; the family is one more unknown."""
        self._told(pairs, self.nominal)
        choices, effort = families(self.request.step, pairs), self.request.options.effort
        cost = self._cost(choices, self.nominal, NOMINAL)

        def family(points: Floats) -> Ints:
            return np.minimum((points[:, 0] * len(choices)).astype(np.int64), len(choices) - 1)

        nu = 1 + self.request.step.unknowns(pairs)
        length = FrontSearch(
            max(int(ON_ONE.scan * effort), 64),
            int(np.clip(ON_ONE.population * effort, 48, ON_ONE.population)),
            max(int(ON_ONE.generations * effort), SETTLED),
        )
        visited = Visited.empty(nu - 1)
        for _ in range(1 if self.judge.robust else TWICE):
            points, costs = search_front(
                lambda cube: cost(family(cube), cube[:, 1:])[:, None],
                nu,
                np.zeros(nu, dtype=bool),
                length,
                int(self.rng.integers(2**31)),
            )
            visited.add(family(points), points[:, 1:], costs[:, 0])
        rows = np.concatenate(
            [
                own[Visited(visited.numbers[own], visited.points[own], visited.costs[own]).best(OWN_VALLEYS)]
                for own in (np.flatnonzero(visited.numbers == number) for number in range(len(choices)))
            ]
        )
        numbers, starts = visited.numbers[rows], visited.points[rows]
        follow_down(cost, visited, numbers, starts, self._budget(AFTER), self.rng)
        self.visited[pairs] = choices, visited
        return self._signals(pairs, 1)[0]

    def _on_few(self, pairs: int, grounds: Grounds) -> None:
        """Search valleys of the request's risk on a few grounds."""
        self._told(pairs, grounds)
        choices = families(self.request.step, pairs)
        cost = self._cost(choices, grounds, self.request.risk)
        unknowns = self.request.step.unknowns(pairs)
        self.visited[pairs] = choices, search(cost, len(choices), unknowns, self._budget(ON_FEW), self.rng)

    def nominal_designs(self) -> list[LandingSignal]:
        """The best design for the nominal ground with 0, 1, ... pairs; none is worse than that with one pair less."""
        found = [self.plain]
        for pairs in range(1, self.request.pairs + 1):
            found.append(self.best([found[-1], self._on_one(pairs)], self.nominal, NOMINAL))
        return found

    def best(self, rivals: list[LandingSignal], grounds: Grounds, risk: Risk | None = None) -> LandingSignal:
        """That of least score; of equal ones the first."""
        return min(rivals, key=lambda one: float(self.scores(one.rows, grounds, risk)[0]))

    def robust_design(self, nominal: list[LandingSignal]) -> tuple[LandingSignal, Grounds, tuple[Round, ...]]:
        """The best design for the risk, the grounds it was judged on, and the rounds that made them."""
        pairs, judge, over = self.request.pairs, self.judge, self.request.over
        if not judge.robust or not pairs:
            return nominal[-1], self.nominal, ()
        if not judge.by_planes:
            grounds = judge.fixed(MEAN_GROUNDS)
            self._on_few(pairs, _few(grounds))
            self._again(pairs, grounds, AGAIN)
            return self.best([*nominal, *self._signals(pairs, 1)], grounds), grounds, ()
        assert isinstance(over, Unknowns)
        lengths = iter((None, AFTER_FEW))

        def improve(active: Grounds) -> Floats:
            length = next(lengths, AGAIN)
            if length is None:
                self._on_few(pairs, active)
            else:
                self._again(pairs, active, length)
            return np.stack([one.row for one in self._signals(pairs, ATTACKED)])

        first = _few(self.nominal.with_more(corners(over)))
        grounds, rounds, row = judge.close_gap(improve, None, first, BETWEEN, ROUNDS, f"{pairs} pairs")
        return self.best([*nominal, LandingSignal(row, pairs)], grounds), grounds, tuple(rounds)

    def _again(self, pairs: int, grounds: Grounds, length: Budget) -> None:
        """The best of what was visited, judged on other grounds and followed down there."""
        choices, visited = self.visited[pairs]
        cost, budget = self._cost(choices, grounds, self.request.risk), self._budget(length)
        rows = visited.best(budget.scan, near=NEAR)
        again = Visited.empty(visited.points.shape[1])
        numbers, points = visited.numbers[rows], visited.points[rows]
        again.add(numbers, points, cost(numbers, points))
        first = again.best(budget.islands)
        follow_down(cost, again, again.numbers[first], again.points[first], budget, self.rng, step=STEP)
        self.visited[pairs] = choices, again


def _few(grounds: Grounds) -> Grounds:
    """The first of grounds, and `FEW` of the others, as far apart in their order as there are."""
    rows = np.unique(np.linspace(1, len(grounds) - 1, FEW).astype(int)) if len(grounds) > 1 else np.zeros(0, int)
    kept = np.append(0, rows)
    return Grounds(grounds.rows(kept), grounds.weights[kept])
