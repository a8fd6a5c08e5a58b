"""How fast the engine is here, after checking that it is right: reference problems P1 and P2, and a fresh process.

P1: a chain of n masses pulled by a square voltage falls with its tip on the ground, bounces, sticks and tears off;
every impact time is known. P2: the chain of two for 4096 pairs of restitution and film. `benchmarks/README.md` says
more. Everything runs through the general engine on ordinary scenes.
"""

from __future__ import annotations

import json
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from importlib import metadata, resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.events import IMPACTS
from tarsus.base.progress import Progress, silent
from tarsus.base.verb import verb
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.waveforms import Square
from tarsus.model.laws import Adhesion, Film, Restitution
from tarsus.model.scene import Drive, Foot, Ground, PointLoad, Robot, Scene
from tarsus.model.structure import Lumped
from tarsus.plan.lowering import lower_scene
from tarsus.plan.rows import rows_of
from tarsus.solve import Accuracy, Engine, simulate_batch
from tarsus.tables.table import Table
from tarsus.tables.view import View

SIZES = (2, 6, 32)
TIME_TOLERANCE = 1e-6
"""An impact whose time is further off, relatively, is wrong."""
ACCURACY = Accuracy(gap=5e-6)
"""Half of the loosest accuracy at which no event of P1 and P2 is wrong (1e-5 loses one of 4096 runs)."""
PAIRS_DURATION = 0.2
"""Duration of every member of P2 [s]."""
_IS_IMPACT = np.isin(np.arange(16), IMPACTS)  # by kind of event


@dataclass(frozen=True)
class Pairs:
    """P2: restitution and film scale (4096,) of its members; impacts in 200 ms, first and tenth time [s]."""

    restitution: Floats
    film_scale: Floats
    impacts: NDArray[np.int64]
    first: Floats
    tenth: Floats


@cache
def chain(n: int) -> Scene:
    """P1 with n = 2, 6 or 32 masses, from the reference file's units: um, ms, uN, mg (film in uN um^2 ms, damping
    uN ms/um)."""
    given = json.loads(_data().joinpath("chains.json").read_text(encoding="utf-8"))[str(n)]
    names = tuple(f"x{i}" for i in range(n))
    structure = Lumped(
        coordinates=names,
        mass=np.diag(np.array(given["mass_mg"], dtype=float) * 1e-6).tolist(),
        stiffness=np.array(given["stiffness_uN_per_um"], dtype=float).tolist(),
        damping=(np.array(given["damping"], dtype=float) * 1e-3).tolist(),
    )
    pull = Drive(
        load=PointLoad(weights={names[given["drive_index"]]: 1.0}), law=LinearForce(gain=given["gain_uN_per_V"] * 1e-6)
    )
    ground = Ground(
        restitution=Restitution(coefficient=given["restitution"]),
        adhesion=Adhesion(initial=given["adhesion0_uN"] * 1e-6, rate=given["adhesion_rate_uN_per_ms"] * 1e-3),
        film=Film(coefficient=given["film_C"] * 1e-21, thickness=(given["film_offset_um"] + given["ground_um"]) * 1e-6),
    )
    tip = Foot(point=names[given["tip_index"]], gap=-given["ground_um"] * 1e-6)
    return Scene(
        name=f"chain of {n} masses",
        robot=Robot(structure=structure, drives={"pull": pull}, feet={"tip": tip}),
        ground=ground,
        signals={"pull": Square(amplitude=8.0, frequency=50.0)},
        duration=1.0,
    )


@cache
def reference_impacts(n: int) -> Floats:
    """Impact times [s] of P1 that independent solvers agree on: 1 s for n = 2, about 185 ms for n = 6 and 32."""
    with _data().joinpath("impacts_ms.npz").open("rb") as file:
        return np.load(file)[f"n{n}"] * 1e-3


