"""E11 and E12: the torque of the leg, and an objective that is zero for every leg."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.model.structure.leg_motion import equilibrium, step_response
from tarsus.model.structure.leg_step import step_lift
from tarsus_reproduce.legs import millipede_leg


def test_e11_the_leg_stands_with_the_torque_in_micronewton_metres_only():
    leg = millipede_leg().leg
    turns = equilibrium(leg, 14.0, gravity=0.0)
    assert turns[0] == pytest.approx(0.0736, rel=0.01)
    with pytest.raises(InputError, match="wind the leg up"):
        equilibrium(ts.with_values(leg, {"torque": 0.0057}), 14.0, gravity=0.0)


# Slow: legs shorter and longer than one leg, each by its equations of motion.
@pytest.mark.parametrize(
    "hip", [320e-6, pytest.param(250e-6, marks=pytest.mark.slow), pytest.param(400e-6, marks=pytest.mark.slow)]
)
def test_e12_the_speed_at_the_first_peak_is_zero_for_every_leg(hip):
    one = ts.with_values(millipede_leg().leg, {"hip.length": hip, "body_mass": 1.5e-6})
    motion = step_response(one, np.linspace(0.0, 0.02, 401), gravity=0.0)
    first = int(np.argmax(motion.lift))
    assert 0 < first < 400
    assert np.abs(motion.speed[first]) < 0.02 * motion.speed.max()
    assert step_lift(one).mean_speed > 0.1 * motion.speed.max()  # what replaces it is not zero
