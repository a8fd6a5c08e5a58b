"""Figures for notebooks: what is drawn are the numbers of the result."""

from __future__ import annotations

import re
from dataclasses import replace

import matplotlib

matplotlib.use("Agg")

import numpy as np
import pytest
from matplotlib import pyplot

import tarsus as ts
from scene_files import scene
from tarsus.base.errors import InputError
from tarsus.orbits.branches import Branch, Branches, BranchPoint
from tarsus.report.branch_page import branch_html


@pytest.fixture(scope="module")
def run() -> ts.Run:
    return ts.simulate(ts.load_scene("mems-switch"))


@pytest.fixture(autouse=True)
def closed():
    settings = dict(matplotlib.rcParams)
    yield
    pyplot.close("all")
    assert dict(matplotlib.rcParams) == settings


def test_a_run_draws_its_motion_and_its_contact(run):
    axes = run.plot()
    (line,) = axes.get_lines()
    assert line.get_label() == "beam" and line.get_ydata().min() == pytest.approx(-2.6e-6, abs=1e-15)
    assert axes.get_ylabel() == "displacement (µm)" and axes.get_xlabel() == "time (ms)"
    axes.figure.draw_without_rendering()
    assert {"0", "−1", "−2"} <= {word.get_text() for word in axes.get_yticklabels()}
    assert len(axes.collections[0].get_paths()) == 2  # closed twice
    _, own = pyplot.subplots()
    assert ts.plot.motion(run, ["beam"], axes=own) is own
    with pytest.raises(InputError, match="has no 'baem'; did you mean 'beam'"):
        run.plot(points=["baem"])


def test_impacts_and_account_are_those_of_the_run(run):
    (dots,) = ts.plot.impacts(run).get_lines()
    assert dots.get_ydata() == pytest.approx([0.23378, 0.23327], abs=1e-5)
    axes = ts.plot.ledger(run)
    words = [word.get_text() for word in axes.get_yticklabels()]
    bars = dict(zip(words, (bar.get_width() for bar in axes.patches), strict=True))
    assert bars["electrostatic"] == pytest.approx(run.ledger.laws["electrostatic"])
    assert sum(bars.values()) == pytest.approx(0.0, abs=1e-9 * bars["electrostatic"])  # what went in is told
    with pytest.raises(InputError, match="the robot has no foot 'tip'"):
        ts.plot.impacts(run, "tip")


def test_a_batch_draws_a_measure_over_one_number_or_a_grid_of_two():
    held = ts.load_scene("mems-switch", **{"signals.gate": ts.Constant(level=90.0)})
    levels = np.array([100.0, 85.0, 90.0])
    batch = ts.simulate_batch(held, {"signals.gate.level": levels}, 1e-4)
    axes = batch.plot("hardest_impact")
    (line,) = axes.get_lines()
    assert line.get_xdata() == pytest.approx([85.0, 90.0, 100.0])
    assert line.get_ydata() == pytest.approx(np.sort(batch.measure("hardest_impact"))), "more with volts"
    over = {"signals.gate.level": levels, "robot.feet.beam.gap": [2.6e-6, 2.4e-6]}
    grid = ts.simulate_batch(held, over, 1e-4, grid=True)
    image = grid.plot("hardest_impact").collections[0].get_array()
    assert image.shape == (3, 2)
    assert image[1, 1] == pytest.approx(233.78, abs=0.01)  # 90 V, 2.6 um
    scattered = ts.simulate_batch(held, over | {"robot.feet.beam.gap": [2.6e-6] * 3}, 1e-4).plot("hardest_impact")
    assert [line.get_linestyle() for line in scattered.get_lines()] == ["None"], "dots over the first number"
    with pytest.raises((InputError, KeyError), match="there is no measure 'hardest_impct'"):
        batch.plot("hardest_impct")


def test_multipliers_of_a_pair_are_one_curve_and_small_ones_are_not_drawn():
    orbit = ts.periodic(scene("impact_oscillator"))
    for multipliers, words in {
        (0.5 + 0.1j, 0.5 - 0.1j): {"largest two, a pair"},
        (0.5, 0.2): {"largest", "second"},
        (0.5, 1e-7): {"largest"},
        (1e-6, 1e-7): set(),
    }.items():
        given = replace(orbit)
        vars(given)["multipliers"] = np.array(multipliers, dtype=complex)  # which it would work out when first asked
        branches = (Branch(tuple(BranchPoint(at, "orbit", given) for at in (1.0, 1.1)), "", "", ""),)
        found = Branches(scene("impact_oscillator"), "signals.shaker.amplitude", "V", (1.0, 1.1), 0, branches)
        text = branch_html(found)
        assert set(re.findall(r">(largest(?:[^<|]*)|second)</text>", text)) == words
        assert ("All multipliers are below" in text) is (not words)


def test_a_landing_is_drawn_beside_the_step():
    fast = dict(tick=10e-9, shortest=1e-6, effort=0.02)
    design = ts.design.landing(
        ts.load_scene("mems-switch"), "beam", pairs=1, levels="0 V, 90 V", risk="nominal", **fast
    )
    step, softer = ts.plot.landing(design).get_lines()
    assert step.get_ydata().min() == pytest.approx(0.0, abs=1e-15) and softer.get_ydata()[0] > 2e-6
    assert repr(design).startswith("<LandingDesign of 'mems-switch': ") and len(repr(design)) < 120
    page = design._repr_html_()
    assert page.count("<tr>") == 1 + len(design.signal.levels) and "instead of 233.3 mm/s" in page


def test_scenes_and_measures_are_tables(run):
    (row,) = [row for row in run.scene.table().rows if row[0] == "robot.structure.frequencies"]
    assert row[1].startswith("21\N{NO-BREAK SPACE}kHz") and row[2] == "printed"
    paths = [row[0] for row in ts.load_scene("millipede-30").table().rows]
    assert len(paths) < 80 and "robot.structure.legs.*.x\nall 30" in paths
    (impact,) = [row for row in run.measures.table().rows if row[0] == "hardest impact"]
    assert impact[1] == run.measures["hardest_impact"].value == pytest.approx(0.2333, rel=1e-3)
    assert repr(run.measures).startswith("<Measures: bounces, ")
