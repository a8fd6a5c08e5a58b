"""A batch as a whole: grids, measures of all runs, labels, pickles, and what is printed."""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import os
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.base.workers import workers
from tarsus.solve import Batch, ResultCode

SCENES = Path(__file__).parent.parent / "scenes"
FILM, VOLTS = "ground.film.coefficient", "signals.pzt.amplitude"
DURATION = 0.03


@pytest.fixture(scope="module")
def scene() -> ts.Scene:
    return ts.load_scene("cantilever")


@pytest.fixture(scope="module")
def grid(scene) -> Batch:
    return ts.simulate_batch(scene, {FILM: [4e-21, 6e-21, 8e-21], VOLTS: [8.0, 10.0]}, DURATION, grid=True)


def test_a_grid_runs_every_combination_and_its_results_have_its_shape(scene, grid):
    assert len(grid) == 6 and grid.shape == (3, 2)
    assert grid.vary[FILM].tolist() == [4e-21, 4e-21, 6e-21, 6e-21, 8e-21, 8e-21]
    peak = grid.measure("peak")
    assert peak.shape == (3, 2)
    rows = ts.simulate_batch(scene, {FILM: [8e-21, 6e-21], VOLTS: [8.0, 10.0]}, DURATION).measure("peak")
    assert [peak[2, 0], peak[1, 1]] == rows.tolist() and len(np.unique(peak)) == 6
    assert grid.run((2, 0)).values == {FILM: 8e-21, VOLTS: 8.0}
    assert grid.measures((1, 1))["peak"].value == peak[1, 1]
    data = grid.to_dataset(["peak", "bounces"])
    assert dict(data.sizes) == {FILM: 3, VOLTS: 2}
    assert data[VOLTS].attrs["units"] == "V" and data[FILM].values.tolist() == [4e-21, 6e-21, 8e-21]
    assert data["peak"].attrs["units"] == "m" and "highest point in a drive period" in data["peak"].attrs["long_name"]
    assert float(data["peak"].sel({FILM: 6e-21, VOLTS: 10.0})) == peak[1, 1]
    assert data["peak_spread"].shape == (3, 2) and "mean_apex" not in data
    assert data["code"].values.tolist() == [[0, 0]] * 3 and data["code"].attrs["flag_meanings"].startswith("DONE ")


def test_rows_as_a_dataset_have_the_varied_values_as_coordinates():
    chain = ts.read_scene(SCENES / "three_feet.toml")
    path = "ground.restitution.coefficient"
    batch = ts.simulate_batch(chain, {path: [0.2, 0.4]}, 0.02)
    data = batch.to_dataset()
    assert set(batch.measures(0)) <= set(data.data_vars)
    assert data["peak"].dims == ("run",) and path in data.coords and data[path].dims == ("run",)
    assert data["peak_per_foot"].dims == ("run", "foot") and list(data["foot"].values) == list(chain.robot.feet)
    assert data["peak_per_foot"].values[1].tolist() == list(batch.measures(1)["peak"].per_foot.values())


@pytest.mark.parametrize("name", ["cantilever", "millipede", "hexapod"])
@pytest.mark.parametrize("steps", [0, 1, 7, 60])
def test_a_run_that_stopped_early_has_measures_all_the_same(name, steps):
    base = ts.load_scene(name)
    accuracy = ts.Accuracy(steps=steps)
    run = ts.simulate(base, 0.05, accuracy)
    assert run.ended is ResultCode.STEP_LIMIT and run.end_time < 0.05
    assert all(one.n == 0 or np.isfinite(one.value) for one in run.measures.values())
    batch = ts.simulate_batch(base, {}, 0.05, accuracy=accuracy)
    assert set(batch.measures(0)) == set(run.measures)
    assert all(np.isnan(one.value).all() and (one.n == 0).all() for one in batch.measured().values())
    assert len(batch.to_dataset(["peak"]).attrs) and "STEP_LIMIT" in repr(batch)
    assert run._repr_html_() and batch._repr_html_()


def test_a_number_that_the_scene_leaves_out_may_vary_with_its_unit():
    batch = ts.simulate_batch(ts.load_scene("millipede"), {"ground.incline": ["0 deg", "5 deg"]}, 0.02)
    assert "0.08727 rad" in str(batch) and np.ptp(batch.measured()["peak"].value) > 0.0
    assert batch.to_dataset(["peak"])["ground.incline"].attrs["units"] == "rad"


def same(given: object) -> object:
    return given


def test_runs_and_batches_go_to_other_processes_and_come_back(grid):
    runs = [ts.simulate(name, DURATION) for name in ("cantilever", "millipede")]
    for run in runs:
        _ = run.measures, run.series, run.plan.signals, run.code
    _ = grid.codes
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        back, again = pool.submit(same, (runs, grid)).result()
    for one, run in zip(back, runs, strict=True):
        np.testing.assert_array_equal(one.events, run.events)
        assert repr(one) == repr(run) and one.ledger == run.ledger
        assert np.array_equal(one.series.state.x, run.series.state.x)
        assert repr(dict(one.measures)) == repr(dict(run.measures))
    assert repr(again) == repr(grid) and np.array_equal(again.measure("mean_height"), grid.measure("mean_height"))
    np.testing.assert_array_equal(again.events(3), grid.events(3))


LAW = """
import tarsus as ts

class Pad(ts.SmoothLaw):
    stiffness: float = ts.quantity("N/m", "stiffness of a pad", ge=0.0)

    @staticmethod
    def force(gap, gap_rate, volts, time, stiffness):
        return -stiffness * gap
"""


def test_a_users_law_pickles_where_another_process_can_import_it(scene, tmp_path, monkeypatch):
    file = tmp_path / "soft_pad.py"
    file.write_text(LAW)
    monkeypatch.syspath_prepend(tmp_path)
    import soft_pad  # type: ignore[import-not-found]

    def run_with(law: type[ts.SmoothLaw]) -> ts.Run:
        ground = scene.ground.model_copy(update={"laws": {"pad": law(stiffness=1e-3)}})
        return ts.simulate(scene.model_copy(update={"ground": ground}), 5e-3)

    run = run_with(soft_pad.Pad)
    assert pickle.loads(pickle.dumps(run)).ledger == run.ledger
    monkeypatch.delitem(sys.modules, "soft_pad")
    loaded = run_with(ts.load_laws(file)["pad"])
    with pytest.raises(InputError, match=r"ground.laws.pad: the class Pad is in no module"):
        pickle.dumps(loaded)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system has no affinity")
def test_threads_are_as_many_as_the_process_may_use():
    allowed = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(allowed)})
        assert workers() == 1 and workers(3) == 3
    finally:
        os.sched_setaffinity(0, allowed)
    assert workers() == len(allowed)
