"""What is drawn over an atlas: cuts of studies, curves of files, what branches find."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene
from tarsus.atlas.overlays import overlays_of
from tarsus.atlas.verb import AtlasPlan
from tarsus.model.scene import Initial
from tarsus.report.atlas_page import atlas_html

ELECTRO, RATE = "ground.electrostatic.coefficient", "ground.adhesion.rate"


@pytest.fixture(scope="module")
def beam():
    gap, volts = ("robot.feet.tip.gap", "60 um", "80 um"), ("signals.pzt.amplitude", "6 V", "8 V")
    return ts.atlas("cantilever", x=gap, y=volts, depth=1)


@pytest.fixture(scope="module")
def walker():
    """A map of the millipede over both numbers of Figs 4.8 and 4.10, of which nothing was run."""
    scene = ts.load_scene("millipede")
    x, y = (ELECTRO, 1e-22, 1e-16, "log"), (RATE, 1e-8, 0.1, "log")
    axes = AtlasPlan.of(scene, x, y, depth=1).axes
    made = ts.atlas("cantilever", x=("robot.feet.tip.gap", 6e-5, 8e-5), y=("signals.pzt.amplitude", 6, 8), depth=1)
    return dataclasses.replace(made, scene=scene, x=axes[0], y=axes[1])


def test_the_cuts_of_figures_cross_on_the_map(walker):
    along, up = (overlays_of(walker, name)[0] for name in ("millipede-electrostatics", "millipede-adhesion"))
    (line,), (other,) = along.lines, up.lines
    own = [ts.get_value(walker.scene, path) for path in (ELECTRO, RATE)]
    assert walker.x.share(walker.x.at(0.3)) == pytest.approx(0.3)
    assert np.ptp(line[:, 1]) == 0.0 and line[0, 1] == own[1] and line[[0, -1], 0] == pytest.approx([1e-22, 1e-16])
    assert np.ptp(other[:, 0]) == 0.0 and other[0, 0] == own[0] and other[[0, -1], 1] == pytest.approx([1e-8, 0.1])
    assert [one.name for one in walker.overlaid("millipede-electrostatics").overlays] == [along.name]
    packaged = overlays_of(dataclasses.replace(walker, x=walker.y, y=walker.x), "millipede-map")
    assert len(packaged) == 2 and all("Fig. 4." in one.name for one in packaged)


def test_a_study_of_several_values_of_the_other_number_is_as_many_lines(walker):
    axes = AtlasPlan.of(
        walker.scene, (RATE, 1e-8, 0.1, "log"), ("ground.restitution.coefficient", 0.0, 1.0), depth=1
    ).axes
    (cuts,) = overlays_of(dataclasses.replace(walker, x=axes[0], y=axes[1]), "millipede-adhesion")
    assert [line[0, 1] for line in cuts.lines] == [0.1, 0.3, 0.5, 0.7, 0.9]


def test_a_curve_is_read_from_a_table(beam, tmp_path):
    file = tmp_path / "border.csv"
    file.write_text("gap,volts\n6e-5,6\n7e-5,7.5\n8e-5,8\n", encoding="utf-8")
    found = beam.overlaid(file)
    assert found.overlays[0].name == "border" and len(beam.overlays) == 0
    assert found.overlays[0].lines[0].tolist() == [[6e-5, 6.0], [7e-5, 7.5], [8e-5, 8.0]]
    assert ">border</text>" in atlas_html(found) and ">border</text>" not in atlas_html(beam)


@pytest.mark.parametrize(
    ("word", "sentence"),
    [
        ("cantilever-adhesion", "varies neither robot.feet.tip.gap nor signals.pzt.amplitude"),
        ("millipede-adhesion", "is a study of millipede, and the map is of cantilever"),
        ("none.csv", "no such file"),
        ("millipede-adhesoin", "did you mean 'millipede-adhesion'"),
    ],
)
def test_what_cannot_be_drawn_is_said(beam, tmp_path, word, sentence):
    with pytest.raises(ts.InputError, match=sentence):
        beam.overlaid(word)
    with pytest.raises(ts.InputError, match="a number of lines of 1 or more"):
        beam.overlaid(branch=0)
    (tmp_path / "x.csv").write_text("gap,volts\n6e-5,six\n", encoding="utf-8")
    with pytest.raises(ts.InputError, match="a curve has two columns of numbers"):
        beam.overlaid(tmp_path / "x.csv")


@pytest.mark.slow
def test_branches_mark_where_the_motion_of_a_ball_doubles_its_period():
    start = Initial(displacement=(0.12,), velocity=(0.0,))
    ball = scene("vibrating_table").model_copy(update={"initial": start})
    x, y = ("signals.table.amplitude", 1.69, 1.72), ("ground.restitution.coefficient", 0.42, 0.44)
    found = ts.atlas(ball, x=x, y=y, depth=1, periods=16).overlaid(branch=1, threads=1)
    flips = [one for one in found.overlays if one.name.startswith("flip")]
    assert flips and flips[0].marks
    places, e = flips[0].lines[0], 0.43
    flip = np.hypot(np.pi * (1 - e) / (1 + e), 2 * (1 + e * e) / (1 + e) ** 2)
    assert np.abs(places[:, 0] - flip).min() < 1e-6 and places[:, 1] == pytest.approx(e)


def test_a_packaged_map_draws_its_closed_forms():
    found = ts.atlas("ball-on-table-map", depth=2, coarse=2)
    assert (found.x.path, found.y.path) == ("ground.restitution.coefficient", "signals.table.amplitude")
    lift, bounce, flip = (one.lines[0] for one in found.overlays)
    e = bounce[:, 0]
    born = np.pi * (1 - e) / (1 + e)
    np.testing.assert_allclose(bounce[:, 1], born, rtol=1e-7)
    np.testing.assert_allclose(flip[:, 1], np.hypot(born, 2 * (1 + e * e) / (1 + e) ** 2), rtol=1e-7)
    assert found.class_at(0.3, 0.95) == "period 1, stays on the ground" and set(lift[:, 1]) == {1.0}
    assert found.class_at(0.7, 0.95) == "period 1"
    shares = [found.share(code) for code in found.classes]
    assert shares == sorted(shares, reverse=True) and sum(shares) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"x": ("ground.restitution.coefficient", 0.1, 0.9)}, "an atlas has two axes; give both"),
        ({}, "no study is called 'hexapod-table'"),
    ],
)
def test_an_atlas_without_axes_is_a_study_of_two_numbers(given, sentence):
    with pytest.raises(ts.InputError, match=sentence):
        ts.atlas("hexapod-table", **given)
    with pytest.raises(ts.InputError, match="an atlas is over two numbers, each by itself"):
        ts.atlas("millipede-ground")
