"""Soft touchdown: on-off signals that put a foot down gently (5.2.1 and Fig. 5.1 of the source)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.design import shown
from tarsus.design.energy import Energy, period_rises
from tarsus.design.learning import Learning, learn_on_hidden_grounds
from tarsus.design.over import Box, Ensemble, Grounds
from tarsus.design.polish import polish
from tarsus.design.pulses import Family, families
from tarsus.design.request import Options, Request, request_of
from tarsus.design.risk import Nominal, Risk, Worst
from tarsus.design.search import Archive, Budget, descend, search
from tarsus.design.settling import Regime, regime_of, settled_periods
from tarsus.design.target import Target
from tarsus.design.timer import neighbours
from tarsus.design.trials import Landings, Trials
from tarsus.design.worst_ground import Attack, Round, attack, close_gap
from tarsus.model.drive.waveforms import OnOff
from tarsus.model.scene import Scene, override
from tarsus.solve.simulate import scene_of

__all__ = ["FrontPoint", "LandingDesign", "landing"]

Floats = NDArray[np.float64]
Progress = Callable[[int, int, str], None]

SAMPLE = 48
"""Signals that the time to settle is measured on."""
MEAN_GROUNDS = 48
"""Grounds that stand for a box where a risk averages over it: a search runs every candidate on all of them."""
DENSE = 2048
"""Grounds of the last, dense look at a box, before the climb from its worst regions."""
ROUNDS = 6
"""Rounds of cutting planes at most; the cantilever needs one or two."""


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


@dataclass(frozen=True)
class FrontPoint:
    """A design on the front: pairs of switchings, nominal speed [m/s], worst speed over the box (NaN without one),
    plain energy a period and that with charge recovery [J], and its signal."""

    pairs: int
    speed: float
    worst: float
    energy: float
    recovered: float
    signal: OnOff


@dataclass(frozen=True, repr=False)
class LandingDesign:
    """A soft landing and why to believe it.

    signal: rounded to the timer; exact: before rounding. before, after (1, 1): what the foot does on the nominal ground
    with the plain step and with the design. grounds: those that the design was judged on, and the worst of a box that
    were found; on_grounds, before_on_grounds (1, ng). attack: the search for the worst ground of a box; rounds: of
    cutting planes. worst [m/s]: hardest touchdown on any of these grounds, NaN without any; nominal_worst: the same of
    the design for the nominal ground alone. loss [m/s]: of rounding. runs: made in all; settle: periods of a run.
    """

    request: Request
    signal: OnOff
    exact: OnOff
    pairs: int
    before: Landings
    after: Landings
    regime: Regime
    grounds: Grounds
    on_grounds: Landings
    before_on_grounds: Landings
    worst: float
    nominal_worst: float
    attack: Attack | None
    rounds: tuple[Round, ...]
    loss: float
    front: tuple[FrontPoint, ...]
    runs: int
    settle: int
    learning: Learning | None = None
    notes: tuple[str, ...] = field(default=())

    def __repr__(self) -> str:
        return shown.landing_line(self)

    def _repr_html_(self) -> str:
        return shown.landing_html(self)

    @property
    def speed(self) -> float:
        """Hardest touchdown of the whole period on the nominal ground [m/s]."""
        return float(self.after.speed[0, 0])

    @property
    def touchdowns(self) -> float:
        """Touchdowns a step on the nominal ground."""
        return float(self.after.touchdowns[0, 0])

    @property
    def switching_times(self) -> tuple[float, ...]:
        """When each voltage begins [s], from the landing edge on; the period follows from the last duration."""
        return tuple(np.concatenate([[0.0], np.cumsum(self.signal.durations)[:-1]]).tolist())

    @property
    def energies(self) -> tuple[float, float]:
        """Energy a period, plain and with charge recovery [J]; NaN where the drive has no capacitance."""
        squares = period_rises(np.array([self.signal.levels]))
        energy = Energy(self.request.actuator)
        return float(energy.plain(squares)[0]), float(energy.recovered(squares)[0])

    @property
    def scene(self) -> Scene:
        """The scene with the designed signal, whose provenance says so."""
        scene = self.request.scene
        signals = {**scene.signals, self.request.drive: self.signal}
        return override(scene, {"signals": signals}, by="`tarsus design landing`")

    @property
    def plain_signal(self) -> OnOff:
        """The step without pairs, the picture's before."""
        levels, durations = self.request.step.plain()
        return self.request.step.signal(levels[0], durations[0])


