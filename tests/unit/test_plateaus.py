"""Voltages one after the other through a law with memory: lowered together, they are what each is alone."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.model.drive.lower import lower
from tarsus.model.drive.pieces import evaluate
from tarsus.plan.channels import drive_course

PRINTED = ts.TwoBranch(
    rising=ts.Cubic(constant=-0.3e-6, linear=-0.5e-6, cubic=1e-9),
    falling=ts.Cubic(constant=-0.6e-6, linear=-0.4e-6),
)


def _scene(law, repeat):
    scene = ts.load_scene("cantilever")
    wave = ts.OnOff(levels=(8.0, -8.0, 3.0, -8.0), durations=(3e-4, 4e-4, 9.3e-3, 1e-2), repeat=repeat)
    changes = {"signals.pzt": wave}
    return ts.with_values(scene, changes if law is None else {**changes, "robot.drives.pzt.law": law})


@pytest.mark.parametrize("law", [None, PRINTED])
@pytest.mark.parametrize("repeat", [True, False])
def test_every_run_has_the_force_and_the_volts_of_its_own_signal(law, repeat):
    scene, rng, count = _scene(law, repeat), np.random.default_rng(2), 7
    varied = {
        "signals.pzt.durations.0": rng.uniform(1e-5, 1e-3, count),
        "signals.pzt.durations.1": np.append(
            rng.uniform(1e-5, 1e-3, count - 1), 1e-16
        ),  # to rounding no time at all
        "signals.pzt.levels.2": np.append(3.0, rng.uniform(-8.0, 8.0, count - 1)),
    }
    course = drive_course(scene, "pzt", varied)
    times = np.sort(rng.uniform(0.0, 0.06, 400))
    drive = scene.robot.drives["pzt"]
    for run in range(count):
        own = ts.with_values(scene, {path: float(column[run]) for path, column in varied.items()})
        force, volts = lower(own.signals["pzt"], drive.law, drive.history)
        assert np.allclose(
            evaluate(course.pieces[course.force[run]], times), evaluate(force, times), rtol=1e-12, atol=1e-18
        )
        assert np.allclose(
            evaluate(course.pieces[course.volts[run]], times), evaluate(volts, times), rtol=1e-12
        )
        assert (course.pieces[course.force[run]].loop >= 0) is repeat
