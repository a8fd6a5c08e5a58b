"""What an identification predicts is checked, and what differs from its model is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from identify.campaigns import identified
from laboratory import LABORATORY
from tarsus.base.arrays import Floats
from tarsus.base.spec import FrozenDict, with_values
from tarsus.fit.verdict import Verdict, verdict_of
from tarsus.identify import steps
from tarsus.identify.campaign import Campaign, Opened
from tarsus.identify.chain import StepRunner
from tarsus.identify.checks import GAP, air_checks, gap_check, left_check
from tarsus.identify.draws import DRAWS
from tarsus.identify.estimates import Estimates
from tarsus.identify.film_exponent import exponent_of
from tarsus.identify.flight import FILM
from tarsus.identify.foot import FootModel
from tarsus.identify.free_motion import air_records
from tarsus.identify.prediction import AirFit, fit_air
from tarsus.identify.step import Check, Residual, StepResult, failures
from tarsus.identify.traces import Trace
from tarsus.identify.validation import _along, _perturbed
from tarsus.identify.verdict import judge_samples
from tarsus.model.drive.waveforms import Square
from tarsus.model.scene import Provenance
from tarsus.model.standing import rest_state
from tarsus.records.purpose import Purpose

PATHS = (
    "robot.structure.frequencies.0",
    "robot.structure.damping_ratios.0",
    "robot.drives.pzt.law.linear",
    "ground.film.coefficient",
)
SIGNAL = Square(amplitude=2.0, frequency=300.0)
RATE, FAR = 20e3, 0.03
BASE = FootModel(ts.load_scene(LABORATORY), "tip", "pzt", ("tip", "center"))
Change = Callable[[Floats, Floats, Floats], tuple[Floats, Floats]]


def known() -> Estimates:
    """The laboratory's device, a few of its numbers known to a thousandth."""
    values = np.array([float(ts.get_value(BASE.scene, path)) for path in PATHS])
    draws = 1.0 + 1e-3 * np.random.default_rng(5).standard_normal((DRAWS, len(PATHS)))
    return Estimates(BASE, PATHS, values, values * draws)


def recorded(model: FootModel, change: Change = lambda x, v, time: (x, v)) -> list[Trace]:
    """Two records of 50 ms in the air, 40 dB, changed by their instruments."""
    scene = with_values(model.driven(SIGNAL), {"robot.feet.tip.gap": FAR})
    run = ts.simulate(scene, 0.06)
    time, rest = np.arange(1000) / RATE, np.array(rest_state(scene))
    states = run.states(time)
    x, v = change(model.rows @ (states.x - rest[:, None]), model.rows @ states.v, time)
    noise_x, noise_v = (0.01 * np.sqrt(np.mean(one**2, axis=1)) for one in (x, v))
    random = np.random.default_rng(6)
    return [
        Trace(
            f"air-{k}",
            "air",
            model.points,
            time,
            x + noise_x[:, None] * random.standard_normal(x.shape),
            v + noise_v[:, None] * random.standard_normal(v.shape),
            0.0 * time,
            noise_x,
            noise_v,
            0.0 * noise_x,
            FAR,
        )
        for k in (1, 2)
    ]


def looked_at(traces: list[Trace]) -> AirFit:
    """The air fit of the device as known to records."""
    level = -FAR - float(BASE.row @ rest_state(BASE.scene))
    found = fit_air(air_records(known(), traces, {"air": SIGNAL}, level)[0], known())
    assert found is not None and found.values == 2 * 1000 * 4
    return found


def test_a_device_that_is_right_predicts_the_air_to_its_noise():
    found = looked_at(recorded(BASE))
    assert found.predicted == pytest.approx(1.0, abs=0.04)
    assert all(one.passed for one in air_checks(found, known()))


def ringing(size: float) -> Change:
    """The velocity of the center has a line at 700 Hz, so many times its motion."""

    def changed(x: Floats, v: Floats, time: Floats) -> tuple[Floats, Floats]:
        line = np.sin(2.0 * np.pi * 700.0 * time) * v.std(axis=1, keepdims=True)
        return x, v + size * line * np.array([[0.0], [1.0]])

    return changed


def step_of(other: Estimates) -> StepResult:
    """A step that has found all of them, the film from nothing."""
    both = {"film over gap": (2.0, 2.0 + 0.1 * np.linspace(-1.0, 1.0, DRAWS), "1")}
    return StepResult("all", PATHS, other.values, other.samples, combinations=both)


