"""Rigid links on hinges, against closed forms: what moves, how stiff and heavy it is, how far small angles are off."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tarsus as ts
from tarsus.model.structure import Linkage

CRANK = {"mass": "1 mg", "inertia": "0.1 mg mm^2"}
LENGTH, MASS, INERTIA = 2e-3, 1e-6, 1e-13


def pendulum(**hinge: object) -> Linkage:
    """A link whose centre is 2 mm in front of a hinge on the frame."""
    return Linkage(
        links={"arm": {"x": "2 mm", "z": "0 m", **CRANK}},
        hinges={"pin": {"between": ["arm"], "x": "0 m", "z": "0 m", **hinge}},
    )


def four_bar(width: float = 3.0) -> Linkage:
    """Two cranks of 2 mm upright on the frame, a coupler on both, and its middle."""
    right = f"{width} mm"
    pins = {
        "left_foot": (["left"], "0 mm", "0 mm"),
        "right_foot": (["right"], right, "0 mm"),
        "left_top": (["left", "coupler"], "0 mm", "2 mm"),
        "right_top": (["coupler", "right"], right, "2 mm"),
    }
    return Linkage(
        links={
            "left": {"x": "0 mm", "z": "1 mm", **CRANK},
            "coupler": {"x": f"{width / 2} mm", "z": "2 mm", **CRANK},
            "right": {"x": right, "z": "1 mm", **CRANK},
        },
        hinges={
            name: {"between": two, "x": x, "z": z, "stiffness": 1e-6, "damping": 1e-9}
            for name, (two, x, z) in pins.items()
        },
        places={"tip": {"link": "coupler", "x": "10 mm", "z": "2 mm"}},
    )


def test_four_bars_have_one_motion():
    """A parallelogram: the coupler stays level, every hinge bends by the angle of the cranks."""
    bars = four_bar()
    assert bars.coordinates == ("left_pitch",)
    found = bars.matrices()
    cranks = 2.0 * (INERTIA + MASS * (0.5 * LENGTH) ** 2)
    np.testing.assert_allclose(found.mass, [[cranks + MASS * LENGTH**2]], rtol=1e-13)
    np.testing.assert_allclose([found.stiffness, found.damping], np.reshape([4e-6, 4e-9], (2, 1, 1)), rtol=1e-13)
    np.testing.assert_allclose([bars.row(name)[0] for name in ("tip_x", "tip")], [LENGTH, 0.0], atol=1e-17)
    assert bars.row("right_top")[0] == pytest.approx(-1.0, rel=1e-13)
    np.testing.assert_allclose(bars.horizontal() * found.mass[0, 0], 2.0 * MASS * LENGTH, rtol=1e-13)


def test_weight_stiffens_what_hangs_and_softens_what_stands():
    """m g l of a pendulum that hangs, none of one held level; an upright parallelogram falls as its three bars do, and
    of two links in a row that hang the second turns by itself."""
    g = 9.81
    level, hanging = pendulum(), pendulum().model_dump()
    hanging["links"]["arm"] |= {"x": 0.0, "z": -LENGTH}
    hanging["hinges"]["more"] = {"between": ["arm", "low"], "x": 0.0, "z": -3.0 * LENGTH}
    hanging["links"]["low"] = {"x": 0.0, "z": -4.0 * LENGTH, "mass": 3.0 * MASS, "inertia": INERTIA}
    weight = MASS * g * LENGTH
    np.testing.assert_allclose(level.gravity_stiffness(g), [[0.0]], atol=1e-15 * weight)
    two = Linkage(**hanging).gravity_stiffness(g)
    np.testing.assert_allclose(two, weight * np.diag([1.0 + 3.0 * 3.0, 3.0]), rtol=1e-12, atol=1e-15 * weight)
    np.testing.assert_allclose(four_bar().gravity_stiffness(g), [[-2.0 * weight]], rtol=1e-12)


@pytest.mark.parametrize("angle", [1e-4, 0.1, -0.3, 1.0])
def test_small_angles_are_off_by_a_number(angle):
    """A place on a circle is off by its distance from the tangent; bars that stay level are the same everywhere."""
    circle = LENGTH * math.hypot(angle - math.sin(angle), 1.0 - math.cos(angle))
    for one in (pendulum(), four_bar()):
        assert one.small_angle_error([angle]) == pytest.approx(circle, rel=1e-9)
        assert one.small_angle_error([[0.0, angle, 0.5 * angle]]) == pytest.approx(circle, rel=1e-9)
    assert four_bar().small_angle_error([0.0]) == 0.0


def test_free_links_fall_together_and_keep_their_momentum():
    """Two links on a hinge, free in the plane: five motions less a constraint each way, and a fall without bending."""
    two = Linkage(
        links={"front": {"x": "2 mm", "z": "1 mm", **CRANK}, "rear": {"x": "-3 mm", "z": "0 mm", **CRANK}},
        hinges={"waist": {"between": ["front", "rear"], "x": "0 mm", "z": "2 mm", "stiffness": 1e-6}},
        places={"foot": {"link": "front", "x": "4 mm", "z": "-1 mm"}},
    )
    assert two.coordinates == ("front_x", "front", "front_pitch", "rear_pitch")
    mass = two.matrices().mass
    for way, point in ((two.vertical(), "rear"), (two.horizontal(), "rear_x")):
        assert way @ mass @ way == pytest.approx(2.0 * MASS, rel=1e-14)
        assert two.row(point) @ way == pytest.approx(1.0, rel=1e-14)
    scene = ts.Scene(
        name="fall",
        robot=ts.Robot(structure=two, feet={"foot": ts.Foot(point="foot", along="foot_x", gap="5 mm")}),
        ground=ts.Ground(gravity=ts.Gravity(acceleration=9.81), restitution={"coefficient": 0.5}),
        duration=0.04,
    )
    run = ts.simulate(scene)
    assert run.ok and run.ledger.closure < 1e-8
    assert run.events["time"][0] == pytest.approx(math.sqrt(2.0 * 5e-3 / 9.81), rel=1e-10)
    momentum = two.vertical() @ mass @ run.states([0.0, 0.03]).v
    assert momentum[1] == pytest.approx(-2.0 * MASS * 9.81 * 0.03, rel=1e-9)


BAD = [
    ({"links": {}}, "links: expected at least one link, got none"),
    ({"hinges.pin.between": ["harm"]}, "hinges.pin.between: there is no link 'harm'; did you mean 'arm'"),
    ({"hinges.pin.between": ["arm", "arm"]}, "hinges.pin.between: expected two links, got one twice"),
    ({"hinges.arm": {"between": ["arm"], "x": 0.0, "z": 0.0}}, "two points have the name 'arm'"),
    ({"hinges.held": {"between": ["arm"], "x": 1e-3, "z": 0.0}}, "hinges: they leave the links no motion"),
]


@pytest.mark.parametrize(("changes", "words"), BAD)
def test_what_is_no_linkage_is_refused(changes, words):
    given = pendulum().model_dump()
    for path, value in changes.items():
        *way, last = path.split(".")
        at = given
        for key in way:
            at[key] = dict(at[key])
            at = at[key]
        at[last] = value
    with pytest.raises(ts.InputError) as caught:
        Linkage(**given)
    assert words in str(caught.value)


def test_what_links_cannot_reach_is_refused():
    """A crank that turns away from where coupler and rocker reach."""
    bars = four_bar().model_dump()
    bars["links"]["right"]["z"] = 0.5e-3
    for name, x in (("right_top", 2e-3), ("right_foot", 3e-3)):
        bars["hinges"][name] |= {"x": x, "z": 1e-3 * (name == "right_top")}
    with pytest.raises(ts.InputError, match="the hinges do not let the links go as far"):
        Linkage(**bars).small_angle_error([-1.5])
