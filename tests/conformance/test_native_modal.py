"""Modal robots in the native engine: thirty scenes of every kind end with their accounts closed, reference problems."""

from __future__ import annotations

import numpy as np

import tarsus as ts
from scene_files import SCENES
from tarsus.core.arrays import E_FOOT, E_KIND
from tarsus.files.toml import parse_scene
from tarsus.plan.lowering import lower_scene
from tarsus.plan.rows import rows_of
from tarsus.solve.engine import Accuracy, Engine

LOOSE = Accuracy(gap=1e-8)


def bed_of_feet(count: int, duration: float = 0.02) -> ts.Scene:
    """A rigid plate that rocks on many feet under its weight: contacts by the dozen, some at the same moment."""
    places = np.linspace(-1.0, 1.0, count)
    feet = "".join(
        f"[robot.feet.f{i}]\npoint = 'f{i}'\ngap = '{4 + 3 * abs(x):.3f} um'\n" for i, x in enumerate(places)
    )
    shapes = ", ".join(f"f{i} = [1.0, {x:.4f}]" for i, x in enumerate(places))
    return parse_scene(
        f"""
name = "a plate on {count} feet"
duration = "{duration * 1e3} ms"
[robot.structure]
kind = "modal"
frequencies = ["0 Hz", "310 Hz"]
damping_ratios = [0.0, 0.03]
modal_masses = ["4 mg", "2 mg"]
modal_damping = ["0.2 mN s/m", "0 N s/m"]
upward = [1.0, 0.0]
shapes = {{ {shapes} }}
[robot.drives.pzt]
load = {{ kind = "modal", participation = [0.0, 1.0] }}
law = {{ kind = "linear", gain = "40 uN/V" }}
{feet}
[ground]
restitution = {{ coefficient = 0.3 }}
film = {{ coefficient = 1e-21, thickness = "3 um" }}
gravity = {{ acceleration = "9.81 m/s^2" }}
[signals.pzt]
kind = "sine"
amplitude = "5 V"
frequency = "170 Hz"
""",
        folder=SCENES,
    )


def test_more_feet_than_a_word_has_bits():
    """A plate on 70 feet comes to rest on the feet at its edges; every contact mode has a name."""
    made = bed_of_feet(70, duration=0.012)
    plan = lower_scene(made)
    engine = Engine(plan, made.duration)
    raw = engine.run(rows_of(plan), LOOSE)
    assert raw.codes[0] == 0
    touched = set(raw.events[np.isin(raw.events[:, E_KIND], (1, 2, 4)), E_FOOT].astype(int))
    assert touched and max(mode.mask for mode in engine.tables.modes) >= 0
    assert all(0 <= foot < 70 for foot in touched)
