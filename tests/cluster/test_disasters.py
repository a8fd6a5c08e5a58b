"""What happens to clusters: processes die in the middle of units, disks fill up, clocks are wrong."""

from __future__ import annotations

import itertools
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import namedtuple
from pathlib import Path

import pytest

import tarsus as ts
from study.sweep_case import small
from tarsus.cluster.array import prepare
from tarsus.cluster.status import status_of
from tarsus.study.axes import Linspace, Sobol
from tarsus.study.progress import Progress
from tarsus.study.sweeping import run_sweep

KILLS = 30
SWEEP = small(
    vary={"ground.restitution.coefficient": Linspace(start=0.1, stop=0.6)},
    design=Sobol(count=240),
    chunk=2,
    duration=1.5,
)


def units(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.glob("units/*/*.npz")}


# Slow: thirty processes, each of which loads everything and is killed.
@pytest.mark.slow
def test_thirty_kills_in_the_middle_of_units_lose_nothing(tmp_path):
    alone = ts.sweep(SWEEP, tmp_path / "alone").file.read_bytes()
    folder, chance = tmp_path / "killed", random.Random(11)
    array = prepare(SWEEP, folder, 4, resume=False)
    assert array is not None
    turns = itertools.cycle(range(4))

    def begin() -> subprocess.Popen[bytes]:
        said = subprocess.DEVNULL
        return subprocess.Popen(["sh", str(array.script), str(next(turns))], stdout=said, stderr=said)

    running, killed, found = [begin(), begin()], 0, {}
    while not status_of(folder).finished:
        for place, process in enumerate(running):
            if process.poll() is not None:
                running[place] = begin()
        seen = units(folder)
        assert found.items() <= seen.items()  # what was finished stays as it was
        fresh, found = len(seen) > len(found), seen
        if fresh and killed < KILLS:
            time.sleep(chance.uniform(0.0, 0.05))
            running[chance.randrange(2)].send_signal(signal.SIGKILL)
            killed += 1
        time.sleep(0.02)
    for process in running:
        process.kill()
        process.wait()
    assert killed == KILLS and (folder / "sweep.nc").read_bytes() == alone


def test_a_clock_that_is_an_hour_off_changes_nothing(tmp_path, monkeypatch):
    few = small()
    run_sweep(few, tmp_path / "right")
    true = time.time
    monkeypatch.setattr(time, "time", lambda: true() + 3600.0)
    run_sweep(few, tmp_path / "wrong")
    assert (tmp_path / "wrong" / "sweep.nc").read_bytes() == (tmp_path / "right" / "sweep.nc").read_bytes()
    folder = tmp_path / "begun"
    prepare(few, folder, 2, resume=False)
    with Progress(folder) as progress:
        progress.count("n1", 4)
        found = status_of(folder)  # the disk's clock counts, and not that of who asks
    assert (found.working, found.lost) == (1, 0)


def test_a_disk_without_room_for_the_collected_file_is_told_before(tmp_path, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(1, 1, 100))
    with pytest.raises(ts.InputError, match=r"the disk that holds .* is full: make room; finished parts are kept"):
        run_sweep(small(), tmp_path)
    monkeypatch.undo()
    assert list(tmp_path.rglob("*.part")) == []
    assert run_sweep(small(), tmp_path, resume=True).kept == 6


def test_what_killed_collectors_left_makes_room_for_the_next(tmp_path, monkeypatch):
    run_sweep(small(), tmp_path)
    left, busy = (tmp_path / f"sweep.nc.n{n}-7-0.part" for n in (1, 2))
    for file, ago in ((left, 3600.0), (busy, 60.0)):
        file.write_bytes(bytes(1000))
        then = time.time() - ago
        os.utime(file, (then, then))
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(1, 1, 100))
    with pytest.raises(ts.InputError, match="is full"):
        run_sweep(small(), tmp_path, resume=True)
    assert not left.exists() and busy.exists() and [one.name for one in tmp_path.glob("*.part")] == [busy.name]


@pytest.mark.slurm
def test_a_real_full_disk_keeps_what_is_finished(tmp_path):
    """On a disk of its own (root mounts it): the sweep stops with a sentence, and goes on when there is room."""
    disk = tmp_path / "disk"
    disk.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(disk)], check=True)
    try:
        (disk / "ballast").write_bytes(bytes(120_000))
        words = [sys.executable, "-m", "tarsus", "sweep", str(tmp_path / "study.toml"), "-o", str(disk / "out")]
        (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
        full = subprocess.run(words, capture_output=True, text=True)
        assert full.returncode == 2 and "is full: make room; finished parts are kept" in full.stderr, full
        kept = units(disk / "out")
        assert 3 < len(kept) < 60 and not list(disk.rglob("*.part"))
        (disk / "ballast").unlink()
        subprocess.run(["mount", "-o", "remount,size=4m", str(disk)], check=True)
        again = subprocess.run([*words, "--resume"], capture_output=True, text=True)
        assert again.returncode == 0 and f"{2 * len(kept)} of them done before" in again.stdout, again
        assert kept.items() <= units(disk / "out").items()
        subprocess.run([*words[:-1], str(tmp_path / "roomy")], check=True, capture_output=True)
        assert (disk / "out" / "sweep.nc").read_bytes() == (tmp_path / "roomy" / "sweep.nc").read_bytes()
        assert os.path.getsize(disk / "out" / "sweep.nc") > 1000
    finally:
        subprocess.run(["umount", str(disk)], check=True)


STUDY = """
scene = "cantilever"
duration = "20 ms"
measures = ["contact_duration", "peak"]
chunk = 2
[design]
kind = "sobol"
count = 120
[vary]
ground.restitution.coefficient = { kind = "linspace", start = 0.1, stop = 0.6 }
"""
