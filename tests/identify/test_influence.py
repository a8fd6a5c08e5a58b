"""What groups of data say of numbers: what varies is told, chance is not; intervals bear what a file has of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from identify.campaigns import identified
from tarsus.identify.covariance import scatter_over_noise, scattered
from tarsus.identify.influence import (
    BLOCK,
    CONTACT,
    EVENT,
    FILE,
    ORDER,
    SET,
    VOLTS,
    WITHIN,
    Influence,
    events_of,
    of_levels,
    of_records,
)
from tarsus.identify.resonance import of_sweeps
from tarsus.identify.surprises import CHANCE, Surprises, surprises
from tarsus.identify.traces import LEVEL, Stands, Trace, stands_of

PATHS = ("ground.adhesion.initial", "ground.adhesion.rate")
SETS, REPEATS, EVENTS = 6, 3, 4


def session() -> list[Trace]:
    """Six sets of three records with higher volts each, in the order of recording."""
    out, none = [], np.zeros((1, 2))
    for k in range(SETS * REPEATS):
        name, volts = f"set {k // REPEATS}", (1.0 + k // REPEATS) * np.array([-1.0, 1.0])
        out.append(Trace(f"{k}.mat", name, ("tip",), np.arange(2.0), none, none, volts, *3 * [np.ones(1)], None, k))
    return out


def line(random: np.random.Generator, by_file: float = 0.0, drift: float = 0.0, bend: float = 0.0) -> Influence:
    """A line over contact time through pulls with noise of one; each file has a deviation of its own, the constant
    drifts with the order, and the line bends."""
    traces = session()
    which = np.repeat(np.arange(len(traces)), EVENTS)
    time = np.tile(np.linspace(0.0, 1.0, EVENTS), len(traces)) + 0.1 * (which // REPEATS)
    pull = random.standard_normal(len(time)) + by_file * random.standard_normal(len(traces))[which]
    pull += drift * which + bend * time**2
    design = np.column_stack([np.ones_like(time), time])
    left = pull - design @ np.linalg.lstsq(design, pull, rcond=None)[0]
    levels, covariates = of_records(traces, which)
    events = events_of([traces[k].set for k in which], np.tile(np.arange(float(EVENTS)), len(traces)), 0.5)
    return Influence(
        PATHS,
        np.einsum("na,nb->nab", design, design),
        design * left[:, None],
        np.ones(2),
        {EVENT: events} | levels,
        covariates | {CONTACT: time},
    )


def told(surprise: Surprises) -> set[tuple[str, str]]:
    return {(one.path, one.along) for one in surprise.found}


def test_groups_are_events_files_and_sets():
    one = line(np.random.default_rng(1))
    assert [len(np.unique(one.levels[name])) for name in (EVENT, FILE, SET)] == [24, 18, 6]
    assert one.covariates[ORDER].tolist() == np.repeat(np.arange(18.0), EVENTS).tolist()
    assert np.unique(one.covariates[VOLTS]).tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert one.score.sum(axis=0) == pytest.approx(0.0, abs=1e-9)
    for level in (EVENT, FILE, SET):
        shares, pulls, _ = one.pulls(level)
        assert shares.sum(axis=0) == pytest.approx(1.0) and pulls.sum(axis=0) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("trials", [20, pytest.param(150, marks=pytest.mark.full)])
def test_chance_is_told_once_in_a_hundred_campaigns(trials):
    alarms = 0
    for seed in range(trials):
        random = np.random.default_rng(seed)
        alarms += bool(surprises([line(random), line(random)], seed).found)
    assert alarms <= binom.ppf(0.999, trials, CHANCE)


def test_what_drifts_through_a_session_is_told_with_its_slope():
    one = surprises([line(np.random.default_rng(2), drift=0.2)], 1)
    assert (PATHS[0], ORDER) in told(one)
    said = one.of(PATHS[0])
    assert said is not None and said.along == ORDER and said.moves(0.1)
    drift = next(this for this in one.found if (this.path, this.along) == (PATHS[0], ORDER))
    assert drift.slope == pytest.approx(0.2, abs=3.0 * drift.error) and drift.error < 0.05
    assert drift.half == pytest.approx(0.5 * 17 * drift.slope)
    assert drift.sentence("N").startswith(f"{PATHS[0]} rises with the order of recording: ")
    assert "at the end of the session" in drift.record


def test_what_earlier_steps_do_not_know_is_no_surprise():
    """A drift that an earlier number's error makes as often as not, and one of ten times what such an error makes."""
    random = np.random.default_rng(2)
    one = line(random, drift=0.2)
    draws = random.standard_normal((400, 1, 1)) * one.information[:, :, 0] * one.covariates[ORDER][:, None]
    for size, said in ((0.2, False), (0.02, True)):
        found = surprises([replace(one, shared=size * draws)], 1)
        assert ((PATHS[0], ORDER) in told(found)) is said


