"""What a record would show of the numbers of a device: information from derivatives, before it is taken.

A record shows y(theta) with noise of a standard deviation s: its information on the logarithms of the numbers theta is
``J'J``, J the derivatives of y by them over s, and no unbiased estimate from it leaves of number k a variance below
``((J'J)^-1)_kk`` (Cramer 1946, section 32.3; Rao 1945). Derivatives of motion with impacts by its start grow from
impact to impact, and no descent follows them through many: as an identification does, a record is cut into windows of a
few impacts, each with an unknown start of its own. Starts and zeros of instruments are eliminated (Schur complement);
gains of channels are numbers like the others, for all records have the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.events import CONTACT_BEGINS, EventKind
from tarsus.base.quantities import Quantity
from tarsus.fit.record_problem import RecordProblem, Seen, SeenRecord, Segment
from tarsus.fit.unknowns import Prior
from tarsus.model.scene import Scene
from tarsus.solve import Contacts, Output, ResultCode, Run, simulate
from tarsus.synthesis.recordings import Recording, outputs_of, placed

IMPACTS = 3
"""Impacts of a window: as many as a descent from numbers a tenth off followed on a walker (5 ms of the millipede)."""
LEAST = 3
"""Samples of a window at least: fewer than its start has numbers show nothing beyond it."""
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
        size = np.maximum(np.sqrt(np.mean(values**2, axis=1)), np.finfo(float).tiny)
        return np.array(
            [self.noise.get(one.quantity) or self.share[one.quantity] * size[k] for k, one in enumerate(outputs)]
        )


@dataclass(frozen=True)
class RecordInformation:
    """Information (np, np) about logarithms of numbers by name, gains of channels among them."""

    names: tuple[str, ...]
    matrix: Floats

    def about(self, names: Sequence[str]) -> Floats:
        """The same among other names, of which it may hold nothing."""
        out = np.zeros((len(names), len(names)))
        at = [names.index(name) for name in self.names]
        out[np.ix_(at, at)] = self.matrix
        return out


def gains_of(each: Iterable[RecordInformation]) -> tuple[str, ...]:
    """Names of all gains that records show."""
    return tuple(dict.fromkeys(name for one in each for name in one.names if name.startswith(_GAIN)))


def deviations(information: Floats) -> Floats:
    """Standard deviations (..., np) of logarithms that information (..., np, np) leaves, `NOWHERE` at most."""
    whole = information + np.eye(information.shape[-1]) / NOWHERE**2
    size = np.sqrt(np.einsum("...ii->...i", whole))
    inverse = np.linalg.inv(whole / size[..., :, None] / size[..., None, :])
    return np.sqrt(np.einsum("...ii->...i", inverse)) / size


def expected_information(
    scene: Scene,
    recording: Recording,
    unknown: Mapping[str, Mapping[str, float]],
    sensing: Sensing | None = None,
    *,
    drive: str = "",
    impacts: int | None = IMPACTS,
) -> RecordInformation:
    """What one record would show of numbers.

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
    outputs = [one for one in outputs_of(there, recording) if one.quantity in tool.noise or one.quantity in tool.share]
    if not outputs:
        raise InputError(f"'{recording.name}': the instruments show nothing of it")
    run = simulate(there, recording.duration)
    if run.ended is not ResultCode.DONE:
        raise InputError(f"'{recording.name}' cannot be recorded: {run.ended}")
    rate = tool.rate / recording.share
    times = np.arange(1, int(np.floor(recording.duration * rate * (1.0 + 1e-12))) + 1) / rate
    values = run.outputs(outputs, times)
    noise = tool.levels(outputs, values)
    channels, priors = list[Seen](), dict.fromkeys(unknown, Prior(0.0, sd=1.0))
    for one, level in zip(outputs, noise.tolist(), strict=True):
        zero = f"zero of {one.name}" if one.quantity is Quantity.DISPLACEMENT and tool.zero else 0.0
        channels.append(Seen(one, level, gain=f"{_GAIN}{one.name}", zero=zero))
    names = (*unknown, *(str(one.gain) for one in channels))
    priors |= dict.fromkeys(names[len(unknown) :], Prior(1.0, sd=1.0))
    priors |= {one.zero: Prior(0.0, sd=tool.zero) for one in channels if isinstance(one.zero, str)}
    problem = RecordProblem((there,), (SeenRecord(tuple(channels), times, values),), priors, unknown)
    segments = _segments(run, times, impacts)
    start = np.zeros((len(segments), len(segments[0].state)))
    found = problem.equations(segments, start, np.zeros(len(priors)))
    information = found.reduced()[0].sum(axis=0)
    across, rest = information[: len(names), len(names) :], information[len(names) :, len(names) :]
    left = np.linalg.solve(rest + np.eye(len(rest)), across.T)  # zeros are unknown within their spread
    return RecordInformation(names, information[: len(names), : len(names)] - across @ left)


_GAIN = "gain of "


def _segments(run: Run, times: Floats, impacts: int | None) -> list[Segment]:
    """Windows of a run that end between impacts; the first starts as the run does, which is known."""
    events = run.all_events
    hits = events["time"][np.isin(events["kind"], [*CONTACT_BEGINS, EventKind.BOUNCE])]
    begins = [0]
    for at in np.searchsorted(times, 0.5 * (hits[:-1] + hits[1:])[impacts - 1 :: impacts] if impacts else ()):
        if at - begins[-1] >= LEAST and len(times) - at >= LEAST:
            begins.append(int(at))
    edges = np.array([0.0, *times[np.array(begins[1:], dtype=int) - 1], times[-1]])
    there, n = run.states(edges[:-1]), len(run.plan.system.mass)
    states, spread = np.concatenate([there.x, there.v]), np.repeat([LENGTH, SPEED], n)
    out = [Segment(0, 0.0, (0.0, float(edges[1])), run.plan.initial, np.zeros(2 * n))]
    for w, (begin, end) in enumerate(pairwise(edges[1:].tolist()), start=1):
        held = [int(i) for i in np.flatnonzero(there.held[:, w])]
        own = [events[np.isin(events["kind"], CONTACT_BEGINS) & (events["foot"] == i)]["time"] for i in held]
        since = [float(one[one <= begin].max(initial=0.0)) for one in own]
        out.append(Segment(0, begin, (begin, end), states[:, w], spread, Contacts(held, since)))
    return out