@cache
def pairs() -> Pairs:
    """Members of P2 with their reference."""
    with _data().joinpath("pairs.npz").open("rb") as file:
        table = np.load(file)
        return Pairs(
            table["restitution"],
            table["film_scale"],
            table["impacts"].astype(np.int64),
            table["first_ms"] * 1e-3,
            table["tenth_ms"] * 1e-3,
        )


def horizon(n: int) -> float:
    """How long P1 is run [s]: as long as its sequence is known."""
    return 1.0 if n == 2 else float(reference_impacts(n)[-1]) * (1.0 + 10.0 * TIME_TOLERANCE)


def wrong_impacts(times: Floats, reference: Floats) -> int:
    """Impacts that are missing, surplus, or wrong by more than the tolerance, compared index by index."""
    common = min(len(times), len(reference))
    off = np.abs(times[:common] - reference[:common]) > TIME_TOLERANCE * reference[:common]
    return int(off.sum()) + abs(len(times) - len(reference))


class TimedChain:
    """P1 ready to be run: lowered, contact modes and step tables made as they are met in the first run."""

    def __init__(self, n: int, duration: float | None = None, accuracy: Accuracy = ACCURACY) -> None:
        self.duration = horizon(n) if duration is None else duration
        self.accuracy = accuracy
        self.engine = Engine(lower_scene(chain(n)), self.duration)
        self.rows = rows_of(self.engine.plan)

    def impacts(self) -> Floats:
        """Impact times [s] of one run."""
        raw = self.engine.run(self.rows, self.accuracy, track=False)
        return raw.events[_IS_IMPACT[raw.events[:, 2].astype(int)], 0]


def run_pairs(
    restitution: Floats, film_scale: Floats, accuracy: Accuracy = ACCURACY, threads: int = 1
) -> tuple[tuple[NDArray[np.int64], Floats, Floats], float]:
    """Members of P2 through `simulate_batch`: (impact counts, first, tenth impact time [s]), CPU seconds."""
    scene = chain(2)
    assert scene.ground.film is not None
    vary = {
        "ground.restitution.coefficient": restitution,
        "ground.film.coefficient": scene.ground.film.coefficient * film_scale,
    }
    start = time.process_time()
    batch = simulate_batch(scene, vary, PAIRS_DURATION, threads=threads, accuracy=accuracy, track=False)
    seconds = time.process_time() - start
    counts = np.zeros(len(batch), dtype=np.int64)
    marks = np.full((2, len(batch)), np.nan)
    for i in range(len(batch)):
        events = batch.events(i)
        times = events["time"][_IS_IMPACT[events["kind"]]]
        counts[i] = len(times)
        for row, number in ((0, 0), (1, 9)):
            if len(times) > number:
                marks[row, i] = times[number]
    return (counts, marks[0], marks[1]), seconds


def wrong_pairs(answer: tuple[NDArray[np.int64], Floats, Floats], reference: Pairs) -> int:
    """Members of P2 with a wrong count, or a first or tenth impact time wrong by more than the tolerance."""
    counts, first, tenth = answer
    good = counts == reference.impacts
    for found, known in ((first, reference.first), (tenth, reference.tenth)):
        good &= np.abs(found - known) <= TIME_TOLERANCE * known
    return int((~good).sum())


