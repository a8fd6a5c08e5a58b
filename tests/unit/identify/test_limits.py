"""Where a described float may lie."""

from __future__ import annotations

import pytest

import tarsus as ts
from laboratory import LABORATORY
from tarsus.base.errors import InputError
from tarsus.identify.limits import field_limits


def test_limits_are_those_of_the_description():
    scene = ts.load_scene(LABORATORY)
    assert field_limits(scene, "ground.restitution.coefficient") == (0.0, 1.0)
    assert field_limits(scene, "robot.structure.damping_ratios.0")[0] == 0.0
    with pytest.raises(InputError, match="unknown path"):
        field_limits(scene, "ground.restitution.coeficient")
    with pytest.raises(InputError, match="the path of a number"):
        field_limits(scene, "ground.restitution")
