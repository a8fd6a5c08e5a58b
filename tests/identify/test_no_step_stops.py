"""Records that are missing, placeholders, and steps without a solution cost the numbers that they alone tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from identify.campaigns import folder, grounded, identified, modes_as_found, truth
from laboratory import LABORATORY
from tarsus.base.errors import InputError
from tarsus.base.spec import FrozenDict, float_paths
from tarsus.identify.campaign import Campaign, Opened, read_campaign
from tarsus.identify.chain import StepRunner, identify
from tarsus.identify.draws import sandwich_draws
from tarsus.identify.foot import FootModel
from tarsus.identify.result import Identification, identified_device, summary_of, write_identification
from tarsus.identify.step import StepResult
from tarsus.identify.steps import FILM_STEP, STEPS, ChainStep
from tarsus.identify.tables import open_table
from tarsus.model.scene import Scene, Source
from tarsus.records.purpose import Purpose
from tarsus.synthesis.devices import identified_paths

FILM, RESTITUTION, ADHESION = "ground.film.", "ground.restitution.coefficient", "ground.adhesion."
STRUCTURE, LAW = "robot.structure.", "robot.drives.pzt.law."


def without(opened: Opened, *purposes: str) -> Opened:
    """The campaign without its records of some purposes."""
    kept = {k: one for k, one in opened.campaign.records.items() if one.purpose.value not in purposes}
    return replace(opened, campaign=opened.campaign.model_copy(update={"records": FrozenDict(kept)}))


@lru_cache(maxsize=1)
def identified_without(*purposes: str) -> Identification:
    """What the chain finds without them, with the modes that the whole campaign has told; the last one is kept."""
    with pytest.MonkeyPatch.context() as patch:
        modes_as_found(patch)
        return identify(without(read_campaign(folder()), *purposes))


def off(found: Identification, true: Scene) -> dict[str, float]:
    """Standard deviations by which every number that records tell is off the truth; of the logarithms of one that is
    known to a factor."""
    values, out = float_paths(true), {}
    for step in found.steps.values():
        for path, value in zip(step.paths, step.values.tolist(), strict=True):
            drawn, right = step.draws(path), values[path].value
            if path in step.taken:
                continue
            if np.all(drawn * right > 0.0) and np.std(drawn) > 0.2 * abs(value):
                drawn, value, right = np.log(np.abs(drawn)), np.log(abs(value)), np.log(abs(right))
            out[path] = abs(value - right) / float(np.std(drawn))
    return out


def wrong(found: Identification, true: Scene) -> dict[str, float]:
    """Those off by more than three, but damping ratios: of this seed the whole campaign has one 3.7 off, by 0.3 %."""
    return {path: by for path, by in off(found, true).items() if by > 3.0 and "damping_ratios" not in path}


# Slow: each is an identification; one purpose and the steps alone stay, below.
@pytest.mark.parametrize(
    ("gone", "lost"),
    [
        pytest.param(("ramps",), (ADHESION,), marks=pytest.mark.slow),
        pytest.param(("loops",), (), marks=pytest.mark.slow),
        pytest.param(("bounces",), (RESTITUTION,), marks=pytest.mark.slow),
        pytest.param(("loops", "ramps"), (ADHESION, RESTITUTION, FILM, LAW), marks=pytest.mark.slow),
    ],
    ids=" ".join,
)
def test_without_the_records_of_a_purpose_every_other_number_is_found(gone, lost):
    found = identified_without(*gone)
    told = off(found, truth())
    assert not wrong(found, truth())
    every = {path for path in identified().known.paths if not path.startswith("robot.drives.pzt.load")}
    assert {path for path in every if not path.startswith(lost)} <= set(told) if lost else every <= set(told)
    assert not [path for path in told if lost and path.startswith(lost)]


def test_a_step_without_records_leaves_the_others_to_be_done(monkeypatch):
    modes_as_found(monkeypatch)
    chain = grounded(without(read_campaign(folder()), "ramps"))
    chain.take(STEPS)
    assert "adhesion" not in chain.steps and {"film", "restitution"} <= set(chain.steps)
    (told,), true = chain.steps["restitution"].values, float_paths(truth())[RESTITUTION].value
    assert told == pytest.approx(true, rel=0.02)


@pytest.mark.slow
def test_without_detachments_the_impacts_tell_the_film_and_the_device_says_what_nobody_knows(tmp_path):
    found = identified_without("ramps")
    film, full = found.steps["film"], identified().steps["restitution"]
    assert film.used[0].what == "impacts, for the film" and "C / g0^3" in film.combinations
    own = found.steps["restitution"]
    assert own.value(RESTITUTION) == pytest.approx(full.value(RESTITUTION), rel=0.02)
    assert own.std[0] > full.std[0]  # a film that is known less leaves the restitution more open
    rows = {row[0]: row[2] for row in open_table(found).rows}
    assert all(rows.values())
    assert rows["film and adhesion"] == (
        "'ramps': ramped squares of several frequencies up to 8 V on drive pzt, displacement and velocity of tip and "
        "center"
    )
    assert not found.comparisons and any("held-out records are not simulated" in one for one in found.remarks)
    device = identified_device(found)
    assert device.origin(RESTITUTION).source is Source.CALIBRATED
    assert device.origin("ground.adhesion.rate").note.startswith("Placeholder")
    assert write_identification(found, tmp_path)


def test_without_a_structure_the_sentence_says_so(tmp_path):
    """And what does not hang on it is there: the ground that the records show, and a report."""
    found = identify(without(read_campaign(folder()), "modal"))
    assert not found.steps and found.level == pytest.approx(identified().level, rel=1e-3)
    reasons = {one.name: one.reasons for one in found.not_done}
    said = (
        "it needs the structure: the campaign has no sweeps in the air, and the frequencies of the device are "
        "placeholders; record sweeps in the air (purpose 'modal'), or state there what is known"
    )
    assert reasons["hysteresis"] == reasons["film"] == reasons["restitution"] == (said,)
    assert write_identification(found, tmp_path) and "0 of 0 numbers determined" in str(found)


def test_draws_of_what_data_do_not_tell_are_those_of_what_was_known():
    """One number from nine groups, the other from none: known beforehand within two."""
    random = np.random.default_rng(1)
    score = np.column_stack([random.standard_normal(9) * 10.0, np.zeros(9)])
    information = np.tile(np.diag([100.0, 0.0]), (9, 1, 1))
    drawn = sandwich_draws([(information, score)], 3, np.diag([1e-9, 0.25]))
    assert np.std(drawn[:, 1]) == pytest.approx(2.0, rel=0.1)
    assert 0.02 < np.std(drawn[:, 0]) < 0.08


def test_what_a_device_file_holds_as_a_placeholder_does_not_matter(monkeypatch):
    modes_as_found(monkeypatch)
    opened = read_campaign(folder())
    others = {"robot.drives.pzt.law.linear": 3e-6, "robot.drives.pzt.law.constant": 3e-7}
    others |= {"ground.film.coefficient": 3e-20, "ground.film.thickness": 3e-5, "ground.adhesion.rate": 3e-6}
    others |= {"robot.structure.damping_ratios.0": 0.06, "robot.structure.frequencies.0": 610.0}
    others |= {"robot.drives.pzt.load.participation.1": 3.0}
    assert set(others) <= set(identified_paths(opened.model.scene))
    chain = grounded(replace(opened, model=opened.model.changed(others)))
    chain.take(STEPS[:2])
    assert not chain.not_done and chain.known.paths
    found = dict(zip(identified().known.paths, identified().known.values.tolist(), strict=True))
    for path, value in zip(chain.known.paths, chain.known.values.tolist(), strict=True):
        scale = max(abs(found[path]), 1e-9 if "weights" in path else 0.0)
        assert value == pytest.approx(found[path], rel=1e-3, abs=1e-3 * scale), path


def chain() -> StepRunner:
    model = FootModel(ts.load_scene(LABORATORY), "tip", "pzt", ("tip", "center"))
    return StepRunner.of(Opened(Campaign.model_construct(records=FrozenDict()), Path(), model))


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (InputError("too few bounces"), "too few bounces"),
        (np.linalg.LinAlgError("Singular matrix"), "no solution with these data (Singular matrix)"),
        (FloatingPointError("overflow"), "no solution with these data (overflow)"),
        (ValueError("operands could not be broadcast together with shapes (3,) (4,)"), None),
        (KeyError("film"), None),
    ],
)
def test_data_without_a_solution_are_a_reason_and_a_fault_of_the_program_is_raised(error, said):
    def find(_: StepRunner) -> StepResult:
        raise error

    runner = chain()
    tries = (
        lambda: runner.attempt(ChainStep("own", Purpose.BOUNCES, "bounces", find, "A step of its own.")),
        lambda: runner.guarded("checks", lambda: find(runner), None),
    )
    for one in tries:
        if said is None:
            with pytest.raises(type(error)) as raised:
                one()
            assert raised.value is error
        else:
            assert one() is None
    if said is None:
        assert not runner.not_done and not runner.evidence.remarks
    else:
        assert [one.name for one in runner.not_done] == ["own"] and said in runner.not_done[0].reasons[0]
        assert runner.evidence.remarks[0].startswith("checks: not from these data")


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


COEFFICIENT = "ground.film.coefficient"


def film(value: float, draws: np.ndarray) -> StepResult:
    samples = np.column_stack([draws, np.linspace(4e-5, 6e-5, len(draws))])
    return StepResult("film", (COEFFICIENT, "ground.film.thickness"), np.array([value, 5e-5]), samples)


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
    assert chain.steps == {} and chain.film is None and COEFFICIENT not in chain.known.paths
    (out,) = chain.not_done
    assert out.name == "film" and len(out.reasons) == 1
    assert COEFFICIENT in out.reasons[0] and words in out.reasons[0]


def test_nothing_of_a_step_that_is_not_done_is_calibrated():
    found = identified()
    steps = {name: step for name, step in found.steps.items() if name != "film"}
    device = identified_device(replace(found, steps=steps))
    assert device.origin(COEFFICIENT).source is not Source.CALIBRATED
    assert all(step.unsound() == [] for step in found.steps.values())


def test_arithmetic_that_overflows_on_the_way_is_no_warning(recwarn):
    chain = StepRunner.of(read_campaign(folder()))

    def overflowing() -> StepResult:
        np.exp(np.array([1000.0]))
        return film(2e-21, GOOD)

    chain.attempt(found(overflowing))
    assert "film" in chain.steps and chain.evidence.remarks == []
    assert not recwarn.list


def test_motion_in_the_wrong_unit_throughout_is_told_by_the_gap(monkeypatch):
    modes_as_found(monkeypatch)
    chain = StepRunner.of(read_campaign(folder()))
    chain.read()
    wrong = {
        purpose: [
            replace(t, **{name: 1e3 * getattr(t, name) for name in ("x", "v", "noise_x", "noise_v", "zero")})
            for t in traces
        ]
        for purpose, traces in chain.evidence.traces.items()
    }
    chain.evidence.traces = wrong
    chain.find_ground()
    (said,) = chain.evidence.remarks
    assert "are its displacements and velocities in mm stated as m" in said and "e+03 times as much" in said
    assert chain.evidence.level is None and not any(chain.evidence.traces.values())
    assert {one.file for one in chain.evidence.left_out} == {t.file for traces in wrong.values() for t in traces}
    chain.read = lambda: None
    told = chain.run()  # the sweeps still tell the modes
    assert list(told.steps) == ["resonances"]
    assert [one.name for one in told.not_done][:2] == ["hysteresis", "film"]
    assert any("are its displacements" in said for said in told.not_done[0].reasons)
    assert summary_of(told)["remarks"][0] == said
    assert chain.evidence.traces[Purpose.RAMPS] == []
