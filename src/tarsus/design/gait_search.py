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
from tarsus.design.gait_request import SEARCHED, GaitRequest, GaitSettings, gait_request
from tarsus.design.grounds import Grounds, drawn, started, with_starts
from tarsus.design.judge import (
    CLOSED,
    NOMINAL,
    WORST,
    Attack,
    Certificate,
    Each,
    Judge,
    Look,
    Risk,
    Round,
    excess,
    finite,
)
from tarsus.design.request import Given, settings_of
from tarsus.design.walks import WalkObjective, Walks
from tarsus.files.library import SceneLike, as_scene
from tarsus.files.runstore import UNIT_FILES, RunStore
from tarsus.files.toml import scene_texts
from tarsus.fit.front import FrontSearch, farthest, search_front, undominated
from tarsus.fit.unknowns import Unknowns
from tarsus.measure.shares import tolerance_interval

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
"""Steps uphill of an attack."""
CHECK = 4
"""Grounds drawn by chance in the last look, for each that an attack between rounds looks at: what none of 192 is, is
less than 1.6 % of a box, and 93 or more hold 95 % of what gaits do (`tolerance_interval`)."""
CONFIRMED = 24
"""Candidates of each kind (front, robust gait, nominal front) that walk as long as what is shown: twice as many as are
shown, for a short walk orders neighbours by luck."""
FRESH = 96
"""Other starts on the scene's own ground, by which a gait's value there is stated: those that it was chosen by favour
it. 93 or more hold 95 % of what the gait does."""
_STATED = 2
"""Number of that set of starts; 0 and 1 are those of short and of long walks."""

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
        Further ones: symmetry, dead, candidates, look, loss, starts, duration, from_rest, seed. Objectives are those of
        the settled motion, the mean of ``starts`` on the scene's own ground, the risk over grounds and starts; with
        ``from_rest`` [s] those of an episode of that length from the scene's own start.

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
    the risk and on the scene's own ground."""

    points: Floats
    costs: Floats
    risked: Floats
    own: Floats


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
    """The search of one request: ``quick`` judges by short walks, ``sure`` by those that all that is shown comes from,
    from other starts."""

    def __init__(
        self, request: GaitRequest, options: GaitSettings, store: RunStore, progress: Progress
    ) -> None:
        self.request, self.options, self.progress, self.memo = request, options, progress, store.memo()
        self.walks = request.walks()
        grounded = tuple(j for j, one in enumerate(request.objectives) if one.grounded)
        over = request.over
        if over is not None and request.starts is not None:
            over = with_starts(over, request.starts, options.seed, MEAN_GROUNDS)
        self.quick, self.sure = (
            Judge(self._kept(walks), self._own(number), over, request.risk, options.seed, grounded)
            for number, walks in enumerate((request.walks(SEARCHED), self.walks))
        )
        self.tried = self.asked = 0
        self.certificate: Certificate | None = None

    def _front(self, costs: Floats) -> NDArray[np.int64]:
        """Rows of the front of costs (n, no) that are shown: of gaits that make way, where any do; what goes backward
        or stays is undominated as soon as it costs next to nothing."""
        most = [j for j, one in enumerate(self.request.objectives) if one.most]
        rows = np.flatnonzero((costs[:, most] < 0.0).all(axis=1))
        rows = rows if len(rows) else np.arange(len(costs))
        return rows[along(costs[rows])]

    def _report(self, what: str) -> None:
        """Tell progress: searches finish their last generation, which may try more gaits than were asked for."""
        self.progress(min(self.tried, self.options.candidates), self.options.candidates, what)

    def _own(self, number: int) -> Grounds:
        """The scene's own ground, once for each of a number of starts; other ones for every set."""
        own = Grounds.nominal(
            self.request.scene, () if self.request.over is None else self.request.over.names
        )
        if self.request.starts is None:
            return own
        count = FRESH if number == _STATED else self.options.starts
        return started(own, self.request.starts, count, 3 * self.options.seed + number)

    def _kept(self, walks: Walks) -> Each:
        """Costs of walks, each made once and kept."""

        def each(points: Floats, grounds: Mapping[str, Floats]) -> Floats:
            nu = points.shape[1]

            def walked(rows: Floats) -> dict[str, Floats]:
                own = {path: np.ascontiguousarray(rows[:, nu + i]) for i, path in enumerate(grounds)}
                return {"costs": walks.each(np.ascontiguousarray(rows[:, :nu]), own)}

            lasting = np.full(len(points), walks.duration)
            asked = np.column_stack([points, *grounds.values(), lasting])
            return self.memo.evaluate(asked, walked)["costs"]

        return each

    def _search(self, goal: _Goal, grounds: Grounds, risk: Risk, share: float, starts: Floats) -> _Found:
        """Search the front of a goal on grounds."""
        every: list[tuple[Floats, Floats]] = []

        def costs(points: Floats) -> Floats:
            self._report(f"{goal.what}, {len(grounds)} grounds")
            each = self.quick.costs(points, grounds)
            self.tried += len(points)
            every.append((self.quick.risked(each, grounds, risk), self.quick.nominal(each)))
            return goal.costs(*every[-1])

        search = search_of(int(share * self.options.candidates) - len(starts))
        self.asked += 1
        seed = 1000 * self.options.seed + self.asked
        unknowns = self.request.unknowns
        points, values = search_front(costs, len(unknowns), unknowns.numbers.circular, search, seed, starts)
        risked, own = (np.concatenate(part) for part in zip(*every, strict=True))
        return _Found(points, values, risked, own)

    def design(self) -> GaitFront:
        """The whole design: searches by short walks, then what is shown by long ones."""
        request, loss = self.request, self.options.loss
        plain, pool, rivals, grounds, rounds = self._candidates()
        found, made, gap = self._sure(pool, grounds), list[GaitPoint](), np.nan
        for number in range(LAST_LOOKS):
            others = self._sure(rivals, grounds)
            best = others.points[_best(others.own)]
            goal, _ = _within(float(others.own[:, 0].min()), loss)
            robust = others.points[goal.pick(goal.costs(others.risked, others.own), 1)[0]]
            robust = robust if self.sure.robust else best
            chosen = np.concatenate([found.points[self._front(found.costs)], robust[None], best[None]])
            made, gap, hurt = self._shown(chosen, grounds)
            if not gap > CLOSED or number == LAST_LOOKS - 1:
                break
            grounds = grounds.with_more(hurt)
            rounds.append(Round("last look", len(grounds), gap))
            found = self._sure(pool, grounds)
        alone = self._sure(plain, self.sure.own)
        nominal = self._points(plain[self._front(alone.own)], grounds)
        return GaitFront(
            request, tuple(made[:-2]), tuple(nominal), made[-2], made[-1], grounds, tuple(rounds), gap,
            found.points, found.costs, self.tried, self.memo.computed, self.memo.reused, self.certificate,
        )  # fmt: skip

    def _candidates(self) -> tuple[Floats, Floats, Floats, Grounds, list[Round]]:
        """Gaits that short walks find for the nominal front, the front, and the robust gait; the grounds for long ones,
        and the rounds that made them."""
        own, loss, circular = self.quick.own, self.options.loss, self.request.unknowns.numbers.circular
        share = SHARES if self.quick.robust else (1.0, 0.0, 0.0)
        nominal = self._search(_FRONT, own, NOMINAL, share[0], np.zeros((0, len(self.request.unknowns))))
        plain = nominal.points[along(nominal.costs, CONFIRMED)]
        starts = nominal.points[along(nominal.costs, STARTS)]
        if not self.quick.robust:
            return plain, starts, plain, self.sure.own, []
        found, grounds, rounds = self._judged(_FRONT, starts, own, share[1])
        goal, limit = _within(float(nominal.own[:, 0].min()), loss)
        near = nominal.points[nominal.own[:, 0] <= limit]
        near = near[farthest(near, circular, STARTS)]
        pool = found.points[along(found.costs, STARTS)]
        compared, grounds, more = self._judged(
            goal, np.concatenate([plain[:1], near, pool]), grounds, share[2]
        )
        goal, _ = _within(float(compared.own[:, 0].min()), loss)
        near = goal.pick(goal.costs(compared.risked, compared.own), CONFIRMED)
        lasting = (
            self.sure.own.with_more(grounds.points()[len(own) :])
            if self.sure.by_planes
            else self.sure.fixed(MEAN_GROUNDS)
        )
        return plain, pool, np.concatenate([compared.points[near], plain]), lasting, [*rounds, *more]

    def _sure(self, points: Floats, grounds: Grounds) -> _Found:
        """Candidates judged by long walks."""
        self._report("walks that confirm")
        each = self.sure.costs(points, grounds)
        costs = self.sure.risked(each, grounds)
        return _Found(points, costs, costs, self.sure.nominal(each))

    def _judged(
        self, goal: _Goal, starts: Floats, grounds: Grounds, share: float
    ) -> tuple[_Found, Grounds, list[Round]]:
        """Search the front of a goal under the request's risk, its grounds, and the rounds that made them."""
        if not self.quick.by_planes:
            grounds = self.quick.fixed(MEAN_GROUNDS)
            return self._search(goal, grounds, self.request.risk, share, starts), grounds, []
        found: list[_Found] = []

        def improve(active: Grounds) -> Floats:
            begun = found[-1].points[along(found[-1].costs, STARTS)] if found else starts
            found.append(self._search(goal, active, WORST, MORE_SHARE if found else share, begun))
            return found[-1].points[goal.pick(found[-1].costs, goal.attacked)]

        first = starts[np.linspace(0, len(starts) - 1, min(goal.attacked, len(starts))).astype(int)]
        look = Look(self.options.look, CLIMB)
        grounds, rounds, _ = self.quick.close_gap(improve, first, grounds, look, ROUNDS, goal.what)
        return found[-1], grounds, rounds

    def _shown(self, points: Floats, grounds: Grounds) -> tuple[list[GaitPoint], float, Floats]:
        """Points (k, nu) as gaits, after an attack on them; the gap of all but the last, which is of no front, and the
        grounds (n, np) that open it."""
        over, count = self.sure.over, CHECK * self.options.look
        if not isinstance(over, Unknowns):
            tried = None
            if over is not None:
                tried = self.sure.costs(
                    points, drawn(over, count, np.random.default_rng([self.options.seed, 37]))
                )
            return self._points(points, grounds, tried), np.nan, np.zeros((0, 0))
        self._report("the last look at the box")
        active = self.sure.costs(points, grounds).max(axis=1)
        found = self.sure.attack(points, Look(self.options.look, CLIMB))
        checked = self.sure.attack(points, Look(count, CLIMB), by_chance=True)
        beyond = excess(np.maximum(found.costs, active)[:, None], checked.first) > CLOSED
        self.certificate = Certificate(count, int(beyond.any(axis=2).sum(axis=1).max()))
        worse = checked.costs > found.costs
        found = Attack(
            np.where(worse, checked.costs, found.costs),
            np.where(worse[:, :, None], checked.grounds, found.grounds), found.tried + checked.tried, found.first,
        )  # fmt: skip
        gaps = excess(active, found.costs)[:-1]
        made = self._points(points, grounds, checked.first, found)
        if not self.sure.by_planes:
            return made, np.nan, np.zeros((0, 0))
        return made, float(gaps.max()), self.sure.hurting(found.grounds[:-1], gaps)

    def _points(
        self, points: Floats, grounds: Grounds, tried: Floats | None = None, found: Attack | None = None
    ) -> list[GaitPoint]:
        """Points (k, nu) as gaits, with the costs (k, n, no) of grounds drawn by chance, of starts on the scene's own
        one where there are none, and what an attack found worst."""
        request, objectives = self.request, self.request.objectives
        each = self.sure.costs(points, grounds)
        risked, own = self.sure.risked(each, grounds), self.sure.nominal(each)
        worst: Floats = np.full(risked.shape, np.nan)
        where: list[Mapping[str, float]] = [{} for _ in points]
        if request.starts is not None:
            fresh = self.sure.costs(points, self._own(_STATED))
            own, tried = finite(fresh.mean(axis=1)), fresh if tried is None else tried
        if request.over is not None:
            first = next((j for j, one in enumerate(objectives) if one.grounded), 0)
            named, worst = grounds.each(), each.max(axis=1)
            where = [named[i] for i in each[:, :, first].argmax(axis=1)]
            if found is not None and isinstance(self.sure.over, Unknowns):
                for i in np.flatnonzero(found.costs[:, first] > worst[:, first]):
                    where[i] = dict(zip(self.sure.over.names, found.grounds[i, first].tolist(), strict=True))
                worst = np.maximum(worst, found.costs)
        priced = any(one.priced for one in objectives)
        plain, recovered = self.walks.energies(points) if priced else np.full((2, len(points)), np.nan)

        def values(costs: Floats) -> tuple[float, ...]:
            return tuple(float(one.value(cost)) for one, cost in zip(objectives, costs, strict=True))

        def intervals(costs: Floats) -> tuple[tuple[float, float], ...]:
            return tuple(tolerance_interval(one.value(costs[:, j])) for j, one in enumerate(objectives))

        return [
            GaitPoint(
                point, self.walks.changes(point), values(own[i]), values(risked[i]), values(worst[i]),
                where[i], float(plain[i]), float(recovered[i]), intervals((each if tried is None else tried)[i]),
            )
            for i, point in enumerate(points)
        ]  # fmt: skip


def search_of(candidates: int) -> FrontSearch:
    """A search of about so many candidates: a quarter of them spread evenly, a population of 24 to 96."""
    population = int(np.clip(candidates // 24, 24, 96)) // 2 * 2
    scan = max(candidates // 4, 2)
    return FrontSearch(scan, population, max((candidates - scan) // population, 1))


def _best(costs: Floats) -> int:
    return int(np.argmin(costs[:, 0]))
