"""Soft touchdown: on-off signals that put a foot down gently (5.2.1 and Fig. 5.1 of the source)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.workers import Workers
from tarsus.design.energy import Energy, period_rises
from tarsus.design.grounds import Grounds
from tarsus.design.judge import Attack, Round
from tarsus.design.landing_files import landing_data, landing_line, landing_table, write_landing
from tarsus.design.landing_request import LandingRequest, LandingSettings, Sensor, landing_request
from tarsus.design.landing_search import COMPARED, DENSE, LandingSearch, Signal
from tarsus.design.learning import Learning, learn_on_hidden_grounds
from tarsus.design.request import Given, settings_of
from tarsus.design.settling import Regime, regime_of
from tarsus.design.timer import neighbours
from tarsus.design.trials import Landings
from tarsus.files.library import SceneLike, as_scene
from tarsus.fit.front import undominated
from tarsus.fit.unknowns import Unknowns
from tarsus.model.drive.waveforms import OnOff
from tarsus.model.scene import Scene, override
from tarsus.tables.table import Table

__all__ = ["FrontPoint", "LandingDesign", "landing", "learn"]

Floats = NDArray[np.float64]
Progress = Callable[[int, int, str], None]

SHOWN = 12
"""Signals of the search's front for each number of pairs that are run again for the front of the design."""


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

    request: LandingRequest
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
        return f"<{landing_line(self)}>"

    def __str__(self) -> str:
        return str(self.table())

    def _repr_html_(self) -> str:
        return self.table().html()

    def table(self) -> Table:
        """The plateaus of the signal, and how softly it lands."""
        return landing_table(self)

    def to_dict(self) -> dict[str, Any]:
        """Plain data in SI units: what ``--json`` prints."""
        return landing_data(self)

    def write(self, folder: str | Path) -> Path:
        """Write everything but the report into a folder; returns it. Raises InputError where it cannot be written."""
        return write_landing(self, folder)

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
        return self.request.step.waveform(self.request.step.plain()[0])


