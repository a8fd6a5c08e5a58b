"""Records tell the landing rule: the device file's may be wrong."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from laboratory import LABORATORY
from tarsus.identify.foot import FootModel
from tarsus.identify.landing import judge_landing
from tarsus.identify.traces import Trace
from tarsus.model.drive.waveforms import Sine
from tarsus.model.laws.landing import CaptureUnlessPulled, RestituteFirst

CAPTURE, RESTITUTE = CaptureUnlessPulled(), RestituteFirst(speed=20e-3)
SIGNALS = {"slow": Sine(amplitude=8.0, frequency=50.0), "fast": Sine(amplitude=8.0, frequency=100.0)}
RATE, NOISE_X, NOISE_V = 20e3, 5e-8, 2e-4


def device(rule) -> FootModel:
    """The laboratory's device under a landing rule, with adhesion that holds what lands slowly."""
    sticky = {"ground.adhesion.initial": 2e-7, "ground.adhesion.rate": 3e-6}
    scene = ts.with_values(ts.load_scene(LABORATORY), {"ground.landing": rule, **sticky})
    return FootModel(scene, "tip", "pzt", ("tip",))


def record(model: FootModel, name: str, signal: Sine) -> tuple[Trace, float]:
    """A noisy record of 40 ms with a drive, and the contact level."""
    run = ts.simulate(model.driven(signal), 0.04)
    time = np.arange(round(0.04 * RATE)) / RATE
    states, noise = run.states(time), np.random.default_rng(3).normal(size=(2, len(time)))
    start = states.gap[0, 0]
    x, v = states.gap[:1] - start + NOISE_X * noise[0], states.rate[:1] + NOISE_V * noise[1]
    one = np.ones(1)
    trace = Trace(name, name, ("tip",), time, x, v, 0.0 * time, NOISE_X * one, NOISE_V * one, 0.0 * one)
    return trace, -float(start)


@pytest.mark.parametrize(("true", "assumed"), [(CAPTURE, RESTITUTE), (RESTITUTE, CAPTURE)])
def test_the_rule_behind_the_records_is_found_whatever_the_device_file_says(true, assumed):
    pairs = [record(device(true), name, signal) for name, signal in SIGNALS.items()]
    verdict = judge_landing(device(assumed), [trace for trace, _ in pairs], SIGNALS, pairs[0][1])
    assert verdict is not None and verdict.sets == tuple(SIGNALS)
    assert verdict.chosen.kind == true.kind and verdict.replaced
    said = " ".join(verdict.sentences())
    assert f"{true.kind}" in said and f"{assumed.kind}" in said and "was replaced" in said
    if true == RESTITUTE:
        assert verdict.decided and "is preferred" in said
        assert isinstance(verdict.chosen, RestituteFirst)
        assert verdict.chosen.speed == pytest.approx(20e-3, rel=1.0), "within the factor between those tried"


def test_records_without_landings_leave_the_rule_undecided_and_the_file_s_own_in_use():
    quiet, model = Sine(amplitude=0.5, frequency=50.0), device(RESTITUTE)
    trace, level = record(model, "quiet", quiet)
    verdict = judge_landing(model, [trace], {"quiet": quiet}, level)
    assert verdict is not None and not verdict.decided and not verdict.replaced
    assert "undecided between" in verdict.sentences()[0]
    assert judge_landing(model, [trace], {}, level) is None, "no drive is known"
