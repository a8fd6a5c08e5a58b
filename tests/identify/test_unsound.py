"""What must never be called identified: numbers that are none, and motion in the wrong unit throughout."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from identify.campaigns import folder, identified, modes_as_found
from tarsus.identify.campaign import read_campaign
from tarsus.identify.chain import StepRunner
from tarsus.identify.result import identified_device, summary_of
from tarsus.identify.step import StepResult
from tarsus.identify.steps import FILM_STEP, ChainStep
from tarsus.model.scene import Source
from tarsus.records.purpose import Purpose

FILM = "ground.film.coefficient"


def film(value: float, draws: np.ndarray) -> StepResult:
    samples = np.column_stack([draws, np.linspace(4e-5, 6e-5, len(draws))])
    return StepResult("film", (FILM, "ground.film.thickness"), np.array([value, 5e-5]), samples)


def found(step: Callable[[], StepResult]) -> ChainStep:
    """The film's step, without needs, that finds this."""
    return replace(FILM_STEP, find=lambda _: step(), needs=())


GOOD = np.linspace(1e-21, 3e-21, 400)


@pytest.mark.parametrize(
    ("value", "draws", "words"),
    [
        (4.4e-27, GOOD, "lies outside of its own interval, 1.05e-21 to 2.95e-21"),
        (2e-21, np.where(np.arange(400) < 30, np.inf, GOOD), "has no finite interval"),
        (2e-21, np.where(np.arange(400) < 30, np.nan, GOOD), "has no finite interval"),
        (np.nan, GOOD, "comes out as nan"),
    ],
)
def test_a_number_without_an_interval_that_holds_it_is_not_done(value, draws, words):
    assert film(2e-21, GOOD).unsound() == []
    chain = StepRunner.of(read_campaign(folder()))
    chain.film = identified().film
    chain.attempt(found(lambda: film(value, draws)))
    assert chain.steps == {} and chain.film is None and FILM not in chain.known.paths
    (out,) = chain.not_done
    assert out.name == "film" and len(out.reasons) == 1
    assert FILM in out.reasons[0] and words in out.reasons[0]


def test_nothing_of_a_step_that_is_not_done_is_calibrated():
    found = identified()
    steps = {name: step for name, step in found.steps.items() if name != "film"}
    device = identified_device(replace(found, steps=steps))
    assert device.origin(FILM).source is not Source.CALIBRATED
    assert all(step.unsound() == [] for step in found.steps.values())


def test_arithmetic_that_overflows_on_the_way_is_no_warning(recwarn):
    chain = StepRunner.of(read_campaign(folder()))

    def overflowing() -> StepResult:
        np.exp(np.array([1000.0]))
        return film(2e-21, GOOD)

    chain.attempt(found(overflowing))
    assert "film" in chain.steps and chain.evidence.remarks == []
    assert not recwarn.list


# Slow: the same in the other direction. Metres stated as millimetres stay.
@pytest.mark.parametrize(
    ("factor", "words"), [(1e3, "e+03 times as much"), pytest.param(1e-3, "times as much", marks=pytest.mark.slow)]
)
def test_motion_in_the_wrong_unit_throughout_is_told_by_the_gap(monkeypatch, factor, words):
    modes_as_found(monkeypatch)
    chain = StepRunner.of(read_campaign(folder()))
    chain.read()
    wrong = {
        purpose: [
            replace(t, **{name: factor * getattr(t, name) for name in ("x", "v", "noise_x", "noise_v", "zero")})
            for t in traces
        ]
        for purpose, traces in chain.evidence.traces.items()
    }
    chain.evidence.traces = wrong
    chain.find_ground()
    (said,) = chain.evidence.remarks
    assert "are its displacements and velocities in mm stated as m" in said and words in said
    assert chain.evidence.level is None and not any(chain.evidence.traces.values())
    assert {one.file for one in chain.evidence.left_out} == {t.file for traces in wrong.values() for t in traces}
    chain.read = lambda: None
    told = chain.run()  # the sweeps still tell the modes
    assert list(told.steps) == ["resonances"]
    assert [one.name for one in told.not_done][:2] == ["hysteresis", "film"]
    assert any("are its displacements" in said for said in told.not_done[0].reasons)
    assert summary_of(told)["remarks"][0] == said
    assert chain.evidence.traces[Purpose.RAMPS] == []
