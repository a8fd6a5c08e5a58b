"""`tarsus recommend`: records ranked for one number, or for all, within a budget."""

from __future__ import annotations

import math

import numpy as np
import pytest

RATE = "ground.adhesion.rate"
SMALL = ("--vary", "hz=15, 100", "--vary", "volts=6", "--vary", "ramp=0.25")


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> str:
    """A cantilever whose numbers come without intervals."""
    import tarsus as ts

    scene = ts.load_scene("cantilever")
    bare = {path: origin.model_copy(update={"interval": None}) for path, origin in scene.provenance.items()}
    ground = {"ground.landing": None, "ground.adhesion.initial": 15.43e-9, RATE: 3.4e-6}
    file = tmp_path_factory.mktemp("plain") / "plain.toml"
    bare = {path: origin for path, origin in bare.items() if not path.startswith("ground.landing")}
    ts.write_scene(ts.with_values(ts.with_values(scene, {"provenance": bare}), ground), file)
    return str(file)


def test_a_table_and_a_plan(tarsus, plain):
    result = tarsus("recommend", plain, "--parameter", RATE, "--budget", "0.7 s", *SMALL)
    assert result.code == 0 and result.sentences == []
    lines = result.out.splitlines()
    assert lines[0] == f"{RATE} = 3.4 µN/s, known within a factor of 1.8 (95 %)"
    assert "ground.adhesion.initial" in lines[1] and RATE not in lines[1]
    assert lines[4].startswith("15 Hz, 6 V, lambda 0.25")
    assert "of 700 ms:" in result.out and "\nExpected: known within " in result.out
    assert any(line.startswith("Lower bounds: ") for line in lines[-2:])


def test_one_json_object(tarsus, plain):
    steps = ("--vary", "hz=25, 100", "--vary", "volts=6", "--vary", "ramp=0.25", "--vary", "gap=70 um, 90 um")
    words = (*steps, "--unknown", "robot.feet.tip.gap", "--spread", "0.1", "--json")
    found = tarsus("recommend", plain, "--parameter", RATE, "--budget", "0.1 s", *words).json()
    assert found["std"] == pytest.approx(0.1) and "robot.feet.tip.gap" in found["unknown"]
    assert {(one["signal"]["frequency"], one["gap_m"]) for one in found["records"]} == {
        (25.0, 70e-6),
        (25.0, 90e-6),
        (100.0, 70e-6),
        (100.0, 90e-6),
    }
    gains = [one["gain"] for one in found["records"]]
    assert gains == sorted(gains, reverse=True)
    assert all(one["std"] == pytest.approx(0.1 * math.exp(-one["gain"])) for one in found["records"])
    assert {one["note"] for one in found["records"] if one["record_s"] > 0.1} == {"longer than the budget"}


@pytest.mark.slow
def test_draws_beside_an_identified_device_are_used(tarsus, tmp_path):
    from tarsus.files.library import load_scene
    from tarsus.files.toml import write_scene

    device = tmp_path / "identified.toml"
    write_scene(load_scene("cantilever"), device)
    logs = np.random.default_rng(1).multivariate_normal([0.0, 0.0], [[0.04, -0.01], [-0.01, 0.01]], 400)
    samples = np.exp(logs) * [15.43e-9, 3.4e-6]
    paths = np.array(["ground.adhesion.initial", RATE])
    np.savez(tmp_path / "draws.npz", paths=paths, values=samples[0], samples=samples)
    words = ("recommend", device, "--parameter", RATE, "--budget", "0.1 s", *SMALL, "--json")
    assert tarsus(*words).json()["std"] == pytest.approx(0.1, rel=0.1)
    (tmp_path / "draws.npz").write_text("nothing")
    result = tarsus(*words)
    assert result.code == 2 and "holds no draws of an identification" in result.sentences[0]


def test_nothing_worth_taking_is_said(tarsus):
    words = ("--vary", "hz=100", "--vary", "volts=0.3", "--vary", "ramp=0.25")
    result = tarsus("recommend", "cantilever", "--parameter", "ground.restitution.coefficient", "--budget", "1", *words)
    assert result.code == 0
    assert "No record within 1 s determines ground.restitution.coefficient" in result.out
