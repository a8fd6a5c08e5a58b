"""Landing rules, and impact maps: the source's, the mass-weighted one, and the nearest that makes no energy."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from printed_robots import body, hexapod, printed, printed_map
from tarsus.model.laws.impact_map import Directed, DominantMode, ImpactMap, MassWeighted

NORMAL = np.eye(6)[0]


def directed(chosen: ImpactMap, restitution: float) -> Directed:
    return Directed(printed()[0], NORMAL, chosen.direction("foot1", NORMAL, body()), restitution)


@pytest.mark.parametrize(
    ("chosen", "restitution", "gain"),
    [(printed_map(), 0.50, 22.7), (DominantMode(mode=6), 0.51, 2.3), (MassWeighted(), 0.51, 1.0)],
    ids=["printed", "mode 6", "mass-weighted"],
)
def test_largest_gain_of_kinetic_energy(chosen, restitution, gain):
    impact = directed(chosen, restitution)
    assert impact.gain() == pytest.approx(gain, abs=0.05)
    assert impact.gain(passive=True) == pytest.approx(1.0, abs=1e-12)


def test_the_rule_picks_the_mode_of_the_source():
    by_rule, sixth = (DominantMode(mode=k).direction("foot1", NORMAL, body()) for k in (None, 6))
    np.testing.assert_array_equal(by_rule, sixth)
    assert by_rule[0] == pytest.approx(1.0)


def test_the_source_s_matrix_of_a_mode():
    # (3.17)-(3.24): first column (alpha, (alpha - 1) phi_k / phi_k,c) with alpha = -e, the identity elsewhere
    impact = directed(DominantMode(mode=6), 0.51)
    column = -(1.0 + 0.51) * impact.direction
    column[0] += 1.0
    assert column[0] == pytest.approx(-0.51)
    np.testing.assert_allclose(impact.matrix()[:, 0], column, rtol=1e-14)
    np.testing.assert_array_equal(impact.matrix()[:, 1:], np.eye(6)[:, 1:])


CORNERS = [(printed_map(), 0.0), (printed_map(), 1.0), (DominantMode(), 0.51), (MassWeighted(), 0.51)]


@pytest.mark.parametrize(("chosen", "restitution"), CORNERS)
def test_the_passive_projection_is_the_nearest_passive_map(chosen, restitution):
    # The passive maps that keep the foot's row are a convex set: P is nearest where (R - P, X - P) <= 0 for all its X.
    impact = directed(chosen, restitution)
    root = np.linalg.cholesky(impact.mass).T
    given, nearest = (root @ r @ np.linalg.inv(root) for r in (impact.matrix(), impact.passive_matrix()))
    normal = np.linalg.solve(root.T, NORMAL)
    np.testing.assert_allclose(normal @ nearest, -restitution * normal, atol=1e-9)
    assert np.linalg.norm(nearest, ord=2) <= 1.0 + 1e-12
    rng = np.random.default_rng(1)
    unit = normal / np.linalg.norm(normal)
    across = np.eye(6) - np.outer(unit, unit)
    wide = np.where(np.arange(200)[:, None, None] % 2, nearest, given)
    others = across @ (wide + 10.0 ** rng.uniform(-3, 0.5, (200, 1, 1)) * rng.normal(size=(200, 6, 6)))
    others -= restitution * np.outer(unit, unit)
    # those that are not passive shrink towards the mass-weighted map, which is, until they just are
    inside = np.eye(6) - (1.0 + restitution) * np.outer(unit, unit)
    low, high = np.zeros((200, 1, 1)), np.ones((200, 1, 1))
    low[np.linalg.norm(others, ord=2, axis=(1, 2)) <= 1.0] = 1.0
    for _ in range(20):
        middle = 0.5 * (low + high)
        size = np.linalg.norm(inside + middle * (others - inside), ord=2, axis=(1, 2))[:, None, None]
        low, high = np.where(size <= 1.0, middle, low), np.where(size <= 1.0, high, middle)
    passive = inside + low * (others - inside)
    assert np.all(np.sum((given - nearest) * (passive - nearest), axis=(1, 2)) <= 1e-7)


def test_energy_per_impact_adds_up():
    impact = directed(DominantMode(), 0.51)
    rng = np.random.default_rng(2)
    velocity = rng.normal(size=(6, 50))
    made = impact.energy(velocity)
    before = 0.5 * np.einsum("ik,ij,jk->k", velocity, impact.mass, velocity)
    assert np.all(made <= (impact.gain() - 1.0) * before * (1.0 + 1e-12))
    assert made.max() > 0.0
    assert np.all(impact.energy(velocity, passive=True) <= 1e-9 * before)
    normal_only = np.linalg.solve(impact.mass, NORMAL)
    lost = directed(MassWeighted(), 0.51).energy(normal_only)
    assert lost == pytest.approx(-(1.0 - 0.51**2) * 0.5 * normal_only @ impact.mass @ normal_only)


def test_the_engine_applies_the_map():
    # One impact in flight: the velocities just after it are R times those just before.
    for chosen in (
        MassWeighted(),
        DominantMode(),
        DominantMode(passive=False),
        printed_map(),
        printed_map(passive=False),
    ):
        scene = hexapod(signal=ts.Square(amplitude=10.0, frequency=30.0), impact=chosen)
        run = ts.simulate(scene, duration=0.02)
        event = run.events[0]
        assert event["kind"] == 1
        instant = float(event["time"])
        before, after = run.at(np.array([instant * (1 - 1e-12), instant * (1 + 1e-12)])).state.v.T
        impact = directed(chosen, 0.51)
        matrix = impact.passive_matrix() if chosen.passive else impact.matrix()
        np.testing.assert_allclose(after, matrix @ before, atol=1e-6 * np.abs(after).max())
        scale = run.plan.system.mass[0, 0] / impact.mass[0, 0]
        assert float(event["energy"]) == pytest.approx(
            -scale * float(impact.energy(before, passive=chosen.passive)), rel=1e-5
        )


def test_simultaneous_impacts_of_many_feet_make_no_energy():
    """By the printed map, which would make the most energy."""
    drive = ts.Square(amplitude=10.0, frequency=40.0)
    run = ts.simulate(hexapod(signal=drive, impact=printed_map(), feet=6, gap=2e-6), duration=0.1)
    assert run.ok and len(np.unique(run.events["foot"])) > 1
    assert run.ledger.closure < 1e-8
    assert run.at(np.linspace(0.0, 0.1, 4001)).state.gap.min() >= -1e-12
    assert np.all(run.events["energy"] >= -1e-12 * run.events["energy"].max())


def test_a_leg_level_with_the_ground():
    # Leg electrostatics against its integral over the leg, and its limit of a stiff hip
    law = ts.laws.LegElectrostatic(coefficient=2e-20, offset=3e-6, rest=1e-5)
    from scipy.integrate import quad

    for gap in (0.0, 2e-6, 9.9e-6, 1e-5, 1.01e-5, 4e-5):
        exact, _ = quad(lambda x, g=gap: x / (1.3e-5 + (g - 1e-5) * x) ** 2, 0.0, 1.0, epsabs=0.0, epsrel=1e-12)
        assert law.force(gap, 0.0, 7.0, 0.0, *law.parameters()) == pytest.approx(-2e-20 * 49.0 * exact, rel=1e-11)
    at_rest = ts.Electrostatic(coefficient=2e-20, offset=3e-6).force(1e-5, 0.0, 7.0, 0.0, 2e-20, 3e-6)
    assert law.force(1e-5, 0.0, 7.0, 0.0, *law.parameters()) == pytest.approx(0.5 * at_rest, rel=1e-14)


def test_near_field_forces_are_one_switch():
    forces = {
        "film": ts.Film(coefficient=1e-18, thickness=5e-6),
        "electrostatic": ts.Electrostatic(coefficient=1e-18, offset=5e-6),
        "leg_electrostatic": ts.laws.LegElectrostatic(coefficient=1e-18, offset=5e-6, rest=1e-5),
    }
    drive = ts.Square(amplitude=10.0, frequency=30.0)
    bare, all_on = hexapod(signal=drive), hexapod(signal=drive, **forces)
    off = ts.with_values(all_on, {"ground.near_field_forces": False})
    times = np.linspace(0.0, 0.05, 501)
    one, other, third = (ts.simulate(scene, duration=0.05) for scene in (bare, off, all_on))
    np.testing.assert_array_equal(one.at(times).state.x, other.at(times).state.x)
    assert not other.ledger.laws
    assert third.ledger.laws["film"] < 0.0 and third.ledger.laws["electrostatic"] != 0.0
    assert third.ledger.closure < 1e-8
    least = [one.laws["electrostatic"].min() for one in (third.series, third.at(times))]
    assert math.isclose(*least, rel_tol=0.2)
