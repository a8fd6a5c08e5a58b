"""The page of an atlas: a pixel of its map for every point, a run of each class, and how much of it there is."""

from __future__ import annotations

import base64
import io
import re

import numpy as np
import pytest
from PIL import Image

import tarsus as ts
from tarsus.atlas.cells import MEASURES
from tarsus.atlas.classes import words
from tarsus.atlas.quadtree import Quadtree
from tarsus.atlas.result import Atlas
from tarsus.report.atlas_page import atlas_html


@pytest.fixture(scope="module")
def beam() -> Atlas:
    gap, volts = ("robot.feet.tip.gap", "80 um", "90 um"), ("signals.pzt.amplitude", "4 V", "6 V")
    return ts.atlas("cantilever", x=gap, y=volts, depth=4, coarse=2)


@pytest.fixture(scope="module")
def text(beam) -> str:
    return atlas_html(beam)


def test_a_pixel_of_the_map_is_the_class_of_its_point(beam, text):
    found = re.search(r'base64,([^"]+)" id="\w+" width="17" height="17" transform="matrix\(\S+ 0 0 -', text)
    assert found, "its own size, drawn upward"
    pixels = np.array(Image.open(io.BytesIO(base64.b64decode(found[1]))).convert("RGB")).astype(int)
    colours = dict(zip(map(tuple, pixels.reshape(-1, 3).tolist()), beam.grid.code.T.ravel().tolist(), strict=True))
    assert len(colours) == len(beam.classes) > 2
    shown = [[colours[tuple(one)] for one in row] for row in pixels.tolist()]
    assert np.array_equal(shown, beam.grid.code.T)
    for code in beam.classes:
        colour = next("#{:02x}{:02x}{:02x}".format(*one) for one, of in colours.items() if of == code)
        assert colour in text, f"the key of {words(code)}"


def test_a_run_of_each_class_is_named(beam, text):
    line = r"<dt>([^<]+)</dt><dd>tarsus simulate scene\.toml --set (\S+)=(\S+) --set (\S+)=(\S+) --duration \S+s</dd>"
    found = re.findall(line, text)
    assert {one[0] for one in found} == {words(code) for code in beam.classes}
    for name, x, gap, y, volts in found:
        assert (x, y) == (beam.x.path, beam.y.path) and beam.class_at(float(gap), float(volts)) == name


def test_a_large_page_is_below_4_mb(beam):
    """A map of 1025 points each way of which 90,000 are run, with measures that no picture packs."""

    def ask(points):
        return (np.hypot(*(points.T / 1024 - 0.5)) * 5).astype(np.int16) % 3 * 16 + 17

    grid = Quadtree.refined(10, 7, ask)
    code = grid.code[grid.points[:, 0], grid.points[:, 1]]
    measures = {name: np.random.default_rng(0).random(len(code)) for name in MEASURES if name != "motions"}
    text = atlas_html(Atlas(beam.scene, beam.x, beam.y, 1, grid, code, code[:, None], measures))
    assert 'width="513" height="513"' in text and len(text.encode()) <= 4_000_000
