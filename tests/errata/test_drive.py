"""E5: the printed branches of the drive (2.9) do not close at 6 V; a closed operator does."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.model.drive.laws import Cubic, PrandtlIshlinskii, TwoBranch


@pytest.fixture(scope="module")
def printed() -> TwoBranch:
    """Equation (2.9), micronewtons over volts."""
    return TwoBranch(
        falling=Cubic(constant="-0.6350 uN", linear="-0.6062 uN/V", quadratic="0.0076 uN/V^2"),
        rising=Cubic(constant="1.4796 uN", linear="-0.7057 uN/V", quadratic="-0.0255 uN/V^2", cubic="0.0016 uN/V^3"),
    )


def turn(law, volts: float) -> float:
    """Jump of the force [N] when the drive, swinging between plus and minus `volts` [V], turns at `volts`."""
    before, after = law.force([-volts, volts, volts * (1.0 - 1e-12)])[1:]
    return abs(float(after - before))


def test_e5_the_printed_branches_jump_at_6_volts(printed):
    assert turn(printed, 6.0) == pytest.approx(0.67e-6, abs=0.005e-6)
    assert turn(printed, -6.0) == pytest.approx(1.17e-6, abs=0.005e-6)


def test_e5_the_printed_branches_nearly_meet_at_8_volts(printed):
    assert turn(printed, 8.0) < 0.03e-6
    assert turn(printed, -8.0) < 0.03e-6


def test_e5_a_closed_operator_never_jumps():
    law = PrandtlIshlinskii(
        linear="-0.5 uN/V", thresholds=["1 V", "2 V", "4 V"], weights=["-0.05 uN/V", "-0.05 uN/V", "-0.05 uN/V"]
    )
    for volts in (2.0, 6.0, 8.0):
        assert turn(law, volts) < 1e-16
    volts = 6.0 * np.sin(np.linspace(0.0, 20.0, 20001))
    assert np.max(np.abs(np.diff(law.force(volts)))) <= 0.65e-6 * np.max(np.abs(np.diff(volts))) * (1.0 + 1e-9)
