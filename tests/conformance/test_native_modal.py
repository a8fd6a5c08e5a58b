"""Modal robots in the native engine: contact modes of more feet than a word has bits."""

from __future__ import annotations

import math

import numpy as np

import tarsus as ts
from tarsus.core.arrays import E_FOOT, E_KIND
from tarsus.plan.lowering import lower_scene
from tarsus.plan.rows import rows_of
from tarsus.solve.engine import Accuracy, Engine


def bed_of_feet(count: int) -> ts.Scene:
    """A rigid plate that rocks on many feet under its weight: contacts by the dozen, some at the same moment."""
    places = {f"f{i}": float(x) for i, x in enumerate(np.linspace(-1.0, 1.0, count))}
    rocking = 2.0 * math.pi * 310.0
    structure = ts.Lumped(
        coordinates=("z", "p"),
        mass=(4e-6, 2e-6),
        stiffness=(0.0, 2e-6 * rocking**2),
        damping=(2e-4, 2.0 * 0.03 * rocking * 2e-6),
        weights={name: (1.0, x) for name, x in places.items()},
        upward=(1.0, 0.0),
    )
    drive = ts.Drive(load=ts.PointLoad(weights={"p": 1.0}), law=ts.LinearForce(gain=40e-6))
    feet = {name: ts.Foot(point=name, gap=(4.0 + 3.0 * abs(x)) * 1e-6) for name, x in places.items()}
    ground = ts.Ground(
        restitution=ts.Restitution(coefficient=0.3),
        film=ts.Film(coefficient=1e-21, thickness=3e-6),
        gravity=ts.Gravity(acceleration=9.81),
    )
    robot = ts.Robot(structure=structure, drives={"pzt": drive}, feet=feet)
    signals = {"pzt": ts.Sine(amplitude=5.0, frequency=170.0)}
    return ts.Scene(name="a plate on many feet", robot=robot, ground=ground, signals=signals, duration=0.012)


def test_more_feet_than_a_word_has_bits():
    """A plate on 70 feet comes to rest on the feet at its edges; every contact mode has a name."""
    made = bed_of_feet(70)
    plan = lower_scene(made)
    engine = Engine(plan, made.duration)
    raw = engine.run(rows_of(plan), Accuracy(gap=1e-8))
    assert raw.codes[0] == 0
    touched = set(raw.events[np.isin(raw.events[:, E_KIND], (1, 2, 4)), E_FOOT].astype(int))
    assert touched == {0, 69} and max(mode.mask for mode in engine.tables.modes) >= 0
