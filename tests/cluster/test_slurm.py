"""Sweeps on SLURM itself: a controller and a node that the tests start on this machine.

A lane of its own, `pytest -m slurm`: it fails where SLURM's daemons are not installed.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import tarsus as ts
from cluster.slurm_daemons import slurm
from tarsus.cli import main
from tarsus.cluster.slurm import submit
from tarsus.cluster.status import status_of
from tarsus.study.studyfile import load_sweep

pytestmark = pytest.mark.slurm

STUDY = """
scene = "cantilever"
duration = "2 s"
measures = ["contact_duration", "peak", "bounces"]
chunk = 2
[set]
wave = "sine"
hz = 200
[design]
kind = "sobol"
count = 60
[vary]
ground.restitution.coefficient = { kind = "linspace", start = 0.1, stop = 0.6 }
"""
ASKED = "--partition=main --time=10 --cpus-per-task=1 --mem=100"


@pytest.fixture(scope="module", autouse=True)
def cluster() -> Iterator[Path]:
    with slurm(cpus=3) as place:
        yield place


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("study") / "grounds.toml"
    file.write_text(STUDY, encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def alone(study, tmp_path_factory) -> bytes:
    folder = tmp_path_factory.mktemp("alone")
    return ts.sweep(study, folder).file.read_bytes()


def until(said: Callable[[], object], patience: float = 240.0) -> None:
    end = time.monotonic() + patience
    while not said():
        assert time.monotonic() < end, said
        time.sleep(0.1)


def slurm_says(*words: str) -> str:
    return subprocess.run(words, capture_output=True, text=True, check=True, timeout=60).stdout


def queued() -> list[str]:
    return slurm_says("squeue", "--noheader", "--array", "--format=%i").split()


def own_processes(folder: Path) -> list[int]:
    """Tasks of the array that run: of this folder and of nobody else."""
    found = []
    for file in (folder / "workers").glob("*.json"):
        try:
            said = json.loads(file.read_text(encoding="utf-8"))
            words = Path(f"/proc/{said['pid']}/cmdline").read_bytes().decode().split("\0")
        except (OSError, ValueError):
            continue
        if str(folder) in words and not said["ended"]:
            found.append(said["pid"])
    return found


def test_an_array_gives_the_bytes_of_one_machine(study, alone, tmp_path, capsys):
    folder = tmp_path / "out"
    assert main(["sweep", str(study), "-o", str(folder), "--array", "4", f"--sbatch={ASKED}"]) == 0
    assert "30 units in 4 tasks" in capsys.readouterr().out
    until(lambda: status_of(folder).runs_done > 0)
    with pytest.raises(ts.InputError, match="tasks in the queue: wait for it, or `scancel"):
        submit(load_sweep(study), folder, ASKED, 4, resume=True)
    until(lambda: status_of(folder).finished)
    assert (folder / "sweep.nc").read_bytes() == alone
    until(lambda: not queued())
    assert submit(load_sweep(study), folder, ASKED, 4, resume=True) is None
    assert main(["show", str(folder)]) == 0
    assert "60 of 60 runs done (100.0 %), 30 of 30 units\nfinished" in capsys.readouterr().out


def test_killed_requeued_and_cancelled_tasks_lose_nothing(study, alone, tmp_path):
    folder = tmp_path / "out"
    first = submit(load_sweep(study), folder, ASKED, 3, resume=False)
    assert first is not None
    job = first.job
    assert first is not None and job is not None
    until(lambda: len(own_processes(folder)) >= 2 and status_of(folder).units_done >= 2)
    kept = {path: path.read_bytes() for path in folder.glob("units/*/*.npz")}
    random.Random(1).shuffle(pids := own_processes(folder))
    os.kill(pids[0], signal.SIGKILL)
    slurm_says("scontrol", "requeue", f"{job}_1")
    time.sleep(1.0)
    slurm_says("scancel", f"{job}_2")
    until(lambda: not queued() or status_of(folder).finished or _held(job))
    for held in queued():
        subprocess.run(["scontrol", "release", held], check=False, timeout=60)
    until(lambda: not queued())
    missing = status_of(folder)
    if not missing.finished:  # what was killed and cancelled
        again = submit(load_sweep(study), folder, ASKED, 3, resume=True)
        assert again is not None and again.units == missing.units - missing.units_done
        until(lambda: status_of(folder).finished)
    assert (folder / "sweep.nc").read_bytes() == alone
    assert kept.items() <= {path: path.read_bytes() for path in folder.glob("units/*/*.npz")}.items()


def _held(job: str) -> bool:
    return not slurm_says("squeue", "--noheader", "--states=RUNNING,COMPLETING,CONFIGURING", f"--jobs={job}").split()


def test_a_task_uses_the_processors_it_was_given(tmp_path, cluster):
    import sys

    code = "from tarsus.base.workers import workers; print('threads', workers())"
    for count in (1, 2):
        out = tmp_path / f"{count}.txt"
        script = tmp_path / f"{count}.sh"
        script.write_text(f'#!/bin/sh\nexec {sys.executable} -c "{code}"\n', encoding="utf-8")
        slurm_says("sbatch", "--wait", f"--cpus-per-task={count}", f"--output={out}", str(script))
        until(out.exists, 20.0)
        assert out.read_text(encoding="utf-8").strip() == f"threads {count}"


def test_what_slurm_refuses_is_a_sentence(study, tmp_path):
    with pytest.raises(ts.InputError, match=r"`sbatch` refused: .*nvalid partition"):
        submit(load_sweep(study), tmp_path / "out", "--partition=nowhere", 2, resume=False)