def landing(
    scene: Scene | str | PathLike[str],
    foot: str,
    *,
    pairs: int = 1,
    levels: Any = "-8 V, 8 V",
    over: Any = None,
    risk: str | Risk | None = None,
    learn: int = 0,
    progress: Progress | None = None,
    **options: Any,
) -> LandingDesign:
    """Design an on-off signal with which a foot touches down softly, every touchdown of the period counted.

    Parameters
    ----------
    scene
        Or the name of a device, or a scene file. Its drive has a periodic signal: its period, and the share of it
        in which the foot stands, are kept.
    foot
        Name of the foot.
    pairs
        Pairs of switchings beside the two edges of the step, at most; fewer where more are no better.
    levels
        ``"-8 V, 8 V"`` or more listed voltages, or ``"free=-8V:8V"``: any between. The lowest and the highest are held.
    over
        Grounds: a mapping of paths to (low, high), a `tarsus.design.Ensemble`, or a file of draws of `tarsus identify`.
    risk
        ``worst``, ``cvar:q``, ``mean`` or ``nominal``; worst with grounds and nominal without.
    learn
        Steps in which the landing is learned again without a model, on hidden grounds; 0 for none.
    progress
        Called as ``progress(done, total, what)``.
    options
        Fields of `tarsus.design.request.Options`: objective, drive, tick, shortest, ringing, contact, lift, seed,
        threads, effort.

    Raises
    ------
    InputError
        With every problem of the request: an unknown foot, levels beyond the drive's law, an empty box, a foot that
        never lands.
    """
    request = request_of(scene_of(scene), foot, pairs, levels, over, risk, Options(**options))
    return _Designer(request, progress or (lambda done, total, what: None)).design(learn)


