"""Arrays of tasks over one folder, as any scheduler runs them, and how they go."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

import tarsus as ts
from study.sweep_case import small
from tarsus.cluster.array import _ranges, _units, prepare, run_task
from tarsus.cluster.slurm import _jobs, submit
from tarsus.cluster.status import _span, status_lines, status_of
from tarsus.study.axes import Linspace, Sobol
from tarsus.study.progress import Progress
from tarsus.study.sweeping import run_sweep

SWEEP = small(vary={"ground.restitution.coefficient": Linspace(start=0.1, stop=0.6)}, design=Sobol(count=29), chunk=2)


def result(folder: Path) -> bytes:
    return (folder / "sweep.nc").read_bytes()


def test_tasks_share_the_units_and_the_last_collects(alone, tmp_path):
    array = prepare(SWEEP, tmp_path, 4, resume=False)
    assert array is not None and (array.tasks, array.units) == (4, 15)
    done = [run_task(tmp_path, task, array.number) for task in range(4)]
    assert [one.units for one in done] == [4, 4, 4, 3] and sum(one.runs for one in done) == 29
    assert [one.finished for one in done] == [False, False, False, True]
    assert result(tmp_path) == result(alone)


def test_a_task_that_is_done_helps_others_with_a_tenth_of_its_share(alone, tmp_path):
    few = small(vary=dict(SWEEP.vary), design=SWEEP.design, chunk=1)
    array = prepare(few, tmp_path, 2, resume=False)
    assert array is not None and array.units == 29
    assert run_task(tmp_path, 0, array.number).units == 15 + 1
    assert run_task(tmp_path, 1, array.number).units == 14 - 1


def test_a_second_array_is_of_what_is_missing(alone, tmp_path):
    first = prepare(SWEEP, tmp_path, 4, resume=False)
    assert first is not None
    for task in (0, 2, 3, 2):  # one is requeued, one is lost
        run_task(tmp_path, task, first.number)
    status = status_of(tmp_path)
    assert (status.units_done, status.runs_done, status.finished) == (11, 22, False)
    again = prepare(SWEEP, tmp_path, 100, resume=True)
    assert again is not None and (again.number, again.tasks, again.units) == (2, 4, 4)
    assert all(run_task(tmp_path, task, again.number).units == 1 for task in (1, 2, 3, 4))  # numbers from 1 do, too
    assert result(tmp_path) == result(alone) and prepare(SWEEP, tmp_path, 4, resume=True) is None
    assert run_task(tmp_path, 1, first.number).units == 0  # the lost one comes back late
    assert result(tmp_path) == result(alone) and status_of(tmp_path).finished


def test_no_array_is_told(tmp_path):
    prepare(SWEEP, tmp_path, 2, resume=False)
    with pytest.raises(ts.InputError, match=r"9\.units' cannot be read"):
        run_task(tmp_path, 0, 9)
    with pytest.raises(ts.InputError, match="at least 1"):
        prepare(SWEEP, tmp_path, 0, resume=True)
    with pytest.raises(ValueError, match="holds no sweep"):
        status_of(tmp_path / "elsewhere")


def worker(folder: Path, name: str, *, ago: float, **said: object) -> None:
    table = {"node": name, "pid": 1, "task": 0, "seconds": 10.0, "units": 1, "runs": {f"{name}:1": 50}, "ended": False}
    file = folder / "workers" / f"{name}.json"
    file.parent.mkdir(exist_ok=True)
    file.write_text(json.dumps(table | said), encoding="utf-8")
    then = time.time() - ago
    os.utime(file, (then, then))


def test_status_tells_who_works_who_is_lost_and_how_long_it_takes(tmp_path):
    prepare(SWEEP, tmp_path, 4, resume=False)
    worker(tmp_path, "n1", ago=1.0)
    worker(tmp_path, "n2", ago=1.0, seconds=5.0, runs={"n2:1": 4, "n2:2": 6})
    worker(tmp_path, "n3", ago=3600.0)
    worker(tmp_path, "n4", ago=3600.0, ended=True, runs={})
    found = status_of(tmp_path)
    assert (found.working, found.lost, found.ended) == (2, 1, 1)
    assert found.runs_per_second == pytest.approx(7.0) and found.seconds_left == pytest.approx(29 / 7)
    assert found.nodes == {"n1": 50, "n2": 10, "n3": 50}
    text = "\n".join(status_lines(found))
    assert "0 of 29 runs done (0.0 %), 0 of 15 units" in text and "2 processes work, 1 are lost, 1 have ended" in text
    assert "7 runs a second; 4 s left" in text


def test_status_needs_nothing_but_python(tmp_path):
    prepare(SWEEP, tmp_path, 4, resume=False)
    source = Path(ts.__file__).parents[1]
    # -S -I: without site-packages there is no numpy
    code = f"import sys; sys.path.insert(0, {str(source)!r}); from tarsus.cluster.status import main; "
    code += f"main([{str(tmp_path)!r}])"
    done = subprocess.run([sys.executable, "-S", "-I", "-c", code], capture_output=True, text=True, check=True)
    assert "0 of 29 runs done" in done.stdout


@pytest.mark.slow
def test_the_script_runs_its_share_in_any_shell(tmp_path):
    run_sweep(small(), tmp_path / "alone")
    array = prepare(small(), tmp_path / "a folder", 1, resume=False)
    assert array is not None
    environment = {name: text for name, text in os.environ.items() if not name.startswith("SLURM")}
    done = subprocess.run(["sh", str(array.script), "0"], capture_output=True, text=True, env=environment)
    assert done.returncode == 0 and "6 runs in 2 units; the sweep is finished" in done.stdout, done.stderr
    assert result(tmp_path / "a folder") == result(tmp_path / "alone")


def test_a_damaged_unit_is_done_again_by_the_task_that_finishes(alone, tmp_path):
    array = prepare(SWEEP, tmp_path, 2, resume=False)
    assert array is not None
    run_task(tmp_path, 0, array.number)
    for name in ("000000", "000004"):
        file = tmp_path / "units" / "000" / f"{name}.npz"
        file.write_bytes(file.read_bytes()[:-100])
    done = run_task(tmp_path, 1, array.number)
    assert done.finished and done.units == 7 + 2
    assert result(tmp_path) == result(alone)


def test_a_task_that_ends_after_the_others_have_finished_leaves_nothing(alone, tmp_path):
    array = prepare(SWEEP, tmp_path, 2, resume=False)
    assert array is not None
    with Progress(tmp_path, 0) as late:
        run_task(tmp_path, 0, array.number)
        run_task(tmp_path, 1, array.number)
        late.count("n1", 1)
    assert result(tmp_path) == result(alone) and not (tmp_path / "workers").exists()


def test_a_task_without_a_number_is_told(tmp_path):
    array = prepare(SWEEP, tmp_path, 1, resume=False)
    assert array is not None
    environment = {name: text for name, text in os.environ.items() if not name.startswith("SLURM")}
    done = subprocess.run(["sh", str(array.script)], capture_output=True, text=True, env=environment)
    assert done.returncode == 2 and "the script takes the task's number" in done.stderr


def test_a_submission_whose_job_cannot_be_read_is_left_out(tmp_path):
    place = tmp_path / "array"
    place.mkdir()
    for number, text in enumerate(('{"job": 7}', "", "[]", '{"jo": 7}'), start=1):
        (place / f"{number}.json").write_text(text, encoding="utf-8")
    assert _jobs(tmp_path) == ["7"]


def test_units_of_an_array_are_written_as_ranges_and_its_job_is_named_without_its_cluster(tmp_path, monkeypatch):
    assert _ranges([0, 1, 2, 5, 7, 8]) == "0-2,5,7-8" and _units("0-2,5,7-8") == [0, 1, 2, 5, 7, 8]
    monkeypatch.setattr("tarsus.cluster.slurm._command", lambda *_: "77;main\n")
    first = submit(SWEEP, tmp_path, "", 2, resume=False)
    assert first is not None and (first.number, first.job) == (1, "77")


def test_status_of_a_sweep_that_has_just_begun(tmp_path):
    prepare(SWEEP, tmp_path, 1, resume=False)
    (tmp_path / "units").rmdir()
    assert status_of(tmp_path).units_done == 0
    assert [_span(one) for one in (100.0, 5400.0, 1e5, 2e5)] == ["100 s", "90.0 min", "27.8 h", "2.3 days"]


def test_laws_from_several_folders_are_one_plan(tmp_path):
    scene = ts.load_scene("cantilever", wave="sine", hz=200)
    for place, law in (("b", "Alpha"), ("a", "Beta")):  # by paths b/alpha.py comes last, by names first
        (tmp_path / place).mkdir()
        text = LAW.replace("Pull", law)
        (tmp_path / place / f"{law.lower()}.py").write_text(text, encoding="utf-8")
    laws = {
        name: cls
        for place, law in (("b", "alpha"), ("a", "beta"))
        for name, cls in ts.load_laws(tmp_path / place / f"{law}.py").items()
    }
    ground = scene.ground.model_copy(update={"laws": {name: cls() for name, cls in laws.items()}})
    own = small(scene=scene.model_copy(update={"ground": ground}))
    array = prepare(own, tmp_path / "out", 1, resume=False)
    assert array is not None and run_task(tmp_path / "out", 0, 1).finished


LAW = """
from tarsus import SmoothLaw, quantity


class Pull(SmoothLaw):
    strength: float = quantity("N", "a constant pull", default=1e-9)

    uses_rate = False

    @staticmethod
    def force(gap, gap_rate, volts, time, strength):
        return -strength
"""
