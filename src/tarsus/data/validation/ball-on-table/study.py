"""A ball that bounces once a period of a vibrating table: its speed of approach, and the time between impacts."""

import math

import numpy as np

from tarsus import InputError
from tarsus.validation import RowCase

GRAVITY, PERIOD = 9.80665, 0.01  # of the device [m/s^2, s]
LAST = 20  # impacts that are looked at, of some 300


def case(row, device):
    """Flights last a period, g T = (1 + e) v: with the approach speed v the table gives back what restitution takes.

    Several motions may coexist. The ball starts where this one leaves the table, 1 % slower, and settles.
    """
    e, gamma = row["restitution"], row["acceleration_g"]
    speed = GRAVITY * PERIOD / (1.0 + e)
    least = math.pi * (1.0 - e) / (1.0 + e)
    if e == 0.0 or gamma < least:
        raise InputError(f"no ball of restitution {e:g} bounces once a period at {gamma:g} g: it takes {least:.3g} g")
    changes = {
        "ground.restitution.coefficient": e,
        "signals.table.amplitude": gamma,
        "signals.table.phase": math.acos(least / gamma),
        "initial.displacement": (0.0,),
        "initial.velocity": (0.99 * e * speed,),
        "duration": 300.0 * PERIOD,
    }
    return RowCase(changes, read, {"approach_m_s": speed, "interval_s": PERIOD})


def read(run):
    """Of the last impacts: mean speed of approach, and mean time between them."""
    last = run.events[-LAST:]
    return {"approach_m_s": float(last["speed_before"].mean()), "interval_s": float(np.diff(last["time"]).mean())}