def run_bench(progress: Progress | None = None, repeats: int = 25) -> dict[str, Any]:
    """Times of the engine on this machine, each with the number of wrong events or members.

    Parameters
    ----------
    progress
        called as `progress(done, total, what)`.
    repeats
        runs of which the fastest counts.

    Returns
    -------
    dict
        flat. `p1_n2_ms`, `p1_n6_ms`, `p1_n32_ms`: CPU milliseconds per simulated second, with `*_wrong` of
        `*_impacts` and `*_setup_ms` for lowering the scene and its first run; `p2_runs_per_s` on one thread,
        `p2_wrong` of `p2_runs`; `first_run_s`: first run in a fresh process, `start_s`: that whole process; versions.
    """
    report = progress or silent
    result: dict[str, Any] = {}
    stages: list[tuple[str, Callable[[], dict[str, Any]]]] = [
        *((f"P1, {n} masses", partial(_chain_figures, n, repeats)) for n in SIZES),
        ("P2, 4096 runs", _pair_figures),
        ("a fresh process", _start_figures),
    ]
    for stage, (what, figures) in enumerate(stages):
        report(stage, len(stages), what)
        result |= figures()
    report(len(stages), len(stages), "")
    versions = {name: metadata.version(name) for name in ("tarsus", "numpy")}
    return result | {"accuracy_gap": ACCURACY.gap, "python": platform.python_version(), **versions}


@verb
def bench(*, progress: Progress | None = None) -> View:
    """Time the engine on the reference problems; whole event sequences are checked before a time is printed.

    Parameters
    ----------
    progress
        Called as ``progress(done, total, what)``.

    Returns
    -------
    View
        The figures of `run_bench`, and a problem for each count of wrong events.
    """
    found = run_bench(progress)
    wrong = [
        f"{name.removesuffix('_wrong')}: {value:g} events or counts are wrong"
        for name, value in found.items()
        if name.endswith("_wrong") and value
    ]
    return View(found, Table("", ("figure", "value"), found.items()), problems=tuple(wrong))


def fastest(work: Callable[[], Any], repeats: int) -> tuple[float, list[Any]]:
    """Processor time [s] of the fastest of so many calls, and what every one gave."""
    best, found = np.inf, []
    for _ in range(repeats):
        start = time.process_time()
        found.append(work())
        best = min(best, time.process_time() - start)
    return best, found


def _chain_figures(n: int, repeats: int) -> dict[str, Any]:
    reference = reference_impacts(n)
    TimedChain(2).impacts()  # made before any clock starts
    setup, _ = fastest(lambda: TimedChain(n).impacts(), 1)
    chained = TimedChain(n)
    chained.impacts()
    best, found = fastest(chained.impacts, repeats + 1)
    return {
        f"p1_n{n}_ms": best * 1e3 / chained.duration,
        f"p1_n{n}_wrong": max(wrong_impacts(times, reference) for times in found),
        f"p1_n{n}_impacts": len(reference),
        f"p1_n{n}_setup_ms": setup * 1e3,
    }


def _pair_figures(repeats: int = 3) -> dict[str, Any]:
    reference = pairs()
    made = [run_pairs(reference.restitution, reference.film_scale) for _ in range(repeats)]
    count = len(reference.impacts)
    wrong = max(wrong_pairs(answer, reference) for answer, _ in made)
    return {"p2_runs_per_s": count / min(s for _, s in made), "p2_wrong": wrong, "p2_runs": count}


_FIRST_RUN = """
import sys
import time
import tarsus
import tarsus.solve.engine
scene = tarsus.load_scene(sys.argv[1])
start = time.perf_counter()
run = tarsus.simulate(scene)
print(time.perf_counter() - start)
"""


def isolated(script: str, *arguments: str) -> str:
    """What a script prints in a Python of its own, which imports nothing from the folder that the user is in (-P)."""
    command = [sys.executable, "-P", "-c", script, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def _start_figures() -> dict[str, float]:
    """Seconds of the first run in a fresh process, and of that whole process; the best of three."""
    runs = []
    for _ in range(3):
        start = time.perf_counter()
        first = float(isolated(_FIRST_RUN, str(scene_file("hysteresis"))))
        runs.append((first, time.perf_counter() - start))
    return {"first_run_s": min(first for first, _ in runs), "start_s": min(whole for _, whole in runs)}


def scene_file(name: str) -> Path:
    """A scene that is timed."""
    return Path(str(_data() / f"{name}.toml"))


def _data() -> Any:
    return resources.files("tarsus") / "data" / "bench"
