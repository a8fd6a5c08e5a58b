"""What a run asks to be cited."""

from __future__ import annotations

import re

import tarsus as ts
from scene_files import scene


class Sticky(ts.SmoothLaw):
    """A law with a source of its own."""

    source = "Sticky feet & other forces, Journal of Feet, 2019"
    pull: float = ts.quantity("N", "pull", default=1e-9)

    @staticmethod
    def force(gap, gap_rate, volts, time, pull):
        return -pull


def entries(text: str) -> dict[str, str]:
    found = dict(re.findall(r"^@(\w+\{[\w-]+),\n(.*?)\n\}$", text, re.MULTILINE | re.DOTALL))
    assert text.count("{") == text.count("}")
    return found


def test_a_run_cites_the_library_its_device_and_its_laws_once(tmp_path):
    scene = ts.with_values(ts.load_scene("cantilever"), {"ground.laws.sticky": Sticky()})
    run = ts.simulate(scene, "1 ms")
    found = entries(run.citations())
    assert list(found) == ["software{tarsus", "phdthesis{tarsus-source-1", "misc{tarsus-source-2"]
    assert f"version = {{{ts.__version__}}}" in found["software{tarsus"]
    assert "Walking Micro-Robots" in found["phdthesis{tarsus-source-1"] and "chapter 2" in run.citations()
    assert "Sticky feet \\& other forces" in found["misc{tarsus-source-2"]
    assert "year = {2019}" in found["misc{tarsus-source-2"]
    assert ts.load_run(run.write(tmp_path / "run"), {"sticky": Sticky}).citations() == run.citations()


def test_a_scene_of_ones_own_cites_the_laws_it_uses():
    ball = scene("ball")
    assert list(entries(ts.simulate(ball, "1 ms").citations())) == ["software{tarsus"]
    film = ts.with_values(ball, {"ground.film": ts.Film(coefficient=1e-21, thickness="3 um")})
    assert "phdthesis{tarsus-source-1" in entries(ts.simulate(film, "1 ms").citations())
