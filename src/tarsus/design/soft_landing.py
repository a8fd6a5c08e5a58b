"""Soft touchdown: on-off signals that put a foot down gently (5.2.1 and Fig. 5.1 of the source)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.progress import Progress
from tarsus.base.spec import with_values
from tarsus.design.energy import energies, period_rises
from tarsus.design.headers import neighbours
from tarsus.design.landing_design import FrontPoint, LandingDesign
from tarsus.design.landing_percents import landing_percents
from tarsus.design.landing_request import LandingSettings, Sensor, landing_request
from tarsus.design.landing_search import ATTACKED, BETWEEN, COMPARED, DENSE, ROUNDS, LandingSearch, LandingSignal
from tarsus.design.learning import Learning, learn_on_hidden_grounds
from tarsus.design.pulses import OwnStep
from tarsus.design.request import Given, settings_of
from tarsus.design.trials import regime_of, stated_periods
from tarsus.files.library import SceneLike, as_scene
from tarsus.fit.front import undominated
from tarsus.fit.unknowns import Unknowns
from tarsus.fit.valleys import shorter_steps

if TYPE_CHECKING:
    from tarsus.base.workers import Workers
    from tarsus.design.grounds import Grounds
    from tarsus.model.drive.waveforms import OnOff

Floats = NDArray[np.float64]

SHOWN = 12
"""Signals of the search's front for each number of pairs that are run again for the front of the design."""
RETUNED, TRIED = 6, 8
"""Roundings to ticks whose levels are tuned again, and how many levels are tried about each in a step."""
RETUNING = tuple(3e-3 * 0.7**i for i in range(12))
"""Steps of that, parts of the range of the levels: from what half a tick of a plateau of 100 us is worth to a
millivolt of 16 V."""
STARTS = 48
"""Other starts that a design is put down from: a motion that a twentieth of them lead to is missed once in ten."""


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
        In place of those of the request: pairs of switchings at the two edges of the step, at most (fewer where
        more are no better); levels ``"-8 V, 8 V"`` or more listed voltages, or ``"free=-8V:8V"``, any between; over, a
        mapping of paths to (low, high), `tarsus.design.Grounds`, or a file of draws of `tarsus identify`, and unless
        given the frequencies of the structure within their intervals, or 1 %; risk ``worst``, ``mean``, `cvar`, or
        ``nominal`` for the scene as it is; learn, steps in which the landing is learned on hidden grounds;
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
    options = settings_of(LandingSettings, request, foot=foot, **settings)
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
    options = settings_of(LandingSettings, dict(design.request.options), learn=steps, sensor=sensor)
    search = LandingSearch(replace(design.request, options=options, threads=threads))
    return _learned(search, design.signal, steps)


def _designed(search: LandingSearch) -> LandingDesign:
    """The whole design: both searches, rounding, and what is reported of the best."""
    request, trials, plain = search.request, search.trials, search.plain
    nominal = search.nominal_designs()
    robust, grounds, rounds = search.robust_design(nominal)
    rounded, grounds = _on_timer(search, robust, grounds)
    attack, nominal_worst = None, np.nan
    if isinstance(request.over, Unknowns):
        attack = search.judge.attack(rounded.rows, DENSE)
        grounds = grounds.with_more(attack.grounds[0])
        other = search.judge.attack(nominal[-1].rows, COMPARED)
        nominal_worst = float(trials.on(nominal[-1].rows, grounds.with_more(other.grounds[0])).speed.max())
    trials.periods = stated_periods(trials, rounded.rows, search.nominal)
    on_grounds = trials.on(rounded.rows, grounds)
    exact, whole = (trials.on(one.rows, grounds).speed for one in (robust, rounded))
    loss = request.risk(whole, grounds.weights)[0] - request.risk(exact, grounds.weights)[0]
    signal = request.step.waveform(rounded.row)
    return LandingDesign(
        request,
        signal,
        request.step.waveform(robust.row),
        rounded.pairs,
        search.target.plain,
        trials.on(rounded.rows, search.nominal),
        regime_of(trials, rounded.rows, search.nominal),
        grounds,
        on_grounds,
        trials.on(plain.rows, grounds),
        np.nan if request.over is None else float(on_grounds.speed.max()),
        nominal_worst,
        attack,
        rounds,
        float(loss),
        _front(search, [*nominal, robust]),
        trials.put_down(signal, STARTS),
        landing_percents(trials, rounded.row, with_values(request.scene, {f"signals.{request.drive}": signal})),
        trials.runs,
        trials.periods,
    )


