"""The page of a robot's reproduction, and circular plots of several points."""

from __future__ import annotations

import re
from functools import lru_cache

import numpy as np
import pytest

import tarsus as ts
from tarsus.impacts.energy import creation_warning
from tarsus.report.circular import dials
from tarsus.report.run_page import report_html
from tarsus.report.series import Trace, last_turns, point_trace
from tarsus.report.sheet import figure_style
from tarsus_reproduce.impacts import impact_energies
from tarsus_reproduce.mixtures import packaged_members
from tarsus_reproduce.pages.robot import robot_html
from tarsus_reproduce.robot_runs import STEADY, RobotRuns, robot_runs, settling_time, share_made
from tarsus_reproduce.robots import RobotReproduction, reproduce_robot
from unit.html_page import Page

SECTIONS = [
    "Heights and bounces",
    "Motion over the ground",
    "Motion in the air",
    "Modes and the printed impact matrix",
    "Impact maps",
]

NOT_PASSIVE = {"ground.impact": {"kind": "dominant_mode", "passive": False}}


@lru_cache
def runs_of(robot: str) -> RobotRuns:
    return robot_runs(robot)


@pytest.fixture(scope="module", params=["hexapod", pytest.param("quadruped", marks=pytest.mark.slow)])
def found(request: pytest.FixtureRequest) -> tuple[RobotReproduction, RobotRuns, str]:
    few = packaged_members(request.param)[:2] or None  # all of the mixture's members are in the slow lane
    reproduction = reproduce_robot(request.param, few, seeds=2)
    runs = runs_of(request.param)
    return reproduction, runs, robot_html(reproduction, runs)


def test_every_section_is_there_in_order(found: tuple[RobotReproduction, RobotRuns, str]) -> None:
    reproduction, _, text = found
    page = Page(text)
    positions = [page.text.index(section) for section in SECTIONS]
    assert positions == sorted(positions)
    figures = [int(n) for n in re.findall(r"<b>Figure (\d+)\.</b>", text)]
    assert figures == list(range(1, len(figures) + 1))
    assert len(figures) == (6 if reproduction.rows else 5)
    assert "nan" not in re.sub("dominant", "", page.text)
    for row in reproduction.rows:
        assert row.role in page.text.replace("\N{NO-BREAK SPACE}", " ")


def test_page_needs_nothing_from_outside(found: tuple[RobotReproduction, RobotRuns, str]) -> None:
    _, _, text = found
    page = Page(text)
    assert len(text.encode()) < 1_500_000
    assert not {"link", "img"} & set(page.tags) and ("script", "src") not in {
        one[:2] for one in page.attributes
    }
    for _, name, value in page.attributes:
        if name in ("src", "href", "xlink:href"):
            assert value.startswith("#"), value
    assert not re.findall(r"url\((?!#)", text)
    assert "http" not in re.sub(r'xmlns(:\w+)?="[^"]*"', "", text)


def test_figures_are_of_sane_size(found: tuple[RobotReproduction, RobotRuns, str]) -> None:
    _, _, text = found
    boxes = [tuple(map(float, box.split())) for box in re.findall(r'viewBox="([^"]*)"', text)]
    assert boxes
    for _, _, width, height in boxes:
        tallest = 720.0 if width > 300.0 else 1600.0  # on narrow paper panels are below each other
        assert 250.0 < width < 640.0 and 72.0 < height < tallest


def test_no_run_of_these_devices_creates_energy(found: tuple[RobotReproduction, RobotRuns, str]) -> None:
    _, runs, text = found
    assert not runs.problems
    assert runs.energies.actual.max() <= 1e-9 * np.abs(runs.energies.actual).max()
    assert "can create energy:" not in text


def test_every_point_of_the_quadruped_is_shown_and_the_hexapod_s_foot() -> None:
    (near,) = runs_of("quadruped").near
    assert near.points == ("foot1", "foot2", "body", "foot3", "foot4")
    assert {near.points for near in runs_of("hexapod").near} == {("foot1",)}


def test_height_of_a_point_without_foot_is_its_displacement_on_the_gap_at_rest() -> None:
    (near,) = runs_of("quadruped").near
    series = last_turns(near.run, 4, 500)
    gap = near.run.scene.robot.feet["foot1"].gap
    body = point_trace(series, "body", "body")
    shift = series["displacement"][series.points.index("body")]
    np.testing.assert_allclose(body.height, gap + shift, atol=1e-18)
    foot = point_trace(series, "foot1", "foot1")
    assert foot.height.min() >= -1e-9 and foot.contacts and not body.contacts


def test_motion_in_the_air_is_steady() -> None:
    for robot in ("hexapod", "quadruped"):
        for air in runs_of(robot).air:
            half = air.displacement.shape[1] // 2
            first, second = air.displacement[:, :half], air.displacement[:, half : 2 * half]
            assert np.abs(second - first).max() < 10.0 * STEADY * air.peak_to_peak.max()


def test_settling_follows_the_slowest_mode() -> None:
    scene = ts.load_scene("hexapod")
    structure = scene.robot.structure
    rates = 2.0 * np.pi * np.array(structure.frequencies) * np.array(structure.damping_ratios)
    assert settling_time(scene) == pytest.approx(-np.log(STEADY) / rates.min(), rel=1e-6)


def test_rounding_is_no_made_energy() -> None:
    assert share_made(np.array([-1.0, 1e-12, 0.5, -0.2])) == 0.25
    assert share_made(np.zeros(0)) is None


def test_the_run_s_own_map_is_the_one_that_acts() -> None:
    near = runs_of("hexapod").struck
    energies = impact_energies(near.run, "hexapod")
    scene = near.run.scene
    if scene.ground.impact is None:
        np.testing.assert_allclose(
            energies.by_map["mass-weighted"], energies.actual, atol=1e-6 * np.abs(energies.actual).max()
        )
    assert len(energies.time) == len(energies.actual)


def test_a_map_that_can_create_energy_says_so_in_the_ordinary_report() -> None:
    scene = ts.load_scene("hexapod", **NOT_PASSIVE)
    run = ts.simulate(scene, duration=0.02)
    assert "This map can create energy: the dominant mode impact map" in Page(report_html(run)).text
    passive = ts.load_scene("hexapod", **{"ground.impact": {"kind": "dominant_mode"}})
    assert creation_warning(passive) is None
    newton = ts.load_scene("hexapod", **{"ground.impact": {"kind": "mass_weighted", "passive": False}})
    assert creation_warning(newton) is None


def _turning(lowest: float) -> Trace:
    time = np.linspace(0.0, 0.1, 2001)
    height = 20e-6 + (20e-6 - lowest) * np.sin(2.0 * np.pi * time / 0.05)
    return Trace("point", time, height, np.sin(time), 0.05)


def test_a_point_below_the_ground_s_level_moves_the_centre_of_its_plot() -> None:
    with figure_style():
        above, below = (dials([_turning(lowest), _turning(lowest)]) for lowest in (5e-6, -23e-6))
    assert "the centre is the ground" in above.caption
    assert "the centre is at −40 µm, the dashed ring is the ground's level" in below.caption


def test_numbers_in_figures_keep_their_digits() -> None:
    from matplotlib.figure import Figure

    from tarsus.report.sheet import to_svg

    figure = Figure(figsize=(2.0, 2.0))
    with figure_style():
        figure.text(0.5, 0.5, "0.0012345")
        assert "0.0012345" in to_svg(figure, "digits")
