"""A sweep on other processes: the same bytes as on one machine, whoever dies."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import tarsus as ts
import tarsus.study.pool as pool
from study.sweep_case import FailingExecutor, files, small
from tarsus.calibrate.lowering import lower_study
from tarsus.calibrate.studyfile import load_study
from tarsus.study.axes import Linspace, Sobol
from tarsus.study.sweeping import run_sweep

SWEEP = small(vary={"ground.restitution.coefficient": Linspace(start=0.1, stop=0.6)}, design=Sobol(count=37), chunk=3)


def test_an_executor_gives_the_bytes_of_one_machine(alone, tmp_path):
    said = []
    result = run_sweep(
        SWEEP, tmp_path, threads=FailingExecutor(lambda _: False), progress=lambda *one: said.append(one)
    )
    assert files(tmp_path) == files(alone)
    assert sum(result.workers.values()) == 37 == said[-1][0] and (result.units, result.kept) == (13, 0)


def test_workers_that_die_cost_time_only(alone, tmp_path):
    executor = FailingExecutor(lambda number: number % 3 == 0)
    run_sweep(SWEEP, tmp_path, threads=executor)
    assert executor.calls > 13 and files(tmp_path) == files(alone)


def test_a_unit_that_kills_its_workers_ends_the_sweep_and_the_others_are_kept(alone, tmp_path):
    class Unlucky(FailingExecutor):
        def submit(self, fn, /, *args, **kwargs):
            self._dies = lambda _: args[1] == 0
            return super().submit(fn, *args, **kwargs)

    with pytest.raises(ts.InputError, match=r"unit 0 was begun 5 times .*EOFError.*continue with --resume"):
        run_sweep(SWEEP, tmp_path, threads=Unlucky(lambda _: False))
    kept = {name: text for name, text in files(tmp_path).items() if name.startswith("units")}
    assert len(kept) == 12 and kept.items() <= files(alone).items()
    assert run_sweep(SWEEP, tmp_path, resume=True).kept == 34
    assert files(tmp_path) == files(alone)


def test_a_worker_of_another_version_is_named(tmp_path, monkeypatch):
    executor = FailingExecutor(lambda _: False)
    sent = pool.WorkerPool.__init__

    def there(self, *words):
        sent(self, *words)
        self._plan = dataclasses.replace(self._plan, versions=(("engine", "feed"), ("tarsus", "9.9")), node="login1")

    monkeypatch.setattr(pool.WorkerPool, "__init__", there)
    with pytest.raises(
        ts.InputError, match=r"node \S+ has engine \w+, tarsus \S+ and .* begun on login1 with engine feed"
    ):
        run_sweep(SWEEP, tmp_path, threads=executor)


def test_units_that_another_process_made_meanwhile_are_left_out(alone, tmp_path):
    made = []

    class Meanwhile(FailingExecutor):
        def submit(self, fn, /, *args, **kwargs):
            made.append(args[1])
            if len(made) == 1:
                run_sweep(SWEEP, tmp_path, resume=True)
            return super().submit(fn, *args, **kwargs)

    run_sweep(SWEEP, tmp_path, threads=Meanwhile(lambda _: False))
    assert made == [0] and files(tmp_path) == files(alone)


def test_the_collected_file_does_not_depend_on_units(alone, tmp_path):
    run_sweep(small(vary=dict(SWEEP.vary), design=SWEEP.design, chunk=37), tmp_path / "one")
    run_sweep(small(vary=dict(SWEEP.vary), design=SWEEP.design, chunk=1), tmp_path / "many")
    import xarray as xr

    with xr.open_dataset(tmp_path / "one" / "sweep.nc") as one, xr.open_dataset(tmp_path / "many" / "sweep.nc") as many:
        assert one.load().drop_attrs(deep=False).identical(many.load().drop_attrs(deep=False))


def test_ts_sweep_takes_what_is_no_client_at_its_word(tmp_path):
    with pytest.raises(ts.InputError, match="threads: expected a whole number of 1 or more, got '3'"):
        ts.sweep(SWEEP, tmp_path, threads="3")
    result = ts.sweep(SWEEP, tmp_path, threads=FailingExecutor(lambda _: False))
    assert result.file == tmp_path / "sweep.nc" and result.outcomes == {"DONE": 37}


def test_a_batch_in_shares_is_the_batch():
    scene, points = SWEEP.scene, SWEEP.points(slice(0, 11))
    here = ts.simulate_batch(scene, points, 0.02)
    executor = FailingExecutor(lambda _: False)
    executor._max_workers = 2
    there = ts.simulate_batch(scene, points, 0.02, threads=executor)
    assert executor.calls == 4 and there.codes == here.codes
    assert np.array_equal(there.periods, here.periods)
    for name in ("peak", "contact_duration"):
        assert np.array_equal(there.measure(name), here.measure(name), equal_nan=True)
    assert np.array_equal(there.events(7), here.events(7))


def test_sets_of_a_calibration_read_the_same_elsewhere():
    lowered = lower_study(load_study("cantilever-1"), 1)
    middle = np.full((2, len(lowered.problem.unknowns.names)), 0.5) + np.array([[0.0], [0.1]])
    sets = lowered.problem.unknowns.values(middle)
    here = lowered.forward(0, sets, (0,))
    there = dataclasses.replace(lowered.forward, threads=FailingExecutor(lambda _: False))(0, sets, (0,))
    assert np.array_equal(here, there, equal_nan=True)
