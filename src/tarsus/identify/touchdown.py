"""When the contacts before detachments began.

Adhesion grows from the last touchdown on (2.14). A foot that lands bounces, or is released again at once, and the last
of these rebounds are lower than the noise and shorter than a few samples: the record shows a contact that begins too
early. The device as found so far, simulated with the same drive, shows the touchdowns between. They are believed where
the simulation shows the contact begin and end where the record does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.events import CONTACT_BEGINS, EventKind
from tarsus.identify.film import FilmFit
from tarsus.identify.foot import FootModel
from tarsus.identify.traces import Trace
from tarsus.model.drive.waveforms import Waveform

_BEGIN = 1.5
"""Samples, at the beginning: a landing is seen to one sample, and its noise adds half of one."""
_END = 2.0
"""Samples within which a simulated contact must begin and end where the recorded one does."""
_TRUST = 0.2
"""Part of the time between the touchdown that is seen and the last one by which the simulation may be wrong."""


@dataclass(frozen=True)
class ContactDurations:
    """Durations (nr,) [s] of the contacts before detachments and their standard errors; simulated (nr,): whether the
    last touchdown is a simulation's."""

    duration: Floats
    error: Floats
    simulated: NDArray[np.bool_]


def seen_contacts(film: FilmFit) -> ContactDurations:
    """Contacts that begin where the record shows a foot standing still."""
    duration = film.pulls.duration
    return ContactDurations(duration, film.offs.beginnings(), np.zeros(len(duration), dtype=bool))


def simulated_contacts(model: FootModel, film: FilmFit, signals: Mapping[str, Waveform]) -> ContactDurations:
    """Contacts that begin with the last touchdown of a simulation, where it agrees with the record.

    Parameters
    ----------
    model
        The device as found so far, restitution and a first adhesion included.
    film
        Detachments and their moments.
    signals
        Drive of each set of records; contacts of other sets stay as they are seen.
    """
    seen, offs, late = seen_contacts(film), film.offs, film.fitted.unknowns[:, 0]
    duration, error, simulated = seen.duration.copy(), seen.error.copy(), seen.simulated.copy()
    sets = {offs.traces[one.trace].set for one in offs.items}
    events = {name: _contacts(model, offs.traces, name, signals[name]) for name in sets if name in signals}
    for r, one in enumerate(offs.items):
        trace = offs.traces[one.trace]
        released = float(trace.time[one.first] - late[r])
        begins, ends = events.get(trace.set, (np.zeros(0), np.zeros(0)))
        if not len(ends):
            continue
        k = int(np.argmin(np.abs(ends - released)))
        began = released - seen.duration[r]
        first = int(np.argmin(np.abs(begins - began)))
        agree = abs(begins[first] - began) < _BEGIN * offs.step and abs(ends[k] - released) < _END * offs.step
        if first > k or not agree:
            continue
        duration[r] = released - begins[k]
        error[r] = np.hypot(released - ends[k], _TRUST * (begins[k] - begins[first]))
        simulated[r] = True
    return ContactDurations(duration, error, simulated)


def _contacts(model: FootModel, traces: Sequence[Trace], name: str, signal: Waveform) -> tuple[Floats, Floats]:
    """Beginnings and ends (nc,) [s] of the contacts that a simulation with one set's drive shows; of a run that stops
    early, those before."""
    until = max(float(t.time[-1]) for t in traces if t.set == name)
    _, events, _ = model.run(model.driven(signal), until, np.zeros(0))
    events = events[np.isin(events["kind"], (*CONTACT_BEGINS, EventKind.RELEASE))]
    ended = np.flatnonzero(events["kind"][1:] == EventKind.RELEASE)
    ended = ended[np.isin(events["kind"][ended], CONTACT_BEGINS)]
    return events["time"][ended], events["time"][ended + 1]
