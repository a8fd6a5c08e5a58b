"""Searching soft landings: the best switching times with 0, 1, ... pairs, on the scene's own ground and on many."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.progress import Progress, silent
from tarsus.design.grounds import Grounds, corners
from tarsus.design.judge import NOMINAL, Judge, Look, Risk, Round
from tarsus.design.landing_request import LandingRequest
from tarsus.design.pulses import Family, families
from tarsus.design.target import Target, touchdown_pieces
from tarsus.design.transfer import GENTLE, STARTS, Transfer, transfers
from tarsus.design.trials import Trials, settled_periods
from tarsus.fit.minimax import descend_pieces
from tarsus.fit.valleys import Budget, Visited, follow_down, search

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SAMPLE = 48
"""Signals that the time to settle is measured on: of so many 95 % are all but two."""
MEAN_GROUNDS = 48
"""Grounds that stand for a box where a risk averages over it: a search runs every candidate on all of them."""
BETWEEN, DENSE = Look(256, 10, 6), Look(2048, 10, 6)
"""Attacks between rounds of cutting planes, and the last, dense one: ten steps uphill end below a thousandth of the
box's sides, and six regions are more than any box of the cantilever has peaks. Whole designs are compared by a quarter
of the dense one."""
COMPARED = Look(DENSE.count // 4, DENSE.steps, DENSE.islands)
ROUNDS = 6
"""Rounds of cutting planes at most; the cantilever needs one or two."""
ATTACKED = 3
"""Designs that are attacked in a round: the best, and two more for what hurts those that come after it."""
NARROW, ABOUT_TRANSFERS = 0.01, 12
"""First step of the strategies about transfers, and how many of them: an eighth of a valley's size, for what stands
behind a foot that is not let go is at rest within a few hundredths of the plateaus only."""
VALLEYS = 24
"""Valleys of the nominal ground that a search on many grounds judges for each that it follows: what is best on many
lies far down the nominal order."""
APART, AGAIN = 0.03, 0.05
"""Points of so different valleys are judged anew on other grounds, and the first step of the strategies about the best
of them: a third and two thirds of a valley's size, for what is best on many grounds lies beside what is best on one."""
FIRST_SHARE, FIRST_VALLEYS, MORE_SHARE, MORE_VALLEYS = 0.8, 32, 0.4, 8
"""Share of a search's length, and valleys that are followed, in the first round of cutting planes and in further ones,
which begin beside what the first one found."""
FIXED_SHARE, FIXED_VALLEYS = 0.5, 24
"""The same of a search on fixed grounds, which has no further rounds."""
POLISHED, POLISHING = 2, 12
"""Valleys whose lowest points are sought by slopes at the end of a search, and how often slopes are asked for there."""


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
    that was asked for.

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

    def budget(self, pairs: int, share: float = 1.0) -> Budget:
        """A search's length: the more unknowns the longer, up to six of them."""
        unknowns = self.request.step.unknowns(pairs)
        effort = self.request.options.effort * share * min(unknowns, 6) / 4.0
        return Budget(
            max(int(4000 * effort), 64), max(int(32 * effort), 2), max(int(48 * min(effort, 1.0)), 6)
        )

    def _shortened(self, count: int) -> int:
        """As many of something as a search of this effort has, two at least; no more where the effort is above 1."""
        return max(int(count * min(self.request.options.effort, 1.0)), 2)

    def scores(self, rows: Floats, grounds: Grounds, risk: Risk | None = None) -> Floats:
        """Scores (n,) of signals (n, 2S) by a risk, the request's unless given."""
        return self.judge.risked(self.judge.costs(rows, grounds), grounds, risk)[:, 0]

    def _cost(self, choices: list[Family], grounds: Grounds, risk: Risk) -> Callable[[Ints, Floats], Floats]:
        return lambda numbers, points: self.scores(
            self.request.step.place(choices, numbers, points), grounds, risk
        )

    def _signals(self, pairs: int, count: int) -> list[LandingSignal]:
        """The best signals that were visited."""
        choices, visited = self.visited[pairs]
        rows = visited.best(count)
        placed = self.request.step.place(choices, visited.numbers[rows], visited.points[rows])
        return [LandingSignal(row, pairs) for row in placed]

    def nominal_designs(self) -> list[LandingSignal]:
        """The best design for the nominal ground with 0, 1, ... pairs; none is worse than that with one pair less."""
        found = [self.plain]
        for pairs in range(1, self.request.pairs + 1):
            self.progress(pairs - 1, 2 * self.request.pairs, f"{pairs} pairs, nominal ground")
            self.visited[pairs] = self._searched(pairs)
            self._polish(pairs, self.nominal, NOMINAL)
            best = self._signals(pairs, 1)[0]
            both = [self.scores(one.rows, self.nominal, NOMINAL)[0] for one in (best, found[-1])]
            found.append(found[-1] if both[0] > both[1] else best)
        return found

    def _searched(self, pairs: int) -> tuple[list[Family], Visited]:
        """The scene's own ground: scanned, valleys followed down, those about transfers more closely."""
        step, budget = self.request.step, self.budget(pairs)
        choices = families(step, pairs)
        cost = self._cost(choices, self.nominal, NOMINAL)
        starts = None
        if pairs - 1 in self.visited:
            before, visited = self.visited[pairs - 1]
            made = [
                step.children(before[visited.numbers[row]], visited.points[row], choices)
                for row in visited.best(3)
            ]
            starts = np.concatenate([n for n, _ in made]), np.concatenate([x for _, x in made])
        visited = search(cost, len(choices), step.unknowns(pairs), budget, self.rng, starts)
        speed = GENTLE * float(self.target.plain.speed[0, 0])
        transfer = Transfer.of(self.request.scene, self.request.drive, self.request.foot, step, speed)
        if transfer is not None:
            begun = Visited.empty(step.unknowns(pairs))
            starts = max(self._shortened(STARTS), 256)
            numbers, points = transfers(transfer, step, choices, self.trials, self.rng, starts)
            if len(numbers):
                begun.add(numbers, points, cost(numbers, points))
                rows = begun.best(max(int(ABOUT_TRANSFERS * self.request.options.effort), 2), near=NARROW)
                follow_down(
                    cost, visited, begun.numbers[rows], begun.points[rows], budget, self.rng, step=NARROW
                )
        return choices, visited

    def _polish(self, pairs: int, grounds: Grounds, risk: Risk) -> None:
        """The lowest points of the best valleys by slopes, which join the visited ones."""
        choices, visited = self.visited[pairs]
        effort, step = self.request.options.effort, self.request.step
        cost = self._cost(choices, grounds, risk)
        rounds = self._shortened(POLISHING)
        for row in visited.best(max(int(POLISHED * effort), 1), near=APART):
            number = visited.numbers[row : row + 1]
            point, least, _ = descend_pieces(
                lambda x, n=number: cost(np.repeat(n, len(x)), x),
                lambda x, n=number: touchdown_pieces(
                    self.trials, step, self.target, choices, (int(n[0]), x), grounds
                ),
                visited.points[row], rounds, risk.tail or 0.0, grounds.weights,
            )  # fmt: skip
            visited.add(number, point[None], np.array([least]))

    def robust_designs(
        self, nominal: list[LandingSignal]
    ) -> tuple[list[LandingSignal], Grounds, tuple[Round, ...]]:
        """The best design for the risk with 0, 1, ... pairs, the grounds it was judged on, and rounds of the last."""
        if not self.judge.robust:
            return nominal, self.nominal, ()
        planes, over = self.judge.by_planes, self.request.over
        grounds = self.nominal.with_more(corners(over)) if planes else self.judge.fixed(MEAN_GROUNDS)  # pyright: ignore[reportArgumentType]
        found, rounds = [self.plain], []
        for pairs in range(1, self.request.pairs + 1):
            done = self.request.pairs + pairs - 1
            self.progress(done, 2 * self.request.pairs, f"{pairs} pairs, {len(grounds)} grounds")
            judged = [found[-1], nominal[pairs]]
            if planes:
                grounds, rounds, best = self._planes(pairs, grounds)
                judged.append(best)
                scores = [self.judge.attack(one.rows, COMPARED).costs[0, 0] for one in judged]
            else:
                self._again(pairs, grounds, self.budget(pairs, FIXED_SHARE), FIXED_VALLEYS)
                judged += self._signals(pairs, 1)
                scores = [self.scores(one.rows, grounds)[0] for one in judged]
            found.append(judged[int(np.argmin(scores))])
        return found, grounds, tuple(rounds)

    def _again(self, pairs: int, grounds: Grounds, budget: Budget, count: int) -> None:
        """The best of what was visited, judged on other grounds and followed down there."""
        choices, visited = self.visited[pairs]
        cost, count = self._cost(choices, grounds, self.request.risk), self._shortened(count)
        rows = visited.best(max(VALLEYS * count, 64), near=APART)
        again = Visited.empty(visited.points.shape[1])
        numbers, points = visited.numbers[rows], visited.points[rows]
        again.add(numbers, points, cost(numbers, points))
        first = again.best(count)
        follow_down(cost, again, again.numbers[first], again.points[first], budget, self.rng, step=AGAIN)
        self.visited[pairs] = choices, again
        self._polish(pairs, grounds, self.request.risk)

    def _planes(self, pairs: int, grounds: Grounds) -> tuple[Grounds, list[Round], LandingSignal]:
        """Cutting planes: the grounds, the rounds, and the design that was hurt least in all of them."""
        shares = iter([(FIRST_SHARE, FIRST_VALLEYS)])

        def improve(active: Grounds) -> Floats:
            share, count = next(shares, (MORE_SHARE, MORE_VALLEYS))
            self._again(pairs, active, self.budget(pairs, share), count)
            return np.stack([one.row for one in self._signals(pairs, ATTACKED)])

        grounds, rounds, row = self.judge.close_gap(improve, None, grounds, BETWEEN, ROUNDS, f"{pairs} pairs")
        return grounds, rounds, LandingSignal(row, pairs)
