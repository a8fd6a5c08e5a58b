"""Table 3.2: statistics over seeds, what is compared with what, modes and impact maps."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus_reproduce import robots
from tarsus_reproduce.compared import merits_table
from tarsus_reproduce.impacts import energies_table, impact_energies, maps_table, modes_table, printed_column
from tarsus_reproduce.reproduction import CALIBRATED, PREDICTED
from tarsus_reproduce.robot_runs import robot_runs
from tarsus_reproduce.rows import HEIGHTS


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Rows of the best device with two seeds, and one more row."""
    rows = tmp_path_factory.mktemp("rows") / "mine.csv"
    rows.write_text("square,10,5,200,30,12\n", encoding="utf-8")
    return robots.robot_table("hexapod", "hexapod", rows, seeds=2)


def merits(found, rows: str, model: str) -> dict[str, float]:
    """Mean sizes of the errors of a model in some rows, by quantity."""
    table = merits_table(HEIGHTS, found.numbers)
    return {row[2]: row[7] for row in table.rows if row[0].startswith(rows) and row[1] == model}


def test_like_is_compared_with_like(found):
    source = merits(found, CALIBRATED, "dissertation")
    # the source's model against its own measurement, from the four printed pairs
    assert source["bounces in a second"] == pytest.approx((80 / 260 + 40 / 160) / 2)
    assert source["peak height"] == pytest.approx((0.5 / 23.5 + 7.7 / 36.2) / 2)
    assert source["mean height"] == pytest.approx((2.5 / 14.8 + 2.2 / 23.6) / 2)
    assert [row.role for row in found.numbers[::4]] == [CALIBRATED] * 2 + [PREDICTED] * 2
    assert all(row.measured is None and row.held is None for row in found.numbers[8:12])
    assert not found.problems and found.runs == 2


def test_added_rows_are_summarised_apart(found):
    peak = next(row for row in found.numbers[12:] if row.quantity == "peak height")
    assert 55.0 <= float(peak.case.split(" Hz")[0]) <= 135.0  # that of the device: the table has none
    added = merits(found, PREDICTED, "this model")
    assert added["peak height"] == pytest.approx(abs(1e6 * peak.ours[0] - 30) / 30)
    assert merits(found, PREDICTED, "dissertation") == {}


def test_a_frequency_that_would_take_hours_is_refused(tmp_path):
    path = tmp_path / "fast.csv"
    path.write_text("wave,volt_v,gap_um,freq_hz\nsine,10,5,1e9\n", encoding="utf-8")
    with pytest.raises(ts.InputError, match="1e\\+09"):
        robots.robot_table("hexapod", "hexapod", path)


def test_seeds_are_shared_out_over_the_packaged_ensemble(monkeypatch):
    rows = robots.printed_rows("hexapod")[:1]
    monkeypatch.setattr(robots, "printed_rows", lambda robot: rows)
    result = robots.robot_table("hexapod", seeds=50)
    assert "ensemble of 48" in result.device
    assert result.runs == 2 * 48  # fifty initial states for 48 members: two each


def test_modes_beside_the_printed_column():
    table = modes_table(ts.load_scene("hexapod"), "hexapod")
    assert table is not None
    rows = table.rows[:-1]
    assert [round(row[1], 1) for row in rows] == [117.2, 136.1, 329.2, 342.2, 678.1, 2866.1]
    assert rows[5][2] == pytest.approx(0.965, abs=0.001)
    assert max(row[2] for row in rows[:5]) < 0.3
    np.testing.assert_allclose(printed_column("hexapod"), [1.0, -0.3933, -0.6467, -0.2667, -0.28, 0.28], atol=1e-4)


def test_worst_gains_and_energies_along_a_run():
    scene = ts.with_values(ts.load_scene("hexapod"), {"ground.restitution.coefficient": 0.515981})
    gains = {name: (worst, passive) for name, _, _, worst, passive in maps_table(scene, "hexapod").rows}
    assert gains["mass-weighted"][0] == pytest.approx(1.0)
    assert gains["dominant mode"][0] == pytest.approx(2.33, abs=0.05)  # at e = 0.515
    assert gains["printed"][0] > 20.0
    assert all(passive == pytest.approx(1.0) for _, passive in gains.values())
    run = ts.simulate(ts.with_values(scene, {"ground.impact": {"kind": "mass_weighted"}}), duration=0.2)
    energies = impact_energies(run, "hexapod")
    actual = energies["as run"]
    assert len(actual) > 10
    bounced = run.events["kind"][np.isin(run.events["kind"], (1, 2, 4))] == 1
    np.testing.assert_allclose(
        actual[bounced], energies["mass-weighted, as it is"][bounced], rtol=1e-6, atol=1e-9 * np.abs(actual).max()
    )
    assert energies["printed, as it is"].max() > 0.0 > actual.min()
    ((_, total, mean, made, lost, share),) = energies_table({"a": np.array([-1.0, 1e-12, 0.5, -0.2])}, "").rows
    assert (total, mean, made, lost, share) == (pytest.approx(-0.7), pytest.approx(-0.175), 0.5, 1.0, 0.25)


def test_motion_in_the_air_is_steady_and_linear_in_the_volts():
    near, air = robot_runs("hexapod", ts.load_scene("hexapod"))
    assert all(one.run.ok for one in (*near, *air)) and len(near) == 3
    for one in air:
        end, period = one.run.duration, next(iter(one.run.scene.signals.values())).period
        phase = np.linspace(0.0, 1.0, 500)
        first, second = (one.run.states(end - (turn - phase) * period).x for turn in (2.0, 1.0))
        assert np.abs(second - first).max() < 0.01 * np.ptp(second)
    sizes = [one.peak_to_peak[0] for one in air]
    assert sizes[3] / sizes[0] == pytest.approx(2.0, rel=1e-3)
