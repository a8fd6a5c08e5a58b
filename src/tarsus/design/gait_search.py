"""Fronts of gaits: speed against energy and whatever else walks are judged by, on grounds that nobody measured
(5.2.3)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.progress import Progress, silent
from tarsus.base.workers import Workers
from tarsus.design.gait_front import GaitFront, GaitPoint
from tarsus.design.gait_request import GaitRequest, GaitSettings, gait_request
from tarsus.design.grounds import Grounds
from tarsus.design.judge import CLOSED, NOMINAL, WORST, Attack, Certificate, Judge, Look, Risk, Round, excess
from tarsus.design.request import Given, settings_of
from tarsus.design.walks import WalkObjective, Walks
from tarsus.files.library import SceneLike, as_scene
from tarsus.files.runstore import UNIT_FILES, RunStore
from tarsus.files.toml import scene_texts
from tarsus.fit.front import FrontSearch, farthest, search_front, undominated
from tarsus.fit.unknowns import Unknowns

Floats = NDArray[np.float64]

MEMBERS = 12
"""Gaits of a front that are shown, attacked and given pages: spread along it, its ends among them."""
ROUNDS = 5
"""Rounds of cutting planes at most."""
SHARES: tuple[float, ...] = (0.55, 0.15, 0.25)
"""Shares of the candidates that go to the nominal front, each of which costs one walk, to the first search under the
risk, each of which costs one on every ground, and to the robust gait."""
MORE_SHARE = 0.02
"""Share of the candidates in every further round."""
STARTS = 48
"""Gaits of one search that the next one begins with; and as many of the nominal search that lose no more than the
robust gait may, as far from each other as there are."""
MEAN_GROUNDS = 24
"""Grounds that stand for a box where a risk averages over it."""
LAST_LOOKS = 3
"""Attacks at the end at most: grounds that one finds join, the best candidates are judged again, and the next looks
elsewhere."""
CLIMB = 4
"""Steps uphill of an attack between rounds; the last attack looks at four times as many grounds, climbs twice as long,
and from `ISLANDS` regions."""
ISLANDS = 3
"""Regions of the last attack: a worst ground that one climb misses lies beside another of the first looks."""
CHECK = 16
"""Grounds drawn by chance in the last look, for each that an attack between rounds looks at: what none of 768 is, is
less than 0.4 % of a box."""

KEPT_FILES = (
    *(
        f"{name}{end}"
        for name in ("scene.toml", "request.txt", "plan.json", "laws/*.py")
        for end in ("", ".*.part")
    ),
    *UNIT_FILES,
)
"""What a design keeps in its folder while it works, as glob patterns."""


def gait(
    scene: SceneLike,
    free: Mapping[str, Any] | Iterable[str] | None = None,
    objective: str | Sequence[str | WalkObjective] | None = None,
    over: Any = None,
    risk: str | Risk | None = None,
    *,
    request: Given = None,
    folder: str | Path | None = None,
    resume: bool = False,
    threads: Workers = None,
    progress: Progress | None = None,
    **settings: Any,
) -> GaitFront:
    """Design gaits: the front of what no other gait beats in all objectives at once.

    Parameters
    ----------
    scene
        Of a walker with a gait; or the name of a device, or a scene file.
    free
        Paths of the gait and of signals that may change, with their ranges or None for the usual ones;
        ``gait.phases`` for those of all legs, see `tarsus.design.gait_unknowns.gait_unknowns`.
    objective
        One to three of `tarsus.design.walks.OBJECTIVES`, with commas or as a list; speed and energy unless
        given.
    over
        Grounds: a mapping of paths to (low, high), `tarsus.design.Grounds`, or a file of draws of `tarsus identify`.
        All candidates are judged on the same ones.
    risk
        ``worst``, ``cvar:q``, ``mean`` or ``nominal``, of each objective for itself; worst with grounds, else
        nominal.
    request, threads, progress
        As for `tarsus.design.landing`.
    folder
        Where batches of runs are kept; with ``resume`` a design that was killed goes on there, and ends the same.
    settings
        Further ones: symmetry, dead, candidates, look, loss, duration, seed.

    Returns
    -------
    GaitFront
        The front (`members`), the robust gait, the nominal optimum, the active grounds and the certificate.

    Raises
    ------
    InputError
        With every problem of the request.
    """
    options = settings_of(
        GaitSettings, request, free=free, objective=objective, over=over, risk=risk, **settings
    )
    asked = gait_request(as_scene(scene), options, options.risk, threads)
    texts = {**scene_texts(asked.scene), "request.txt": asked.text}
    store = RunStore.open(folder, texts, resume=resume, what="design", values=asked.numbers)
    return _GaitSearch(asked, options, store, progress or silent).design()


@dataclass(frozen=True)
class _Found:
    """What a search found: points (n, nu) and their costs (n, k) for its goal; the objectives' costs (n, no) under
    the risk and on the scene's own ground; grounds: how many they were judged on."""

    points: Floats
    costs: Floats
    risked: Floats
    own: Floats
    grounds: int = 1


