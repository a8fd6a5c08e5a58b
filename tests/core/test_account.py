"""States and energies of a run between its events, against a fine numerical integration of the same motion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import tarsus as ts
from tarsus.base.events import EventKind
from tarsus.core.arrays import DAMPING, ENERGIES, FILM, SMOOTH, WORK
from tarsus.model.drive.waveforms.sine import Sine

START = np.array([0.1, -0.05, 1.0, -2.0])
GAP, OMEGA, THICKNESS, RESISTANCE, ATTRACTION = 3.0, 40.0, 0.5, 20.0, 2.0
MASS, WEIGHTS = np.array([1.0, 0.5]), np.array([1.0, 0.5])


def robot(stiff: float, damping: float, **ground: ts.Film | ts.Electrostatic) -> ts.Scene:
    """Two masses, a foot that hangs on both high above the ground, and a drive on the second."""
    structure = ts.Lumped(
        coordinates=("a", "b"),
        mass=tuple(MASS),
        stiffness=((40.0, -10.0), (-10.0, stiff)),
        damping=((0.6, -0.1), (-0.1, damping)),
        weights={"tip": tuple(WEIGHTS)},
    )
    drive = ts.Drive(load=ts.PointLoad(weights={"b": 1.0}), law=ts.LinearForce(gain=1.0))
    return ts.Scene(
        name="above the ground",
        duration=0.5,
        robot=ts.Robot(
            structure=structure, drives={"d": drive}, feet={"f": ts.Foot(point="tip", gap=GAP, electrode="d")}
        ),
        signals={"d": Sine(amplitude=1.5, frequency=OMEGA / (2.0 * np.pi))},
        ground=ts.Ground(restitution=ts.Restitution(coefficient=0.5), **ground),
        initial=ts.Initial(displacement=tuple(START[:2]), velocity=tuple(START[2:])),
    )


@pytest.mark.parametrize(
    ("stiff", "damping"), [(90.0, 0.2), (1e5, 3.0), (1e4, 1e3)], ids=["slow", "stiff", "overdamped"]
)
def test_states_and_energies_of_a_motion(stiff: float, damping: float) -> None:
    scene = robot(
        stiff,
        damping,
        film=ts.Film(coefficient=RESISTANCE, thickness=THICKNESS),
        electrostatic=ts.Electrostatic(coefficient=ATTRACTION, offset=THICKNESS),
    )
    run = ts.simulate(scene, accuracy=ts.Accuracy(gap=1e-12, drive=1e-12))
    assert run.ok and not len(run.events)
    stiffness = np.array([[40.0, -10.0], [-10.0, stiff]])
    damper = np.array([[0.6, -0.1], [-0.1, damping]])

    def forces(t, z):
        height, rate = GAP + THICKNESS + WEIGHTS @ z[:2], WEIGHTS @ z[2:4]
        volts = 1.5 * np.sin(OMEGA * t)
        return volts, -RESISTANCE / height**3 * rate, -ATTRACTION * volts**2 / height**2, rate

    def rates(t, z):
        push, film, attraction, rate = forces(t, z)
        x, v = z[:2], z[2:4]
        total = np.array([0.0, push]) + WEIGHTS * (film + attraction) - damper @ v - stiffness @ x
        return np.concatenate([v, total / MASS, [push * v[1], v @ damper @ v, -film * rate, attraction * rate]])

    exact = solve_ivp(
        rates,
        (0.0, 0.5),
        np.concatenate([START, np.zeros(4)]),
        method="Radau" if damping > 100 else "DOP853",
        rtol=1e-9 if damping > 100 else 1e-12,
        atol=1e-13,
        dense_output=True,
    )
    tolerance = 3e-6 if damping > 100 else 1e-9
    energies = run.motion.log.energies
    assert energies.shape == (ENERGIES,)
    wanted = exact.y[4:, -1]
    np.testing.assert_allclose(
        energies[[WORK, DAMPING, FILM, SMOOTH]], wanted, rtol=0, atol=tolerance * np.abs(wanted).max()
    )
    times = np.linspace(0.0, 0.5, 19)
    states, reference = run.states(times), exact.sol(times)
    for values, own in ((states.x, reference[:2]), (states.v, reference[2:4])):
        np.testing.assert_allclose(values, own, rtol=0, atol=10 * tolerance * np.abs(own).max())
    _, film, attraction, _ = forces(times, reference)
    np.testing.assert_allclose(states.smooth[0], attraction, rtol=0, atol=30 * tolerance * np.abs(attraction).max())
    part = max(30 * tolerance, 1e-6)  # it is the slope of a polynomial, which is less exact at the ends of a step
    np.testing.assert_allclose(states.resistive[0], film, rtol=0, atol=part * np.abs(film).max())
    np.testing.assert_allclose(states.gap[0], GAP + WEIGHTS @ states.x, rtol=1e-12)
    end = np.concatenate([states.x, states.v])[:, -1]
    np.testing.assert_allclose(end, run.motion.last, rtol=0, atol=1e-12 * np.abs(end).max())


def test_energy_balance_over_fifty_thousand_oscillations() -> None:
    run = ts.simulate(robot(5e11, 50.0))
    terms = run.ledger
    assert run.ok and abs(terms.residual) < 1e-9 * max(terms.damping, 0.5 * MASS @ START[2:] ** 2)
    assert terms.damping > 0.4 * MASS[1] * START[3] ** 2


def test_samples_at_an_event_are_those_after_it_and_the_last_is_the_end() -> None:
    run = ts.simulate("cantilever", "60 ms")
    struck = run.events["time"][run.events["kind"] == EventKind.BOUNCE]
    states = run.states(struck)
    assert len(struck) > 5 and (states.rate > 0.0).all() and np.abs(states.gap).max() < 1e-15
    end = run.states([0.06])
    np.testing.assert_allclose(np.concatenate([end.x, end.v])[:, 0], run.motion.last, rtol=1e-9)
