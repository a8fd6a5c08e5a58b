"""The search of a design: candidates by short runs on few grounds, then one list of them, judged by long ones on their
worst grounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.progress import Progress, silent
from tarsus.design.descent import CLOSE, OWN, WIDE, follow, settled, valleys
from tarsus.design.front import FRONT_FILES, Candidate, Design
from tarsus.design.grounds import Grounds, corners, drawn, started, with_starts
from tarsus.design.judge import (
    CLOSED,
    NOMINAL,
    WORST,
    AttackEffort,
    Certificate,
    Each,
    Judge,
    Risk,
    Round,
    excess,
    finite,
)
from tarsus.design.motion import MOTIONS, motions_of
from tarsus.design.percents import percents_of
from tarsus.design.problem import SEARCHED, DesignProblem, DesignSettings, LastPeriod
from tarsus.design.runs import Runs
from tarsus.files.runstore import UNIT_FILES, RunStore
from tarsus.fit.front import FrontSearch, farthest, search_front, undominated
from tarsus.fit.unknowns import Unknowns
from tarsus.fit.valleys import shorter_steps
from tarsus.measure.shares import tolerance_interval

Floats = NDArray[np.float64]

MEMBERS = 12
"""Candidates of a front that are attacked: spread along it, its ends among them."""
LOOKED = 4
"""Candidates that are attacked at least, the next best ones where the front has fewer: which of them is the most robust
is found there."""
ROUNDS = 5
"""Rounds of cutting planes at most."""
SHARES = (0.55, 0.4), (0.2, 0.4)
"""Shares of the candidates that go to the nominal front, each of which costs one run, and to the first search under
the risk, each of which costs one on every ground; and where they follow valleys down, of which the softest is found by
chance there."""
MORE_SHARE = 0.02, 0.12
"""Share of the candidates in every further round, and where each of them follows valleys down."""
FEW = 2
"""Corners of a box that a search which follows valleys down begins with, and the scene's own ground: what is best on
many is found by what is good on these."""
STARTS = 48
"""Candidates of one search that the next one begins with; and as many of the nominal search that lose no more than a
tenth of what the median loses, as far from each other as there are: what is robust may lie anywhere among them."""
NEAR_BEST = 0.1
ATTACKED = 6
"""Candidates along a front that are attacked between rounds."""
MEAN_GROUNDS = 24
"""Grounds that stand for a box, or for more draws than so many, where a risk averages over them."""
RETUNED, TRIED = 6, 8
"""Roundings to ticks whose free levels are tuned again, and how many levels are tried about each in a step."""
RETUNING = tuple(3e-3 * 0.7**i for i in range(12))
"""Steps of that, parts of the range of the levels: from what half a tick of a plateau of 100 us is worth to a
millivolt of 16 V."""
LAST_LOOKS = 3
"""Attacks at the end at most: grounds that one finds join, the best candidates are judged again, and the next looks
elsewhere."""
CLIMB = 4
"""Steps uphill of an attack."""
CHECK = 4
"""Grounds drawn by chance in the last look, for each that an attack between rounds looks at: what none of 192 is, is
less than 1.6 % of a box, and 93 or more hold 95 % of what candidates do (`tolerance_interval`)."""
CONFIRMED = 24
"""Candidates of each search, nominal and under the risk, that run as long as what is shown: twice as many as are
shown, for a short run orders neighbours by luck."""
BARRED = 1e30
"""Cost of a run beyond its limits, more the farther it is: above all numbers of a run in SI units."""
FRESH = 96
"""Other starts on the scene's own ground, by which a value there is stated: those that a candidate was chosen by favour
it. 93 or more hold 95 % of what it does."""
PAIRED = 8
"""Starts from which a percent of every number is tried: the mean of the differences of pairs, each from one start, is
known to a third of their scatter."""
CONFIRMING, LOOKING, TELLING = "runs that confirm", "the last look at the box", "what the motions are"
AFTER = {CONFIRMING: 0.4, LOOKING: 0.45, TELLING: 0.85}
"""How much of a design's time has gone when what follows its searches begins: of a walker on two cores."""
_STATED, _MOTION, _PERCENTS = 2, 3, 4
"""Numbers of these sets of starts, of those that say what a motion is, and of these pairs; 0 and 1 are those of short
and of long runs."""

