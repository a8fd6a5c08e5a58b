"""The simulated cluster: limits that can be worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tarsus.cluster.model import Costs, main, simulated

PLAIN = Costs(run=1e-3, spread=0.0, unit=1.0, start=0.0, write=0.0, operations=1e12)


def test_without_losses_every_worker_is_busy():
    found = simulated(PLAIN, 10, 100_000)
    assert found.seconds == pytest.approx(10.0) and found.efficiency == pytest.approx(1.0)
    assert found.deaths == 0


def test_units_that_do_not_go_round_leave_workers_idle():
    found = simulated(PLAIN, 10, 11_000)  # 11 units on 10 workers take two rounds
    assert found.seconds == pytest.approx(2.0) and found.efficiency == pytest.approx(0.55)


def test_a_slow_file_system_sets_the_pace():
    found = simulated(replace(PLAIN, operations=12.0, per_unit=6.0), 10, 100_000)
    assert found.seconds == pytest.approx(100 / 2, rel=0.05) and found.busy > 0.95


def test_a_start_is_paid_once():
    found = simulated(replace(PLAIN, start=1.0), 10, 100_000)
    assert 10.8 <= found.seconds <= 11.5


def test_deaths_cost_what_was_under_way_and_the_way_back():
    found = simulated(replace(PLAIN, life=20.0, back=1.0), 50, 2_000_000, strided=False)
    assert found.deaths == pytest.approx(2000 / 20, rel=0.3)
    lost = found.deaths * (0.5 + 1.0)  # half a unit and the way back, on average
    assert 2000.0 / found.efficiency - 2000.0 == pytest.approx(lost, rel=0.5)


def test_one_queue_bears_many_slow_workers_better_than_shares():
    slow = replace(PLAIN, slow=0.4)
    shares, queue = (simulated(slow, 50, 5_000_000, strided=one).efficiency for one in (True, False))
    assert shares < 0.7 < 0.84 < queue


def test_the_command_line_prints_a_case(capsys):
    assert main(["--workers", "100", "--runs", "1e6"]) == 0
    assert "1000000 runs in 1500 units on 100 workers: " in capsys.readouterr().out
