"""Walks as moving pictures."""

import subprocess

import numpy as np
import pytest
from PIL import Image

import tarsus as ts
from example_files import load
from tarsus.report.movie import CAPTION


@pytest.mark.slow
def test_a_movie_shows_a_period_and_filled_feet_on_the_ground(tmp_path):
    walk = ts.simulate("millipede-printed", "30 ms")
    assert 0.0 < walk.variables()["contact"].values.mean() < 1.0
    with Image.open(ts.movie(walk, tmp_path / "walk.gif", width=240, periods=1)) as movie:
        assert movie.size[0] == 240 and 40 <= movie.n_frames <= 49 and movie.info["loop"] == 0
        dark, seen = [], set()
        for frame in range(0, movie.n_frames, 4):
            movie.seek(frame)
            pixels = np.asarray(movie.convert("RGB")).astype(int)
            dark.append(int((pixels[CAPTION:].max(axis=-1) < 80).sum()))
            seen.add(pixels.tobytes())
    assert len(seen) > 8  # it moves
    assert max(dark) - min(dark) > 10  # a foot is filled while it is stuck; outlines and ground stay as they are


@pytest.mark.ffmpeg
def test_a_webm_has_the_frames_of_the_gif(tmp_path):
    walk = ts.simulate("millipede-printed", "30 ms")
    with Image.open(ts.movie(walk, tmp_path / "walk.gif", width=240, periods=1)) as movie:
        count, size = movie.n_frames, movie.size
        movie.seek(count // 2)
        wanted = np.asarray(movie.convert("L")).astype(float)
    film = ts.movie(walk, tmp_path / "walk.webm", width=240, periods=1)
    command = ["ffmpeg", "-loglevel", "error", "-i", film, "-f", "rawvideo", "-pix_fmt", "gray", "-"]
    raw = np.frombuffer(subprocess.run(command, capture_output=True, check=True).stdout, dtype=np.uint8)
    wide, high = (side + side % 2 for side in size)
    frames = raw.reshape(-1, high, wide)
    assert abs(len(frames) - count) <= 1  # a GIF holds equal frames once, for longer
    middle = frames[count // 2, : size[1], : size[0]].astype(float)
    assert np.corrcoef(middle.ravel(), wanted.ravel())[0, 1] > 0.9


def test_a_webm_without_ffmpeg_and_other_endings_are_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    walk = ts.simulate("millipede-printed", "12 ms")
    for name, said in (("walk.webm", "a WebM needs ffmpeg on the path"), ("walk.mp4", "ending in .gif or .webm")):
        with pytest.raises(ts.InputError, match=said):
            ts.movie(walk, tmp_path / name)


@pytest.mark.parametrize("name", ["cantilever", "hexapod"])
def test_robots_without_legs_move_too(tmp_path, name):
    with Image.open(ts.movie(name, tmp_path / "a.gif", width=160, periods=1, duration="25 ms")) as movie:
        seen = set()
        for frame in range(0, movie.n_frames, 6):
            movie.seek(frame)
            seen.add(movie.convert("L").tobytes())
    assert len(seen) > 4


@pytest.mark.slow
def test_readme_walk_py_makes_the_picture_of_the_readme(tmp_path, capsys, monkeypatch):
    target = tmp_path / "walk.gif"
    monkeypatch.setattr("sys.argv", ["readme_walk.py", str(target)])
    load("readme_walk")
    assert "the robot walks at" in capsys.readouterr().out and 5e4 < target.stat().st_size < 1e6
