"""What a sweep of ten million runs costs beside its runs: planning, a worker's start, status, listing, collecting.

python benchmarks/sweep_store.py FOLDER [--runs 10000000] [--chunk 64]

Units are filled with made-up numbers; nothing is simulated. FOLDER must not exist; it takes some gigabytes.
"""

from __future__ import annotations

import argparse
import io
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import tarsus as ts
from tarsus.study.axes import Linspace, Logspace, Sobol
from tarsus.study.collecting import collect
from tarsus.study.layout import open_store
from tarsus.study.sweep import Sweep

START = """
import time; begin = time.perf_counter()
import sys
from pathlib import Path
from tarsus.study.layout import open_store
from tarsus.study.studyfile import frozen_sweep
loaded = time.perf_counter()
folder = Path(sys.argv[1])
sweep = frozen_sweep(folder)
store = open_store(sweep, folder, resume=True)
points = sweep.points(store.part(store.units - 1))
print(f"{loaded - begin:.2f} s to load, {time.perf_counter() - loaded:.2f} s to open the sweep and draw its last unit")
"""


@contextmanager
def timed(what: str) -> Iterator[None]:
    wall, cpu = time.perf_counter(), time.process_time()
    yield
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    print(f"{what}: {wall:.2f} s ({cpu:.2f} s of processor time)", flush=True)


def the_sweep(runs: int, chunk: int) -> Sweep:
    return Sweep(
        name="ten million",
        scene=ts.load_scene("cantilever", wave="sine", hz=200),
        duration=0.02,
        vary={
            "ground.restitution.coefficient": Linspace(start=0.1, stop=0.6),
            "ground.adhesion.rate": Logspace(start=1e-6, stop=1e-4),
            "ground.film.coefficient": Logspace(start=1e-22, stop=1e-20),
            "robot.feet.tip.gap": Linspace(start=5e-5, stop=7e-5),
        },
        design=Sobol(count=runs),
        measures=("contact_duration", "peak"),
        chunk=chunk,
    )


def fill(folder: Path, digest: str, units: int, chunk: int, runs: int) -> None:
    """Files of all units, written plainly: the disk's own time is not what is measured."""
    for unit in range(units):
        count = min(chunk, runs - unit * chunk)
        value = np.full((count, 2), float(unit))
        stream = io.BytesIO()
        np.savez(
            stream, plan=np.array(digest), unit=np.array([str(unit), str(units)]), code=np.zeros(count, np.int8),
            value=value, spread=value, per_foot=value[:, :, None],
        )  # fmt: skip
        place = folder / "units" / f"{unit // 1000:03d}"
        if unit % 1000 == 0:
            place.mkdir(exist_ok=True)
        (place / f"{unit:06d}.npz").write_bytes(stream.getvalue())


def measure(folder: Path, runs: int, chunk: int) -> None:
    with timed("plan"):
        sweep = the_sweep(runs, chunk)
        store = open_store(sweep, folder, resume=False)
    print(f"{runs} runs in {store.units} units")
    with timed("filling units"):
        fill(folder, store.digest, store.units, chunk, runs)
    for _ in range(2):
        subprocess.run([sys.executable, "-c", START, str(folder)], check=True)
        with timed("status"):
            subprocess.run([sys.executable, "-m", "tarsus", "show", str(folder)], check=True)
    with timed("list what is missing"):
        assert store.pending() == []
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with timed("collect"):
        file, outcomes = collect(sweep, store)
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert outcomes == {"DONE": runs}
    print(
        f"{os.path.getsize(file) / 1e6:.0f} MB; at most {after / 1e6:.2f} GB of memory, {before / 1e6:.2f} GB before"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--runs", type=int, default=10_000_000)
    parser.add_argument("--chunk", type=int, default=64)
    words = parser.parse_args()
    measure(words.folder, words.runs, words.chunk)
