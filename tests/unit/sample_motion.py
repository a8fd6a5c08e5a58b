"""A walk to test animation and figures with, made by kinematics alone: feet swing, lift and slip by turns."""

from __future__ import annotations

import numpy as np

from tarsus.report.motion import AIR, SLIPPING, STUCK, Motion

LIFT, STRIDE, WEIGHT = 12e-6, 20e-6, 2e-6
"""Height a foot is lifted [m], way of a step [m], weight on the feet [N]."""


def make_motion(legs: int = 6, *, periods: int = 10, samples: int = 200, hz: float = 50.0) -> Motion:
    """A robot of two rows of legs (one leg of each group at one place for two legs) in an alternating gait.

    Even legs step in the first half of a period, odd ones in the second; the first tenth of a foot's contact slips.
    """
    time = np.linspace(0.0, periods / hz, periods * samples + 1)
    turns = time * hz
    rows = legs // 2
    x = np.zeros(legs) if legs == 2 else np.repeat(np.linspace(2e-3, -2e-3, rows), 2)
    y = np.zeros(legs) if legs == 2 else np.tile([0.9e-3, -0.9e-3], rows)
    group = np.arange(legs) % 2 if legs == 2 else (np.arange(legs) % 2 + np.arange(legs) // 2) % 2
    surge = STRIDE * (2.0 * turns + 0.05 * np.sin(4.0 * np.pi * turns))
    height, place, state, normal, friction = ([] for _ in range(5))
    for leg in range(legs):
        phase = (turns + 0.5 * group[leg]) % 1.0
        swing = phase < 0.5
        height.append(np.where(swing, LIFT * np.sin(2.0 * np.pi * phase) ** 2, 0.0))
        steps = (
            np.floor(turns + 0.5 * group[leg]) - 0.5 * group[leg] + np.where(swing, 2.0 * phase, 1.0) - 0.5
        )
        place.append(x[leg] + 2.0 * STRIDE * steps)
        state.append(np.where(swing, AIR, np.where(phase < 0.55, SLIPPING, STUCK)))
        normal.append(np.where(swing, 0.0, WEIGHT * (1.0 + 0.3 * np.sin(8.0 * np.pi * phase))))
        friction.append(np.where(swing, 0.0, np.where(phase < 0.55, -0.4, 0.25) * WEIGHT))
    return Motion(
        time=time,
        body={
            "surge": surge,
            "heave": -3e-6 + 1.5e-6 * np.cos(4.0 * np.pi * turns),
            "roll": 1.2e-3 * np.sin(2.0 * np.pi * turns),
            "pitch": 0.6e-3 * np.sin(2.0 * np.pi * turns + 1.0),
        },
        legs=tuple(f"L{i + 1}" for i in range(legs))
        if legs == 2
        else tuple(f"{'LR'[i % 2]}{i // 2 + 1}" for i in range(legs)),
        hips=np.column_stack([x, y, np.zeros(legs)]),
        foot_x=np.array(place),
        foot_z=np.array(height),
        state=np.array(state, dtype=np.uint8),
        normal=np.array(normal),
        friction=np.array(friction),
        drives=tuple(f"leg-{i + 1}" for i in range(legs)),
        volts=np.array([np.where((turns + 0.5 * g) % 1.0 < 0.5, 10.0, 0.0) for g in group]),
        period=1.0 / hz,
    )