@dataclass(frozen=True)
class _Goal:
    """What a search is for. what: in words; costs: from the objectives' costs (n, no) under the risk and on the
    scene's own ground; pick: from costs and a number to the rows that are attacked, so many at most."""

    what: str
    costs: Callable[[Floats, Floats], Floats]
    pick: Callable[[Floats, int], NDArray[np.int64]]
    attacked: int


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


_FRONT = _Goal("front", lambda risked, own: risked, along, 6)


def _within(best: float, loss: float) -> tuple[_Goal, float]:
    """The best risk in the first objective of what loses at most a share of the best value on the scene's own
    ground, and the cost there that is that limit."""
    limit = best + loss * abs(best)

    def costs(risked: Floats, own: Floats) -> Floats:
        return np.stack([risked[:, 0], np.maximum(own[:, 0] - limit, 0.0)], axis=1)

    def pick(costs: Floats, count: int) -> NDArray[np.int64]:
        return np.lexsort((costs[:, 0], costs[:, 1]))[:count]

    return _Goal("robust gait", costs, pick, 2), limit


class _GaitSearch:
    """The search of one request."""

    def __init__(
        self, request: GaitRequest, options: GaitSettings, store: RunStore, progress: Progress
    ) -> None:
        self.request, self.options, self.progress, self.memo = request, options, progress, store.memo()
        self.walks = Walks(
            request.scene, request.unknowns, request.objectives, request.duration, request.threads
        )
        own = Grounds.nominal(request.scene, () if request.over is None else request.over.names)
        grounded = tuple(j for j, one in enumerate(request.objectives) if one.grounded)
        seed = self.options.seed
        self.judge = Judge(self._each, own, request.over, request.risk, seed, grounded)
        self.tried = self.asked = 0
        self.certificate: Certificate | None = None

    def _each(self, points: Floats, grounds: Mapping[str, Floats]) -> Floats:
        """Costs of walks, each made once and kept."""
        nu = points.shape[1]

        def walked(rows: Floats) -> dict[str, Floats]:
            own = {path: np.ascontiguousarray(rows[:, nu + i]) for i, path in enumerate(grounds)}
            return {"costs": self.walks.each(np.ascontiguousarray(rows[:, :nu]), own)}

        return self.memo.evaluate(np.column_stack([points, *grounds.values()]), walked)["costs"]

    def _search(self, goal: _Goal, grounds: Grounds, risk: Risk, share: float, starts: Floats) -> _Found:
        """Search the front of a goal on grounds."""
        every: list[tuple[Floats, Floats]] = []

        def costs(points: Floats) -> Floats:
            self.progress(self.tried, self.options.candidates, f"{goal.what}, {len(grounds)} grounds")
            each = self.judge.costs(points, grounds)
            self.tried += len(points)
            every.append((self.judge.risked(each, grounds, risk), each[:, 0]))
            return goal.costs(*every[-1])

        search = search_of(int(share * self.options.candidates) - len(starts))
        self.asked += 1
        seed = 1000 * self.options.seed + self.asked
        unknowns = self.request.unknowns
        points, values = search_front(costs, len(unknowns), unknowns.numbers.circular, search, seed, starts)
        risked, own = (np.concatenate(part) for part in zip(*every, strict=True))
        return _Found(points, values, risked, own, len(grounds))

    def design(self) -> GaitFront:
        """The whole design."""
        request, own = self.request, self.judge.own
        none = np.zeros((0, len(request.unknowns)))
        share = SHARES if self.judge.robust else (1.0, 0.0, 0.0)
        nominal = self._search(_FRONT, own, NOMINAL, share[0], none)
        best = nominal.points[_best(nominal.costs)]
        found, robust, grounds, rounds = nominal, best, own, []
        if self.judge.robust:
            starts = nominal.points[along(nominal.costs, STARTS)]
            found, grounds, rounds = self._judged(_FRONT, starts, own, share[1])
            goal, limit = _within(float(nominal.own[:, 0].min()), self.options.loss)
            near = nominal.points[nominal.own[:, 0] <= limit]
            near = near[farthest(near, request.unknowns.numbers.circular, STARTS)]
            starts = np.concatenate([best[None], near, found.points[along(found.costs, STARTS)]])
            compared, grounds, more = self._judged(goal, starts, grounds, share[2])
            rounds += more
            best = compared.points[_best(compared.own)]  # the optimum so far is among them
            goal, _ = _within(float(compared.own[:, 0].min()), self.options.loss)
            robust = compared.points[goal.pick(goal.costs(compared.risked, compared.own), 1)[0]]
            found = self._again(found.points[along(found.costs, STARTS)], found, grounds)
        made, gap = [], np.nan
        for number in range(LAST_LOOKS):
            chosen = np.concatenate([found.points[along(found.costs)], robust[None], best[None]])
            made, gap, hurt = self._shown(chosen, grounds, number)
            if not gap > CLOSED or number == LAST_LOOKS - 1:
                break
            grounds = grounds.with_more(hurt)
            rounds.append(Round("last look", len(grounds), gap))
            found = self._again(found.points[along(found.costs, STARTS)], found, grounds)
        plain, _, _ = self._shown(nominal.points[along(nominal.costs)], grounds, None)
        return GaitFront(
            request, tuple(made[:-2]), tuple(plain), made[-2], made[-1], grounds, tuple(rounds), gap,
            found.points, found.costs, self.tried, self.memo.computed, self.memo.reused, self.certificate,
        )  # fmt: skip

    def _again(self, points: Floats, before: _Found, grounds: Grounds) -> _Found:
        """The candidates at these points judged anew where there are more grounds than they were judged on."""
        if len(grounds) == before.grounds:
            return before
        each = self.judge.costs(points, grounds)
        costs = self.judge.risked(each, grounds)
        return _Found(points, costs, costs, each[:, 0], len(grounds))

    def _judged(
        self, goal: _Goal, starts: Floats, grounds: Grounds, share: float
    ) -> tuple[_Found, Grounds, list[Round]]:
        """Search the front of a goal under the request's risk, its grounds, and the rounds that made them."""
        if not self.judge.by_planes:
            grounds = self.judge.fixed(MEAN_GROUNDS)
            return self._search(goal, grounds, self.request.risk, share, starts), grounds, []
        found: list[_Found] = []

        def improve(active: Grounds) -> Floats:
            begun = found[-1].points[along(found[-1].costs, STARTS)] if found else starts
            found.append(self._search(goal, active, WORST, MORE_SHARE if found else share, begun))
            return found[-1].points[goal.pick(found[-1].costs, goal.attacked)]

        first = starts[np.linspace(0, len(starts) - 1, min(goal.attacked, len(starts))).astype(int)]
        look = Look(self.options.look, CLIMB)
        grounds, rounds, _ = self.judge.close_gap(improve, first, grounds, look, ROUNDS, goal.what)
        return found[-1], grounds, rounds

    def _last_look(self, points: Floats, active: Floats, risked: Floats, number: int) -> Attack:
        """An attack on gaits at points (k, nu), of worst costs (k, no) on active grounds: four times as many grounds as
        between rounds, and many more by chance, which certify the others: for the gaits that matter most, and for all
        where that leaves nothing open."""
        count = self.options.look
        found = self.judge.attack(points, Look(4 * count, 2 * CLIMB, ISLANDS))
        known = np.maximum(found.costs, active)
        looked = np.repeat(known[:, None], CHECK * count, axis=1)
        first = np.unique([*np.argmin(risked[:-2], axis=0), len(points) - 2, len(points) - 1])
        for rows in filter(len, (first, np.setdiff1d(np.arange(len(points)), first))):
            checked = self.judge.attack(points[rows], Look(CHECK * count, 2 * CLIMB, ISLANDS), by_chance=True)
            looked[rows] = checked.first
            worse = checked.costs > found.costs[rows]
            found.costs[rows] = np.where(worse, checked.costs, found.costs[rows])
            found.grounds[rows] = np.where(worse[:, :, None], checked.grounds, found.grounds[rows])
            if self._open(active, found) > CLOSED and number < LAST_LOOKS - 1:
                break  # there will be another look
        beyond = (excess(known[:, None], looked) > CLOSED).any(axis=2)
        self.certificate = Certificate(CHECK * count, int(beyond.sum(axis=1).max()))
        return found

    def _open(self, active: Floats, found: Attack) -> float:
        """The gap of all gaits but the last, of worst costs (k, no) on active grounds; NaN where none join."""
        return float(excess(active, found.costs)[:-1].max()) if self.judge.by_planes else np.nan

    def _shown(
        self, points: Floats, grounds: Grounds, look: int | None
    ) -> tuple[list[GaitPoint], float, Floats]:
        """Points (k, nu) as gaits; the gap of all but the last, which is of no front, and the grounds (n, np) that
        open it. look: number of the attack on them; None for none, and then the worst is that of the grounds."""
        request, objectives = self.request, self.request.objectives
        each = self.judge.costs(points, grounds)
        risked = self.judge.risked(each, grounds)
        gap, worst, hurt = np.nan, np.full(risked.shape, np.nan), np.zeros((0, 0))
        where: list[dict[str, float]] = [{} for _ in points]
        first = next((j for j, one in enumerate(objectives) if one.grounded), 0)
        if request.over is not None:
            worst, at = each.max(axis=1), each[:, :, first].argmax(axis=1)
            named = grounds.each()
            where = [named[i] for i in at]
        if look is not None and isinstance(request.over, Unknowns):
            self.progress(self.tried, self.options.candidates, "the last look at the box")
            found = self._last_look(points, worst, risked, look)
            gap = self._open(worst, found)
            if self.judge.by_planes:
                hurt = self.judge.hurting(found.grounds[:-1], excess(worst, found.costs)[:-1])
            for i in np.flatnonzero(found.costs[:, first] > worst[:, first]):
                where[i] = dict(zip(request.over.names, found.grounds[i, first].tolist(), strict=True))
            worst = np.maximum(worst, found.costs)
        priced = any(one.priced for one in objectives)
        plain, recovered = self.walks.energies(points) if priced else np.full((2, len(points)), np.nan)

        def values(costs: Floats) -> tuple[float, ...]:
            return tuple(float(one.value(cost)) for one, cost in zip(objectives, costs, strict=True))

        made = [
            GaitPoint(
                point, self.walks.changes(point), values(each[i, 0]), values(risked[i]), values(worst[i]),
                where[i], float(plain[i]), float(recovered[i]),
            )
            for i, point in enumerate(points)
        ]  # fmt: skip
        return made, gap, hurt


def search_of(candidates: int) -> FrontSearch:
    """A search of about so many candidates: a quarter of them spread evenly, a population of 24 to 96."""
    population = int(np.clip(candidates // 24, 24, 96)) // 2 * 2
    scan = max(candidates // 4, 2)
    return FrontSearch(scan, population, max((candidates - scan) // population, 1))


def _best(costs: Floats) -> int:
    return int(np.argmin(costs[:, 0]))
