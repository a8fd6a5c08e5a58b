"""The gallery's pictures: each is shown, small, and what the examples draw now."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def script() -> dict[str, Any]:
    return runpy.run_path(str(DOCS / "draw_gallery.py"))


def test_every_picture_is_shown_and_all_are_small(script: dict[str, Any]) -> None:
    page = (DOCS / "gallery.md").read_text(encoding="utf-8")
    names = {file.stem for file in (DOCS / "gallery").glob("*.png")}
    assert names == set(script["PICTURES"])
    assert all(f"](gallery/{name}.png)" in page for name in names)
    assert sum(file.stat().st_size for file in (DOCS / "gallery").iterdir()) < 1_000_000


def pixels(file: Path) -> np.ndarray:
    return np.asarray(Image.open(file).convert("L"), dtype=float) / 255.0


LONG = ("switch", "thirty-legs")
"""Pictures that take 26 of 31 s of CPU; the tutorial of landings and the test of the example run the same."""


@pytest.mark.full
def test_pictures_are_what_their_examples_draw(script: dict[str, Any], tmp_path: Path) -> None:
    for name in set(script["PICTURES"]) - set(LONG):
        again(script, name, tmp_path)


@pytest.mark.slow
def test_pictures_that_take_long_are_what_their_examples_draw(script: dict[str, Any], tmp_path: Path) -> None:
    for name in LONG:
        again(script, name, tmp_path)


def again(script: dict[str, Any], name: str, folder: Path) -> None:
    """Draw a picture once more: fonts and smoothing may differ, lines may not."""
    drawn, kept = pixels(script["draw"](name, folder)), pixels(DOCS / "gallery" / f"{name}.png")
    assert drawn.shape == kept.shape, f"{name}: run `python docs/draw_gallery.py`"
    assert np.abs(drawn - kept).mean() < 0.01, f"{name}: run `python docs/draw_gallery.py`"