DESIGN_FILES = (
    *FRONT_FILES,
    *(f"{name}{end}" for name in ("scene.toml", "request.txt", "plan.json", "laws/*.py") for end in ("", ".*.part")),
    *UNIT_FILES,
)
"""What a design writes into its folder, and keeps there while it works, as glob patterns."""


@dataclass(frozen=True)
class _Found:
    """What a search found: points (n, nu) or rows (n, np), and their costs (n, no) under the risk and on the scene's
    own ground, of what keeps its limits."""

    points: Floats
    risked: Floats
    own: Floats

    def leading(self, count: int) -> Floats:
        """So many points (k, nu) at most: along the front under the risk, then along that of the others, and so on."""
        return self.points[leading(self.risked, count)]


def along(costs: Floats, count: int = MEMBERS) -> NDArray[np.int64]:
    """Rows of at most ``count`` of the front of costs (n, no), from the best in the first one on, spread along it
    evenly; the ends are among them."""
    rows = np.flatnonzero(undominated(costs))
    if not len(rows):
        return np.array([_best(costs)])
    rows = rows[np.argsort(costs[rows, 0], kind="stable")]
    front = costs[rows]
    span = np.where(np.ptp(front, axis=0) > 0.0, np.ptp(front, axis=0), 1.0)
    way = np.concatenate([[0.0], np.cumsum(np.sqrt((np.diff(front / span, axis=0) ** 2).sum(axis=1)))])
    if len(rows) <= count:
        return rows
    wanted = np.linspace(0.0, way[-1], count)
    return rows[np.unique(np.abs(way[None] - wanted[:, None]).argmin(axis=1))]


@dataclass(frozen=True)
class _Shown:
    """Candidates that are shown, and their costs (k, no) as stated, under the risk and on the scene's own ground."""

    points: tuple[Candidate, ...]
    risked: Floats
    own: Floats


def leading(costs: Floats, count: int) -> NDArray[np.int64]:
    """So many rows at most of costs (n, no), the best first: along their front, then along that of the others."""
    found, left = list[int](), np.arange(len(costs))
    while len(left) and len(found) < count:
        rows = left[along(costs[left], count - len(found))]
        found += rows.tolist()
        left = np.setdiff1d(left, rows)
    return np.array(found, dtype=np.int64)


def allowed(costs: Floats, objectives: int) -> Floats:
    """Costs (..., no) of costs with a further column that is above 1 beyond limits: `BARRED` and more there."""
    if costs.shape[-1] == objectives:
        return costs
    beyond = costs[..., -1:]
    return np.where(beyond > 1.0, BARRED * beyond, costs[..., :-1])


