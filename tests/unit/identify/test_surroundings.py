"""Hum of the mains, and a ground that gives way, are named; without them nothing is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tarsus as ts
from laboratory import LABORATORY
from tarsus.identify.draws import DRAWS
from tarsus.identify.estimates import Estimates
from tarsus.identify.foot import FootModel
from tarsus.identify.surroundings import ground_checks, hum_checks
from tarsus.identify.traces import Trace
from tarsus.identify.volts import Volts

MODEL = FootModel(ts.load_scene(LABORATORY), "tip", "pzt", ("tip", "center"))
LEVEL, NOISE = -1.6e-5, 4e-7
TIME = 5e-5 * np.arange(6000.0)


def traces(hum: float = 0.0, follows: float = 0.0, hertz: float = 50.0) -> list[Trace]:
    """Three repeats of a foot that stands on the ground under a slow drive; hum [m] in a phase of each repeat's own."""
    random = np.random.default_rng(3)
    volts = 6.0 * np.sin(2.0 * np.pi * 4.0 * TIME)
    folded = Volts.of(volts)
    free = MODEL.static_load * folded.force(MODEL.law, MODEL.history, 0, len(volts))[:: folded.substeps]
    out = []
    for k in range(3):
        x = np.array([LEVEL + MODEL.normal * follows * (free - free[0]), 0.3 * free])
        x += hum * np.sin(2.0 * np.pi * hertz * TIME + 6.0 * random.random())
        x += NOISE * random.standard_normal(x.shape)
        v, each = 1e-6 * random.standard_normal(x.shape), np.ones(2)
        zero = 0.05 * NOISE * each
        out.append(Trace(f"{k}", "ramps", MODEL.points, TIME, x, v, volts, NOISE * each, 1e-6 * each, zero))
    return out


@pytest.mark.parametrize("hertz", [50.0, 120.0])
def test_hum_is_named_with_its_frequency_and_size(hertz):
    (check,) = hum_checks(traces(hum=0.2 * NOISE, hertz=hertz))
    assert (
        not check.passed and check.cause.startswith(f"mains hum: a line at {hertz:g} Hz") and not check.paths
    )
    size = float(check.cause.split("displacements, ")[1].split(" um")[0])
    assert size == pytest.approx(1e6 * 0.2 * NOISE, rel=0.3)
    (check,) = hum_checks(traces())
    assert check.passed
    (check,) = hum_checks(traces(hum=0.2 * NOISE, hertz=77.0))
    assert check.passed, "a line that is no mains'"


def test_repeats_that_agree_to_their_last_digit_show_no_hum():
    """Of a coarse converter: the rest has no noise, and no line."""
    whole = [replace(one, x=np.round(one.x, 5)) for one in traces()]
    same = [replace(one, x=whole[0].x) for one in whole]
    assert hum_checks(same) == ()
    half = [replace(one, x=np.stack([one.x[0], whole[0].x[1]])) for one in traces(hum=0.2 * NOISE)]
    (check,) = hum_checks(half)
    assert np.isfinite(check.value) and not check.passed


def test_a_ground_that_gives_way_is_named_with_its_stiffness():
    path = "ground.adhesion.initial"
    known = Estimates(MODEL, (path,), np.array([2.5e-7]), np.full((DRAWS, 1), 2.5e-7))
    foot = 1.0 / float(MODEL.row @ np.linalg.solve(MODEL.stiffness, MODEL.row))
    (check,) = ground_checks(known, traces(follows=2e-3), LEVEL)
    assert not check.passed and check.value == pytest.approx(2e-3, abs=4e-4) and check.paths == (path,)
    said = float(check.cause.split("about ")[1].split(" N/m")[0])
    assert said == pytest.approx(foot * (1.0 / check.value - 1.0), rel=5e-3)
    (check,) = ground_checks(known, traces(), LEVEL)
    assert check.passed