def test_a_line_that_bends_is_told_over_what_it_bends():
    """The constant over contact time is the slope, and no figure of its own."""
    one = surprises([line(np.random.default_rng(3), bend=6.0)], 1)
    assert one.found[0].along == CONTACT and one.found[0].path == PATHS[1]
    assert (PATHS[0], CONTACT) not in {(this.path, this.along) for this in one.figures}


def test_files_that_differ_are_told_and_widen_the_interval():
    random, covered, trials = np.random.default_rng(4), 0, 40
    assert "file" in {one.along for one in surprises([line(random, by_file=3.0)], 1).found}
    alone, wide = (float(scattered(line(random, by_file=by), 1)[:, 0].std()) for by in (0.0, 3.0))
    assert wide > 2.0 * alone
    for seed in range(trials):
        one = line(random, by_file=3.0)
        found = np.linalg.solve(one.information.sum(axis=0), rhs(random, one, 3.0))
        covered += bool(np.all(np.abs(found) <= np.quantile(np.abs(scattered(one, seed)), 0.95, axis=0)))
    assert covered >= binom.ppf(1e-3, trials, 0.85)  # both at once


def test_a_file_that_says_nothing_of_a_number_is_no_group_of_it():
    one = line(np.random.default_rng(4), by_file=3.0)
    mute = one.levels[FILE] == one.levels[FILE][0]
    mute = replace(
        one,
        information=np.where(mute[:, None, None], 0.0, one.information),
        score=np.where(mute[:, None], 0.0, one.score),
    )
    assert "file" in {found.along for found in surprises([mute], 1).found}


def test_known_noise_is_all_of_an_interval_unless_groups_scatter_more():
    for seed in range(5):
        sound, by_file = (line(np.random.default_rng(seed), by_file=by) for by in (0.0, 3.0))
        noise = np.linalg.inv(sound.information.sum(axis=0))
        assert scatter_over_noise(sound) == pytest.approx(noise)
        assert np.all(np.diag(scatter_over_noise(by_file)) > 4.0 * np.diag(noise))


def rhs(random: np.random.Generator, one: Influence, by_file: float) -> np.ndarray:
    """Scores about the true line, zero, of pulls such as those of an influence."""
    files = one.levels[FILE]
    pull = random.standard_normal(len(files)) + by_file * random.standard_normal(files.max() + 1)[files]
    return np.column_stack([np.ones_like(pull), one.covariates[CONTACT]]).T @ pull


def test_a_ground_that_sinks_from_file_to_file_is_told():
    """By 22 nm a file of 40 nm noise; one file far off is no drift."""
    random, traces = np.random.default_rng(5), session()
    levels = 4e-8 * random.standard_normal(len(traces))
    levels[-1] += 5e-6

    def ground(levels: np.ndarray) -> Influence:
        count, none = len(traces), np.zeros(len(traces))
        error = np.full(count, 1.2e-7)
        return of_levels(Stands(tuple(traces), levels, error, np.arange(count), np.ones(count), none, none))

    assert not surprises([ground(levels)], 1).found
    levels[-1] -= 5e-6
    found = surprises([ground(levels - 2.2e-8 * np.arange(len(traces)))], 1).found
    drift = next(one for one in found if one.along == ORDER)
    assert drift.path == LEVEL and drift.slope == pytest.approx(-2.2e-8, abs=3.0 * drift.error)
    assert drift.sentence("m").startswith("the level of the ground falls with the order of recording: ")