def test_what_no_number_explains_is_shown_where_it_is_most():
    """No number explains the line, and none keeps its word where it is larger than the noise."""
    found = looked_at(recorded(BASE, ringing(0.1)))
    assert "the cause is unknown" in found.cause and "'air'" in found.record
    assert "velocity of 'center'" in found.cause
    assert float(found.cause.rpartition("near ")[2].split()[0]) == pytest.approx(700.0, abs=40.0)
    failed = [one for one in air_checks(found, known()) if not one.passed]
    assert not found.widens and failed and failed[0].paths == PATHS
    far, other = dict(failed[0].far), known()
    assert far and set(far) <= set(PATHS)
    judged = judge_samples(PATHS[2:3], other.values[2:3], other.samples[:, 2:3], doubts={PATHS[2]: ["why"]}, far=far)
    assert "may be wrong by " in judged[PATHS[2]].sentence("N")


def test_a_difference_below_the_noise_widens_every_interval_and_takes_no_word():
    found, own = looked_at(recorded(BASE, ringing(0.02))), step_of(known())
    assert found.widens and found.beyond == max(found.predicted, found.apart) > 1.15
    failed = [one for one in air_checks(found, known()) if not one.passed]
    assert failed and not failed[0].paths and "all intervals are " in failed[0].cause
    wider = found.widened(own)
    assert wider.std[-1] == pytest.approx(found.beyond * own.std[-1], rel=1e-6), "which the air does not feel"
    assert np.all(wider.std >= found.beyond * (1.0 - 1e-9) * own.std)
    ((_, draws, _),) = wider.combinations.values()
    assert np.ptp(draws) == pytest.approx(0.2 * found.beyond)
    assert np.array_equal(found.widened(replace(own, taken=PATHS[3:])).draws(PATHS[3]), own.draws(PATHS[3]))
    none = StepResult("impact map", (), np.zeros(0), np.zeros((DRAWS, 0)))
    assert found.widened(none).samples.shape == (DRAWS, 0)
    far = replace(found, apart=2e3).widened(own)  # a film that may be anything stays positive, with an open lower end
    assert far.draws(PATHS[3]).min() > 0.0 and np.isfinite(far.bounds[PATHS[3]][0])
    judged = judge_samples(PATHS, far.values, far.samples, limits={PATHS[3]: far.interval(PATHS[3])})
    assert judged[PATHS[3]].word == "undecided"


def test_a_number_that_is_off_is_told_by_the_air_and_its_interval_reaches_there():
    other = known()
    off = np.array([0.0, 0.0, 0.02, 0.0]) * other.values
    found = looked_at(recorded(other.model(other.values + off)))
    assert found.apart > 5.0 and found.widens and PATHS[2] in found.cause
    assert found.missed[PATHS[2]] * other.samples[:, 2].std() >= 0.99 * abs(off[2])
    low, high = found.widened(step_of(other)).interval(PATHS[2])
    assert low < other.values[2] + off[2] < high


def test_flights_around_impacts_that_leave_more_than_noise_put_the_restitution_in_doubt():
    paths, values = ("ground.restitution.coefficient",), np.array([0.4])
    other = Estimates(BASE, paths, values, np.repeat(values[None], DRAWS, axis=0))
    for left, passed in ((1.05, True), (1.7, False)):
        around = Residual("flights around impacts", "1", left, 1.0, 1500), Residual("departures", "m/s", 0.8, 1.0, 25)
        step = StepResult("restitution", paths, values, other.samples, residuals=around)
        (one,) = left_check(step, other)
        assert one.passed is passed and one.paths == paths


def test_a_failed_check_takes_the_word_determined_and_names_its_cause():
    draws = np.random.default_rng(8).normal([2.0, 3.0], [0.1, 0.1], (400, 2))
    failed = Check("residual", 3.0, 1.15, paths=("a",), cause="the drive creeps")
    (said,) = failures([failed, replace(failed, name="pull"), replace(failed, value=1.0)])
    assert said == "the drive creeps (residual 3, 1.15 at most; pull 3, 1.15 at most)"
    found = judge_samples(("a", "b"), (2.0, 3.0), draws, doubts={"a": [said]})
    assert found["a"].word == "preferred" and found["b"].word == "determined"
    assert "but the drive creeps" in found["a"].sentence()
    assert verdict_of((1.0, 9.0), doubted=True) is Verdict.UNDECIDED, "a wide number stays what it is"


