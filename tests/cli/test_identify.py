"""`synthesize` and `identify` as a user runs them."""

from __future__ import annotations

import json

import pytest

from tarsus.base.spec import float_paths
from tarsus.files.toml import read_scene


@pytest.mark.slow
def test_a_campaign_from_end_to_end(tarsus, tmp_path, opened):
    lab, result = tmp_path / "lab", tmp_path / "result"
    made = tarsus("synthesize", "cantilever", "-o", str(lab), "--seed", "3", "--perturb", "0.2")
    assert made.code == 0 and (lab / "truth" / "device.toml").is_file()
    (lab / "loops-2.txt").write_bytes((lab / "loops-2.txt").read_bytes()[:100_000])
    found = tarsus("identify", str(lab / "campaign.toml"), "-o", str(result))
    assert found.code == 0, found.err
    assert "excluded: loops-2.txt: is truncated" in found.sentences[0]
    # The slowest ramps: contacts have aged beyond what this device's drive pulls by then, so that no foot leaves.
    held = [f"ramps-5hz-100-{repeat}.mat" for repeat in (1, 2, 3)]
    several = f"excluded: {held[0]} and {len(held) - 1} more: read, but nothing of it was used"
    # Flights say little of how a film depends on the gap, of which this device has much.
    assert len(found.sentences) == 3 and several in found.sentences[1]
    assert "the film is taken for an even one, of exponent 3, and flights leave the exponent open" in found.sentences[2]
    assert "ground.adhesion.rate" in found.out and "held-out signals: 16" in found.out
    assert sorted(path.name for path in result.iterdir() if not path.name.startswith(".")) == [
        "draws.npz",
        "identification.json",
        "identified.toml",
        "report.html",
    ]
    told = json.loads((result / "identification.json").read_text(encoding="utf-8"))
    assert told["not_done"] == {} and told["files"]["read"] - told["files"]["used"] == 1 + len(held)
    assert tarsus("simulate", str(result / "identified.toml"), "--json").code == 0
    assert tarsus("check", str(result / "identified.toml")).code == 0
    assert opened(result, "identification", "ground.adhesion.rate")["files"] == told["files"]
    numbers = opened(result / "draws.npz", "draws", "ground.adhesion.rate")["numbers"]
    low, high = numbers["ground.adhesion.rate"]["interval"]
    assert 0.0 < low < numbers["ground.adhesion.rate"]["median"] < high


RATIOS = (0.002553195, 0.006302068, 0.00471986, 0.00363146, 0.003429172, 0.005262212)


@pytest.mark.slow
def test_a_robot_close_to_the_ground(tarsus, tmp_path):
    lab = tmp_path / "lab"
    # a device of its own: the packaged one is whatever its table last told
    given = {
        "robot.drives.pzt.law.gain": 1.928e-6,
        "ground.restitution.coefficient": 0.51,
        "ground.film.coefficient": 9.999e-20,
        "ground.electrostatic.coefficient": 9.999e-17,
        **{f"robot.structure.damping_ratios.{n}": ratio for n, ratio in enumerate(RATIOS)},
    }
    near = [word for path, value in given.items() for word in ("--set", f"{path}={value}")]
    assert tarsus("synthesize", "hexapod", "-o", str(lab), "--seed", "2", *near).code == 0
    found = tarsus("identify", str(lab), "--no-report", "--json")
    assert found.code == 0, found.err
    numbers = {path: one for step in found.json()["steps"].values() for path, one in step["parameters"].items()}
    for path, true in (
        ("robot.structure.frequencies.0", 117.2396),
        ("robot.structure.frequencies.5", 2866.066),
        ("robot.drives.pzt.law.gain", 1.928e-6),
        ("ground.film.coefficient", 9.999e-20),
        ("ground.film.thickness", 5e-6),
        ("ground.electrostatic.coefficient", 9.999e-17),
        ("ground.electrostatic.offset", 250e-6),
        ("ground.restitution.coefficient", 0.51),
    ):
        assert numbers[path]["value"] == pytest.approx(true, rel=0.05), path


@pytest.mark.slow
def test_the_packaged_robot(tarsus, tmp_path):
    """Its film and attraction are too weak to be told one by one; its impacts tell the restitution all the same."""
    lab = tmp_path / "lab"
    assert tarsus("synthesize", "hexapod", "-o", str(lab), "--seed", "2").code == 0
    found = tarsus("identify", str(lab), "--no-report", "--json")
    assert found.code == 0, found.err
    assert not found.json()["remarks"] and not found.json()["not_done"]
    numbers = {path: one for step in found.json()["steps"].values() for path, one in step["parameters"].items()}
    true = float_paths(read_scene(lab / "truth" / "device.toml"))
    written = float_paths(read_scene(lab / "identified" / "identified.toml"))
    assert {path: written[path].value for path in numbers} == {path: one["value"] for path, one in numbers.items()}
    goals = {"robot.structure.frequencies.": 5e-4, "robot.drives.pzt.law.gain": 3e-4, "ground.restitution.": 0.03}
    for path, one in numbers.items():
        goal = next((limit for start, limit in goals.items() if path.startswith(start)), None)
        if goal is not None:
            assert one["value"] == pytest.approx(true[path].value, rel=goal), path
        if path.startswith("ground."):
            low, high = one["interval"]
            assert low < true[path].value < high, path
