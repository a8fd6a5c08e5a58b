"""Every example runs, and a number from it is right."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import tarsus as ts
from example_files import EXAMPLES, load


@pytest.mark.nojit
@pytest.mark.bounds
def test_bouncing_ball():
    example = load("bouncing_ball")
    assert example.impact_times(0.9)[1] == pytest.approx(1.264266194760045, rel=1e-14)
    assert example.largest_error() < 1e-10
    fall = math.sqrt(2.0 / 9.81)
    assert example.time_of_rest(0.7) == pytest.approx(fall * (1.0 + 0.7) / (1.0 - 0.7), rel=1e-6)


def test_own_law():
    example = load("own_law")
    without, weak = example.run_with_magnet(0.0), example.run_with_magnet(1e-24)
    assert without.ledger.laws == 0.0
    assert weak.ledger.laws != 0.0
    assert weak.ok and weak.ledger.closure < 1e-8


def test_a_weak_magnet_does_the_work_of_its_potential():
    # While the foot is in flight, the work is K/3 (1/(g + d)^3) between the ends: no history in it.
    import tarsus as ts

    example = load("own_law")
    run = example.run_with_magnet(1e-24, duration=0.004)
    magnet = run.scene.ground.laws["magnet"]
    gap = run.to_dataset()["gap"].values[0]

    def potential(g: float) -> float:
        return -magnet.strength / (3.0 * (g + magnet.offset) ** 3)

    assert run.ledger.laws == pytest.approx(potential(gap[0]) - potential(gap[-1]), rel=1e-6)
    assert ts.get_value(run.scene, "ground.laws.magnet.strength") == 1e-24


def test_film_sweep():
    example = load("film_sweep")
    counts = example.impacts_over_film(np.array([0.1, 1.0, 1e7]))
    assert counts.shape == (3,)
    assert counts[2] == 0  # a film that thick keeps the foot off the ground
    import tarsus as ts

    alone = ts.simulate(ts.load_scene("cantilever", volts=8, hz=50, wave="square"), duration=0.1)
    assert counts[1] == np.count_nonzero(np.isin(alone.events["kind"], (1, 2)))


# The optimum the calibration found for `cantilever`, and its objective.
OPTIMUM = {
    "static": 16.32,
    "ratio": 0.2006,
    "zeta1": 0.01127,
    "zeta2": 0.08707,
    "offset": -1.61,
    "swing": 3.974,
    "restitution": 0.2653,
    "initial": 0.01543,
    "rate": 3.4,
    "film": -20.51,
    "thickness": 50.43,
}


def test_calibrate_cantilever_describes_the_packaged_device():
    import tarsus as ts

    example = load("calibrate_cantilever")
    described = example.paths("cantilever", {name: np.array([value]) for name, value in OPTIMUM.items()})
    packaged = ts.load_scene("cantilever")
    assert len(described) == 4 + 4 + 6 + 5  # structure, polynomial, plays, ground
    for path, (value,) in described.items():
        assert ts.get_value(packaged, path) == pytest.approx(value, rel=2e-4), path


def test_calibrate_cantilever_scores_the_packaged_optimum():
    example = load("calibrate_cantilever")
    values = {name: np.array([value]) for name, value in OPTIMUM.items()}
    worse = {name: np.append(value, value) for name, value in values.items()} | {
        "static": np.array([16.32, 14.0])
    }
    found = example.simulate_cases("cantilever", worse, threads=1)
    assert found.shape[0] == 2 and found.shape[1] >= 12 and np.isfinite(found).all()
    best, off = example.objective(found, "cantilever")
    assert best == pytest.approx(0.669, abs=0.02)
    assert off > best + 0.1


def test_every_example_is_in_a_test():
    tests = "".join(path.read_text(encoding="utf-8") for path in EXAMPLES.parent.glob("tests/**/test_*.py"))
    for path in EXAMPLES.glob("*.py"):
        assert f'load("{path.stem}")' in tests or path.name in tests, f"{path.name} has no test"


def test_the_python_of_the_readme_runs(capsys):
    page = (EXAMPLES.parent / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.+?)```", page, re.DOTALL)
    names: dict = {}
    exec(block, names)
    sentence, closure, contact = capsys.readouterr().out.splitlines()
    assert sentence == names["run"].code.value
    assert float(closure) < 1e-8
    assert "contact" in contact or "zero gap" in contact


def test_calibrate_hexapod_describes_the_packaged_device():
    example = load("calibrate_hexapod")
    best = example.Unknowns(static=9.51e-6, sine_hz=304.2, square_hz=317.1, scale=0.0469)
    device = ts.load_scene("hexapod")
    assert {s.wave: s.freq_hz for s in example.targets()} == {"sine": 304.2, "square": 317.1}
    scene = example.described("hexapod", example.targets()[1], best)
    assert scene.robot.drives["pzt"].law.gain == pytest.approx(device.robot.drives["pzt"].law.gain, rel=1e-4)
    assert scene.ground.film.coefficient == pytest.approx(device.ground.film.coefficient, rel=1e-3)
    assert scene.ground.film.thickness == device.ground.film.thickness
    assert scene.ground.electrostatic.coefficient == pytest.approx(
        device.ground.electrostatic.coefficient, rel=1e-3
    )
    assert scene.signals == device.signals


def test_calibrate_hexapod_scores_the_packaged_optimum():
    example = load("calibrate_hexapod")
    best = example.Unknowns(static=9.51e-6, sine_hz=304.2, square_hz=317.1, scale=0.0469)
    bounces, peak, mean = example.mean_errors(example.evaluate("hexapod", best, 4))
    assert (
        bounces < 0.20 and peak == pytest.approx(0.134, abs=0.01) and mean == pytest.approx(0.151, abs=0.01)
    )
