"""Thousands of random scenes: does each run end in time, in numbers, above the ground, with its account closed?

    python tests/survey.py FILE --scenes wide --count 5000 --workers 2

writes a line a scene beside FILE, goes on where it was stopped, and says what was found. A worker that a scene kills or
that it holds for longer than `LIMIT` is started again behind that scene.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import tarsus as ts
from random_scenes import scene_of, sliding_scene, wide_scene, wide_sliding_scene
from tarsus.model.scene import Scene
from tarsus.solve.codes import CLOSED

LIMIT = 20
"""[s] of the processor's time that a run may take; a worker is stopped at three times that."""
PERIODS = 1e4
"""A run of so many drive periods may take longer."""
OPEN = 0.003
"""Share of the runs that may end with an open account and say so."""
DEPTH = 1e-9
"""Deepest a foot may be seen below the ground, relative to the length that the run's tolerances refer to: ten times the
error of a gap that a step may leave (1e-10)."""
SAMPLES = 301
Found = dict[int, dict[str, Any]]


def look_at(scene: Scene) -> dict[str, Any]:
    """What became of a scene: code, the processor's time [s], closure, depth below the ground, whether it is finite,
    and what numpy warned of."""
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        out = _seen(scene)
    return out | {"warnings": sorted({f"{one.category.__name__}: {one.message}" for one in warned})}


def _seen(scene: Scene) -> dict[str, Any]:
    start = time.process_time()
    run = ts.simulate(scene)
    code = run.code.name
    wall = time.process_time() - start
    out: dict[str, Any] = {"code": code, "wall": round(wall, 3), "steps": int(run.log.finish[0, 1])}
    out["events"], out["reached"] = len(run.events), run.end_time / scene.duration
    out["closure"] = float(run.ledger.closure)
    out["periods"] = cycles(scene)
    state = run.at(np.linspace(0.0, run.end_time, SAMPLES)).state
    out["depth"] = float(-state.gap.min(initial=0.0) / run.plan.length)
    numbers = (state.x, state.v, state.gap, state.pull)
    columns = [run.events[field] for field in run.events.dtype.names or ()]
    out["finite"] = all(bool(np.isfinite(values).all()) for values in (*numbers, *columns))
    return out


def cycles(scene: Scene) -> float:
    """Periods of the fastest drive that a run lasts: times its own length, of a signal that does not repeat."""
    lengths = {
        "on_off": lambda wave: sum(wave.durations),
        "sampled": lambda wave: wave.times[-1],
        "poling": lambda wave: wave.hold,
        "swept_sine": lambda wave: 1.0 / wave.start_frequency,
        "constant": lambda wave: np.inf,
        "ramp": lambda wave: np.inf,
    }
    waves = scene.signals.values()
    shortest = min((lengths.get(wave.kind, lambda wave: 1.0 / wave.frequency)(wave) for wave in waves), default=np.inf)
    return float(scene.duration / shortest)


def faults(found: dict[str, Any]) -> list[str]:
    """What is wrong with what became of a scene, in words; a code or a sentence that says what failed is not."""
    if "code" not in found:
        error = found.get("error", "the process died or did not end")
        long = "error" not in found and found.get("periods", 0.0) > PERIODS
        return [] if long or error.startswith("InputError") else [error]
    said = []
    if found["wall"] > LIMIT and not found.get("periods", 0.0) > PERIODS:
        said.append("slow")
    if found["code"] == "STALLED":
        said.append("stalled")
    said += found.get("warnings", [])
    if found["code"] == "DONE":
        if not found["finite"]:
            said.append("not finite")
        if not found["depth"] <= DEPTH:
            said.append("below the ground")
        if not found["closure"] <= CLOSED:
            said.append("open account")
    return said


Look = Callable[[int], dict[str, Any]]


