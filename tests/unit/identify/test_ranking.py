"""What to measure next: where the information is known, and where it can be sampled."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from laboratory import LABORATORY
from scene_files import scene
from tarsus.base.errors import InputError
from tarsus.identify.candidates import Candidate, candidate_grid
from tarsus.identify.features import Resolution, simulated
from tarsus.identify.prior import LogNormalPrior
from tarsus.identify.ranking import RANKED, rank

E = "ground.restitution.coefficient"
A0, A = "ground.adhesion.initial", "ground.adhesion.rate"
GROUND = (E, A0, A, "ground.film.coefficient", "ground.film.thickness")
DEVICE = ts.load_scene(LABORATORY)


def ball() -> ts.Scene:
    """A ball that a drive could push, dropped from 1 m."""
    drive = ts.Drive(load=ts.PointLoad(weights={"ball": 1.0}), law=ts.LinearForce(gain=1.0))
    return scene("ball", {E: 0.6, "robot.drives": {"kick": drive}})


def test_the_rebound_of_a_ball_tells_what_it_must():
    prior = LogNormalPrior((E,), np.array([0.6]), np.array([[0.1**2]]))
    drop = Candidate(name="drop", signal=ts.Constant(level=0.0), record=1.2)
    tool = Resolution(length=0.01, share=0.02)
    found = rank(ball(), [drop], prior, E, 3.0, kinds=("rebound",), instrument=tool, draws=8, step=0.5)
    apex, d = np.exp(2.0 * np.log(0.6) + 2.0 * prior.draws(8)[:, 0]), 0.05  # h e^2
    slope = apex * np.sinh(2.0 * d) / d
    for repeats, std in ((1, found.ranked[0].std), (2, found.plan.std)):
        variance = 0.01**2 / repeats + (0.02 * apex) ** 2 + (apex * (np.cosh(2.0 * d) - 1.0)) ** 2
        gains = 0.5 * np.log(1.0 + 0.1**2 * slope**2 / variance)
        assert std == pytest.approx(0.1 * np.exp(-gains.mean()), rel=1e-5)
    assert found.std == pytest.approx(0.1)
    assert [step[0].name for step in found.plan.steps] == ["drop", "drop"] and found.plan.cost == 2.4
    assert found.ranked[0].repeats == 2


def test_signals_without_contact_tell_nothing_of_restitution():
    grid = candidate_grid((100.0,), (0.3, 2.0), (0.25,))
    found = rank(DEVICE, grid, LogNormalPrior.of_scene(DEVICE, GROUND), E, 0.1, draws=4)
    best, worst = found.ranked
    assert best.candidate.name == "100 Hz, 2 V, lambda 0.25" and best.gain > 0.5
    assert worst.gain == pytest.approx(0.0, abs=1e-12) and worst.std == pytest.approx(0.3)
    assert {step[0].name for step in found.plan.steps} == {best.candidate.name}


def test_long_contacts_tell_the_growth_of_adhesion_and_different_ones_separate_it_from_its_start():
    device = ts.with_values(DEVICE, {A0: 150e-9})
    prior = LogNormalPrior.of_scene(device, (A0, A))
    found = rank(device, candidate_grid((5.0, 15.0, 100.0), (6.0,), (0.25,)), prior, A, 20.0, draws=4)
    gains = {one.candidate.signal.frequency: one.gain for one in found.ranked}
    assert gains[5.0] > gains[15.0] > gains[100.0]
    grid = candidate_grid((5.0, 100.0), (8.0,), (0.25,))
    alone = [rank(device, [one], prior, A, 20.0, draws=4).plan.std for one in grid]
    plan = rank(device, grid, prior, A, 20.0, draws=4).plan
    assert plan.std < 0.8 * min(alone) and {step[0].name for step in plan.steps} == {one.name for one in grid}


def test_a_plan_keeps_its_budget():
    grid = candidate_grid((5.0, 50.0, 100.0), (6.0,), (0.25,))
    prior = LogNormalPrior.of_scene(DEVICE, (A0, A))
    said = []
    found = rank(DEVICE, grid, prior, A, 0.3, draws=2, progress=lambda k, n, what: said.append((k, n, what)))
    assert found.plan.cost <= 0.3 * (1.0 + 1e-9)
    assert found.plan.cost == pytest.approx(sum(c.record for c, _ in found.plan.steps))
    notes = {one.candidate.signal.frequency: one.note for one in found.ranked}
    assert notes == {5.0: "longer than the budget", 50.0: "", 100.0: ""}
    stds = [std for _, std in found.plan.steps]
    assert stds == sorted(stds, reverse=True) and stds[-1] == pytest.approx(found.plan.std)
    assert said[0] == (0, 3, grid[0].name) and len(said) == 3
    empty = rank(DEVICE, grid, prior, A, 0.01, draws=2).plan
    assert empty.steps == () and empty.cost == 0.0 and empty.std == pytest.approx(found.std)


def test_a_candidate_changes_signal_and_gap_and_nothing_else():
    (one,) = candidate_grid((50.0,), (6.0,), (0.25,), (90e-6,))
    assert one.name == "50 Hz, 6 V, lambda 0.25, gap 90 um" and one.record == pytest.approx(8 / 50)
    changed = one.on(DEVICE)
    assert changed.signals["pzt"] == ts.waveforms.RampedSquare(amplitude=6.0, frequency=50.0, duty=0.25)
    assert ts.get_value(changed, "robot.feet.tip.gap") == 90e-6
    assert changed.ground == DEVICE.ground


def test_priors_come_from_draws_or_from_intervals():
    random = np.random.default_rng(2)
    cov = np.array([[0.04, 0.03], [0.03, 0.09]])
    prior = LogNormalPrior.of_samples((A0, A), np.exp(random.multivariate_normal([-18.0, -12.0], cov, 4000)))
    assert prior.covariance == pytest.approx(cov, rel=0.1)
    assert np.log(prior.values) == pytest.approx([-18.0, -12.0], abs=0.02)
    known = ts.with_values(DEVICE, {"provenance": {
        E: {"source": "calibrated", "note": "from bounces", "interval": [[0.2653 / 1.1, 0.2653 * 1.1]]}
    }})  # fmt: skip
    assert LogNormalPrior.of_scene(known, (E, A), 0.4).std == pytest.approx(
        [np.log(1.1) / 1.96, 0.4], rel=1e-3
    )
    drawn = np.exp(random.multivariate_normal([-18.0, -12.0], cov, 4000))
    mixed = LogNormalPrior.of_scene(
        known, (A0, E, A), 0.4, {A0: drawn[:, 0], A: drawn[:, 1], E: np.zeros(4000)}
    )
    assert mixed.covariance[np.ix_([0, 2], [0, 2])] == pytest.approx(cov, rel=0.1)
    assert mixed.std[1] == pytest.approx(np.log(1.1) / 1.96, rel=1e-3) and mixed.covariance[0, 1] == 0.0


def test_what_cannot_be_ranked_is_said_at_once():
    prior = LogNormalPrior.of_scene(DEVICE, (A0, A))
    with pytest.raises(InputError) as refused:
        rank(DEVICE, [], prior, E, 0.0)
    said = refused.value.problems
    assert len(said) == 3 and "no candidate" in said[0] and E in said[1] and "budget" in said[2]
    wrong = Candidate(name="x", signal=ts.Constant(level=1.0), drive="pxt", record=0.1)
    with pytest.raises(InputError, match="no drive 'pxt'; did you mean 'pzt'"):
        rank(DEVICE, [wrong], prior, A, 1.0)
    with pytest.raises(InputError, match="record"):
        Candidate(name="x", signal=ts.Constant(level=1.0), record=0.0)
    with pytest.raises(InputError, match="more than 2 draws"):
        LogNormalPrior.of_samples((A0, A), [[1.0, 2.0]])


@pytest.mark.slow
@pytest.mark.parametrize("parameter", [E, A])
def test_the_signal_on_top_shrinks_the_interval_more_than_one_below(parameter):
    """Records are made at 30 devices drawn from the prior, and its draws weighed by how likely they make each."""
    prior = LogNormalPrior.of_scene(DEVICE, GROUND)
    grid = candidate_grid((15.0, 50.0, 100.0), (2.0, 6.0), (0.0, 0.25))
    found = rank(DEVICE, grid, prior, parameter, 1.0)
    j = GROUND.index(parameter)
    tool, random = Resolution(), np.random.default_rng(8)
    logs = prior.draws(512, seed=4)
    rows = prior.values * np.exp(logs)

    def shrunk(candidate: Candidate) -> float:
        made = simulated(
            candidate.on(DEVICE),
            {path: rows[:, k] for k, path in enumerate(GROUND)},
            candidate.record,
            RANKED,
        )
        error = np.array([made.of(i).error(tool) for i in range(len(rows))])
        gains = []
        for truth in range(30):
            record = made.values[truth] + error[truth] * random.standard_normal(error.shape[1])
            off = np.nan_to_num((record - made.values) ** 2 / error**2 + 2.0 * np.log(error))
            one_only = np.isfinite(record) != np.isfinite(made.values)
            chance = -0.5 * np.sum(np.where(one_only, 16.0 + 2.0 * np.log(error[truth]), off), axis=1)
            weight = np.exp(chance - np.delete(chance, truth).max())
            weight[truth] = 0.0
            weight /= weight.sum()
            spread = np.sqrt(weight @ (logs[:, j] - weight @ logs[:, j]) ** 2)
            gains.append(np.log(prior.std[j] / max(spread, 0.02)))
        return float(np.mean(gains))

    top, middle, low = (found.ranked[k] for k in (0, len(grid) // 2, -1))
    by_sampling = [shrunk(one.candidate) for one in (top, middle, low)]
    assert by_sampling[0] > by_sampling[1] - 0.05 and by_sampling[0] > by_sampling[2] + 0.3
    assert by_sampling[0] == pytest.approx(top.gain, abs=0.7)
