"""Searching soft landings: the best switching times with 0, 1, ... pairs, on the scene's own ground and on many."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tarsus.design.over import Box, Ensemble, Grounds
from tarsus.design.polish import polish
from tarsus.design.pulses import Family, families
from tarsus.design.request import Request
from tarsus.design.risk import Nominal, Risk, Worst
from tarsus.design.search import Archive, Budget, descend, search
from tarsus.design.target import Target
from tarsus.design.touchdown_slopes import touchdown_pieces
from tarsus.design.transfer import GENTLE, STARTS, Transfer, transfers
from tarsus.design.trials import Trials
from tarsus.design.worst_ground import Attack, Round, attack, close_gap

__all__ = ["DENSE", "Candidate", "Searcher", "replace_points"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Progress = Callable[[int, int, str], None]

MEAN_GROUNDS = 48
"""Grounds that stand for a box where a risk averages over it: a search runs every candidate on all of them."""
DENSE = 2048
"""Grounds of the last, dense look at a box, before the climb from its worst regions."""
ROUNDS = 6
"""Rounds of cutting planes at most; the cantilever needs one or two."""
NARROW, ABOUT_TRANSFERS = 0.01, 12
"""First step of the strategies about transfers, and how many of them: an eighth of a valley's size, for what stands
behind a foot that is not let go is at rest within a few hundredths of the plateaus only."""
VALLEYS = 24
"""Valleys of the nominal ground that a search on many grounds judges for each that it follows: what is best on many
lies far down the nominal order."""
POLISHED, POLISHING = 2, 12
"""Valleys whose lowest points are sought by slopes at the end of a search, and how often slopes are asked for there."""


@dataclass(frozen=True)
class Candidate:
    """A signal by its plateaus: levels [V] and durations [s] (S,), with its pairs; where it came from, the family's
    number and the point (nu,) of the unit cube, is empty for the plain step."""

    levels: Floats
    durations: Floats
    pairs: int
    number: int = 0
    point: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def rows(self) -> tuple[Floats, Floats]:
        return self.levels[None], self.durations[None]


class Searcher:
    """The searches of one request. archives: by pairs, the families and every point that was asked for."""

    def __init__(
        self, request: Request, trials: Trials, target: Target, plain: Candidate, progress: Progress
    ) -> None:
        self.request, self.trials, self.target = request, trials, target
        self.plain, self.progress = plain, progress
        self.rng = np.random.default_rng([request.options.seed, 5])
        self.nominal = Grounds.nominal(request.scene, () if request.over is None else request.over.paths)
        self.archives: dict[int, tuple[list[Family], Archive]] = {}

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

    def score(self, one: Candidate, grounds: Grounds, risk: Risk) -> float:
        return float(risk(self.target.scores(self.trials(*one.rows, grounds)), grounds.weights)[0])

    def nominal_designs(self) -> list[Candidate]:
        """The best design for the nominal ground with 0, 1, ... pairs; none is worse than that with one pair less."""
        found = [self.plain]
        for pairs in range(1, self.request.pairs + 1):
            self.progress(pairs - 1, 2 * self.request.pairs, f"{pairs} pairs, nominal ground")
            self.archives[pairs] = self._searched(pairs)
            self._polish(pairs, self.nominal, Nominal())
            best = self._best(pairs)
            worse = self.score(best, self.nominal, Nominal()) > self.score(found[-1], self.nominal, Nominal())
            found.append(found[-1] if worse else best)
        return found

    def _searched(self, pairs: int) -> tuple[list[Family], Archive]:
        """The scene's own ground: scanned, valleys followed down, those about transfers more closely."""
        step, budget = self.request.step, self.budget(pairs)
        choices = families(step, pairs)
        cost = self._cost(choices, self.nominal, Nominal())
        starts = None
        if pairs - 1 in self.archives:
            before, archive = self.archives[pairs - 1]
            made = [
                step.children(before[archive.numbers[row]], archive.points[row], choices)
                for row in archive.best(3)
            ]
            starts = np.concatenate([n for n, _ in made]), np.concatenate([x for _, x in made])
        archive = search(cost, len(choices), step.unknowns(pairs), budget, self.rng, starts)
        speed = GENTLE * float(self.target.plain.speed[0, 0])
        transfer = Transfer.of(self.request.scene, self.request.drive, self.request.foot, step, speed)
        if transfer is not None:
            begun = Archive.empty(step.unknowns(pairs))
            starts = max(self._shortened(STARTS), 256)
            numbers, points = transfers(transfer, step, choices, self.trials, self.rng, starts)
            if len(numbers):
                begun.add(numbers, points, cost(numbers, points))
                rows = begun.best(max(int(ABOUT_TRANSFERS * self.request.options.effort), 2), near=NARROW)
                descend(cost, archive, begun.numbers[rows], begun.points[rows], budget, self.rng, step=NARROW)
        return choices, archive

    def _polish(self, pairs: int, grounds: Grounds, risk: Risk) -> None:
        """The lowest points of the best valleys by slopes, which join the archive."""
        choices, archive = self.archives[pairs]
        effort, step = self.request.options.effort, self.request.step
        cost = self._cost(choices, grounds, risk)
        rounds = self._shortened(POLISHING)
        for row in archive.best(max(int(POLISHED * effort), 1), near=0.03):
            number = archive.numbers[row : row + 1]
            point, least, _ = polish(
                lambda x, n=number: cost(np.repeat(n, len(x)), x),
                lambda x, n=number: touchdown_pieces(
                    self.trials, step, self.target, choices, (int(n[0]), x), grounds
                ),
                archive.points[row], rounds, risk.tail, grounds.weights,
            )  # fmt: skip
            archive.add(number, point[None], np.array([least]))

    def _cost(self, choices: list[Family], grounds: Grounds, risk: Risk) -> Callable[..., Floats]:
        def cost(numbers: NDArray[np.int64], points: Floats) -> Floats:
            placed = self.request.step.place(choices, numbers, points)
            return risk(self.target.scores(self.trials(*placed, grounds)), grounds.weights)

        return cost

    def _candidate(self, pairs: int, choices: list[Family], archive: Archive, row: int) -> Candidate:
        levels, durations = self.request.step.place(
            choices, archive.numbers[row : row + 1], archive.points[row : row + 1]
        )
        return Candidate(levels[0], durations[0], pairs, int(archive.numbers[row]), archive.points[row])

    def _best(self, pairs: int) -> Candidate:
        choices, archive = self.archives[pairs]
        return self._candidate(pairs, choices, archive, int(np.argmin(archive.costs)))

    def robust_designs(self, nominal: list[Candidate]) -> tuple[list[Candidate], Grounds, tuple[Round, ...]]:
        """The best design for the risk with 0, 1, ... pairs, the grounds it was judged on, and rounds of the last."""
        over, risk = self.request.over, self.request.risk
        if over is None or isinstance(risk, Nominal):
            return nominal, self.nominal, ()
        if isinstance(over, Ensemble):
            grounds = over.grounds(self.request.scene)
        elif isinstance(risk, Worst):
            grounds = self.nominal.with_more(over.first())
        else:
            grounds = self.nominal.with_more(over.spread(MEAN_GROUNDS, self.request.options.seed))
        found, rounds = [self.plain], ()
        for pairs in range(1, self.request.pairs + 1):
            self.progress(
                self.request.pairs + pairs - 1,
                2 * self.request.pairs,
                f"{pairs} pairs, {len(grounds)} grounds",
            )
            if isinstance(over, Box) and isinstance(risk, Worst):
                best, grounds, rounds = self._cutting_planes(pairs, over, grounds)
            else:
                best = self._on_fixed_grounds(pairs, grounds)
            judged = [one for one in (best, found[-1], nominal[pairs])]
            scores = [self._judge(one, grounds) for one in judged]
            found.append(judged[int(np.argmin(scores))])
        return found, grounds, rounds

    def _judge(self, one: Candidate, grounds: Grounds) -> float:
        """Score by the risk, of a box's worst by a dense look."""
        over = self.request.over
        if isinstance(over, Box) and isinstance(self.request.risk, Worst):
            return self.strike(one, DENSE // 4).score
        return self.score(one, grounds, self.request.risk)

    def _on_fixed_grounds(self, pairs: int, grounds: Grounds) -> Candidate:
        choices, archive = self.archives[pairs]
        cost = self._cost(choices, grounds, self.request.risk)
        count = self._shortened(24)
        self.archives[pairs] = choices, self._descended(archive, cost, self.budget(pairs, 0.5), count)
        self._polish(pairs, grounds, self.request.risk)
        return self._best(pairs)

    def _descended(
        self, archive: Archive, cost: Callable[..., Floats], budget: Budget, count: int
    ) -> Archive:
        """The best of an archive judged by another cost, and followed down by it."""
        rows = archive.best(max(VALLEYS * count, 64), near=0.03)
        again = Archive.empty(archive.points.shape[1])
        again.add(
            archive.numbers[rows], archive.points[rows], cost(archive.numbers[rows], archive.points[rows])
        )
        first = again.best(count)
        descend(cost, again, again.numbers[first], again.points[first], budget, self.rng, step=0.05)
        return again

    def _cutting_planes(
        self, pairs: int, box: Box, grounds: Grounds
    ) -> tuple[Candidate, Grounds, tuple[Round, ...]]:
        state = {"round": 0, "grounds": grounds}

        def improve(points: Floats) -> tuple[Floats, list[Candidate]]:
            active = replace_points(state["grounds"], points)
            first, state["grounds"] = state["round"] == 0, active
            state["round"] += 1
            choices, archive = self.archives[pairs]
            cost = self._cost(choices, active, Worst())
            count = self._shortened(32 if first else 8)
            again = self._descended(archive, cost, self.budget(pairs, 0.8 if first else 0.4), count)
            self.archives[pairs] = choices, again
            self._polish(pairs, active, Worst())
            rows = again.best(3)
            return again.costs[rows], [self._candidate(pairs, choices, again, int(row)) for row in rows]

        best, _, rounds = close_gap(improve, lambda one: self.strike(one, 256), grounds.points(), ROUNDS)
        return best, state["grounds"], tuple(rounds)

    def strike(self, one: Candidate, count: int) -> Attack:
        """An attack on a design from so many grounds of the box."""
        box = self.request.over
        assert isinstance(box, Box)

        def hurt(points: Floats) -> Floats:
            grounds = replace_points(self.nominal, points)
            return self.target.scores(self.trials(*one.rows, grounds))[0]

        return attack(box, hurt, count, np.random.default_rng([self.request.options.seed, 11]))


def replace_points(grounds: Grounds, points: Floats) -> Grounds:
    """Grounds of the same paths with other values (ng, np), of equal weight."""
    values = {path: points[:, i] for i, path in enumerate(grounds.values)}
    return Grounds(values, np.full(len(points), 1.0 / len(points)))


