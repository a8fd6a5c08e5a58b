"""Drives of many runs are made at once: each has the very pieces that it has alone."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from drive_cases import PRINTED, WAVEFORMS
from scene_files import scene as scene_of
from tarsus.base.spec import float_paths
from tarsus.model.drive.lower import lower
from tarsus.plan.channels import drive_courses

PLAYS = ts.drives.PrandtlIshlinskii(
    linear=-1e-4, quadratic=2e-6, cubic=1e-7, thresholds=(0.5, 1.5, 3.0, 5.0), weights=(-1e-4, -2e-4, -1e-4, -5e-5)
)
LAWS = {"linear": ts.LinearForce(gain=-1e-4, offset=2e-5), "plays": PLAYS, "branches": PRINTED}


def check(scene: ts.Scene, varied: dict[str, np.ndarray]) -> None:
    """Force and volts of every run are the pieces of the changed scene alone, to the last bit."""
    course = drive_courses(scene, varied, ["pull"])["pull"]
    for run in range(len(course.which)):
        own = ts.with_values(scene, {path: float(column[run]) for path, column in varied.items()})
        drive = own.robot.drives["pull"]
        alone = lower(own.actuator_volts["pull"], drive.law, drive.history)
        for channels, wanted in zip((course.force, course.volts), alone, strict=True):
            got = channels[course.which[run]]
            for name in ("start", "coef", "kink"):
                np.testing.assert_array_equal(getattr(got, name), getattr(wanted, name), err_msg=f"{run} {name}")
            assert got.loop == wanted.loop


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("wave", WAVEFORMS)
def test_every_number_of_a_signal_at_once(wave, law):
    drive = {"robot.drives.pull.law": LAWS[law], "robot.drives.pull.history": (10.0, 0.0)}
    scene = ts.with_values(scene_of("p1_n2"), {**drive, "signals": {"pull": WAVEFORMS[wave]}})
    rng = np.random.default_rng(7)
    # of some runs all numbers are a little different, of the first none is
    small = {path: 0.01 * rng.uniform(0.0, 1.0, 5) * (np.arange(5) > 0) for path in float_paths(scene)}
    check(
        scene, {path: ts.get_value(scene, path) * (1.0 - small[path]) for path in small if path.startswith("signals.")}
    )


def test_what_has_no_amplitude_or_no_edge_is_constant_beside_what_has():
    for wave, path, values in (
        (ts.Sine(amplitude=1.0, frequency=50.0, phase=0.3, offset=2.0), "amplitude", [0.0, 1.0, 3.0]),
        (ts.Square(amplitude=8.0, frequency=50.0), "duty", [0.0, 0.3, 1.0, 0.5]),
        (ts.waveforms.RampedSquare(amplitude=8.0, frequency=50.0, duty=0.2), "amplitude", [0.0, 3.0]),
        (ts.OnOff(levels=(3.0, 5.0), durations=(0.01, 0.02), repeat=True), "levels.1", [3.0, 5.0, 3.0]),
        (ts.OnOff(levels=(3.0, 5.0, 1.0), durations=(0.01, 0.02, 0.01)), "durations.1", [1e-3, 1e-17]),
        (ts.Sampled(times=(0.0, 0.1, 0.2, 0.3), levels=(1.0, 1.0, 1.0, 5.0)), "times.0", [0.0, 0.05]),
        (ts.Sampled(times=(0.0, 0.1, 0.2, 0.3), levels=(1.0, 2.0, 1.0, 5.0)), "levels.1", [1.0, 2.0]),
    ):
        scene = ts.with_values(scene_of("p1_n2"), {"robot.drives.pull.law": PLAYS, "signals": {"pull": wave}})
        check(scene, {f"signals.pull.{path}": np.array(values)})


def test_numbers_of_drives_of_histories_and_of_amplifiers():
    wave = ts.waveforms.RampedSquare(amplitude=8.0, frequency=50.0, duty=0.3, phase=0.4)
    scene = ts.with_values(
        scene_of("p1_n2"),
        {"robot.drives.pull.law": PLAYS, "robot.drives.pull.history": (10.0, -3.0), "signals": {"pull": wave}},
    )
    head = "robot.drives.pull."
    three = np.array([0.9, 1.0, 1.1])
    check(
        scene,
        {
            f"{head}law.{name}": ts.get_value(scene, f"{head}law.{name}") * three
            for name in ("linear", "cubic", "thresholds.1", "thresholds.3", "weights.2")
        },
    )
    check(scene, {f"{head}law.weights.0": np.array([-1e-4, 0.0]), f"{head}history.1": np.array([-3.0, 2.0])})
    behind = ts.with_values(scene, {f"{head}amplifier": {"bandwidth": 800.0, "slew_rate": 9000.0}})
    check(behind, {f"{head}amplifier.bandwidth": 800.0 * three, "signals.pull.amplitude": 8.0 * three})
    branches = ts.with_values(scene, {f"{head}law": PRINTED})
    check(branches, {f"{head}law.rising.linear": PRINTED.rising.linear * three})
