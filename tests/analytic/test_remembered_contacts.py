"""A contact that remembers the one before it: releases and strengths in closed form, from touchdowns on."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import tarsus as ts
from scene_files import pushed
from tarsus.base.events import CONTACT_BEGINS, EventKind
from tarsus.model.laws.ageing_adhesion import AgeingAdhesion

MASS, SPRING, DAMPING_RATIO, GAP = 1e-6, 1.0, 0.4, 1e-5
TIMES = (0.0, 0.010, 0.025, 0.055, 0.075, 0.090, 0.115, 0.13)
FORCES = (0.0, -3e-5, -3e-5, 6e-5, -3e-5, -3e-5, 7e-5, 7e-5)
FRESH, GAIN, AGEING, FADING = 8e-6, 2.5e-5, 0.020, 0.030
LAW = AgeingAdhesion(initial=FRESH, gain=GAIN, ageing=AGEING, fading=FADING)


def strength(age: float, law: AgeingAdhesion = LAW) -> float:
    return law.initial + law.gain * (1.0 - math.exp(-age / law.ageing))


def scene() -> ts.Scene:
    """A mass that is pressed down and pulled off twice."""
    mass = {"coordinates": ["x"], "mass": [MASS], "stiffness": [SPRING], "damping_ratios": [DAMPING_RATIO]}
    made = pushed({"kind": "lumped"} | mass, "x", 0.13, {"kind": "sampled", "times": TIMES, "levels": FORCES})
    foot = {"x": {"point": "x", "gap": GAP}}
    return ts.with_values(made, {"robot.feet": foot, "ground.laws": {"ageing": LAW}})


def release(touchdown: float, brought: float) -> float:
    """When the pull F + k g has outgrown the strength."""

    def left(t: float) -> float:
        return strength(t - touchdown + brought) - np.interp(t, TIMES, FORCES) - SPRING * GAP

    grid = np.linspace(touchdown, TIMES[-1], 2000)
    first = next(k for k, t in enumerate(grid) if left(t) < 0.0)
    return brentq(left, grid[first - 1], grid[first], xtol=1e-18, rtol=1e-15)


def test_two_contacts_in_closed_form():
    run = ts.simulate(scene(), 0.13, ts.Accuracy(gap=1e-12, drive=1e-12))
    kinds = run.events["kind"]
    begun, ended = run.events[np.isin(kinds, CONTACT_BEGINS)], run.events[kinds == EventKind.RELEASE]
    touch, again = begun["time"]
    let_go = release(touch, 0.0)
    brought = (let_go - touch) * math.exp(-(again - let_go) / FADING)
    last = release(again, brought)
    assert brought > 0.2 * AGEING  # which a new contact would not have
    assert last - release(again, 0.0) > 1e-4
    assert ended["time"] == pytest.approx([let_go, last], rel=1e-9)
    wanted = [strength(0.0), strength(brought)]
    assert begun["strength"] == pytest.approx(wanted, rel=1e-9)
    assert ended["strength"] == pytest.approx([strength(let_go - touch), strength(last - again + brought)], rel=1e-9)
    assert run.ok and run.ledger.closure < 1e-8
    held = (run.time > again) & (run.time < last)
    shown = run.series.strength[0][held]
    assert shown == pytest.approx([strength(t - again + brought) for t in run.time[held]], rel=1e-9)


def test_walkers_remember_as_well():
    """The strengths in the log of a walker are those of the ages that follow from its events."""
    ripe = AgeingAdhesion(initial=1e-7, gain=3e-6, ageing=3e-3, fading=4e-3)
    walker = ts.with_values(ts.load_scene("millipede"), {"ground.adhesion": None, "ground.laws": {"ageing": ripe}})
    run = ts.simulate(walker, 0.05)
    assert run.ok and run.ledger.closure < 1e-8
    more = 0
    for foot in range(2):
        age = parted = since = 0.0
        for event in run.events[run.events["foot"] == foot]:
            kind, time = event["kind"], event["time"]
            if kind in CONTACT_BEGINS or kind == EventKind.BOUNCE:
                brought = age * math.exp(-(time - parted) / ripe.fading)
                if kind == EventKind.CAPTURE:
                    assert event["strength"] == pytest.approx(strength(brought, ripe), rel=1e-9)
                    more += brought > 1e-4
                since = time - brought if kind != EventKind.BOUNCE else since
            elif kind == EventKind.RELEASE:
                age, parted = time - since, time
                assert event["strength"] == pytest.approx(strength(age, ripe), rel=1e-9)
    assert more >= 3


def test_a_law_whose_contacts_remember_says_by_what():
    with pytest.raises(TypeError, match=r"must take \(age, away, "):
        own = {"__annotations__": {}, "remaining": lambda age, fresh: age, "__module__": __name__}
        type("Short", (AgeingAdhesion,), own)
