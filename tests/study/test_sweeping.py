"""Running a sweep: the same numbers as a batch, failures kept, nothing run twice."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import tarsus as ts
import tarsus.orbits.scored as scored
import tarsus.study.collecting as collecting
import tarsus.study.sweeping as sweeping
from scene_files import scene
from study.sweep_case import RATE, RESTITUTION, small
from tarsus.solve import Accuracy
from tarsus.study.axes import Linspace, Sobol
from tarsus.study.sweeping import run_sweep
from tarsus.study.workunit import OUTCOMES


def opened(result) -> xr.Dataset:
    with xr.open_dataset(result.file) as dataset:
        return dataset.load()


def test_a_grid_holds_what_a_batch_gives(tmp_path):
    sweep = small()
    result = run_sweep(sweep, tmp_path)
    assert repr(result) == f"<SweepResult {str(result).splitlines()[0]}>"
    dataset = opened(result)
    assert dataset["peak"].dims == (RESTITUTION, RATE)
    assert dataset[RATE].values.tolist() == [1e-6, 5e-6, 25e-6]
    assert dataset[RATE].attrs["units"] == "N/s" and dataset["peak"].attrs["units"] == "m"
    assert (dataset["code"] == 0).all()
    batch = ts.simulate_batch(sweep.scene, sweep.points(), 0.02)
    for name in sweep.measures:
        assert np.array_equal(dataset[name].values.ravel(), batch.measure(name))
        spreads = [batch.measures(i)[name].spread for i in range(6)]
        assert np.array_equal(dataset[f"{name}_spread"].values.ravel(), spreads, equal_nan=True)
    assert np.ptp(dataset["contact_duration"].values) > 0.0


def test_a_sobol_sweep_has_its_values_as_coordinates(tmp_path):
    gap = Linspace(start=5e-5, stop=7e-5, paths=("robot.feet.tip.gap",))
    sweep = small(vary={RESTITUTION: Linspace(start=0.1, stop=0.6), "gap": gap}, design=Sobol(count=6, seed=1))
    dataset = opened(run_sweep(sweep, tmp_path))
    assert dataset["peak"].dims == ("run",) and set(dataset.coords) == {RESTITUTION, "gap"}
    for axis, values in sweep.points().items():
        assert np.array_equal(dataset[axis].values, values)
    chosen = {path: float(dataset[axis][3]) for axis in sweep.vary for path in sweep.paths(axis)}
    alone = ts.simulate_batch(ts.with_values(sweep.scene, chosen), {}, 0.02)
    assert float(dataset["peak"][3]) == alone.measure("peak")[0]


def test_several_feet_have_a_dimension_of_their_own(tmp_path):
    feet = scene("three_feet")
    sweep = small(scene=feet, duration=None, vary={RESTITUTION: [0.1, 0.4]}, measures=("impacts",))
    dataset = opened(run_sweep(sweep, tmp_path))
    assert dataset["impacts_per_foot"].dims == (RESTITUTION, "foot")
    assert dataset["foot"].values.astype(str).tolist() == list(feet.robot.feet)
    assert np.allclose(dataset["impacts_per_foot"].mean("foot"), dataset["impacts"])


def test_finished_units_are_not_run_again(tmp_path, monkeypatch):
    whole = run_sweep(small(), tmp_path / "whole")
    folder = tmp_path / "part"
    run_sweep(small(), folder)
    (folder / "units" / "000" / "000001.npz").unlink()
    (folder / "sweep.nc").unlink()
    kept = (folder / "units" / "000" / "000000.npz").stat().st_mtime_ns
    seen = []
    monkeypatch.setattr(collecting, "BLOCK", 1)  # run by run
    again = run_sweep(small(), folder, resume=True, progress=lambda done, total, who: seen.append((done, total)))
    assert seen == [(4, 6), (6, 6)] and again.kept == 4
    assert (folder / "units" / "000" / "000000.npz").stat().st_mtime_ns == kept
    assert again.file.read_bytes() == whole.file.read_bytes()
    monkeypatch.setattr(sweeping, "work_unit", lambda *_: pytest.fail("nothing was left to run"))
    assert run_sweep(small(), folder, resume=True).kept == 6


def test_runs_that_end_early_are_kept_with_their_sentence(tmp_path, monkeypatch):
    sweep = small(vary={"ground.film.coefficient": [0.0, 1e-18]}, measures=("peak",))
    batch = scored.simulate_batch

    def hurried(*words, **options):
        return batch(*words, **options, accuracy=Accuracy(steps=300))

    monkeypatch.setattr(scored, "simulate_batch", hurried)
    result = run_sweep(sweep, tmp_path)
    dataset = opened(result)
    assert result.outcomes == {"DONE": 1, "STEP_LIMIT": 1}
    code = int(dataset["code"].values[~np.isfinite(dataset["peak"].values)][0])
    name = dataset["code"].attrs["flag_meanings"].split()[code]
    assert dataset["code"].attrs[name] == OUTCOMES["STEP_LIMIT"]


def test_values_that_the_scene_refuses_together_are_kept_as_refused(tmp_path):
    # each value alone is that of a beam; 900 Hz and 5000 Hz together are of none with this tip
    first, second = "robot.structure.frequencies.0", "robot.structure.frequencies.1"
    sweep = small(vary={first: ["623 Hz", "900 Hz"], second: ["5000 Hz", "6424 Hz"]}, measures=("peak",), duration=0.01)
    result = run_sweep(sweep, tmp_path)
    assert result.outcomes == {"DONE": 3, "REFUSED": 1}
    assert np.argwhere(np.isnan(opened(result)["peak"].values)).tolist() == [[1, 0]]