def test_a_ground_that_gives_way_is_told_over_the_volts_that_press_the_foot():
    """By 40 nm a volt, where a free foot moves by 2 um."""
    random, time, told = np.random.default_rng(6), 5e-5 * np.arange(4000.0), []
    volts = 6.0 * np.sin(2.0 * np.pi * 5.0 * time)
    for follows in (0.0, 4e-8):
        traces = []
        for k in range(12):
            x = np.maximum(-2e-6 * volts, -6e-6 + follows * volts) + 4e-7 * random.standard_normal(len(time))
            v = 1e-6 * random.standard_normal(len(time)) - 5e-4 * (np.abs(-2e-6 * volts) < 6e-6)
            own = np.array([4e-7]), np.array([1e-6]), np.array([2e-8])
            traces.append(Trace(f"{k}.mat", f"set {k // 3}", ("tip",), time, x[None], v[None], volts, *own, None, k))
        stands = stands_of(traces, [], "tip")
        assert stands is not None and len(stands.levels) == 12
        assert stands.levels == pytest.approx(-6e-6, abs=3e-7)
        told.append([one for one in surprises([of_levels(stands)], 1).found if one.along == WITHIN])
    assert not told[0]
    (slope,) = told[1]
    assert slope.slope == pytest.approx(4e-8, abs=3.0 * slope.error) and "press the foot" in slope.record


def test_a_frequency_that_drifts_through_the_sweeps_is_told_with_its_slope():
    """Of 24 sweeps whose poles scatter as far as the interval says, and that rise by half of that from one to next."""
    found = identified().resonances
    assert found is not None
    count, chance = 24, 0
    sources = tuple(f"sweep-{k}" for k in range(count))
    order, volts = {one: 3 * k for k, one in enumerate(sources)}, dict.fromkeys(sources, 0.2)
    rise = 0.5 * np.sqrt(count) * float(found.step.std[0])

    def drifting(seed: int, drift: float) -> Influence:
        random, modes = np.random.default_rng(seed), []
        for k, mode in enumerate(found.fit.modes):
            scatter = 2.0 * np.pi * np.sqrt(count) * float(found.step.std[k]) * random.standard_normal(count)
            modes.append(replace(mode, shifts=1j * (scatter + 2.0 * np.pi * drift * (k == 0) * np.arange(count))))
        one = of_sweeps(replace(found, fit=replace(found.fit, modes=tuple(modes)), sources=sources), order, volts)
        assert one is not None and one.score.sum(axis=0) == pytest.approx(0.0, abs=1e-6)
        return one

    for seed in range(10):
        chance += bool(surprises([drifting(seed, 0.0)], seed).found)
        told = [one for one in surprises([drifting(seed, rise)], seed).found if one.path.endswith("frequencies.0")]
        assert told[0].along == ORDER and told[0].slope == pytest.approx(rise / 3.0, abs=5.0 * told[0].error)
    assert chance <= binom.ppf(0.999, 10, CHANCE)


def test_loops_say_what_each_run_of_the_volts_says_of_the_law():
    one = identified().steps["hysteresis"].influence
    assert one is not None and len(one.score) == len(one.levels[BLOCK])
    assert len(np.unique(one.levels[FILE])) > 1 and len(np.unique(one.levels[EVENT])) < len(one.score)
    assert one.paths == tuple(p for p in identified().steps["hysteresis"].paths if not p.endswith("constant"))
    _, pulls, variance = one.pulls(BLOCK)
    law = [".law." in path for path in one.paths]
    assert np.all(np.abs(pulls.sum(axis=0)) < 1e-3 * np.sqrt(variance), where=law), "about the minimum"
