"""What an explorer turns: sliders, drives lowered at all their stops, and rows that run as `simulate` does."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.solve.explored import Explored

TURNED = {
    "cantilever": {"robot.feet.tip.gap": 4e-5, "ground.restitution.coefficient": 0.4, "signals.pzt.duty": 4},
    "hexapod": {"ground.film.thickness": 3e-6, "signals.pzt.amplitude": 5, "signals.pzt.frequency": 8},
    "millipede": {
        "robot.feet.L1.gap": 3e-7,
        "ground.friction.coefficient": 0.9,
        "ground.gravity.acceleration": 8.0,
        "gait.high": 2,
        "gait.frequency": 11,
    },
}
"""Values of sliders; of what drives do the number of a stop."""


@pytest.fixture(scope="module", params=TURNED)
def turned(request):
    own = {"robot.drives.R1.recovery": 0.3} if request.param == "millipede" else {}
    explored = Explored.of(ts.load_scene(request.param, **own), 0.06)
    stops = {one.paths[0]: one.stops for one in explored.sliders if one.stops}
    values = {path: stops[path][of] if path in stops else of for path, of in TURNED[request.param].items()}
    return explored, values


def test_a_turned_row_runs_as_the_changed_scene(turned):
    explored, values = turned
    times = np.linspace(0.0, explored.seconds, 60)
    code, events, rows, measures = explored.shown(times, values)
    run = ts.simulate(explored.changed(values), explored.seconds)
    wanted = run.motion.log.events
    assert code == 0 and len(wanted) > 15
    np.testing.assert_array_equal(events[:, 1:3], wanted[:, 1:3])
    np.testing.assert_allclose(events[:, 0], wanted[:, 0], rtol=0.0, atol=1e-10)
    assert explored.scene.gait is None or run.measures["cost_of_transport"].value > 0.0
    for name, found in zip(explored.measures, measures, strict=True):
        one = run.measures[name]
        size = 0.0 if np.isnan(one.value) else 1e-8 * abs(one.value)
        np.testing.assert_allclose(found, [one.value, one.spread, one.n], rtol=1e-7, atol=size, err_msg=name)
    series = run.variables(times)
    feet, drives = len(explored.scene.robot.feet), len(explored.scene.robot.drives)
    shown = iter(np.split(rows.T[1:], np.cumsum([drives, feet, feet, feet])))
    for name in ("volts", "gap", "contact_force", *(["friction_force"] if "friction_force" in series else [])):
        own, found = np.asarray(series[name].values, dtype=float), next(shown)
        np.testing.assert_allclose(found, own, rtol=0.0, atol=1e-6 * np.abs(own).max(), err_msg=name)


def test_ranges_are_those_of_the_provenance_and_of_the_user():
    scene = ts.load_scene("cantilever")
    sliders = {one.paths[0]: one for one in Explored.of(scene, 0.02, drives=["signals.pzt.amplitude"]).sliders}
    restitution, gap = sliders["ground.restitution.coefficient"], sliders["robot.feet.tip.gap"]
    assert (restitution.low, restitution.high) == scene.interval("ground.restitution.coefficient")
    assert restitution.known and not gap.known
    assert gap.log and gap.high / gap.low == pytest.approx(16.0)
    assert sliders["signals.pzt.amplitude"].value in sliders["signals.pzt.amplitude"].stops
    assert "signals.pzt.frequency" not in sliders
    ends = {"robot.feet.tip.gap": ("50 um", "90 um")}
    chosen = ts.explore("cantilever", duration=0.02, over=ends, drive=[]).sliders
    assert chosen["robot.feet.tip.gap"] == (7e-5, pytest.approx(5e-5), pytest.approx(9e-5))
    assert not any(path.startswith("signals.") for path in chosen)


def test_numbers_of_many_feet_that_are_alike_are_one_slider():
    explored = Explored.of(ts.load_scene("millipede-30"), 0.01, drives=["gait.high"])
    gaps = [one for one in explored.sliders if one.paths[0].startswith("robot.feet.")]
    assert [len(one.paths) for one in gaps] == [30]
    assert explored.row({gaps[0].paths[0]: 2e-7})["rows.sources"][:30].tolist() == [2e-7] * 30
    assert len(explored.lattice.pool) <= 4 * 81, "legs that a gait moves alike share what was lowered"


def test_gravity_on_an_incline_is_turned_by_its_acceleration_and_by_the_incline():
    """Both write the same two numbers of the packet, g cos(a) and g sin(a)."""
    scene = ts.load_scene("millipede")
    flat = {one.paths[0] for one in Explored.of(scene, 0.02, drives=[]).sliders}
    assert "ground.gravity.acceleration" in flat and "ground.incline" not in flat
    tilted = Explored.of(ts.with_values(scene, {"ground.incline": 0.05}), 0.04, drives=[])
    (incline,) = [one for one in tilted.sliders if one.paths[0] == "ground.incline"]
    assert (incline.low, incline.high, incline.log) == (-0.1, 0.1, False)
    for values in ({"ground.incline": -0.08, "ground.gravity.acceleration": 5.0}, {"ground.gravity.acceleration": 7.0}):
        into, along = tilted.row(values)["rows.sources"][-2:]
        angle, pull = values.get("ground.incline", 0.05), values["ground.gravity.acceleration"]
        assert (into, along) == pytest.approx((pull * np.cos(angle), pull * np.sin(angle)), rel=1e-15)
        _, events, _, _ = tilted.shown(np.array([0.0, 0.04]), values)
        wanted = ts.simulate(tilted.changed(values), 0.04).motion.log.events
        np.testing.assert_array_equal(events[:, 1:3], wanted[:, 1:3])
        np.testing.assert_allclose(events[:, 0], wanted[:, 0], rtol=0.0, atol=1e-10)


def test_a_drive_without_a_capacitance_has_no_cost_of_transport():
    bare = Explored.of(ts.load_scene("millipede", **{"robot.drives.R1.capacitance": None}), 0.1, drives=[])
    _, _, _, measures = bare.shown(np.array([0.0, 0.1]))
    assert np.isnan(measures[bare.measures.index("cost_of_transport"), 0])
