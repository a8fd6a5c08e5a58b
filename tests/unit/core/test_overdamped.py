"""Structures damped so strongly that their slow rates lie many orders below their fast ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.spec import validate
from tarsus.core.blocks import split_modes
from tarsus.model.scene import Scene

PUSH = {"kind": "constant", "level": 1e-3}


def pushed(structure: dict, point: str, duration: float, signal: dict) -> ts.Run:
    """A structure without feet, pushed by a drive of 1 N/V."""
    drive = {"load": {"kind": "point", "weights": {point: 1.0}}, "law": {"kind": "linear", "gain": 1.0}}
    robot = {"structure": structure, "drives": {"d": drive}, "feet": {}}
    made = {"name": "pushed", "duration": duration, "robot": robot, "signals": {"d": signal}}
    return ts.simulate(validate(Scene, made))


@pytest.mark.parametrize("zeta", [1e2, 1e4, 1e6])
@pytest.mark.parametrize("spell", [0.01, 1.0, 10.0])
def test_one_mode_creeps_as_its_equation_says(zeta, spell):
    """Under a constant force, to ten slow time constants; those are 4e13 fast ones at most."""
    frequency, mass = 1e4, 1e-6
    rate = 2.0 * math.pi * frequency
    duration = 2.0 * zeta / rate * spell
    structure = {
        "kind": "modal", "frequencies": [frequency], "damping_ratios": [zeta], "modal_masses": [mass],
        "shapes": {"A": [1.0]},
    }  # fmt: skip
    run = pushed(structure, "A", duration, PUSH)
    root = math.sqrt(zeta * zeta - 1.0)
    slow, fast = -rate / (zeta + root), -rate * (zeta + root)
    ways = -(fast * math.expm1(slow * duration) - slow * math.expm1(fast * duration)) / (fast - slow)
    assert run.ok and run.ledger.closure < 1e-12
    assert run.at(np.array([duration])).state.x[0, -1] == pytest.approx(
        1e-3 / mass / rate**2 * ways, rel=1e-12
    )


def chain(zeta: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, damping, stiffness of three masses of 1 mg, with dashpots between them that are no part of the modes."""
    ties = np.eye(3) - np.eye(3, k=-1)
    rate = 2.0 * math.pi * 1e3
    stiffness = 1e-6 * rate**2 * ties.T @ np.diag([1.0, 2.0, 3.0]) @ ties
    return 1e-6 * np.eye(3), 2e-6 * rate * ties.T @ np.diag([zeta, 0.01, 0.3 * zeta]) @ ties, stiffness


@pytest.mark.parametrize("zeta", [1e3, 1e4, 1e5])
@pytest.mark.parametrize("duration", [0.01, 1.0, 20.0])
def test_dashpots_of_any_strength_keep_the_account(zeta, duration):
    mass, damping, stiffness = (matrix.tolist() for matrix in chain(zeta))
    structure = {
        "kind": "lumped", "coordinates": ["a", "b", "c"], "mass": mass, "stiffness": stiffness, "damping": damping,
    }  # fmt: skip
    square = {"kind": "square", "amplitude": 1e-3, "frequency": 3.0 / duration}
    run = pushed(structure, "c", duration, square)
    assert run.ok and run.ledger.closure < 2e-9


@pytest.mark.parametrize("zeta", [1e2, 1e4])
def test_slow_rates_are_known_to_themselves(zeta):
    """Their product over all modes is det K / det M, fast ones included: what the state matrix loses shows there."""
    mass, damping, stiffness = chain(zeta)
    blocks, _ = split_modes(mass, damping, stiffness)
    product = np.prod([block[0, 0] * block[1, 1] - block[0, 1] * block[1, 0] for block in blocks])
    assert product == pytest.approx(np.linalg.det(stiffness) / np.linalg.det(mass), rel=1e-11)
