"""Soft touchdown: on-off signals that put a foot down gently (5.2.1 and Fig. 5.1 of the source)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.design import shown
from tarsus.design.energy import Energy, period_rises
from tarsus.design.landing_search import DENSE, Candidate, Searcher
from tarsus.design.learning import Learning, learn_on_hidden_grounds
from tarsus.design.over import Box, Grounds
from tarsus.design.pulses import families
from tarsus.design.request import Options, Request, request_of
from tarsus.design.risk import Risk
from tarsus.design.settling import Regime, regime_of, settled_periods
from tarsus.design.target import Target
from tarsus.design.timer import neighbours
from tarsus.design.trials import Landings, Trials
from tarsus.design.worst_ground import Attack, Round
from tarsus.files.library import SceneLike, as_scene
from tarsus.model.drive.waveforms import OnOff
from tarsus.model.scene import Scene, override

__all__ = ["FrontPoint", "LandingDesign", "landing"]

Floats = NDArray[np.float64]
Progress = Callable[[int, int, str], None]

SAMPLE = 48
"""Signals that the time to settle is measured on."""

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
    scene: SceneLike,
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
        Steps in which the landing is learned on hidden grounds, from a scalar or a bit a step; 0 for none.
    progress
        Called as ``progress(done, total, what)``.
    options
        Fields of `tarsus.design.request.Options`: objective, drive, tick, shortest, ringing, contact, lift, seed,
        threads, effort.

    Returns
    -------
    LandingDesign
        The signal, landing speeds [m/s] of step and design, and what they are on every ground.

    Raises
    ------
    InputError
        With every problem of the request: an unknown foot, levels beyond the drive's law, an empty box, a foot that
        never lands.
    """
    if learn < 0:
        raise InputError(f"learn: expected 0 or more steps, got {learn}")
    request = request_of(as_scene(scene), foot, pairs, levels, over, risk, Options(**options))
    return _Designer(request, progress or (lambda done, total, what: None)).design(learn)


class _Designer:
    """The design of one request: what the plain step does, the searches, and what is told of the best."""

    def __init__(self, request: Request, progress: Progress) -> None:
        self.request = request
        options, step = request.options, request.step
        self.trials = Trials(request.scene, request.drive, request.foot, step.period, threads=options.threads)
        paths = request.over.paths if request.over is not None else ()
        self.nominal = Grounds.nominal(request.scene, paths)
        levels, durations = step.plain()
        self.settle = self._settle()
        self.trials.periods = self.settle
        plain = Candidate(levels[0], durations[0], 0)
        before = self.trials(levels, durations, self.nominal)
        if not before.touchdowns[0, 0] > 0.0:
            where = "stays on the ground" if before.contact[0, 0] > 0.0 else "stays in the air"
            raise InputError(
                f"foot '{request.foot}' never lands: with the plain step between {step.lift:g} V and "
                f"{step.support:g} V it {where}"
            )
        self.target = Target(options.objective, before, options.contact, options.lift, options.ringing)
        self.search = Searcher(request, self.trials, self.target, plain, progress)

    def _settle(self) -> int:
        step = self.request.step
        choices = families(step, 1)
        rng = np.random.default_rng([self.request.options.seed, 7])
        numbers = rng.integers(0, len(choices), SAMPLE)
        placed = step.place(choices, numbers, rng.random((SAMPLE, step.unknowns(1))))
        return settled_periods(self.trials, *placed, self.nominal)

    def design(self, learn: int) -> LandingDesign:
        """The whole design."""
        request = self.request
        nominal = self.search.nominal_designs()
        robust, grounds, rounds = self.search.robust_designs(nominal)
        chosen = robust[-1]
        rounded, loss = self._rounded(chosen, grounds)
        struck = self.search.strike(rounded, DENSE) if isinstance(request.over, Box) else None
        nominal_worst = np.nan
        if struck is not None:
            grounds = grounds.with_more(struck.grounds)
            nominal_worst = self._worst_speed(nominal[-1], self.search.strike(nominal[-1], DENSE // 4), grounds)
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
            self.trials(*self.search.plain.rows, grounds), worst, nominal_worst, struck, rounds, loss,
            self._front(nominal, robust), self.trials.runs, self.settle, learning,
        )  # fmt: skip

    def _worst_speed(self, one: Candidate, struck: Attack, grounds: Grounds) -> float:
        return float(self.trials(*one.rows, grounds.with_more(struck.grounds)).speed.max())

    def _rounded(self, one: Candidate, grounds: Grounds) -> tuple[Candidate, float]:
        """The best neighbour in whole ticks and whole millivolts, and what rounding costs [m/s]."""
        request = self.request
        ticks = neighbours(one.durations, request.ticks, self.search.rng)
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
        for pairs, (choices, archive) in self.search.archives.items():
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


def _undominated(first: Floats, second: Floats) -> list[int]:
    """Rows that no other is at most as large as in both numbers, the lowest second number first."""
    kept: list[int] = []
    lowest = np.inf
    for row in np.lexsort((first, np.round(second, 6))):
        if first[row] < lowest:
            kept.append(int(row))
            lowest = float(first[row])
    return kept