def work(look: Look, file: Path, first: int, count: int, step: int, before: Look = lambda seed: {}) -> None:
    """Look at the seeds first, first + step, ... below ``count`` that the file has not; before: what is written of a
    seed first, and stays if the process dies of it."""
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    known = read(file)
    with file.open("a", encoding="utf-8") as out:
        for seed in range(first, count, step):
            if seed in known:
                continue
            print(json.dumps({"seed": seed, **before(seed)}), file=out, flush=True)
            signal.setitimer(signal.ITIMER_PROF, 3 * LIMIT)
            try:
                found = look(seed)
            except Exception as error:
                found = {"error": f"{type(error).__name__}: {error}"[:300]}
            signal.setitimer(signal.ITIMER_PROF, 0)
            print(json.dumps({"seed": seed, **found}), file=out, flush=True)


def read(file: Path) -> Found:
    """What a file says of each seed; one that was begun and not ended says what was known before."""
    lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
    return {found["seed"]: found for found in map(json.loads, lines)}


def survey(script: str, file: Path, count: int, workers: int, *, words: Sequence[str] = ()) -> Found:
    """Let a script look at the seeds below ``count`` in processes of their own and collect what became of them.

    words: further ones for the script.
    """
    parts = [file.with_suffix(f".{w}.jsonl") for w in range(workers)]

    def begin(w: int) -> subprocess.Popen[bytes]:
        numbers = [str(parts[w]), str(w), str(count), str(workers)]
        return subprocess.Popen([sys.executable, script, "--part", *numbers, *words])

    begun = {w: begin(w) for w in range(workers)}
    while begun:
        time.sleep(0.5)
        for w, process in list(begun.items()):
            if process.poll() is None:
                continue
            del begun[w]
            if process.returncode != 0:  # stopped by a scene: go on behind it
                begun[w] = begin(w)
    found = {seed: one for part in parts for seed, one in read(part).items()}
    return dict(sorted(found.items()))


def part_of_a_survey(look: Look, before: Look = lambda seed: {}) -> None:
    """A script that was started as a part of a survey does it and ends here."""
    if sys.argv[1:2] == ["--part"]:
        work(look, Path(sys.argv[2]), *(int(number) for number in sys.argv[3:6]), before)
        sys.exit(0)


def arguments(about: str | None) -> argparse.ArgumentParser:
    """What every survey may be asked for."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--count", type=int, default=10000)
    parser.add_argument("--workers", type=int, default=2)
    return parser


SCENES = {"edge": scene_of, "wide": wide_scene, "sliding": sliding_scene, "wide_sliding": wide_sliding_scene}


def tell(found: Found) -> bool:
    """Print what was found; whether all of it is as it should be."""
    said = Counter(text.split(":")[0] for one in found.values() for text in faults(one) or ["right"])
    for text, times in said.most_common():
        seeds = [seed for seed, one in found.items() if text in [s.split(":")[0] for s in faults(one)]]
        print(f"{times:6d}  {text}  {seeds[:12] if text != 'right' else ''}")
    codes = Counter(one.get("code", "refused" if "error" in one else "died") for one in found.values())
    print(", ".join(f"{times} {code}" for code, times in codes.most_common()))
    walls = sorted(one["wall"] for one in found.values() if "wall" in one)
    print(f"{len(found)} scenes, {sum(walls):.0f} s of runs, the longest {walls[-1]:.1f} s")
    return set(said) == {"right"} and codes["LEDGER_OPEN"] <= OPEN * len(found)


def main() -> int:
    kind = sys.argv[6] if sys.argv[1:2] == ["--part"] else ""
    part_of_a_survey(lambda seed: look_at(SCENES[kind](seed)), lambda seed: {"periods": cycles(SCENES[kind](seed))})
    parser = arguments(__doc__)
    parser.add_argument("--scenes", choices=SCENES, default="edge")
    asked = parser.parse_args()
    return 0 if tell(survey(__file__, asked.file, asked.count, asked.workers, words=[asked.scenes])) else 1


if __name__ == "__main__":
    sys.exit(main())