def landing(
    scene: SceneLike,
    foot: str | None = None,
    *,
    request: Given = None,
    threads: Workers = None,
    progress: Progress | None = None,
    **settings: Any,
) -> LandingDesign:
    """Design an on-off signal with which a foot touches down softly, every touchdown of the period counted.

    Parameters
    ----------
    scene
        Or the name of a device, or a scene file. Its drive has a periodic signal: its period, and the share of it
        in which the foot stands, are kept.
    foot
        Name of the foot.
    request
        Settings as a mapping or a TOML file, see `tarsus.design.settings_text`.
    threads
        Worker threads, or an executor.
    progress
        Called as ``progress(done, total, what)``.
    settings
        In place of those of the request: pairs of switchings beside the two edges of the step, at most (fewer where
        more are no better); levels ``"-8 V, 8 V"`` or more listed voltages, or ``"free=-8V:8V"``, any between; over, a
        mapping of paths to (low, high), `tarsus.design.Grounds`, or a file of draws of `tarsus identify`; risk
        ``worst``, ``cvar:q``, ``mean`` or ``nominal``; learn, steps in which the landing is learned on hidden grounds;
        drive, free, objective, contact, lift, ringing, effort, seed, tick, shortest, sensor.

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
    given = settings | ({} if foot is None else {"foot": foot})
    options = settings_of(LandingSettings, request, given)
    search = LandingSearch(landing_request(as_scene(scene), options, threads), progress)
    design = _designed(search)
    if options.learn:
        return replace(design, learning=_learned(search, design.signal, options.learn))
    return design


def learn(
    design: LandingDesign, steps: int = 30, sensor: Sensor | str | None = None, *, threads: Workers = None
) -> Learning:
    """Let a landing go on being learned on hidden grounds, from a scalar or a bit a step.

    Parameters
    ----------
    design
        Of `landing`: what the learner begins with, and over which grounds.
    steps
        Of each learner.
    sensor
        What is measured of each step, ``speed`` or ``contact``; that of the design's request unless given.
    threads
        Worker threads, or an executor.

    Raises
    ------
    InputError
        For no steps, and for another sensor.
    """
    given = {"learn": steps} | ({} if sensor is None else {"sensor": sensor})
    options = settings_of(LandingSettings, {**dict(design.request.options), **given})
    search = LandingSearch(replace(design.request, options=options, threads=threads))
    return _learned(search, design.signal, steps)


def _designed(search: LandingSearch) -> LandingDesign:
    """The whole design: both searches, rounding, and what is reported of the best."""
    request, trials, plain = search.request, search.trials, search.plain
    nominal = search.nominal_designs()
    robust, grounds, rounds = search.robust_designs(nominal)
    rounded = _rounded(search, robust[-1], grounds)
    attack, nominal_worst = None, np.nan
    if isinstance(request.over, Unknowns):
        attack = search.judge.attack(rounded.rows, DENSE)
        grounds = grounds.with_more(attack.grounds[0])
        other = search.judge.attack(nominal[-1].rows, COMPARED)
        nominal_worst = float(trials.on(nominal[-1].rows, grounds.with_more(other.grounds[0])).speed.max())
    on_grounds = trials.on(rounded.rows, grounds)
    exact, whole = (trials.on(one.rows, grounds).speed for one in (robust[-1], rounded))
    loss = request.risk(whole, grounds.weights)[0] - request.risk(exact, grounds.weights)[0]
    return LandingDesign(
        request, request.step.waveform(rounded.row), request.step.waveform(robust[-1].row), rounded.pairs,
        search.target.plain, trials.on(rounded.rows, search.nominal), regime_of(trials, rounded.rows, search.nominal),
        grounds, on_grounds, trials.on(plain.rows, grounds),
        np.nan if request.over is None else float(on_grounds.speed.max()), nominal_worst, attack, rounds, float(loss),
        _front(search, nominal, robust), trials.runs, trials.periods,
    )  # fmt: skip


def _learned(search: LandingSearch, signal: OnOff, steps: int) -> Learning:
    """What learners make of a signal in so many steps on hidden grounds."""
    row = np.array([[*signal.levels, *signal.durations]])
    return learn_on_hidden_grounds(search.trials, search.request, search.target, row, steps)


def _rounded(search: LandingSearch, one: Signal, grounds: Grounds) -> Signal:
    """The best neighbour in whole ticks and whole millivolts."""
    request = search.request
    levels, durations = np.split(one.row, 2)
    ticks = neighbours(durations, request.ticks, search.rng)
    spans = np.asarray(ticks * (request.step.period / request.ticks), dtype=np.float64)
    rows = np.concatenate([np.tile(np.round(levels, 3), (len(ticks), 1)), spans], axis=1)
    return replace(one, row=rows[int(np.argmin(search.scores(rows, grounds)))])


def _front(search: LandingSearch, nominal: list[Signal], robust: list[Signal]) -> tuple[FrontPoint, ...]:
    """Designs that no other beats in both speed and energy: the best with each number of pairs, and those that the
    search met on its way."""
    step, energy = search.request.step, Energy(search.request.actuator)
    signals = [*nominal, *robust]
    for pairs, (choices, visited) in search.visited.items():
        placed = step.place(choices, visited.numbers, visited.points)
        best = _cheapest(_rises(placed), visited.costs)[:SHOWN]
        signals += [Signal(placed[i], pairs) for i in best]
    points, rises = [], []
    for one in signals:
        found = search.trials.on(one.rows, search.nominal)
        if search.target.excess(found)[0, 0] > 0.0:
            continue
        squares = _rises(one.rows)
        rises.append(squares[0])
        points.append(
            FrontPoint(one.pairs, float(found.speed[0, 0]), np.nan, float(energy.plain(squares)[0]),
                       float(energy.recovered(squares)[0]), step.waveform(one.row))
        )  # fmt: skip
    return tuple(points[i] for i in _cheapest(np.array(rises), np.array([one.speed for one in points])))


def _rises(signals: Floats) -> Floats:
    return period_rises(np.split(signals, 2, axis=1)[0])


def _cheapest(rises: Floats, costs: Floats) -> list[int]:
    """Rows that no other is at most as large as in both numbers, the lowest rises [V^2] first; a microvolt squared is
    none."""
    both = np.stack([np.round(rises, 6), costs], axis=1)
    rows = np.flatnonzero(undominated(both))
    return rows[np.argsort(both[rows, 0], kind="stable")].tolist()
