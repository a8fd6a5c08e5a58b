"""Lowering: a waveform through a force law as piecewise polynomials of time, exact to 1e-12 of their span.

Waveforms are cut where they turn, jump or change their formula, laws add the instants at which plays engage
or branches switch, and what remains smooth is cut further only as degree 11 needs. Of a periodic drive with
memory the first period is kept apart: after it every play has forgotten the history or rests for ever, so
that the second period repeats.

There is one way from a voltage to pieces, and it takes the voltages of any number of runs: signal -> `Track` ->
parts on which the force is a cubic of the voltage -> `Channels`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.model.drive.law import VoltageLaw
from tarsus.model.drive.laws.linear import LinearForce
from tarsus.model.drive.parts import IDENTITY, to_pieces, whole_parts
from tarsus.model.drive.pieces import TERMS, Channels, Pieces, evaluate
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.track import Track

__all__ = ["TERMS", "Pieces", "evaluate", "lower", "lower_track"]


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
    with np.errstate(over="ignore", invalid="ignore"):
        track = waveform.track()
    force, volts = lower_track(track, law, history)
    assert volts is not None
    return force[0], volts[0]


def lower_track(
    track: Track, law: VoltageLaw, history: Any = (), *, volts: bool = True, late: Any = None
) -> tuple[Channels, Channels | None]:
    """The same of the voltages of many runs, a channel for each, and of volts where they are asked for; numbers of
    the law and of the history may be one a run (nr,), as those of the track; late: what a law
    that goes by the rate lags, see `VoltageLaw.channels`."""
    if not all(np.isfinite(v).all() for v in history):
        raise InputError("the history of a drive must be finite voltages")
    with np.errstate(all="ignore"):
        if isinstance(law, LinearForce):
            level = to_pieces(track, whole_parts(track, IDENTITY))
            gain, offset = (np.repeat(np.broadcast_to(one, len(level)), level.counts) for one in (law.gain, law.offset))
            first = np.arange(TERMS) == 0
            return replace(level, coef=gain[:, None] * level.coef + np.where(first, offset[:, None], 0.0)), level
        level = to_pieces(track, whole_parts(track, IDENTITY)) if volts else None
        return law.channels(track, history, late), level
