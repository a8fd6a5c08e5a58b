"""Time of the packaged 10,000-run ground sweep of the millipede through the store.

python benchmarks/ground_sweep.py [--study NAME] [--threads N]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import tarsus as ts
from tarsus.study.studyfile import load_sweep
from tarsus.study.sweeping import run_sweep


def measure(study: str, threads: int | None) -> None:
    """Run a study into a folder that is thrown away, and again with resume."""
    sweep = load_sweep(study)
    ts.simulate(sweep.scene, 1e-3)
    with tempfile.TemporaryDirectory() as folder:
        wall, cpu = time.perf_counter(), time.process_time()
        result = run_sweep(sweep, Path(folder), threads=threads)
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        again = run_sweep(sweep, Path(folder), threads=threads, resume=True)
    print(f"{result.runs} runs of {sweep.seconds:g} s: {wall:.1f} s, {cpu:.1f} s of processor time")
    print(f"{cpu / result.runs * 1e3:.2f} ms a run; {dict(result.outcomes)}; resumed, {again.kept} were kept")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--study", default="millipede-ground")
    parser.add_argument("--threads", type=int)
    words = parser.parse_args()
    measure(words.study, words.threads)
