"""The drawing of robots without legs: their points, and that what they hang on follows them."""

from __future__ import annotations

import numpy as np

import tarsus as ts
from laboratory import LABORATORY
from scene_files import scene
from tarsus.report.drawing import BENT, FootMark, Shape, drawing_of
from tarsus.report.motion import Held, whole_motion
from tarsus.report.style import BLUE


def test_a_beam_goes_through_its_points_and_is_level_at_its_clamp() -> None:
    run = ts.simulate(ts.load_scene(LABORATORY), 0.04)
    moved, series = whole_motion(run), run.variables()
    drawing = drawing_of(moved)
    assert moved.held is Held.BEAM and set(moved.legs) == {"center", "tip"}
    x, z = drawing.seen(moved)
    (line,) = [part.points for part in drawing.side.parts if isinstance(part, Shape) and part.edge == BLUE]
    feet = {part.leg: part.point for part in drawing.side.parts if isinstance(part, FootMark)}
    names = [str(one) for one in series["point"].values]
    for leg, name in enumerate(moved.legs):
        risen = drawing.up * series["displacement"].values[names.index(name)]
        np.testing.assert_allclose(z[feet[leg]] - z[line[0]], risen, atol=1e-12)
        on_line = [np.interp(x[feet[leg], 0], x[list(line), 0], row) for row in z[list(line)].T[::50]]
        np.testing.assert_allclose(on_line, z[feet[leg], ::50], atol=2e-3 * np.ptp(z))
    assert np.abs(z[line[1]] - z[line[0]]).max() < 0.01 * np.ptp(z)
    figures = [part for part in drawing.side.parts if isinstance(part, Shape) and part.width == 2.0]
    assert len(figures) == 1, "the ground is below the tip alone"
    held = moved.state[moved.legs.index("tip")] > 0
    assert held.any() and np.abs(z[feet[moved.legs.index("tip")], held] - z[figures[0].points[0], 0]).max() < 1e-12
    assert np.ptp(z) <= 1.01 * BENT * drawing.length or drawing.up == 1.0


def test_robots_that_are_no_beam_have_their_points_side_by_side_and_a_loose_mass_hangs_on_nothing() -> None:
    moved = whole_motion(ts.simulate("hexapod", 0.04))
    drawing = drawing_of(moved)
    places = [drawing.side.points[part.point].x for part in drawing.side.parts if isinstance(part, FootMark)]
    assert moved.held is Held.SPRINGS and len(places) == 6
    np.testing.assert_allclose(np.diff(sorted(places)), np.ptp(places) / 5)
    loose = drawing_of(whole_motion(ts.simulate(scene("vibrating_table"), 0.04)))
    assert [type(part) for part in loose.side.parts] == [FootMark]
