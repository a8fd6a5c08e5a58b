"""What a slow drive still moves: the motion of the points less the static one, along a record in the air.

Every corner of a slow voltage, where its slope changes by dV', sets each mode ringing by ``dV' / omega`` volts. The
mode rings for about ``1 / (zeta omega)``: with a soft robot as long as a straight run of its loops, and a mean over
few such runs does not average it out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tarsus.identify.flight import SUBSTEPS, FilmConstants, Launches, Varied, of_model
from tarsus.identify.foot import FootModel
from tarsus.identify.traces import Trace

_AWAY = 10.0
"""Own gaps of the device from which on the ground counts as away: a film damps a thousandth of what it does there."""


def calmed(model: FootModel, trace: Trace) -> Trace:
    """A record without the ringing (displacements less what they are beyond ``by_drive F``), by the model's structure
    and drive; as it is where the ground is near, whose film and contacts end the ringing."""
    if trace.gap is None or trace.gap < _AWAY * model.gap:
        return trace
    force = trace.between.force(model.law, model.history, 0, len(trace.volts))
    start = np.zeros(len(model.flow))
    start[: len(model.row)] = np.linalg.solve(model.stiffness, model.load) * force[0]
    none, two = np.zeros(1), np.zeros((1, 2))
    launch = Launches(
        Varied(start[None]), Varied(none), Varied(two), Varied(FilmConstants(0.0, 1.0).law().value[None]),
        np.array([trace.gap]), two, 1.0,
    )  # fmt: skip
    flow, seen = of_model(model, trace.step / SUBSTEPS), np.pad(model.rows, ((0, 0), (0, len(model.row))))
    moved = flow.fly(launch, force[None], np.array([len(trace.time)]), seen)[0].T
    return replace(trace, x=trace.x - (moved - np.outer(model.by_drive, force[::SUBSTEPS])))