def test_the_exponent_of_the_film_is_found_and_what_it_leaves_open_takes_the_word():
    chain = identified()
    assert chain.film is not None
    found = exponent_of(chain.film, 3)
    assert found is not None and abs(found.value - 3.0) < 3.0 * found.error
    step, (law, thickness) = chain.film.step, FILM
    for value, error, far in ((3.0, 0.5, 0.5), (2.2, 0.6, 1.0), (3.0, 1e-3, 1e-3)):
        is_three, holds = replace(found, value=value, error=error).checks(step)
        assert is_three.passed and holds.passed == (far < 0.1)
        assert holds.far[thickness] == pytest.approx(far * found.moves[1] * step.value(thickness), rel=1e-6)
        assert holds.far[law] > 0.0
    for value in (2.0, -78.0):
        wrong, _ = replace(found, value=value, error=0.1).checks(step)
        assert not wrong.passed and "not damped as by a film of exponent 3" in wrong.cause


@pytest.mark.parametrize("even", [False, True])
def test_a_film_that_is_stated_to_be_even_is_not_asked_for_its_exponent(even: bool, monkeypatch: pytest.MonkeyPatch):
    found = identified()
    assert found.film is not None
    bare = replace(found.film, step=replace(found.film.step, checks=()))
    monkeypatch.setattr(steps, "identify_film", lambda *_: bare)
    campaign = found.opened.campaign.model_copy(update={"even_film": even})
    runner = StepRunner.of(replace(found.opened, campaign=campaign))
    runner.evidence.level, runner.evidence.traces = found.level, {Purpose.RAMPS: list(bare.offs.traces)}
    assert runner.opened.campaign.even_film is even
    assert len(steps.FILM_STEP.find(runner).checks) == (0 if even else 2)


def test_what_the_device_file_states_with_an_interval_is_moved_by_its_standard_error():
    model = known().base
    gap = {"source": "assumed", "note": "By eye.", "interval": (model.gap - 1.96e-6, model.gap + 1.96e-6)}
    provenance = FrozenDict({**model.scene.provenance, "robot.feet.tip.gap": Provenance.model_validate(gap)})
    stated = model.changed({"provenance": provenance})
    opened = Opened(Campaign.model_construct(records=FrozenDict()), Path(), stated)
    ((moved, _),) = _perturbed(StepRunner.of(opened))
    assert moved.gap == pytest.approx(model.gap + 1e-6, rel=1e-4)
    assert not list(_perturbed(StepRunner.of(replace(opened, model=model))))


def test_a_constant_that_counts_from_the_gap_as_stated_must_bear_an_error_of_it():
    found, path = known(), "robot.drives.pzt.law.constant"
    model = found.base
    bears = GAP * model.gap / abs(model.static_load)  # an error of the gap of 5 %, as a force
    for sd, passes in ((0.1 * bears, False), (bears, True)):
        draws = -1e-6 + sd * np.random.default_rng(3).standard_normal((DRAWS, 1))
        of_law = StepResult("hysteresis", (path,), np.array([-1e-6]), draws)
        (check,) = gap_check(of_law, found)
        assert check.passed == passes and check.paths == (path,)
    assert not gap_check(replace(of_law, taken=(path,)), found)  # nothing shows the ground
    gap = {"source": "assumed", "note": "By eye.", "interval": (0.9 * model.gap, 1.1 * model.gap)}
    provenance = FrozenDict({**model.scene.provenance, "robot.feet.tip.gap": Provenance.model_validate(gap)})
    assert not gap_check(of_law, replace(found, base=model.changed({"provenance": provenance})))


def test_numbers_are_drawn_along_with_what_was_corrected():
    drawn = np.random.default_rng(1).standard_normal(400)
    paths, still = ("ground.film.thickness", "robot.drives.pzt.law.constant"), np.zeros((400, 2))
    own = StepResult("film", paths, np.array([2.0, -1.0]), np.array([2.0, -1.0]) + still)
    there = StepResult("film", paths, np.array([2.2, -1.3]), still)
    along = _along(own, there, drawn).samples
    assert np.allclose(along[:, 0], 2.0 * 1.1**drawn) and np.allclose(along[:, 1], -1.0 - 0.3 * drawn)
