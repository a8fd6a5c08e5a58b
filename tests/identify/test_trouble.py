"""What stops a step: data without a solution are its reason, faults of the program are nobody's data."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from laboratory import LABORATORY
from tarsus.base.errors import InputError
from tarsus.base.spec import FrozenDict
from tarsus.identify.campaign import Campaign, Opened
from tarsus.identify.chain import StepRunner
from tarsus.identify.foot import FootModel
from tarsus.identify.step import StepResult
from tarsus.identify.steps import STEPS, ChainStep
from tarsus.records.purpose import Purpose

UNSOLVED = {
    "in a sentence": (InputError("too few bounces"), "too few bounces"),
    "singular": (np.linalg.LinAlgError("Singular matrix"), "no solution with these data (Singular matrix)"),
    "overflow": (FloatingPointError("overflow"), "no solution with these data (overflow)"),
}
FAULTS = {
    "shapes": ValueError("operands could not be broadcast together with shapes (3,) (4,)"),
    "types": TypeError("unsupported operand"),
    "names": KeyError("film"),
}


def chain() -> StepRunner:
    model = FootModel(ts.load_scene(LABORATORY), "tip", "pzt", ("tip", "center"))
    return StepRunner.of(Opened(Campaign.model_construct(records=FrozenDict()), Path(), model))


def raising(error: Exception) -> ChainStep:
    """A step that raises an error."""

    def find(_: StepRunner) -> StepResult:
        raise error

    return ChainStep("own", Purpose.BOUNCES, "bounces", find, "A step of its own.")


@pytest.mark.parametrize("kind", UNSOLVED)
def test_data_without_a_solution_are_the_reason_why_a_step_was_not_done(kind):
    (error, said), runner = UNSOLVED[kind], chain()
    runner.attempt(raising(error))
    assert [one.name for one in runner.not_done] == ["own"] and said in runner.not_done[0].reasons[0]
    assert runner.guarded("checks", lambda: raising(error).find(runner), None) is None
    assert runner.evidence.remarks[0].startswith("checks: not from these data")


@pytest.mark.parametrize("kind", FAULTS)
def test_a_fault_of_the_program_is_not_taken_for_data(kind):
    error, runner = FAULTS[kind], chain()
    for run in (
        lambda: runner.attempt(raising(error)),
        lambda: runner.guarded("checks", lambda: raising(error).find(runner), None),
    ):
        with pytest.raises(type(error)) as raised:
            run()
        assert raised.value is error
    assert not runner.not_done and not runner.evidence.remarks


def test_results_of_wrong_shape_are_a_fault_of_their_step():
    with pytest.raises(ValueError, match="expected 1 values") as raised:
        StepResult("own", ("a",), np.ones(2), np.ones((3, 1)))
    assert not isinstance(raised.value, InputError)


def test_progress_counts_every_step_once():
    runner, told = chain(), []
    runner.progress = lambda done, total, what: told.append((done, total, what))
    names = list(dict.fromkeys(one.name for one in STEPS))
    for name in [*names, *names, *names]:
        runner.report(name)
    assert len({total for _, total, _ in told}) == 1 and all(done <= total for done, total, _ in told)
    assert told[0][1] == len(names) + 4  # landing rule, errors of what is given, air, checks
