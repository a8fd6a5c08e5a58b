"""What the report of a walker's run shows, from runs of the engine."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from html_page import alone
from packed_series import unpacked
from tarsus.base.events import TRANSITIONS, FootState
from tarsus.report.motion import AIR, SLIPPING, STUCK, Motion, motion_of, whole_motion
from tarsus.report.player import walk_figure
from tarsus.report.run_page import report_html
from tarsus.report.walk_figures import ground_forces, path_above, travel
from tarsus.solve.run import Run
from walking_devices import creeping_millipede, walk


@pytest.fixture(scope="module")
def run() -> Run:
    return ts.simulate(creeping_millipede(), duration=0.06)


@pytest.fixture(scope="module")
def motion(run: Run) -> Motion:
    return whole_motion(run)


def test_motion_is_that_of_the_run(run: Run, motion: Motion) -> None:
    data = run.to_dataset()
    assert motion.legs == tuple(run.scene.robot.structure.legs)
    assert motion.period == pytest.approx(0.02)
    np.testing.assert_array_equal(motion.time, data["time"].values)
    np.testing.assert_array_equal(motion.body["surge"], data["body"].sel(coordinate="surge").values)
    np.testing.assert_array_equal(motion.hip_shift_z[0], data["displacement"].sel(point=f"{motion.legs[0]}_hip").values)
    np.testing.assert_allclose(motion.foot_z, data["gap"].values, atol=1e-18)
    np.testing.assert_allclose(motion.foot_x, data["foot_x"].values, atol=1e-18)
    np.testing.assert_array_equal(motion.normal, data["contact_force"].values)
    np.testing.assert_array_equal(motion.friction, data["friction_force"].values)
    np.testing.assert_array_equal(motion.state > AIR, data["contact"].values)
    assert {AIR, STUCK, SLIPPING} == set(np.unique(motion.state))


def test_a_long_run_is_shown_by_its_last_periods_and_taken_anew_where_it_is_too_coarse(
    run: Run, motion: Motion
) -> None:
    few = motion_of(run, most=128)
    assert (few.time[0], few.time[-1]) == pytest.approx((0.02, 0.06), abs=5e-6), "to a sample"
    whole = motion_of(run, most=192)
    assert (whole.time[0], whole.time[-1]) == pytest.approx((0.0, 0.06))
    fine = motion_of(run, most=128, whole=motion.taken(slice(0, None, 400)))
    assert len(few.time) == len(fine.time) == 128 and (fine.time[0], fine.time[-1]) == pytest.approx((0.02, 0.06))
    surge = np.interp(fine.time, motion.time, motion.body["surge"])
    np.testing.assert_allclose(fine.body["surge"], surge, atol=1e-8)


def test_a_leg_without_a_foot_swings_over_the_ground_of_the_others() -> None:
    scene = creeping_millipede()
    feet = {name: foot.model_copy(update={"gap": 3e-6}) for name, foot in scene.robot.feet.items() if name != "R1"}
    robot = scene.robot.model_copy(update={"feet": feet})
    motion = whole_motion(ts.simulate(scene.model_copy(update={"robot": robot}), duration=0.02))
    assert motion.legs == ("L1", "R1")
    assert np.all(motion.state[1] == AIR) and np.all(motion.normal[1] == 0.0)
    assert motion.foot_z[1, 0] == pytest.approx(3e-6)


def test_sections_of_the_page(run: Run, monkeypatch) -> None:
    monkeypatch.setattr("tarsus.files.summary.MOST_FEET_LISTED", 1)
    page = alone(report_html(run))
    headings = ["The walk", "Measures", "Forces", "Energy", "Events", "Values of this run"]
    positions = [page.text.index(f" {heading} ") for heading in headings]
    assert positions == sorted(positions) and "least foot largest foot" in page.text
    for label in ("travel", "Footfalls", "Force of the ground on every foot", "slip begins", "lost to friction"):
        assert label in page.text


def test_turns_that_the_run_does_not_resolve_are_told_and_not_drawn() -> None:
    """Of a body that rises by 10 um a roll of 1 nrad is rounding, one of 1 mrad is none."""
    motion = walk(10, 0.02)
    wave = np.sin(300.0 * motion.time)
    for size, drawn in ((1e-3, True), (1e-9, False)):
        body = {"surge": 1e-5 * wave, "heave": 1e-5 * wave, "roll": size * wave}
        figure = travel(replace(motion, body=body))
        assert ("roll (mrad)" in figure.picture) is drawn, size
        assert ("not resolve" in figure.caption) is not drawn
        assert drawn or "Its roll stays within 2·10⁻⁹ rad" in figure.caption


def test_impacts_at_landings_do_not_press_the_other_forces_to_a_line() -> None:
    """Of ten feet that push with 1 uN, one has an impact of 100 uN for one sample: rows stay as high as the push."""
    motion = walk(10, 0.08)
    state, normal = np.full_like(motion.state, STUCK), np.full_like(motion.normal, 1e-6)
    normal[3, motion.normal.shape[1] // 2] = 1e-4
    pushed = replace(motion, state=state, normal=normal, friction=0.0 * normal)
    figure = ground_forces(pushed, (0.0, float(motion.time[-1])))
    assert "from one line to the next is 1.6 µN" in figure.caption and "the largest is 100 µN" in figure.caption
    calm = ground_forces(replace(pushed, normal=np.full_like(normal, 1e-6)), (0.0, float(motion.time[-1])))
    assert "cut" not in calm.caption
    drawn = json.loads(re.search(r'charts-data">(.*?)</script>', calm.picture)[1])["panels"][0]["series"][0]
    assert np.nanmax(unpacked(drawn["values"], 1, gaps=True)) < 0.0, "upward, where rows count downward"


def test_the_committed_picture_of_a_foot_s_states_names_all_that_the_engine_s_table_has() -> None:
    committed = (Path(__file__).parents[2] / "docs" / "flowchart.svg").read_text(encoding="utf-8")
    shown = re.findall(r"<text[^>]*>([^<]*)</text>", committed)
    changes = [(before, after, event) for before, after, event, _ in TRANSITIONS]
    assert len(set(changes)) == len(changes) and {one for pair in changes for one in pair[:2]} == set(FootState)
    assert {state.words for state in FootState} <= set(shown), "run `python docs/draw_flowchart.py`"
    for number, (before, after, event) in enumerate(changes, 1):
        assert {f"{number}  {event}", f"{before.words} → {after.words}", event} <= set(shown)


@pytest.mark.slow
def test_the_page_says_how_the_ground_rises_and_where_gravity_pulls(motion: Motion) -> None:
    level, rising = (walk_figure(replace(motion, incline=angle)) for angle in (0.0, 0.5235987755982988))
    assert "The ground rises forward by 30 deg" in rising.caption and "rises" not in level.caption
    assert '"incline":0.5235987755982988' in rising.picture.replace(" ", "")


def test_path_from_above_is_to_scale() -> None:
    run = ts.simulate(ts.load_scene("turning-hexapod"), duration=0.1)
    figure = path_above(whole_motion(run))
    series, picture = run.variables(), str(figure.picture)
    drawn = re.findall(r'<path d="([^"]*)"[^>]*style="([^"]*)"', picture)
    lines = [
        np.array(re.findall(r"[ML] ?([-\d.]+) ([-\d.]+)", path), float) for path, style in drawn if "none" in style
    ]
    points = max(lines, key=len)
    place = np.array([series[name].values for name in ("path_x", "path_y")])
    scale = (points[-1, 0] - points[0, 0]) / (place[0, -1] - place[0, 0])
    np.testing.assert_allclose(points[-1] - points[0], scale * (place[:, -1] - place[:, 0]) * [1, -1], atol=0.5)
    sides = [np.linalg.norm(np.diff(one, axis=0), axis=1) / scale for one in lines if 4 <= len(one) <= 5]
    bodies = [one for one in sides if max(one) == pytest.approx(30e-3, rel=0.02)]
    assert len(bodies) == 7
    last = np.diff([one for one in lines if len(one) == 2][-1], axis=0)[0]
    yaw = float(series["body"].values[list(run.scene.robot.structure.body_coordinates).index("yaw"), -1])
    assert np.arctan2(-last[1], last[0]) == pytest.approx(yaw, abs=1e-3) and abs(yaw) > 0.02
    assert picture in report_html(run)