def _learned(search: LandingSearch, signal: OnOff, steps: int) -> Learning:
    """What learners make of a signal in so many steps on hidden grounds."""
    row = np.array([[*signal.levels, *signal.durations]])
    return learn_on_hidden_grounds(search.trials, search.request, search.target, row, steps)


def _on_timer(search: LandingSearch, one: LandingSignal, grounds: Grounds) -> tuple[LandingSignal, Grounds]:
    """The best neighbour in whole ticks and whole millivolts, and the grounds that it was judged on: for the worst of a
    box with those that hurt what is rounded."""
    judge = search.judge
    if not judge.by_planes:
        return replace(one, row=_rounded(search, one, grounds)[0]), grounds

    def improve(active: Grounds) -> Floats:
        return _rounded(search, one, active)[:ATTACKED]

    grounds, _, row = judge.close_gap(improve, None, grounds, BETWEEN, ROUNDS, "timer")
    return replace(one, row=row), grounds


def _rounded(search: LandingSearch, one: LandingSignal, grounds: Grounds) -> Floats:
    """Signals (k, 2S) near one in whole ticks and whole millivolts, the best first; free levels make up for what the
    ticks take."""
    request, step = search.request, search.request.step
    levels, durations = np.split(one.row, 2)
    ticks = neighbours(durations, request.ticks, search.rng)
    spans = np.asarray(ticks * (step.period / request.ticks), dtype=np.float64)
    rows = np.concatenate([np.tile(np.round(levels, 3), (len(ticks), 1)), spans], axis=1)
    scores = search.scores(rows, grounds)
    order = np.argsort(scores, kind="stable")[:RETUNED]
    rows, scores = rows[order], scores[order]
    held = int(np.argmin(np.abs(np.cumsum(durations) - step.supported)))
    moving = [i for i in range(len(levels) - 1) if i != held]
    if step.levels.free and moving and not isinstance(step, OwnStep):
        low, size = step.levels.low, step.levels.high - step.levels.low

        def placed(points: Floats) -> Floats:
            made = np.repeat(rows, points[..., 0].size // len(rows), axis=0)
            made[:, moving] = np.round(low + size * points.reshape(len(made), -1), 3)
            return made

        def cost(points: Floats) -> Floats:
            return search.scores(placed(points), grounds).reshape(points.shape[:2])

        start = (rows[:, moving] - low) / size
        found, scores = shorter_steps(cost, start, scores, RETUNING, TRIED, search.rng)
        rows = placed(found[:, None])
    return rows[np.argsort(scores, kind="stable")]


def _front(search: LandingSearch, signals: list[LandingSignal]) -> tuple[FrontPoint, ...]:
    """Designs that no other beats in both speed and energy: some signals, and those that the search met on its way."""
    step, signals = search.request.step, list(signals)
    for pairs, (choices, visited) in search.visited.items():
        placed = step.place(choices, visited.numbers, visited.points)
        best = _cheapest(_rises(placed), visited.costs)[:SHOWN]
        signals += [LandingSignal(placed[i], pairs) for i in best]
    points, rises = [], []
    for one in signals:
        found = search.trials.on(one.rows, search.nominal)
        if search.target.excess(found)[0, 0] > 0.0:
            continue
        squares = _rises(one.rows)
        rises.append(squares[0])
        plain, recovered = (float(own[0]) for own in energies(search.request.actuator, squares))
        points.append(FrontPoint(one.pairs, float(found.speed[0, 0]), plain, recovered, step.waveform(one.row)))
    return tuple(points[i] for i in _cheapest(np.array(rises), np.array([one.speed for one in points])))


def _rises(signals: Floats) -> Floats:
    return period_rises(np.split(signals, 2, axis=1)[0])


def _cheapest(rises: Floats, costs: Floats) -> list[int]:
    """Rows that no other is at most as large as in both numbers, the lowest rises [V^2] first; a microvolt squared is
    none."""
    both = np.stack([np.round(rises, 6), costs], axis=1)
    rows = np.flatnonzero(undominated(both))
    return rows[np.argsort(both[rows, 0], kind="stable")].tolist()
