"""Table 3.2: its rows, statistics over seeds, and what is compared with what."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.study import seeds
from tarsus_reproduce import robots
from tarsus_reproduce.impacts import impact_energies, map_rows, mode_rows, printed_column
from tarsus_reproduce.mixtures import packaged_members
from tarsus_reproduce.scenarios import packaged_scenarios, parse_scenarios, read_scenarios


def test_packaged_rows_are_the_source_s_and_the_third_has_no_numbers():
    sine, square, third = packaged_scenarios("hexapod")
    assert (sine.wave, sine.volt_v, sine.gap_um) == ("sine", 10.0, 10.0)
    assert sine.measured.bounces_per_s == 260.0 and sine.source.mean_um == 17.3
    assert (square.measured.peak_um, square.source.peak_um) == (36.2, 28.5)
    assert (third.wave, third.gap_um) == ("square", 5.0)
    assert not third.measured and not third.source
    assert packaged_scenarios("quadruped") == []


def test_rows_in_the_usual_order_need_no_header(tmp_path):
    path = tmp_path / "more.csv"
    path.write_text("# mine\nsquare,10,5,111,22.5,13\n\nsine,5,8,,,\n")
    one, other = read_scenarios(path)
    assert (one.wave, one.volt_v, one.gap_um, one.measured.bounces_per_s) == ("square", 10.0, 5.0, 111.0)
    assert one.measured.mean_um == 13.0 and one.origin == "more.csv" and not other.measured
    path.write_text("gap_um,wave,volt_v,freq_hz\n5,sine,10,40\n")
    assert read_scenarios(path)[0].freq_hz == 40.0


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "holds no rows"),
        ("wave,volt_v,gap_um\n", "names its columns but holds no rows"),
        ("wave,volts,gap_um\nsine,1,2\n", "unknown column 'volts'; did you mean 'volt_v'?"),
        ("wave,volt_v\nsine,1\n", "the column 'gap_um' is missing"),
        ("triangle,10,5,1,1,1\n", "unknown column"),
        ("sine,-10,5,1,1,1\n", "'volt_v' must be a number above zero, got '-10'"),
        ("sine,10,0,1,1,1\n", "'gap_um' must be a number above zero, got '0'"),
        ("sine,10,5,x,1,1\n", "'bounces_exp_per_s' should be a number, got 'x'"),
        ("sine,10,5,1,nan,1\n", "'peak_exp_um' must be zero or more, got 'nan'"),
        ("sine,10,5,1,1,1,1,1,1,1,1\n", "11 cells, but there are 10 columns"),
    ],
)
def test_bad_rows_are_sentences(text, sentence):
    with pytest.raises(ts.InputError) as caught:
        parse_scenarios(text, where="rows.csv", origin="rows.csv")
    assert sentence in str(caught.value)


def test_seeds_share_energy_between_modes():
    scene = ts.load_scene("hexapod")
    mass = scene.robot.structure.matrices().mass
    row = scene.robot.structure.row("foot1")
    velocities = np.array([seeds.random_velocities(scene, "foot1", seed) for seed in range(4000)])
    assert (velocities @ row).std() == pytest.approx(seeds.SPEED, rel=0.05)
    energies = velocities**2 @ np.diag(np.diag(mass))  # Modal: mass is diagonal
    means = energies.mean(axis=0)
    assert np.ptp(means) < 0.2 * means.mean()
    assert seeds.random_velocities(scene, "foot1", 3) == seeds.random_velocities(scene, "foot1", 3)


def test_statistics_agree_with_a_single_run():
    scene = ts.load_scene("hexapod")
    found = seeds.foot_statistics(scene, 2, duration=0.2, settle=0.1, window=0.05)
    assert found.ok and found.bounces.shape == (8,)
    assert seeds.foot_statistics(scene, 2, duration=0.2, settle=0.1).bounces.shape == (2,)
    start = ts.with_values(
        scene, {"initial": ts.Initial(velocity=seeds.random_velocities(scene, "foot1", 1))}
    )
    run = ts.simulate(start, duration=0.3, accuracy=seeds.ACCURACY)
    gaps = run.at(0.1 + (np.arange(40_000) + 0.5) / 200_000).state.gap[0].reshape(4, 10_000)
    # the integral of the gap is known at events and marks, and a window's edges lie between them
    assert found.mean[4:] == pytest.approx(gaps.mean(axis=1), rel=0.04)
    assert found.mean[4:].mean() == pytest.approx(gaps.mean(), rel=0.01)
    assert (found.peak[4:] <= gaps.max(axis=1) * (1.0 + 1e-3)).all()
    assert (found.peak[4:] > 0.5 * gaps.max(axis=1)).all()


def test_reproduction_compares_like_with_like():
    result = robots.reproduce_robot("hexapod", "hexapod", seeds=2)
    summary = result.summary()
    # the source's model against its own measurement, from the four printed pairs
    assert summary["source"]["bounces_per_s"] == pytest.approx(100 * (80 / 260 + 40 / 160) / 2)
    assert summary["source"]["peak_um"] == pytest.approx(100 * (0.5 / 23.5 + 7.7 / 36.2) / 2)
    assert summary["source"]["mean_um"] == pytest.approx(100 * (2.5 / 14.8 + 2.2 / 23.6) / 2)
    plain = result.to_dict()
    assert [row["role"] for row in plain["rows"]] == ["calibrated on", "calibrated on", "predicted"]
    assert set(plain["rows"][0]["ours"]) == {"bounces_per_s", "peak_um", "mean_um"}
    assert plain["rows"][2]["errors"] == {"bounces_per_s": None, "peak_um": None, "mean_um": None}
    assert result.ok and "summary_packaged" not in plain


def test_without_a_device_the_packaged_mixture_predicts(monkeypatch):
    few = packaged_members("hexapod")[:2]
    monkeypatch.setattr(robots, "packaged_members", lambda robot: few)
    monkeypatch.setattr(robots, "packaged_scenarios", lambda robot: packaged_scenarios(robot)[:1])
    result = robots.reproduce_robot("hexapod", seeds=3)
    assert result.device == "hexapod, a mixture of 2" and result.column is robots.HeightColumn.MEAN_APEX
    assert result.rows[0].ours.seeds == 2 * 2  # three initial states for two members: two each


def test_added_rows_are_summarised_apart(tmp_path):
    path = tmp_path / "mine.csv"
    path.write_text("square,10,5,200,30,12\n")
    result = robots.reproduce_robot("hexapod", "hexapod", rows=path, seeds=1).to_dict()
    ours = result["rows"][-1]["ours"]
    assert result["rows"][-1]["role"] == "predicted"
    assert 55.0 <= result["rows"][-1]["freq_hz"] <= 135.0  # that of the best member: the table has none
    assert result["summary_added"]["ours"]["peak_um"] == pytest.approx(
        100 * abs(ours["peak_um"]["median"] - 30) / 30
    )
    assert result["summary_added"]["source"]["peak_um"] is None
    assert result["summary_packaged"]["source"]["mean_um"] == pytest.approx(13.107, abs=0.001)


def test_modes_beside_the_printed_column():
    rows = mode_rows(ts.load_scene("hexapod"), "hexapod")
    assert [round(row.freq_hz, 1) for row in rows] == [117.2, 136.1, 329.2, 342.2, 678.1, 2866.1]
    assert rows[5].mac == pytest.approx(0.965, abs=0.001)
    assert max(row.mac for row in rows[:5]) < 0.3
    np.testing.assert_allclose(
        printed_column("hexapod"), [1.0, -0.3933, -0.6467, -0.2667, -0.28, 0.28], atol=1e-4
    )


def test_worst_gains_and_energies_along_a_run():
    scene = ts.with_values(ts.load_scene("hexapod"), {"ground.restitution.coefficient": 0.515981})
    gains = {row.map: row for row in map_rows(scene, "hexapod")}
    assert gains["mass-weighted"].worst_gain == pytest.approx(1.0)
    assert gains["dominant mode"].worst_gain == pytest.approx(2.33, abs=0.05)  # at e = 0.515
    assert gains["printed"].worst_gain > 20.0
    assert all(row.passive_worst_gain == pytest.approx(1.0) for row in gains.values())
    run = ts.simulate(ts.with_values(scene, {"ground.impact": ts.laws.MassWeighted()}), duration=0.2)
    energies = impact_energies(run, "hexapod")
    assert len(energies.time) > 10
    bounced = run.events["kind"][np.isin(run.events["kind"], (1, 2, 4))] == 1
    np.testing.assert_allclose(
        energies.actual[bounced],
        energies.by_map["mass-weighted"][bounced],
        rtol=1e-6,
        atol=1e-9 * np.abs(energies.actual).max(),
    )
    assert energies.by_map["printed"].max() > 0.0 > energies.actual.min()
