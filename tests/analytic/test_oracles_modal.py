"""Oracle 9: free flight against the closed-form modal solution, sweeps against the structure's own FRF."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene
from tarsus.solve import Accuracy

FREQUENCIES = (0.0, 110.0, 623.0, 6424.0, 900.0, 40.0, 300.0)  # Hz
RATIOS = (0.0, 0.0, 0.02, 0.3, 1.0, 4.0, 1.0000001)  # rigid, undamped, light, strong, critical, over, near critical
MASSES = (1e-6, 2e-6, 1e-6, 5e-7, 1e-6, 3e-6, 1e-6)  # kg
RIGID_DAMPING = (0.0,) * 7
DISPLACEMENT = (0.0, 3e-6, -5e-6, 1e-6, 4e-6, -2e-6, 2e-6)
VELOCITY = (1e-4, -2e-3, 1e-2, 0.05, -3e-3, 1e-3, 5e-3)
PARTICIPATION = (0.3, 1.0, -0.7, 0.4, 0.5, 2.0, -1.0)


def plate(signal: ts.Constant | ts.Square | ts.Sine | None, duration: float) -> ts.Scene:
    """Seven modes of every kind, one drive of 1 uN/V, a foot far above the ground."""
    structure = ts.Modal(
        frequencies=FREQUENCIES,
        damping_ratios=RATIOS,
        modal_masses=MASSES,
        modal_damping=RIGID_DAMPING,
        shapes={"tip": (1.0, 1.0, -1.0, 1.0, 0.5, 0.5, 1.0)},
    )
    drive = ts.Drive(load=ts.ModalLoad(participation=PARTICIPATION), law=ts.LinearForce(gain=1e-6))
    return ts.Scene(
        name="seven modes",
        robot=ts.Robot(structure=structure, drives={"d": drive}, feet={"tip": ts.Foot(point="tip", gap=1.0)}),
        signals={"d": signal} if signal is not None else {},
        initial=ts.Initial(displacement=DISPLACEMENT, velocity=VELOCITY),
        duration=duration,
    )


def propagate(r: int, x: float, v: float, force: float, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mode ``r`` under a constant force [N], exactly."""
    w, zeta, push = 2.0 * math.pi * FREQUENCIES[r], RATIOS[r], force * PARTICIPATION[r] / MASSES[r]
    if w == 0.0:
        return x + v * t + 0.5 * push * t**2, v + push * t
    rest = push / w**2
    x = x - rest
    s, d = zeta * w, np.emath.sqrt(zeta**2 - 1.0) * w  # exponents -s +- d
    c = np.cosh(d * t)
    q = t * np.sinc(1j * d * t / math.pi) if zeta != 1.0 else t  # sinh(d t) / d
    decay = np.exp(-s * t)
    free = decay * (x * c + (v + s * x) * q)
    rate = decay * (v * c - (s * v + w**2 * x) * q)
    return rest + np.real(free), np.real(rate)


def peak(row: np.ndarray) -> float:
    return float(np.abs(row).max())


@pytest.mark.parametrize("volts", [0.0, 5.0])
def test_free_flight_is_the_closed_form(volts):
    run = ts.simulate(plate(ts.Constant(level=volts), 0.05))
    t = np.linspace(0.0, 0.05, 3001)
    state = run.at(t).state
    assert run.ok
    for r in range(len(FREQUENCIES)):
        x, v = propagate(r, DISPLACEMENT[r], VELOCITY[r], volts * 1e-6, t)
        assert peak(state.x[r] - x) <= 1e-12 * peak(x), f"mode {r}: {peak(state.x[r] - x) / peak(x):.1e}"
        assert peak(state.v[r] - v) <= 1e-12 * peak(v), f"mode {r}: {peak(state.v[r] - v) / peak(v):.1e}"


@pytest.mark.parametrize("frequency", [20.0, 137.0, 623.0, 2000.0, 6424.0])
def test_steady_response_to_a_sine_is_the_frf(frequency):
    """p1's chain in the air: amplitude and phase of every mass, from the FRF of its own M, C, K."""
    base = scene("p1_n6", {"robot.feet.tip.gap": 1.0})
    values = {"signals.pull": ts.Sine(amplitude=8.0, frequency=frequency), "ground.film": None}
    still = ts.with_values(base, values)
    matrices = still.robot.structure.matrices()
    w = 2.0 * math.pi * frequency
    load = still.robot.drives["pull"].load.vector(still.robot.structure) * still.robot.drives["pull"].law.gain * 8.0
    response = np.linalg.solve(matrices.stiffness - w**2 * matrices.mass + 1j * w * matrices.damping, load)
    x, v = response.imag, (1j * w * response).imag  # of exp(i w t) at t = 0
    run = ts.simulate(
        ts.with_values(still, {"initial.displacement": x.tolist(), "initial.velocity": v.tolist()}),
        duration=5.0 / frequency,
        accuracy=Accuracy(drive=1e-12),
    )
    t = np.linspace(0.0, run.duration, 2000)
    exact = np.imag(response[:, None] * np.exp(1j * w * t))
    error = np.abs(run.at(t).state.x - exact).max(axis=1) / np.abs(response)
    assert run.ok and error.max() < 1e-10