class _Designer:
    """The search of one request."""

    def __init__(self, request: Request, progress: Progress) -> None:
        self.request, self.progress = request, progress
        options, step = request.options, request.step
        self.rng = np.random.default_rng([options.seed, 5])
        self.trials = Trials(request.scene, request.drive, request.foot, step.period, threads=options.threads)
        paths = request.over.paths if request.over is not None else ()
        self.nominal = Grounds.nominal(request.scene, paths)
        levels, durations = step.plain()
        self.settle = self._settle()
        self.trials.periods = self.settle
        self.plain = Candidate(levels[0], durations[0], 0)
        before = self.trials(levels, durations, self.nominal)
        if not before.touchdowns[0, 0] > 0.0:
            where = "stays on the ground" if before.contact[0, 0] > 0.0 else "stays in the air"
            raise InputError(
                f"foot '{request.foot}' never lands: with the plain step between {step.lift:g} V and "
                f"{step.support:g} V it {where}"
            )
        self.target = Target(options.objective, before, options.contact, options.lift, options.ringing)
        self.archives: dict[int, tuple[list[Family], Archive]] = {}

    def _settle(self) -> int:
        step = self.request.step
        choices = families(step, 1)
        rng = np.random.default_rng([self.request.options.seed, 7])
        numbers = rng.integers(0, len(choices), SAMPLE)
        placed = step.place(choices, numbers, rng.random((SAMPLE, step.unknowns(1))))
        return settled_periods(self.trials, *placed, self.nominal)

    def budget(self, share: float = 1.0) -> Budget:
        """A search's length: the more unknowns the longer."""
        effort = self.request.options.effort * share
        return Budget(
            max(int(8000 * effort), 64), max(int(60 * effort), 2), max(int(72 * min(effort, 1.5)), 6)
        )

    def score(self, one: Candidate, grounds: Grounds, risk: Risk) -> float:
        return float(risk(self.target.scores(self.trials(*one.rows, grounds)), grounds.weights)[0])

    def nominal_designs(self) -> list[Candidate]:
        """The best design for the nominal ground with 0, 1, ... pairs; none is worse than that with one pair less."""
        found = [self.plain]
        for pairs in range(1, self.request.pairs + 1):
            self.progress(pairs - 1, 2 * self.request.pairs, f"{pairs} pairs, nominal ground")
            choices, archive = self._search(pairs, self.nominal, Nominal(), self.budget())
            self.archives[pairs] = choices, archive
            best = self._candidate(pairs, int(archive.best(1)[0]))
            worse = self.score(best, self.nominal, Nominal()) > self.score(found[-1], self.nominal, Nominal())
            found.append(found[-1] if worse else best)
        return found

    def _search(
        self, pairs: int, grounds: Grounds, risk: Risk, budget: Budget
    ) -> tuple[list[Family], Archive]:
        step = self.request.step
        choices = families(step, pairs)
        cost = self._cost(choices, grounds, risk)
        starts = None
        if pairs - 1 in self.archives:
            before, archive = self.archives[pairs - 1]
            made = [
                step.children(before[archive.numbers[row]], archive.points[row], choices)
                for row in archive.best(3)
            ]
            starts = np.concatenate([n for n, _ in made]), np.concatenate([x for _, x in made])
        return choices, search(cost, len(choices), step.unknowns(pairs), budget, self.rng, starts)

    def _cost(self, choices: list[Family], grounds: Grounds, risk: Risk) -> Callable[..., Floats]:
        def cost(numbers: NDArray[np.int64], points: Floats) -> Floats:
            placed = self.request.step.place(choices, numbers, points)
            return risk(self.target.scores(self.trials(*placed, grounds)), grounds.weights)

        return cost

    def _candidate(self, pairs: int, row: int) -> Candidate:
        choices, archive = self.archives[pairs]
        levels, durations = self.request.step.place(
            choices, archive.numbers[row : row + 1], archive.points[row : row + 1]
        )
        return Candidate(levels[0], durations[0], pairs, int(archive.numbers[row]), archive.points[row])

    def _polished(self, one: Candidate, grounds: Grounds) -> Candidate:
        if not len(one.point):
            return one
        choices = self.archives[one.pairs][0]
        cost = self._cost(choices, grounds, self.request.risk)
        generations = max(int(40 * self.request.options.effort), 4)
        point, _ = polish(cost, one.number, one.point, self.rng, generations=generations)
        levels, durations = self.request.step.place(choices, np.array([one.number]), point[None])
        return replace(one, levels=levels[0], durations=durations[0], point=point)

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
            return self._strike(one, DENSE // 4).score
        return self.score(one, grounds, self.request.risk)

    def _best_of(self, one: Candidate, other: Candidate, grounds: Grounds) -> Candidate:
        return other if self._judge(other, grounds) <= self._judge(one, grounds) else one

    def _on_fixed_grounds(self, pairs: int, grounds: Grounds) -> Candidate:
        choices, archive = self.archives[pairs]
        cost = self._cost(choices, grounds, self.request.risk)
        self.archives[pairs] = choices, self._descended(archive, cost, self.budget(0.5), 24)
        return self._candidate(pairs, int(self.archives[pairs][1].best(1)[0]))

    def _descended(
        self, archive: Archive, cost: Callable[..., Floats], budget: Budget, count: int
    ) -> Archive:
        """The best of an archive judged by another cost, and followed down by it."""
        rows = archive.best(max(8 * count, 64), near=0.03)
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
        choices, archive = self.archives[pairs]
        state = {"archive": archive, "round": 0, "grounds": grounds}

        def improve(points: Floats) -> tuple[Floats, list[Candidate]]:
            active = replace_points(state["grounds"], points)
            state["grounds"] = active
            first = state["round"] == 0
            state["round"] += 1
            cost = self._cost(choices, active, Worst())
            budget = self.budget(1.0 if first else 0.6)
            state["archive"] = self._descended(state["archive"], cost, budget, 32 if first else 12)
            self.archives[pairs] = choices, state["archive"]
            rows = state["archive"].best(3)
            return state["archive"].costs[rows], [self._candidate(pairs, int(row)) for row in rows]

        best, _, rounds = close_gap(improve, lambda one: self._strike(one, 256), grounds.points(), ROUNDS)
        return best, state["grounds"], tuple(rounds)

    def _strike(self, one: Candidate, count: int) -> Attack:
        box = self.request.over
        assert isinstance(box, Box)

        def hurt(points: Floats) -> Floats:
            grounds = replace_points(self.nominal, points)
            return self.target.scores(self.trials(*one.rows, grounds))[0]

        return attack(box, hurt, count, np.random.default_rng([self.request.options.seed, 11]))

    def design(self, learn: int) -> LandingDesign:
        """The whole design."""
        request = self.request
        nominal = self.nominal_designs()
        robust, grounds, rounds = self.robust_designs(nominal)
        chosen = self._best_of(robust[-1], self._polished(robust[-1], grounds), grounds)
        rounded, loss = self._rounded(chosen, grounds)
        struck = self._strike(rounded, DENSE) if isinstance(request.over, Box) else None
        nominal_worst = np.nan
        if struck is not None:
            grounds = grounds.with_more(struck.grounds)
            nominal_worst = self._worst_speed(nominal[-1], self._strike(nominal[-1], DENSE // 4), grounds)
        on_grounds = self.trials(*rounded.rows, grounds)
        worst = float(on_grounds.speed.max()) if request.over is not None else np.nan
        signal = request.step.signal(rounded.levels, rounded.durations)
        learning = None
        if learn:
            learning = learn_on_hidden_grounds(self.trials, request, self.target, rounded.rows, learn)
        return LandingDesign(
            request, signal, request.step.signal(chosen.levels, chosen.durations), chosen.pairs,
            self.target.plain, self.trials(*rounded.rows, self.nominal),
            regime_of(self.trials, *rounded.rows, self.nominal), grounds, on_grounds,
            self.trials(*self.plain.rows, grounds), worst, nominal_worst, struck, rounds, loss,
            self._front(nominal, robust), self.trials.runs, self.settle, learning,
        )  # fmt: skip

    def _worst_speed(self, one: Candidate, struck: Attack, grounds: Grounds) -> float:
        return float(self.trials(*one.rows, grounds.with_more(struck.grounds)).speed.max())

    def _rounded(self, one: Candidate, grounds: Grounds) -> tuple[Candidate, float]:
        """The best neighbour in whole ticks and whole millivolts, and what rounding costs [m/s]."""
        request = self.request
        ticks = neighbours(one.durations, request.ticks, self.rng)
        durations = np.asarray(ticks * (request.step.period / request.ticks), dtype=np.float64)
        levels = np.tile(np.round(one.levels, 3), (len(ticks), 1))
        risk = request.risk
        scores = risk(self.target.scores(self.trials(levels, durations, grounds)), grounds.weights)
        best = int(np.argmin(scores))
        rounded = replace(one, levels=levels[best], durations=durations[best])
        both = [risk(self.trials(*c.rows, grounds).speed, grounds.weights)[0] for c in (one, rounded)]
        return rounded, float(both[1] - both[0])

    def _front(self, nominal: list[Candidate], robust: list[Candidate]) -> tuple[FrontPoint, ...]:
        """Designs that no other beats in both speed and energy: the best with each number of pairs, and those that the
        search met on its way."""
        step, energy = self.request.step, Energy(self.request.actuator)
        rows = [(one.levels, one.durations, one.pairs) for one in (*nominal, *robust)]
        for pairs, (choices, archive) in self.archives.items():
            placed = step.place(choices, archive.numbers, archive.points)
            kept = _undominated(archive.costs, period_rises(placed[0]))
            rows += [(placed[0][i], placed[1][i], pairs) for i in kept[:12]]
        points = []
        for levels, durations, pairs in rows:
            found = self.trials(levels[None], durations[None], self.nominal)
            if self.target.excess(found)[0, 0] > 0.0:
                continue
            squares = period_rises(levels[None])
            points.append(
                FrontPoint(pairs, float(found.speed[0, 0]), np.nan, float(energy.plain(squares)[0]),
                           float(energy.recovered(squares)[0]), step.signal(levels, durations))
            )  # fmt: skip
        rises = np.array([period_rises(np.array([p.signal.levels]))[0] for p in points])
        kept = _undominated(np.array([p.speed for p in points]), rises)
        return tuple(points[i] for i in kept)


def replace_points(grounds: Grounds, points: Floats) -> Grounds:
    """Grounds of the same paths with other values (ng, np), of equal weight."""
    values = {path: points[:, i] for i, path in enumerate(grounds.values)}
    return Grounds(values, np.full(len(points), 1.0 / len(points)))


def _undominated(first: Floats, second: Floats) -> list[int]:
    """Rows that no other is at most as large as in both numbers, the lowest second number first."""
    kept: list[int] = []
    lowest = np.inf
    for row in np.lexsort((first, np.round(second, 6))):
        if first[row] < lowest:
            kept.append(int(row))
            lowest = float(first[row])
    return kept
