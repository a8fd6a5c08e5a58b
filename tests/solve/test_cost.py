"""The estimate that refuses runs which would never end."""

from __future__ import annotations

import pytest

from tarsus.files.toml import parse_scene
from tarsus.solve.simulation import STEPS_PER_CYCLE, estimated_steps

SCENE = """
name = "two masses"
duration = "1 s"
[robot.structure]
kind = "lumped"
coordinates = ["a", "b"]
mass = [1.0, 4.0]
stiffness = [[{k}, 0.0], [0.0, {k}]]
damping = [0.0, 0.0]
[robot.feet.a]
point = "a"
gap = "1 m"
[robot.drives.d]
load = {{ kind = "point", weights = {{ a = 1.0 }} }}
law = {{ kind = "linear", gain = 1.0 }}
[signals.d]
kind = "sine"
amplitude = 1.0
frequency = 3.0
"""


def test_the_fastest_motion_counts():
    fast = parse_scene(SCENE.format(k=4.0e6))  # sqrt(4e6) rad/s = 318.3 Hz
    assert estimated_steps(fast, 10.0) == pytest.approx(10.0 * 318.3099 * STEPS_PER_CYCLE, rel=1e-6)
    slow = parse_scene(SCENE.format(k=0.0))  # a free mass: the drive's 3 Hz are faster
    assert estimated_steps(slow, 10.0) == pytest.approx(10.0 * 3.0 * STEPS_PER_CYCLE)
