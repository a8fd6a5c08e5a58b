"""Lowering: a waveform through a force law as piecewise polynomials of time, exact to 1e-12 of their span.

Waveforms are cut where they turn, jump or change their formula, laws add the instants at which plays engage
or branches switch, and what remains smooth is cut further only as degree 11 needs. Of a periodic drive with
memory the first period is kept apart: after it every play has forgotten the history or rests for ever, so
that the second period repeats.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tarsus.base.errors import InputError
from tarsus.model.drive.law import VoltageLaw
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.parts import IDENTITY, to_pieces, whole_parts
from tarsus.model.drive.pieces import TERMS, Pieces, evaluate
from tarsus.model.drive.signal import Signal

__all__ = ["TERMS", "Pieces", "evaluate", "lower"]


def lower(waveform: Signal, law: VoltageLaw, history: Sequence[float] = ()) -> tuple[Pieces, Pieces]:
    """Force [N] and voltage [V] of a waveform through a law as piecewise polynomials of time.

    Parameters
    ----------
    waveform
        Voltage [V] of time; at t = 0 it jumps from the last voltage before to its own value.
    law
        Force of voltage.
    history
        Voltages [V] visited before t = 0, in order, such as [10, 0] after poling; the drive is born at 0 V.

    Raises
    ------
    InputError
        For a history that is not finite, or a drive of too many pieces or beyond the range of floats.
    """
    if not all(math.isfinite(v) for v in history):
        raise InputError("the history of a drive must be finite voltages")
    with np.errstate(over="ignore", invalid="ignore"):
        track = waveform.track()
        loop = track.loop if track.periodic else -1
        volts = to_pieces(track, whole_parts(track, IDENTITY), loop)
        if isinstance(law, LinearForce):
            coef = law.gain * volts.coef
            coef[:, 0] += law.offset
            return Pieces(volts.start, coef, volts.kink, volts.loop), volts
        if track.periodic and law.has_memory:
            track = track.twice()
            loop = track.loop
        force = to_pieces(track, law.parts(track, history), loop)
    return force, volts
