"""What a record would tell of the numbers of a device: information from exact derivatives, before it is taken.

A record shows y(theta) with noise of a standard deviation s: it tells ``J'J`` of the logarithms of the numbers theta, J
the derivatives of y by them over s, and no unbiased estimate from it leaves of number k a variance below
``((J'J)^-1)_kk`` (Cramer 1946, section 32.3; Rao 1945). Derivatives of motion with impacts by its start grow from
impact to impact, and no descent follows them through many: as an identification does, a record is cut into windows of a
few impacts, each with a start of its own that nobody knows. Starts and zeros of instruments are eliminated (Schur
complement); gains of channels are numbers beside the others, for all records have the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.events import CONTACT_BEGINS, EventKind
from tarsus.base.quantities import Quantity
from tarsus.fit.normal_equations import NormalEquations
from tarsus.model.scene import Scene
from tarsus.plan.lowering import lower_scene
from tarsus.solve import Run, simulate
from tarsus.solve.codes import ResultCode
from tarsus.solve.contacts import Contacts
from tarsus.solve.outputs import Output, output_slopes
from tarsus.solve.tangents import Direction
from tarsus.solve.window import WindowGradients, WindowStart, simulate_windows
from tarsus.synthesis.recordings import Instrument, Recording, outputs_of, placed

Floats = NDArray[np.float64]

IMPACTS = 3
"""Impacts of a window: as many as a descent from numbers a tenth off followed on a walker (5 ms of the millipede)."""
LEAST = 3
"""Samples of a window at least: fewer than its start has numbers tell nothing beyond it."""
LENGTH, SPEED = 1e-3, 1.0
"""Standard deviations of displacements and velocities of a start before it is seen: beyond what such a robot does."""
NOWHERE = 1e2
"""Standard deviation of a logarithm that says nothing: a factor of 1e43."""


@dataclass(frozen=True)
class Sensing:
    """What instruments show of a sample, and how well they are known.

    rate [Hz]; noise: standard deviation of a sample by quantity [SI]; share: the same in parts of the root mean square
    of what is shown; other quantities are not seen. gain: standard deviation of the logarithm of a channel's gain; zero
    [m]: that of the zero of a displacement, in each record another.
    """

    rate: float = 20e3
    noise: Mapping[Quantity, float] = field(
        default_factory=lambda: {
            Quantity.DISPLACEMENT: 1e-7,
            Quantity.VELOCITY: 5e-5,
            Quantity.ANGLE: 2e-5,  # a displacement over an arm of 5 mm
            Quantity.ANGULAR_VELOCITY: 1e-2,
        }
    )
    share: Mapping[Quantity, float] = field(default_factory=lambda: {Quantity.CURRENT: 0.01})
    gain: float = 0.01
    zero: float = 1e-6

    def levels(self, outputs: Sequence[Output], values: Floats) -> Floats:
        """Noise (nc,) of outputs that show values (nc, nt)."""
        size = np.sqrt(np.mean(values**2, axis=1))
        return np.array(
            [
                self.noise.get(one.quantity) or self.share[one.quantity] * size[k]
                for k, one in enumerate(outputs)
            ]
        )


@dataclass(frozen=True)
class Told:
    """Information (np, np) about logarithms of numbers by name, gains of channels among them."""

    names: tuple[str, ...]
    matrix: Floats

    def about(self, names: Sequence[str]) -> Floats:
        """The same among other names, of which it may tell nothing."""
        out = np.zeros((len(names), len(names)))
        at = [names.index(name) for name in self.names]
        out[np.ix_(at, at)] = self.matrix
        return out


def gains_of(told: Iterable[Told]) -> tuple[str, ...]:
    """Names of all gains that records show."""
    return tuple(dict.fromkeys(name for one in told for name in one.names if name.startswith(_GAIN)))


def deviations(information: Floats) -> Floats:
    """Standard deviations (..., np) of logarithms that information (..., np, np) leaves, `NOWHERE` at most."""
    whole = information + np.eye(information.shape[-1]) / NOWHERE**2
    size = np.sqrt(np.einsum("...ii->...i", whole))
    inverse = np.linalg.inv(whole / size[..., :, None] / size[..., None, :])
    return np.sqrt(np.einsum("...ii->...i", inverse)) / size


def told_by(
    scene: Scene,
    recording: Recording,
    unknown: Mapping[str, Direction],
    sensing: Sensing | None = None,
    *,
    drive: str = "",
    impacts: int | None = IMPACTS,
) -> Told:
    """What one record would tell of numbers.

    Parameters
    ----------
    scene
        The device as believed.
    recording
        What is driven and recorded.
    unknown
        Numbers by name, as directions: how much each number at a path moves for one of the logarithm, its value for a
        number alone.
    sensing
        The instruments.
    drive
        Name of the drive of a recording with one signal.
    impacts
        Impacts of each window; None: no windows, the whole record goes on from its known start. That is the bound for
        any estimator, and of long records with many impacts one that none reaches.

    Raises
    ------
    InputError
        If the simulation does not reach its end, nothing that is recorded is seen, or a number cannot vary.
    """
    tool = sensing or Sensing()
    there = placed(scene, recording, drive)
    outputs = [
        one for one in outputs_of(there, recording, Instrument())
        if one.quantity in tool.noise or one.quantity in tool.share
    ]  # fmt: skip
    if not outputs:
        raise InputError(f"'{recording.name}': the instruments show nothing of it")
    plan, run = lower_scene(there), simulate(there, recording.duration)
    if run.ended is not ResultCode.DONE:
        raise InputError(f"'{recording.name}' cannot be recorded: {run.ended}")
    rate = tool.rate / recording.share
    times = np.arange(1, int(np.floor(recording.duration * rate * (1.0 + 1e-12))) + 1) / rate
    starts = _windows(run, plan.initial, times, impacts)
    by = WindowGradients.of(there, plan, unknown, recording.duration, state=len(starts) > 1, t0=False)
    batch = simulate_windows(plan, starts, gradients=by)
    assert batch.slopes is not None
    slopes = output_slopes(there, outputs, batch.times, batch.states, batch.slopes, unknown, plan)
    seen = run.outputs(outputs, batch.times)
    noise = tool.levels(outputs, seen)
    alive = noise > 0.0  # what does not move tells nothing
    scaled = slopes[alive] / noise[alive, None, None]
    zeros = [one.quantity is Quantity.DISPLACEMENT for one, live in zip(outputs, alive, strict=True) if live]
    shared = np.concatenate(
        [scaled[..., : len(unknown)], _apart(seen[alive] / noise[alive, None]),
         _apart(np.repeat(np.where(zeros, tool.zero, 0.0)[:, None] / noise[alive, None], seen.shape[1], axis=1))],
        axis=-1,
    )  # fmt: skip
    own = [_free(there, one) for one in starts]
    rows = [
        _window_rows(scaled[:, at, len(unknown) :], shared[:, at], free)
        for at, free in zip(map(slice, batch.first[:-1], batch.first[1:]), own, strict=True)
    ]
    states = scaled.shape[-1] - len(unknown)
    equations = NormalEquations.of([np.zeros(len(one)) for one in rows], rows, states).ridged(np.eye(states))
    names = (*unknown, *(f"{_GAIN}{one.name}" for one, live in zip(outputs, alive, strict=True) if live))
    return Told(names, _without_zeros(equations.reduced()[0].sum(axis=0), len(names)))


_GAIN = "gain of "


def _apart(rows: Floats) -> Floats:
    """Derivatives (nc, nt, nc) by a number of each channel of its own, of which rows (nc, nt) are those."""
    return rows[..., None] * np.eye(len(rows))[:, None]


def _window_rows(own: Floats, shared: Floats, free: Floats | None) -> Floats:
    """Derivatives of what a window shows (n, q + p): by the part of its start that is free, none of a known one, then
    by what all windows share. What comes after an event without derivatives tells nothing."""
    if own.shape[-1]:
        own = np.zeros_like(own) if free is None else own @ free
    rows = np.concatenate([own, shared], axis=-1).reshape(-1, own.shape[-1] + shared.shape[-1])
    rows[~np.isfinite(rows).all(axis=1)] = 0.0
    return rows


def _without_zeros(information: Floats, names: int) -> Floats:
    """Information about the first numbers, those after them being unknown within one."""
    rest = information[names:, names:] + np.eye(len(information) - names)
    across = information[:names, names:]
    return information[:names, :names] - across @ np.linalg.solve(rest, across.T)


def _windows(run: Run, initial: Floats, times: Floats, impacts: int | None) -> list[WindowStart]:
    """Windows of a run that end in the middle between impacts; the first starts as the run does."""
    events = run.all_events
    hits = events["time"][np.isin(events["kind"], [*CONTACT_BEGINS, EventKind.BOUNCE])]
    begins = [0]
    if impacts is not None:
        middle = 0.5 * (hits[:-1] + hits[1:])[impacts - 1 :: impacts]
        for at in np.searchsorted(times, middle):
            if at - begins[-1] >= LEAST and len(times) - at >= LEAST:
                begins.append(int(at))
    ends = [*begins[1:], len(times)]
    starts = [WindowStart(initial, 0.0, times[: ends[0]])]
    at = run.states(times[np.array(begins[1:], dtype=int) - 1])
    for w, (first, last) in enumerate(zip(begins[1:], ends[1:], strict=True)):
        begin, held = float(times[first - 1]), [int(i) for i in np.flatnonzero(at.held[:, w])]
        own = [events[np.isin(events["kind"], CONTACT_BEGINS) & (events["foot"] == i)]["time"] for i in held]
        since = [float(one[one <= begin].max(initial=0.0)) for one in own]
        state = np.concatenate([at.x[:, w], at.v[:, w]])
        starts.append(WindowStart(state, begin, times[first:last], Contacts(held, since)))
    return starts


def _free(scene: Scene, start: WindowStart) -> Floats | None:
    """Directions (2n, 2n) of a start that held feet leave free, in its units; none of one that is known."""
    if start.t0 == 0.0:
        return None
    structure, feet = scene.robot.structure, list(scene.robot.feet.values())
    rows = np.array([structure.row(feet[i].point) for i in start.contacts.held]).reshape(-1, structure.size)
    free = np.eye(structure.size) - np.linalg.pinv(rows) @ rows
    return np.asarray(np.kron(np.diag([LENGTH, SPEED]), free), dtype=np.float64)
