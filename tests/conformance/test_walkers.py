"""Runs of the engine: what is asked for beside the events changes none of them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.events import EventKind
from tarsus.base.spec import with_values
from tarsus.plan.lowering import lower_scene
from tarsus.plan.rows import rows_of
from tarsus.solve.codes import structured_events
from tarsus.solve.engine import SINGLE_RUN, Engine
from tarsus.solve.shared import Shared


@pytest.mark.parametrize("name", ["millipede", "cantilever", "hexapod", "quadruped"])
def test_an_account_and_samples_change_no_bit_of_a_run(name: str) -> None:
    engine = Engine(lower_scene(ts.load_scene(name)), 0.03, Shared())
    bare, *others = (
        engine.run(rows_of(engine.plan, 1, math.inf), None, True, times, account=account)
        for account, times in ((False, None), (True, None), (True, np.linspace(0.0, 0.03, 50)))
    )
    for log in others:
        np.testing.assert_array_equal(log.events, bare.events)
        np.testing.assert_array_equal(log.finish, bare.finish)
        np.testing.assert_array_equal(log.last, bare.last)


def test_both_engines_find_both_feet_of_the_millipede_on_the_ground_at_once() -> None:
    """By contact modes the second was captured at 2e-17 s with 5e-15 m/s: rounding of its film's momentum."""
    plan = lower_scene(with_values(ts.load_scene("millipede"), {"ground.friction": None}))
    for own in (plan, dataclasses.replace(plan, legs=None)):
        log = Engine(own, 0.2).run(rows_of(own), SINGLE_RUN)
        first = structured_events(log.events)[:2]
        assert list(first["kind"]) == [EventKind.CONTACT_AT_START] * 2 and not first["time"].any()