class DesignSearch:
    """The search of one problem: ``quick`` judges by short runs, ``sure`` by those that all that is shown comes from,
    from other starts."""

    def __init__(
        self, request: DesignProblem, options: DesignSettings, store: RunStore, progress: Progress | None = None
    ) -> None:
        self.request, self.options, self.memo = request, options, store.memo()
        self.progress, self.runs = progress or silent, request.runs()
        self.rng = np.random.default_rng([options.seed, 5])
        grounded = tuple(j for j, one in enumerate(request.objectives) if one.grounded)
        over = request.over
        if over is not None and request.starts is not None:
            over = with_starts(over, request.starts, options.seed, MEAN_GROUNDS)
        self.quick, self.sure = (
            Judge(
                self._kept(runs),
                self._own(number),
                over,
                request.risk,
                options.seed,
                grounded,
                limited=bool(request.limits),
            )
            for number, runs in enumerate((settled(request).runs(SEARCHED), self.runs))
        )
        self.tried = self.asked = self.done = 0
        self.doing = ""
        self.certificate: Certificate | None = None

    def _front(self, costs: Floats) -> NDArray[np.int64]:
        """Rows of the front of costs (n, no): of what makes way, where anything does; what goes backward or stays is
        undominated as soon as it costs next to nothing."""
        most = [j for j, one in enumerate(self.request.objectives) if one.most]
        rows = np.flatnonzero((costs[:, most] < 0.0).all(axis=1))
        rows = rows if len(rows) else np.arange(len(costs))
        return rows[along(costs[rows])]

    @property
    def descends(self) -> bool:
        """Whether searches follow valleys down: of one objective with pulses."""
        return len(self.request.objectives) == 1 and self.request.free.pulses is not None

    def _begun(self, found: list[_Found]) -> Floats:
        """Points (k, nu) that a search on more grounds begins with: where it descends, those of the first search too,
        for the last one may have seen one valley alone."""
        if self.descends:
            ends = (found[0], found[-1])
            return np.concatenate(
                [valleys(self.request.free, one.points, one.risked[:, 0], 4 * STARTS) for one in ends]
            )
        return found[-1].leading(STARTS)

    def _report(self, what: str) -> None:
        """Tell progress, by the time that it takes: searches finish their last generation, which may try more than was
        asked for."""
        self.doing = what
        done = AFTER.get(what, min(self.tried / self.request.candidates, 1.0) * AFTER[CONFIRMING])
        self.done = max(self.done, round(100 * done))
        self.progress(self.done, 100, f"{what}, {self.memo.computed} runs" if self.memo.computed else what)

    def _own(self, number: int) -> Grounds:
        """The scene's own ground, once for each of a number of starts; other ones for every set."""
        own = Grounds.nominal(self.request.scene, () if self.request.over is None else self.request.over.names)
        if self.request.starts is None:
            return own
        count = {_STATED: FRESH, _MOTION: MOTIONS, _PERCENTS: PAIRED}.get(number, self.request.motion.starts)
        return started(own, self.request.starts, count, 5 * self.options.seed + number)

    def _kept(self, runs: Runs) -> Each:
        """Costs of runs, each made once and kept."""

        def each(rows: Floats, grounds: Mapping[str, Floats]) -> Floats:
            size = rows.shape[1]

            def made(asked: Floats) -> dict[str, Floats]:
                self._report(self.doing)
                own = {path: np.ascontiguousarray(asked[:, size + i]) for i, path in enumerate(grounds)}
                return {"costs": runs.each(np.ascontiguousarray(asked[:, :size]), own)}

            lasting = np.full(len(rows), runs.duration)
            asked = np.column_stack([rows, *grounds.values(), lasting])
            return self.memo.evaluate(asked, made)["costs"]

        return each

    def _search(self, grounds: Grounds, risk: Risk, share: float, starts: Floats, *, again: bool = False) -> _Found:
        """Search the front under a risk on grounds, from points (ns, nu) and an even spread; again: whether the
        points were good on fewer grounds."""
        every: list[tuple[Floats, Floats, Floats]] = []
        size, free = len(self.request.objectives), self.request.free

        def costs(points: Floats) -> Floats:
            self.doing = f"front, {len(grounds)} grounds"
            each = self.quick.costs(free.values(points), grounds)
            self.tried += len(points)
            found = self.quick.risked(each, grounds, risk), self.quick.nominal(each)
            every.append((points, allowed(found[0], size), allowed(found[1], size)))
            return every[-1][1]

        count = int(share * self.request.candidates) - len(starts)
        search = search_of(count)
        one = risk is NOMINAL
        if self.descends and one and self.quick.robust:  # a rival alone: by a population
            search = search_of(count // 2)
        elif self.descends:  # evenly spread: many valleys
            search = replace(search, generations=0, scan=2 if again else search.scan)
        self.asked += 1
        seed = 1000 * self.options.seed + self.asked
        points, found = search_front(costs, len(free), free.circular, search, seed, starts)
        if self.descends:
            left, rng, look = count - len(points), np.random.default_rng(seed), self.options.look
            valley = OWN if one else CLOSE if again else WIDE
            follow(lambda some: costs(some)[:, 0], free, points, found[:, 0], left, rng, look, valley)
        return _Found(*(np.concatenate(part) for part in zip(*every, strict=True)))

    def design(self) -> Design:
        """The whole design: searches by short runs, then one list of what they found, judged by long ones."""
        pool, grounds, rounds = self._candidates()
        found, made, gap = self._sure(pool, grounds), _Shown((), *np.zeros((2, 0, 0))), np.nan
        for number in range(LAST_LOOKS):
            *rivals, best = self._chosen(found)
            rows = [*(self._rounded(one, grounds) for one in rivals), self._rounded(best, self.sure.own)]
            chosen = np.unique(np.stack(rows), axis=0)
            made, gap, worst = self._shown(chosen, grounds)
            if not gap > CLOSED or number == LAST_LOOKS - 1:
                break
            grounds = grounds.with_more(worst)
            rounds.append(Round("last look", len(grounds), gap))
            found = self._sure(pool, grounds)
        members = [made.points[i] for i in self._front(made.risked)]
        optimum = made.points[_best(made.own)]
        self._report(TELLING)
        *shown, optimum = motions_of(self.runs, [*members, optimum], self._own(_MOTION))
        kept = found.risked[:, 0] < BARRED
        kept = kept if kept.any() else ~kept
        periodic = isinstance(self.request.motion, LastPeriod)
        return Design(
            self.request,
            tuple(shown),
            optimum,
            grounds,
            tuple(rounds),
            gap,
            found.points[kept],
            found.risked[kept],
            self.tried,
            self.memo.computed,
            self.memo.reused,
            self.certificate,
            percents_of(self.runs, members[0].row, self._own(_PERCENTS), periodic=periodic),
        )

    def _rounded(self, row: Floats, grounds: Grounds) -> Floats:
        """The best under the risk of what a device can be given about a row (np,)."""
        near = self.request.free.neighbours(row, self.rng)
        if len(near) == 1:
            return row
        judge = self.quick if isinstance(self.request.motion, LastPeriod) else self.sure

        def costs(rows: Floats) -> Floats:
            return self._judgement(judge, rows, grounds).risked[:, 0]

        scores = costs(near)
        order = np.argsort(scores, kind="stable")[:RETUNED]
        near, scores = near[order], scores[order]
        columns, low, high = self.request.free.tunable(row)
        if not columns:
            return near[0]

        def placed(points: Floats) -> Floats:
            rows = np.repeat(near, points.shape[1], axis=0)
            rows[:, columns] = np.round(low + (high - low) * points.reshape(len(rows), -1), 3)
            return rows

        start = (near[:, columns] - low) / (high - low)
        points, scores = shorter_steps(
            lambda some: costs(placed(some)).reshape(some.shape[:2]), start, scores, RETUNING, TRIED, self.rng
        )
        return placed(points[:, None])[scores.argmin()]

    def _chosen(self, found: _Found) -> list[Floats]:
        """Rows (np,) that are attacked and shown: along the front, the next best ones where it has few, and the best
        on the scene's own ground."""
        rows = self._front(found.risked).tolist()
        rows += [i for i in leading(found.risked, LOOKED).tolist() if i not in rows][: LOOKED - len(rows)]
        return [found.points[i] for i in (*rows, _best(found.own))]

    def _candidates(self) -> tuple[Floats, Grounds, list[Round]]:
        """Rows (n, np) that short runs find, the grounds for long ones, and the rounds that made them."""
        own, free = self.quick.own, self.request.free
        share = SHARES[self.descends] if self.quick.robust else (1.0, 0.0)
        nominal = self._search(own, NOMINAL, share[0], np.zeros((0, len(free))))
        if not self.quick.robust:
            return self._pool(nominal.leading(2 * CONFIRMED)), self.sure.own, []
        found, grounds, rounds = self._judged(self._starts(nominal), own, share[1])
        lasting = (
            self.sure.own.with_more(grounds.points()[len(own) :])
            if self.sure.by_planes
            else self.sure.fixed(MEAN_GROUNDS)
        )
        points = np.concatenate([found.leading(CONFIRMED), nominal.leading(CONFIRMED)])
        return self._pool(points), lasting, rounds

    def _starts(self, nominal: _Found) -> Floats:
        """Points (k, nu) that the first search under the risk begins with: the nominal front, and what loses little
        against it. None where valleys are followed down: those of one ground lead into others than those of several."""
        free, costs = self.request.free, nominal.own[:, 0]
        if self.descends:
            return np.zeros((0, len(free)))
        best, usual = float(costs.min()), float(np.median(costs))
        near = nominal.points[costs <= best + NEAR_BEST * min(usual - best, BARRED)]
        near = near[farthest(near, free.circular, STARTS)]
        return np.concatenate([nominal.points[along(nominal.risked, STARTS)], near])

    def _pool(self, points: Floats) -> Floats:
        """Rows (n, np) of points, with the signal that has no pulses, so that nothing is worse than it."""
        free = self.request.free
        return np.concatenate([free.values(points), free.as_it_is()])

    def _sure(self, rows: Floats, grounds: Grounds) -> _Found:
        """Candidates judged by long runs."""
        self._report(CONFIRMING)
        return self._judgement(self.sure, rows, grounds)

    def _judgement(self, judge: Judge, rows: Floats, grounds: Grounds) -> _Found:
        each, size = judge.costs(rows, grounds), len(self.request.objectives)
        return _Found(rows, allowed(judge.risked(each, grounds), size), allowed(judge.nominal(each), size))

    def _judged(self, starts: Floats, grounds: Grounds, share: float) -> tuple[_Found, Grounds, list[Round]]:
        """Search the front under the request's risk, its grounds, and the rounds that made them."""
        if not self.quick.by_planes:
            grounds = self.quick.fixed(MEAN_GROUNDS)
            return self._search(grounds, self.request.risk, share, starts), grounds, []
        found: list[_Found] = []

        def improve(active: Grounds) -> Floats:
            begun = self._begun(found) if found else starts
            more = MORE_SHARE[self.descends] if found else share
            found.append(self._search(active, WORST, more, begun, again=bool(found)))
            return self.request.free.values(found[-1].points[along(found[-1].risked, ATTACKED)])

        look, rows = AttackEffort(self.options.look, CLIMB), None
        if self.descends and isinstance(self.quick.over, Unknowns):
            grounds = grounds.with_more(spaced(corners(self.quick.over), FEW))
        else:
            rows = self.request.free.values(spaced(starts, ATTACKED))
        grounds, rounds, _ = self.quick.close_gap(improve, rows, grounds, look, ROUNDS, "front")
        return found[-1], grounds, rounds

    def _shown(self, points: Floats, grounds: Grounds) -> tuple[_Shown, float, Floats]:
        """Rows (k, np) as candidates, after an attack on each; the gap, and the grounds (n, np) that open it."""
        over, count = self.sure.over, CHECK * self.options.look
        if not isinstance(over, Unknowns):
            tried = None
            if over is not None:
                tried = self.sure.costs(points, drawn(over, count, np.random.default_rng([self.options.seed, 37])))
            return self._points(points, grounds, tried), np.nan, np.zeros((0, 0))
        self._report(LOOKING)
        active = self.sure.costs(points, grounds).max(axis=1)
        found = self.sure.attack(points, AttackEffort(self.options.look, CLIMB))
        checked = self.sure.attack(points, AttackEffort(count, CLIMB), by_chance=True)
        beyond = excess(np.maximum(found.costs, active)[:, None], checked.first) > CLOSED
        self.certificate = Certificate(count, int(beyond.any(axis=2).sum(axis=1).max()))
        worse = checked.costs > found.costs
        hardest = np.where(worse[:, :, None], checked.grounds, found.grounds)
        gaps = excess(active, np.where(worse, checked.costs, found.costs))
        found_for_one = Grounds.of_points(over.names, hardest.reshape(-1, len(over)))  # and all are put on
        made = self._points(points, grounds, checked.first, found_for_one)
        if not self.sure.by_planes:
            return made, np.nan, np.zeros((0, 0))
        return made, float(gaps.max()), self.sure.worst_grounds(hardest, gaps)

    def _points(
        self, points: Floats, grounds: Grounds, tried: Floats | None = None, hardest: Grounds | None = None
    ) -> _Shown:
        """Rows (k, np) as candidates, with the costs (k, n, no) of grounds drawn by chance, of starts on the scene's
        own one where there are none, and the grounds that attacks found worst for any of them."""
        request, objectives = self.request, self.request.objectives
        each = self.sure.costs(points, grounds)
        risked, own = self.sure.risked(each, grounds), self.sure.nominal(each)
        if hardest is not None:
            each = np.concatenate([each, self.sure.costs(points, hardest)], axis=1)
        worst, where = each.max(axis=1), list[Mapping[str, float]]([{} for _ in points])
        if self.sure.by_planes:
            risked = finite(worst)
        if request.starts is not None:
            fresh = self.sure.costs(points, self._own(_STATED))
            own, tried = finite(fresh.mean(axis=1)), fresh if tried is None else tried
        if not self.sure.robust:
            risked = own
        if request.over is not None:
            first = next((j for j, one in enumerate(objectives) if one.grounded), 0)
            named = [*grounds.each(), *(() if hardest is None else hardest.each())]
            where = [named[i] for i in finite(each[:, :, first]).argmax(axis=1)]
        priced = any(one.priced for one in objectives)
        plain, recovered = self.runs.energies(points) if priced else np.full((2, len(points)), np.nan)
        seen = each if tried is None else tried

        def values(costs: Floats) -> tuple[float, ...]:
            return tuple(float(one.value(cost)) for one, cost in zip(objectives, costs, strict=False))

        def intervals(costs: Floats) -> tuple[tuple[float, float], ...]:
            ends = (tolerance_interval(one.value(costs[:, j])) for j, one in enumerate(objectives))
            pairs = zip(objectives, ends, strict=True)
            return tuple(request.reliance.widened(own) if one.grounded else own for one, own in pairs)

        none = tuple(np.nan for _ in objectives)
        made = [
            Candidate(
                point,
                self.runs.changes(point),
                values(own[i]),
                values(risked[i]),
                none if request.over is None else values(worst[i]),
                where[i],
                float(plain[i]),
                float(recovered[i]),
                intervals(seen[i]),
                self._beyond(np.concatenate([each[i], seen[i]])),
            )
            for i, point in enumerate(points)
        ]
        size = len(objectives)
        return _Shown(tuple(made), allowed(risked, size), allowed(own, size))

    def _beyond(self, costs: Floats) -> float:
        """Share of runs (n, no) that do not keep their limits."""
        return float((costs[:, -1] > 1.0).mean()) if self.request.limits else 0.0


def spaced(rows: Floats, count: int) -> Floats:
    """So many rows at most, evenly along their order."""
    return rows[np.linspace(0, len(rows) - 1, min(count, len(rows))).astype(int)]


def search_of(candidates: int) -> FrontSearch:
    """A search of about so many candidates: a quarter of them spread evenly, a population of 24 to 96."""
    population = int(np.clip(candidates // 24, 24, 96)) // 2 * 2
    scan = max(candidates // 4, 2)
    return FrontSearch(scan, population, max((candidates - scan) // population, 1))


def _best(costs: Floats) -> int:
    return int(np.argmin(costs[:, 0]))
