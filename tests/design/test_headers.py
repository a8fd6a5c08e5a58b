"""gait.h and ticks: what a microcontroller does by them is what the scene's drives do."""

from __future__ import annotations

import re
import subprocess

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.design import gait_header_text
from tarsus.design.headers import in_ticks, neighbours


def numbers(text: str, name: str) -> list[int]:
    (found,) = re.findall(rf"{name}(?:\[\w+\])? = \{{?([-\d u,]+)\}}?;", text)
    return [int(one.strip().rstrip("u")) for one in found.split(",")]


@pytest.mark.parametrize("values", [{}, {"gait.duty": 0.7, "gait.swing_lag": 0.4, "gait.low": 20.0}])
def test_switching_by_the_header_gives_the_volts_of_the_gait(values):
    scene = ts.load_scene("hamr-like", **values)
    text = gait_header_text(scene, tick=2e-6)
    others = (scene, ts.with_values(scene, {"gait.duty": 0.51}))
    said, same, other = (
        re.findall(r'DIGEST "(\w{16})"', one) for one in (text, *(gait_header_text(own, tick=2e-6) for own in others))
    )
    assert said == same != other
    assert "LF_lift, LF_swing, RF_lift" in text and numbers(text, "gait_period_ticks") == [10_000]
    (low,), (high,) = numbers(text, "gait_low_millivolts"), numbers(text, "gait_high_millivolts")
    now = np.arange(10_000)
    edges = zip(numbers(text, "gait_rise_ticks"), numbers(text, "gait_fall_ticks"), strict=True)
    for (rise, fall), wave in zip(edges, scene.waveforms.values(), strict=True):
        up = (now - rise) % 10_000 < (fall - rise) % 10_000
        wanted = wave.volts((now + 0.5) * 2e-6)
        assert 1e-3 * np.where(up, high, low) == pytest.approx(wanted)


@pytest.mark.compiler
def test_a_c_compiler_takes_it(tmp_path):
    (tmp_path / "gait.h").write_text(gait_header_text(ts.load_scene("hamr-like")))
    (tmp_path / "main.c").write_text(
        '#include "gait.h"\nint main(void) { return gait_rise_ticks[GAIT_COUNT - 1] != 5000u; }\n'
    )
    subprocess.run(["cc", "-std=c99", "-Wall", "-o", "main", "main.c"], cwd=tmp_path, check=True)
    assert (
        subprocess.run([tmp_path / "main"], check=False).returncode == 0
    )  # RH swings a quarter of 20 ms after the start


def test_no_name_ends_a_comment():
    name = "a */ #error pwned /*/\n#error line\u202e"
    text = gait_header_text(ts.load_scene("hamr-like").model_copy(update={"name": name}))
    code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    assert "pwned" in text and "error" not in code and "/*" not in code and "*/" not in code
    assert text.count("/*") == text.count("*/") == 1 and "\u202e" not in text


def test_what_cannot_be_is_said():
    with pytest.raises(InputError, match="the scene has no gait"):
        gait_header_text(ts.load_scene("mems-switch"))
    with pytest.raises(InputError, match="expected at least 100"):
        gait_header_text(ts.load_scene("hamr-like"), tick=1e-3)


def test_ticks_fill_the_period_and_begin_with_plain_rounding():
    durations = np.array([311.4e-6, 396.6e-6, 9292e-6, 10000e-6])
    total = in_ticks(0.02, 1e-6)
    rows = neighbours(durations, total, np.random.default_rng(0))
    assert (rows.sum(axis=1) == 20000).all() and rows[0].tolist() == [311, 397, 9292, 10000] and len(rows) == 27
    many = neighbours(np.full(10, 2e-3), total, np.random.default_rng(0))
    assert many[0].tolist() == [2000] * 10 and (np.abs(np.cumsum(many, axis=1) - np.cumsum(many[0])) <= 1).all()
    for tick in (0.0, 1e-3):
        with pytest.raises(InputError, match="tick"):
            in_ticks(0.02, tick)


def test_a_header_says_what_rounding_to_ticks_does():
    scene = ts.load_scene("millipede", **{"duration": "60 ms"})
    fine, coarse = (gait_header_text(scene, tick=tick) for tick in (1e-7, 9e-5))
    speed = ts.simulate(scene).measures["mean_speed"].value
    said = re.compile(r"On ticks it has ([0-9.]+) Hz, and edges within ([0-9.]+) us.*makes (.*) so, and (.*) before")
    for text, tick in ((fine, 0.1), (coarse, 90.0)):
        hertz, edges, rounded, before = said.search(text.replace("\n *", "")).groups()
        assert float(edges) == tick and before == f"{1e3 * speed:.4g} mm/s"
        period = re.search(r"gait_period_ticks = (\d+)u", text)[1]
        assert float(hertz) == pytest.approx(1e6 / (int(period) * tick), rel=1e-5)
        assert (rounded == before) == (tick == 0.1)  # a hundredth of a period is felt
    assert fine.isascii()
