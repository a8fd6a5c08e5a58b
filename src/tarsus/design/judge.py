"""Candidates on grounds, judged by a risk: what every robust design does, whatever its candidates are.

Worst grounds of a box come from cutting planes: candidates are searched on a few grounds, the box is searched for the
worst ground of the best of them, that ground is added, and so on until none is found that is more than 2 % worse.
After the outer approximations of semi-infinite programming (Blankenship and Falk, J. Optim. Theory Appl. 19, 1976).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.design.grounds import Grounds, Over, corners, drawn, spread
from tarsus.fit.unknowns import Unknowns
from tarsus.fit.valleys import apart, shorter_steps

Floats = NDArray[np.float64]
Each = Callable[[Floats, Mapping[str, Floats]], Floats]
"""Costs (nr, no) of candidates (nr, nx), each on its own ground, values (nr,) by path."""

CLOSED = 0.02
"""The gap is closed where no ground is found that is worse than the active ones by more than this share."""
FLOOR = 0.1
"""A gap is a share of the candidate's own cost, but of no less than a tenth of the largest one's: that a gait which
hardly moves moves even less on some ground is no news."""
MORE = 3
"""Grounds added in a round at most: every one of them costs a run of each later candidate."""
NEAR = 0.05
"""Grounds nearer to each other than a twentieth of every side of the box are not both added: they say the same."""
FIRST_STEP, SHRINK = 0.1, 0.6
"""Steps uphill: at first a tenth of the box's sides, then by this factor shorter; after eight times below 0.2 %."""
YOUNG = 6
"""Grounds tried about the worst one in every step uphill."""


@dataclass(frozen=True)
class Risk:
    """The mean of the worst share ``tail`` of all grounds (conditional value at risk).

    name: in words; tail: 1 is the mean of all grounds, 0 the worst ground alone, however unlikely, and None the nominal
    ground alone.
    """

    name: str
    tail: float | None

    def __call__(self, costs: Floats, weights: Floats) -> Floats:
        """One number (n,) a candidate, of costs (n, ng) on grounds of weights (ng,) of sum 1; the first ground is the
        nominal one."""
        if self.tail is None:
            return costs[:, 0]
        if self.tail == 0.0:
            return costs.max(axis=1)
        if self.tail == 1.0:
            return costs @ weights
        order = np.argsort(-costs, axis=1)
        own = weights[order]
        taken = np.clip(self.tail - (np.cumsum(own, axis=1) - own), 0.0, own)
        ordered = np.where(taken > 0.0, np.take_along_axis(costs, order, axis=1), 0.0)  # 0 times infinity is 0
        return (taken * ordered).sum(axis=1) / self.tail


NOMINAL, WORST, MEAN = Risk("nominal", None), Risk("worst", 0.0), Risk("mean", 1.0)


def cvar(level: float) -> Risk:
    """The mean of the worst share 1 - level of all grounds, 0 <= level < 1. Raises InputError for another level."""
    if not 0.0 <= level < 1.0:
        raise InputError(f"risk: cvar expected 0 <= q < 1, got {level:g}")
    return Risk(f"cvar {level:g}", 1.0 - level)


def risk_of(given: Any) -> Risk:
    """A `Risk`, or that of a word: worst, mean or nominal; or of ``{"cvar": q}``, as a file has it. Raises InputError
    for any other."""
    if isinstance(given, Risk):
        return given
    for one in (NOMINAL, WORST, MEAN):
        if given == one.name:
            return one
    if isinstance(given, Mapping) and list(given) == ["cvar"] and isinstance(given["cvar"], (int, float)):
        return cvar(float(given["cvar"]))
    if isinstance(given, str) and given.startswith("cvar:"):
        raise InputError(f"risk: '{given}' is {{cvar = {given.removeprefix('cvar:')}}}, in Python `tarsus.design.cvar`")
    raise InputError(f"risk: expected worst, mean, nominal, or {{cvar = q}} with 0 <= q < 1, got '{given}'")


@dataclass(frozen=True)
class AttackEffort:
    """How far an attack looks. count: grounds that all candidates are put on; steps uphill from the worst of each of so
    many regions (islands)."""

    count: int
    steps: int
    islands: int = 1


@dataclass(frozen=True)
class Attack:
    """What was found of k candidates: costs (k, no), the worst of each objective, and the grounds (k, no, np) they are
    on; tried: how many grounds each candidate was put on; first (k, ng, no): costs on the grounds before the climb."""

    costs: Floats
    grounds: Floats
    tried: int
    first: Floats


