"""Fronts of gaits: speed against energy and whatever else walks are judged by, on grounds that nobody measured
(5.2.3)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.progress import Progress, silent
from tarsus.base.workers import Workers
from tarsus.design.gait_front import GaitFront, GaitPoint
from tarsus.design.gait_motion import MOTIONS, motions_of
from tarsus.design.gait_percents import gait_percents
from tarsus.design.gait_request import SEARCHED, GaitRequest, GaitSettings, gait_request
from tarsus.design.grounds import Grounds, drawn, started, with_starts
from tarsus.design.judge import (
    CLOSED,
    NOMINAL,
    WORST,
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
"""Gaits of a front that are attacked: spread along it, its ends among them."""
LOOKED = 4
"""Gaits that are attacked at least, the next best ones where the front has fewer: which of them is the most robust is
found there."""
ROUNDS = 5
"""Rounds of cutting planes at most."""
SHARES: tuple[float, float] = (0.55, 0.4)
"""Shares of the candidates that go to the nominal front, each of which costs one walk, and to the first search under
the risk, each of which costs one on every ground."""
MORE_SHARE = 0.02
"""Share of the candidates in every further round."""
STARTS = 48
"""Gaits of one search that the next one begins with; and as many of the nominal search that lose no more than a tenth
of its best value, as far from each other as there are: what is robust may lie anywhere among them."""
NEAR_BEST = 0.1
ATTACKED = 6
"""Gaits along a front that are attacked between rounds."""
MEAN_GROUNDS = 24
"""Grounds that stand for a box, or for more draws than so many, where a risk averages over them."""
LAST_LOOKS = 3
"""Attacks at the end at most: grounds that one finds join, the best candidates are judged again, and the next looks
elsewhere."""
CLIMB = 4
"""Steps uphill of an attack."""
CHECK = 4
"""Grounds drawn by chance in the last look, for each that an attack between rounds looks at: what none of 192 is, is
less than 1.6 % of a box, and 93 or more hold 95 % of what gaits do (`tolerance_interval`)."""
CONFIRMED = 24
"""Candidates of each search, nominal and under the risk, that walk as long as what is shown: twice as many as are
shown, for a short walk orders neighbours by luck."""
BARRED = 1e30
"""Cost of a walk beyond its limits, more the farther it is: above all numbers of a walk in SI units."""
FRESH = 96
"""Other starts on the scene's own ground, by which a gait's value there is stated: those that it was chosen by favour
it. 93 or more hold 95 % of what the gait does."""
PAIRED = 8
"""Starts from which a percent of every number is tried: the mean of the differences of pairs, each from one start, is
known to a third of their scatter."""
_STATED, _MOTION, _PERCENTS = 2, 3, 4
"""Numbers of these sets of starts, of those that say what a motion is, and of these pairs; 0 and 1 are those of short
and of long walks."""

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
        One to three of `tarsus.design.walks.OBJECTIVES`, or measures by name with a direction (``most duty_factor``),
        with commas or as a list; speed and energy unless given.
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
        Further ones: limits, symmetry, dead, candidates, look, starts, duration, from_rest, seed. ``limits`` are
        measures by name that every walk has to keep, ``{"slip_ratio": ("<", 0.2)}`` or ``"mean_speed > 2 mm/s"``, with
        that of the model (`tarsus.design.limits.model_limit`). Objectives are those of
        the settled motion, the mean of ``starts`` on the scene's own ground, the risk over grounds and starts; with
        ``from_rest`` [s] those of an episode of that length from the scene's own start.

    Returns
    -------
    GaitFront
        One list of gaits, all judged alike: the front under the risk (`members`), of which the first is the robust
        gait, and the nominal optimum; the active grounds and the certificate.

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
    """What a search found: points (n, nu), and their costs (n, no) under the risk and on the scene's own ground, of
    what keeps its limits."""

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
    """Gaits that are shown, and their costs (k, no) as stated, under the risk and on the scene's own ground."""

    points: tuple[GaitPoint, ...]
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
        """Rows of the front of costs (n, no): of gaits that make way, where any do; what goes backward or stays is
        undominated as soon as it costs next to nothing."""
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
        count = {_STATED: FRESH, _MOTION: MOTIONS, _PERCENTS: PAIRED}.get(number, self.options.starts)
        return started(own, self.request.starts, count, 5 * self.options.seed + number)

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

    def _search(self, what: str, grounds: Grounds, risk: Risk, share: float, starts: Floats) -> _Found:
        """Search the front under a risk on grounds."""
        every: list[tuple[Floats, Floats]] = []
        size = len(self.request.objectives)

        def costs(points: Floats) -> Floats:
            self._report(f"{what}, {len(grounds)} grounds")
            each = self.quick.costs(points, grounds)
            self.tried += len(points)
            found = self.quick.risked(each, grounds, risk), self.quick.nominal(each)
            every.append((allowed(found[0], size), allowed(found[1], size)))
            return every[-1][0]

        search = search_of(int(share * self.options.candidates) - len(starts))
        self.asked += 1
        seed = 1000 * self.options.seed + self.asked
        unknowns = self.request.unknowns
        points, _ = search_front(costs, len(unknowns), unknowns.numbers.circular, search, seed, starts)
        risked, own = (np.concatenate(part) for part in zip(*every, strict=True))
        return _Found(points, risked, own)

    def design(self) -> GaitFront:
        """The whole design: searches by short walks, then one list of what they found, judged by long ones."""
        pool, grounds, rounds = self._candidates()
        found, made, gap = self._sure(pool, grounds), _Shown((), *np.zeros((2, 0, 0))), np.nan
        for number in range(LAST_LOOKS):
            chosen = np.unique(np.stack([*self._chosen(found)]), axis=0)
            made, gap, hurt = self._shown(chosen, grounds)
            if not gap > CLOSED or number == LAST_LOOKS - 1:
                break
            grounds = grounds.with_more(hurt)
            rounds.append(Round("last look", len(grounds), gap))
            found = self._sure(pool, grounds)
        members = [made.points[i] for i in self._front(made.risked)]
        optimum = made.points[_best(made.own)]
        self._report("what the motions are")
        *shown, optimum = motions_of(self.walks, [*members, optimum], self._own(_MOTION))
        kept = found.risked[:, 0] < BARRED
        kept = kept if kept.any() else ~kept
        return GaitFront(
            self.request, tuple(shown), optimum, grounds, tuple(rounds), gap,
            found.points[kept], found.risked[kept], self.tried, self.memo.computed, self.memo.reused, self.certificate,
            gait_percents(self.walks, members[0].point, self._own(_PERCENTS)),
        )  # fmt: skip

    def _chosen(self, found: _Found) -> list[Floats]:
        """Points (nu,) that are attacked and shown: along the front, the next best ones where it has few, and the best
        on the scene's own ground."""
        rows = self._front(found.risked).tolist()
        rows += [i for i in leading(found.risked, LOOKED).tolist() if i not in rows][: LOOKED - len(rows)]
        return [found.points[i] for i in (*rows, _best(found.own))]

    def _candidates(self) -> tuple[Floats, Grounds, list[Round]]:
        """Gaits that short walks find, the grounds for long ones, and the rounds that made them."""
        own, circular = self.quick.own, self.request.unknowns.numbers.circular
        share = SHARES if self.quick.robust else (1.0, 0.0)
        nominal = self._search("front", own, NOMINAL, share[0], np.zeros((0, len(self.request.unknowns))))
        if not self.quick.robust:
            return nominal.leading(2 * CONFIRMED), self.sure.own, []
        best = float(nominal.own[:, 0].min())
        near = nominal.points[nominal.own[:, 0] <= best + NEAR_BEST * abs(best)]
        near = near[farthest(near, circular, STARTS)]
        starts = np.concatenate([nominal.points[along(nominal.risked, STARTS)], near])
        found, grounds, rounds = self._judged(starts, own, share[1])
        lasting = (
            self.sure.own.with_more(grounds.points()[len(own) :])
            if self.sure.by_planes
            else self.sure.fixed(MEAN_GROUNDS)
        )
        return np.concatenate([found.leading(CONFIRMED), nominal.leading(CONFIRMED)]), lasting, rounds

    def _sure(self, points: Floats, grounds: Grounds) -> _Found:
        """Candidates judged by long walks."""
        self._report("walks that confirm")
        each, size = self.sure.costs(points, grounds), len(self.request.objectives)
        return _Found(
            points, allowed(self.sure.risked(each, grounds), size), allowed(self.sure.nominal(each), size)
        )

    def _judged(self, starts: Floats, grounds: Grounds, share: float) -> tuple[_Found, Grounds, list[Round]]:
        """Search the front under the request's risk, its grounds, and the rounds that made them."""
        if not self.quick.by_planes:
            grounds = self.quick.fixed(MEAN_GROUNDS)
            return self._search("front", grounds, self.request.risk, share, starts), grounds, []
        found: list[_Found] = []

        def improve(active: Grounds) -> Floats:
            begun = found[-1].leading(STARTS) if found else starts
            found.append(self._search("front", active, WORST, MORE_SHARE if found else share, begun))
            return found[-1].points[along(found[-1].risked, ATTACKED)]

        first = starts[np.linspace(0, len(starts) - 1, min(ATTACKED, len(starts))).astype(int)]
        look = Look(self.options.look, CLIMB)
        grounds, rounds, _ = self.quick.close_gap(improve, first, grounds, look, ROUNDS, "front")
        return found[-1], grounds, rounds

    def _shown(self, points: Floats, grounds: Grounds) -> tuple[_Shown, float, Floats]:
        """Points (k, nu) as gaits, after an attack on each of them; the gap, and the grounds (n, np) that open it."""
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
        hardest = np.where(worse[:, :, None], checked.grounds, found.grounds)
        gaps = excess(active, np.where(worse, checked.costs, found.costs))
        found_for_one = Grounds.of_points(over.names, hardest.reshape(-1, len(over)))  # and all are put on
        made = self._points(points, grounds, checked.first, found_for_one)
        if not self.sure.by_planes:
            return made, np.nan, np.zeros((0, 0))
        return made, float(gaps.max()), self.sure.hurting(hardest, gaps)

    def _points(
        self, points: Floats, grounds: Grounds, tried: Floats | None = None, hardest: Grounds | None = None
    ) -> _Shown:
        """Points (k, nu) as gaits, with the costs (k, n, no) of grounds drawn by chance, of starts on the scene's own
        one where there are none, and the grounds that attacks found worst for any of them."""
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
        plain, recovered = self.walks.energies(points) if priced else np.full((2, len(points)), np.nan)
        seen = each if tried is None else tried

        def values(costs: Floats) -> tuple[float, ...]:
            return tuple(float(one.value(cost)) for one, cost in zip(objectives, costs, strict=False))

        def intervals(costs: Floats) -> tuple[tuple[float, float], ...]:
            return tuple(tolerance_interval(one.value(costs[:, j])) for j, one in enumerate(objectives))

        none = tuple(np.nan for _ in objectives)
        made = [
            GaitPoint(
                point, self.walks.changes(point), values(own[i]), values(risked[i]),
                none if request.over is None else values(worst[i]), where[i], float(plain[i]), float(recovered[i]),
                intervals(seen[i]), self._beyond(np.concatenate([each[i], seen[i]])),
            )
            for i, point in enumerate(points)
        ]  # fmt: skip
        size = len(objectives)
        return _Shown(tuple(made), allowed(risked, size), allowed(own, size))

    def _beyond(self, costs: Floats) -> float:
        """Share of walks (n, no) that do not keep their limits."""
        return float((costs[:, -1] > 1.0).mean()) if self.request.limits else 0.0


def search_of(candidates: int) -> FrontSearch:
    """A search of about so many candidates: a quarter of them spread evenly, a population of 24 to 96."""
    population = int(np.clip(candidates // 24, 24, 96)) // 2 * 2
    scan = max(candidates // 4, 2)
    return FrontSearch(scan, population, max((candidates - scan) // population, 1))


def _best(costs: Floats) -> int:
    return int(np.argmin(costs[:, 0]))
