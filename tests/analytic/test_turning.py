"""Motion across the way, yaw and Coulomb's friction in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.events import EventKind
from turning_scenes import FRICTION, GRAVITY, dragged, puck, spinning_down

MASS, SPEED = 1e-8, 0.02
BOUND = FRICTION * (1e-6 + MASS) * GRAVITY


def test_a_spinning_plate_stops_when_friction_says() -> None:
    """Every foot has mu N across its own radius: the spin falls in a straight line, and what it had goes to
    friction."""
    spin = 40.0
    run = ts.simulate(puck(spin))
    stop = spin / spinning_down()
    assert run.ok and run.ledger.closure < 1e-8
    sticks = run.events[run.events["kind"] == EventKind.STICK_BEGINS]
    assert len(sticks) >= 4 and sticks["time"][0] == pytest.approx(stop, rel=1e-3)
    yaws = run.at(np.array([0.5 * stop, run.end_time])).body
    assert yaws is not None
    yaw = run.scene.robot.structure.body_coordinates.index("yaw")
    assert yaws[yaw, 0] == pytest.approx(spin * 0.5 * stop - spinning_down() * (0.5 * stop) ** 2 / 2.0, rel=1e-9)
    assert yaws[yaw, 1] == pytest.approx(0.5 * spin * stop, rel=1e-3)


def seconds_to(share: float, first: float, last: float) -> float:
    """Time [s] in which friction and a constant force turn the slip from one angle to another: with u = tan(psi/2) and
    beta = B/Q, m s' = Q cos psi - B and m s psi' = -Q sin psi give s = s0 (sin psi0 / sin psi) (u/u0)^beta."""
    beta, u0, u = 1.0 / share, math.tan(0.5 * first), math.tan(0.5 * last)

    def part(power: float) -> float:
        return (u0**power - u**power) / power

    return MASS * SPEED * math.sin(first) / (2.0 * share * BOUND) * (part(beta - 1.0) + part(beta + 1.0)) / u0**beta


@pytest.mark.parametrize(("share", "angle"), [(0.5, 1.0), (0.9, 2.5), (0.3, 0.0), (0.5, math.pi), (0.02, 1.5)])
def test_a_foot_dragged_aslant_stops_when_coulomb_says(share: float, angle: float) -> None:
    """T = m s0 (B + Q cos psi0) / (B^2 - Q^2), wherever it goes until then."""
    run = ts.simulate(dragged(share, angle))
    pull = share * BOUND
    stop = MASS * SPEED * (BOUND + pull * math.cos(angle)) / (BOUND**2 - pull**2)
    sticks = run.events[run.events["kind"] == EventKind.STICK_BEGINS]
    assert len(sticks) == 1 and sticks["time"][0] == pytest.approx(stop, rel=1e-12)
    assert sticks["pull"][0] == pytest.approx(pull, rel=1e-9)
    assert run.ledger.closure < 1e-12


@pytest.mark.parametrize("share", [0.5, 1.0 + 1e-9, 1.6])
def test_its_slip_turns_to_the_force_as_coulomb_says(share: float) -> None:
    first, last = 2.6, 0.9
    run = ts.simulate(dragged(share, first))
    at = run.at(np.array([seconds_to(share, first, last)]))
    walker = run.scene.robot.structure
    slip = np.array([walker.row(f"leg_{d}") @ at.state.v[:, 0] for d in "xy"])
    size = SPEED * math.sin(first) / math.sin(last) * (math.tan(0.5 * last) / math.tan(0.5 * first)) ** (1.0 / share)
    assert slip == pytest.approx(
        size * np.array([math.cos(0.7 + last), math.sin(0.7 + last)]), rel=1e-7, abs=1e-8 * SPEED
    )
    assert at.friction is not None and at.friction_across is not None
    assert np.hypot(at.friction, at.friction_across) == pytest.approx(BOUND, rel=1e-9)


@pytest.mark.parametrize(("share", "slips"), [(1.0 - 1e-9, False), (1.0 + 1e-9, True)])
def test_a_foot_slips_aslant_just_beyond_its_bound(share: float, slips: bool) -> None:
    run = ts.simulate(dragged(share, 0.0, speed=0.0))
    assert (EventKind.SLIP_BEGINS in run.events["kind"]) is slips