@dataclass(frozen=True)
class Round:
    """One round of cutting planes. what: is searched; grounds: that were active; gap: the largest share by which an
    attack found a candidate worse that is wanted; score, worst: cost of the best one in the first objective, on these
    grounds and on the worst that was found."""

    what: str
    grounds: int
    gap: float
    score: float = np.nan
    worst: float = np.nan


@dataclass(frozen=True)
class Certificate:
    """A look at a box after everything else: grounds drawn by chance that a candidate was put on, and those of them
    that were worse than its known worst by more than is allowed (of the candidate that had most)."""

    grounds: int
    worse: int

    @property
    def share(self) -> float:
        """Upper end of the 95 % interval of the box's share that is so much worse (Clopper and Pearson 1934): about
        3 / grounds where none was."""
        from scipy.special import betaincinv

        return float(betaincinv(self.worse + 1, self.grounds - self.worse, 0.95)) if self.worse < self.grounds else 1.0


@dataclass
class Judge:
    """What candidates of one request are judged by.

    each: see `Each`; own: the scene's own ground, once for every start that its walks have; grounds of candidates begin
    with it; over, risk, seed: of the request; grounded: numbers of the objectives
    that depend on the ground at all; one: whether one candidate is wanted, not a front: its gap alone has to be closed;
    limited: whether the last column of costs is that of limits, which every run has to keep, whatever the risk.
    """

    each: Each
    own: Grounds
    over: Over | None
    risk: Risk
    seed: int
    grounded: tuple[int, ...] = (0,)
    one: bool = False
    limited: bool = False
    looks: int = 0

    @property
    def robust(self) -> bool:
        """Whether other grounds than the scene's own are to be borne."""
        return self.over is not None and self.risk.tail is not None

    @property
    def by_planes(self) -> bool:
        """Whether the worst grounds are sought: for the worst of a box."""
        return isinstance(self.over, Unknowns) and self.risk.tail == 0.0

    def costs(self, rows: Floats, grounds: Grounds) -> Floats:
        """Costs (n, ng, no) of candidates (n, nx) on all grounds."""
        return self.each(*grounds.crossed(rows)).reshape(len(rows), len(grounds), -1)

    def risked(self, costs: Floats, grounds: Grounds, risk: Risk | None = None) -> Floats:
        """Costs (n, no) under the request's risk or another one, each objective for itself, of costs (n, ng, no); what
        has no value is the worst."""
        if (risk or self.risk).tail is None:
            return self.nominal(costs)
        each = np.moveaxis(costs, 2, 0)
        out = np.stack([(risk or self.risk)(one, grounds.weights) for one in each], axis=1)
        if self.limited:
            out[:, -1] = costs[:, :, -1].max(axis=1)
        return finite(out)

    def nominal(self, costs: Floats) -> Floats:
        """Of costs (n, ng, no) those (n, no) on the scene's own ground, the mean of its starts: of the motions that
        they lead to, by their share."""
        return finite(costs[:, : len(self.own)].mean(axis=1))

    def fixed(self, count: int) -> Grounds:
        """Grounds that a risk is taken over: so many spread over the box; all members for their worst, and of many
        members so many by chance where it averages."""
        if isinstance(self.over, Grounds):
            over = self.over
            if self.risk.tail != 0.0 and len(over) > count:
                over = drawn(over, count, np.random.default_rng([self.seed, 41]))
            return Grounds(
                {path: np.append(self.own.values[path], own) for path, own in over.values.items()},
                np.append(np.zeros(len(self.own)), over.weights),
            )
        assert self.over is not None
        every = self.own.with_more(spread(self.over, count, self.seed))
        own = np.full(len(self.own), 1.0 / len(self.own))  # the scene's own ground counts once
        return Grounds(every.values, np.append(own, np.ones(count)))

    def attack(self, rows: Floats, look: AttackEffort, *, by_chance: bool = False) -> Attack:
        """Search the box for the worst grounds of candidates (k, nx): on the corners and an even spread, or on grounds
        drawn by chance alone, the same for all; then uphill for each objective that depends on the ground."""
        box, self.looks = self.over, self.looks + 1
        assert isinstance(box, Unknowns)
        rng = np.random.default_rng([self.seed, 31, self.looks])
        if by_chance:
            cube = rng.random((look.count, len(box)))
        else:
            cube = box.cube(np.concatenate([corners(box), spread(box, look.count, int(rng.integers(2**31)))]))
        k = len(rows)
        first = self._on(rows, np.broadcast_to(cube, (k, *cube.shape)))
        seen, where = [first], [np.broadcast_to(cube, (k, *cube.shape))]
        climbed = np.array([(i, j) for i in range(k) for j in self.grounded for _ in range(look.islands)])
        if look.steps and len(climbed):
            order = np.argsort(-np.nan_to_num(first, nan=-np.inf), axis=1, kind="stable")
            regions = [apart(cube, order[i, :, j], FIRST_STEP, look.islands) for i in range(k) for j in self.grounded]
            starts = np.concatenate([np.resize(one, look.islands) for one in regions])
            who, what = climbed.T

            def cost(points: Floats) -> Floats:
                own = points.reshape(k, -1, len(box))
                found = self._on(rows, own)
                seen.append(found)
                where.append(own)
                each = found.reshape(*points.shape[:2], -1)
                return -finite(each[np.arange(len(each)), :, what])

            steps = FIRST_STEP * SHRINK ** np.arange(look.steps)
            shorter_steps(cost, cube[starts], -finite(first[who, starts, what]), steps.tolist(), YOUNG, rng)
        every, grounds = np.concatenate(seen, axis=1), np.concatenate(where, axis=1)
        worst = finite(every).argmax(axis=1)  # (k, no)
        at = box.values(np.take_along_axis(grounds, worst[:, :, None], axis=1))
        return Attack(np.take_along_axis(every, worst[:, None], axis=1)[:, 0], at, every.shape[1], first)

    def _on(self, rows: Floats, cube: Floats) -> Floats:
        """Costs (k, m, no) of candidates (k, nx), each on grounds of its own (k, m, np) of the box."""
        assert isinstance(self.over, Unknowns)
        k, m, nb = cube.shape
        grounds = Grounds.of_points(self.over.names, self.over.values(cube.reshape(-1, nb)))
        return self.each(np.repeat(rows, m, axis=0), grounds.values).reshape(k, m, -1)

    def worst_grounds(self, grounds: Floats, gaps: Floats) -> Floats:
        """Of the grounds (k, no, np) of an attack those (n, np) with the largest gaps (k, no), at most `MORE`, no two
        of them near each other."""
        assert isinstance(self.over, Unknowns)
        flat, size = grounds.reshape(-1, len(self.over)), gaps.ravel()
        order = np.argsort(-size, kind="stable")[: max(int((size > CLOSED).sum()), 1)]
        return flat[apart(self.over.cube(flat), order, NEAR, MORE)]

    def close_gap(
        self,
        improve: Callable[[Grounds], Floats],
        rows: Floats | None,
        grounds: Grounds,
        look: AttackEffort,
        rounds: int,
        what: str,
    ) -> tuple[Grounds, list[Round], Floats]:
        """Cutting planes until the gap is closed, or for so many rounds.

        Parameters
        ----------
        improve
            From active grounds to the candidates (k, nx) that are best on them, the best first.
        rows
            Candidates whose worst grounds are to be active from the beginning, if any.

        Returns
        -------
        tuple
            The active grounds, the rounds, and the candidate (nx,) of `improve` with the best worst first objective.
        """
        history: list[Round] = []
        best, least = np.zeros(0), np.inf
        number = 0
        while True:
            if rows is not None:
                found = self.attack(rows, look)
                known = self.costs(rows, grounds).max(axis=1)
                gaps = excess(known, found.costs)
                gap = float(gaps[: 1 if self.one else None].max())
                history.append(Round(what, len(grounds), gap, float(known[0, 0]), float(found.costs[0, 0])))
                leader = int(np.argmin(found.costs[:, 0]))
                if number and (found.costs[leader, 0] < least or not len(best)):
                    best, least = rows[leader], found.costs[leader, 0]
                if number and (gap <= CLOSED or number == rounds):
                    return grounds, history, best
                if gap > CLOSED:
                    grounds = grounds.with_more(self.worst_grounds(found.grounds, gaps))
            rows, number = improve(grounds), number + 1


def excess(known: Floats, found: Floats) -> Floats:
    """Shares by which costs that were found are worse than those known of candidates, in the first axis of both."""
    known = finite(known)
    size = np.where(np.isfinite(known), np.abs(known), 0.0)
    scale = np.maximum(size, FLOOR * size.max(axis=0))
    with np.errstate(invalid="ignore"):  # a candidate that fails on both is no worse on the one
        worse = np.fmax(found - known, 0.0)
    return np.where(scale > 0.0, worse / np.where(scale > 0.0, scale, 1.0), 0.0)


def finite(costs: Floats) -> Floats:
    """Costs in which what has no value is the worst."""
    return np.where(np.isnan(costs), np.inf, costs)
