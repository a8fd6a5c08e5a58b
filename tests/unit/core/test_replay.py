"""States and energies between the events, against a fine numerical integration of one recorded step."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import tarsus as ts
from scene_files import SCENES
from tarsus.core.arrays import (
    DAMPING,
    ENERGIES,
    FILM,
    SMOOTH,
    T_CLASS,
    T_FRACTION,
    T_JUMPS,
    T_LENGTH,
    T_MODE,
    T_TIME,
    TRACE_HEAD,
    WORK,
)  # fmt: skip
from tarsus.core.modes import LinearSystem, ModeBook
from tarsus.core.nodes import TAU, N
from tarsus.core.replay import integrate, sample

LENGTHS = 0.5 ** np.arange(30)
START = np.array([0.1, -0.05, 1.0, -2.0])


def system(stiff: float, damping: float) -> LinearSystem:
    stiffness = np.array([[40.0, -10.0], [-10.0, stiff]])
    return LinearSystem(
        mass=np.diag([1.0, 0.5]), damping=np.array([[0.6, -0.1], [0.1, damping]]), stiffness=stiffness,
        normals=np.array([[1.0], [0.5]]), rest_gap=np.array([0.3]), loads=np.array([[0.0], [1.0]]),
        weight=np.array([[-0.5, 0.0], [0.0, 0.0]]),
    )  # fmt: skip


def momentum(s):
    return 0.2 * s**2 - 0.1 * s


def force(s):
    return 0.3 - 0.5 * s**3


def drive(s):
    return 2.0 * s - 1.0


def recorded(plan: LinearSystem, k: int, fraction: float) -> tuple[ModeBook, np.ndarray]:
    """One step of class k, started at START with prescribed inputs."""
    book = ModeBook(plan, LENGTHS)
    number = book.require(0)
    mode = book.modes[number]
    row = np.zeros(TRACE_HEAD + 4 + 4 * N)
    row[[T_TIME, T_LENGTH, T_FRACTION, T_MODE, T_CLASS]] = 0.0, LENGTHS[k], fraction, 0, k
    row[TRACE_HEAD : TRACE_HEAD + 4] = mode.from_physical @ START - momentum(0.0) * mode.beta[0]
    row[TRACE_HEAD + 4 :] = np.concatenate([momentum(TAU), force(TAU), drive(TAU), np.ones(N)])
    return book, row[None]


@pytest.mark.parametrize(
    ("stiff", "damping", "k", "fraction"),
    [
        (90.0, 0.2, 6, 1.0), (90.0, 0.2, 0, 1.0), (90.0, 0.2, 1, 0.37), (1e5, 3.0, 3, 1.0), (1e4, 1e3, 2, 0.83),
    ],
)  # fmt: skip
def test_energies_and_states_of_a_step(stiff, damping, k, fraction):
    plan = system(stiff, damping)
    book, trace = recorded(plan, k, fraction)
    h, inverse = LENGTHS[k], np.linalg.inv(plan.mass)
    normal, load = plan.normals[:, 0], plan.loads[:, 0]

    def rates(t, z):
        x, v, s = z[:2], z[2:4], t / h
        film, smooth, push = (0.4 * s - 0.1) / h, force(s), drive(s)
        total = load * push + plan.constant + normal * (film + smooth) - plan.damping @ v - plan.stiffness @ x
        work, loss, rate = push * (load @ v) + plan.constant @ v, v @ plan.damping @ v, normal @ v
        return np.concatenate([v, inverse @ total, [work, loss, film * rate, smooth * rate]])

    end = fraction * h
    exact = solve_ivp(
        rates, (0.0, end), np.concatenate([START, np.zeros(4)]), method="Radau" if damping > 100 else "DOP853",
        rtol=1e-9 if damping > 100 else 1e-12, atol=1e-13, dense_output=True,
    )  # fmt: skip
    tolerance = 3e-6 if damping > 100 else 1e-9
    integrals = integrate(book, trace)
    got = integrals.energies[[WORK, DAMPING, FILM, SMOOTH], 0] * [1.0, 1.0, -1.0, 1.0]
    np.testing.assert_allclose(got, exact.y[4:, -1], rtol=0, atol=tolerance * np.abs(exact.y[4:, -1]).max())
    assert integrals.time[0] == end and integrals.energies.shape == (ENERGIES, 1)
    times = np.linspace(0.0, end, 9)
    states = sample(plan.sources, book, trace, times)
    for values, rows in ((states.x, slice(0, 2)), (states.v, slice(2, 4))):
        reference = exact.sol(times)[rows]
        np.testing.assert_allclose(values, reference, rtol=0, atol=10 * tolerance * np.abs(reference).max())
    np.testing.assert_allclose(states.resistive[0], (0.4 * times / h - 0.1) / h, rtol=1e-11, atol=1e-12 / h)
    np.testing.assert_allclose(states.smooth[0], force(times / h), rtol=1e-12)
    np.testing.assert_allclose(states.gap[0], 0.3 + normal @ states.x, rtol=1e-12)
    np.testing.assert_allclose(_end(plan, book, trace)[:2], states.x[:, -1], rtol=1e-12)


def _end(plan, book, trace):
    last = sample(plan.sources, book, trace, np.array([np.inf]))
    return np.concatenate([last.x[:, 0], last.v[:, 0]])


@pytest.mark.parametrize("fraction", [1.0, 0.6])
def test_energy_balance_of_a_step_over_a_hundred_thousand_oscillations(fraction):
    plan = system(5e11, 50.0)
    book, trace = recorded(plan, 0, fraction)
    last = _end(plan, book, trace)

    def energy(z):
        return 0.5 * z[2:] @ plan.mass @ z[2:] + 0.5 * z[:2] @ plan.stiffness @ z[:2]

    terms = integrate(book, trace)
    gained = np.dot([1.0, -1.0, -1.0, 1.0], terms.energies[[WORK, DAMPING, FILM, SMOOTH], 0])
    assert gained == pytest.approx(energy(last) - energy(START), rel=1e-9)


def test_laws_that_act_together_share_their_work():
    """A film and an attraction in two laws of 1/4 and 3/4 each: their shares are just that."""
    own = ts.load_laws(SCENES / "squeeze.py")
    together = ts.Ground(
        restitution=ts.Restitution(coefficient=0.4),
        film=ts.Film(coefficient=5e-22, thickness=5e-6), electrostatic=ts.Electrostatic(coefficient=1e-20, offset=2e-6),
        laws={
            "rest_film": own["own_film"](coefficient=1.5e-21, thickness=5e-6),
            "rest_attraction": own["own_electrostatic"](coefficient=3e-20, offset=2e-6),
        },
    )  # fmt: skip
    scene = ts.load_scene("cantilever", volts=8, hz=50, wave="sine")
    motion = ts.simulate(scene.model_copy(update={"ground": together}), "45 ms").motion
    found = motion.integrals.energies
    assert found.shape == (ENERGIES + 2, len(motion.log.trace)) and len(motion.log.events) > 20
    for part, whole in zip(found[ENERGIES:], (-found[FILM], found[SMOOTH]), strict=True):
        np.testing.assert_allclose(part, 0.25 * whole, rtol=0, atol=1e-10 * np.abs(whole).max())
    works = motion.account.works
    assert works["rest_film"] == pytest.approx(3.0 * works["film"], rel=1e-9)


def test_work_of_a_momentum_that_jumps_is_that_of_resistive_laws():
    plan = system(90.0, 0.2)
    book, trace = recorded(plan, 3, 1.0)
    before = integrate(book, trace)
    trace[0, T_JUMPS] = -0.3 * before.energies[FILM, 0]
    after = integrate(book, trace)
    assert after.energies[FILM, 0] == pytest.approx(1.3 * before.energies[FILM, 0], rel=1e-14)
    for kind in (WORK, DAMPING, SMOOTH):
        assert after.energies[kind] == before.energies[kind]


@pytest.mark.parametrize("steps", [1, 4, 7])
def test_energies_are_those_of_each_step(steps):
    """Steps of one length are taken together, others alone: a step has the same energies wherever it stands."""
    plan = system(90.0, 0.2)
    book, one = recorded(plan, 3, 1.0)
    _, other = recorded(plan, 5, 0.6)
    trace = np.concatenate([np.tile(one, (steps, 1)), other, one])
    alone = [integrate(book, row) for row in (one, other)]
    found = integrate(book, trace)
    for kind in (WORK, DAMPING, FILM, SMOOTH):
        whole, part = (each.energies[kind, 0] for each in alone)
        expected = np.cumsum([whole] * steps + [part, whole])
        np.testing.assert_allclose(found.energies[kind], expected, rtol=1e-13)
