"""What atlases cost and what they miss: quadtrees against full grids, and a large map against points of its own.

python benchmarks/atlas.py                      # five maps of 257 x 257 points as truth
python benchmarks/atlas.py --maps c --large     # 1025 x 1025 points of a map, and 12,000 of them run again
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import label

import tarsus as ts
from tarsus.atlas.axis import axes_of
from tarsus.atlas.quadtree import Quadtree
from tarsus.atlas.verb import AtlasPlan
from tarsus.files.library import as_scene
from tarsus.study.studyfile import load_sweep

SCENES = Path(__file__).parents[1] / "tests" / "scenes"
VOLTS = ("signals.pzt.amplitude", "4 V", "10 V")


def packaged(name: str) -> tuple[Any, dict[str, Any], tuple[Any, ...], tuple[Any, ...]]:
    """A packaged study of two numbers."""
    study = load_sweep(name)
    return study.scene, {}, *axes_of(study)


MAPS: dict[str, tuple[Any, dict[str, Any], tuple[Any, ...], tuple[Any, ...]]] = {
    "a": ("cantilever", {}, ("ground.adhesion.rate", 1e-5, 1e-2, "log"), VOLTS),
    "b": packaged("cantilever-frequency-map"),
    "c": packaged("cantilever-gap-map"),
    "ball": (
        SCENES / "vibrating_table.toml", {"ground.restitution.coefficient": 0.0},
        ("ground.gravity.acceleration", 0.5, 1.5), ("signals.table.amplitude", 0.5, 4.0),
    ),
    "oscillator": (
        SCENES / "impact_oscillator.toml", {},
        ("signals.shaker.frequency", 0.1, 0.5), ("signals.shaker.amplitude", 0.05, 1.5),
    ),
}  # fmt: skip
"""Scene, values set, both axes; a, b, c: growth of adhesion, restitution by frequency, gap, the others by volts."""


def plan_of(name: str, depth: int, coarse: int | None = None) -> AtlasPlan:
    """The plan of a map."""
    scene, values, x, y = MAPS[name]
    return AtlasPlan.of(ts.with_values(as_scene(scene), values), x, y, depth=depth, coarse=coarse)


def missed(truth: np.ndarray, drawn: np.ndarray, least: int) -> tuple[int, int]:
    """Regions (points of one class that touch along sides) of more than so many points, and those of them in none of
    whose points the map has their class."""
    count = lost = 0
    for code in np.unique(truth):
        labelled: Any = label(truth == code)
        regions, many = labelled
        sizes = np.bincount(regions.ravel(), minlength=many + 1)
        seen = np.bincount(regions.ravel(), drawn.ravel() == code, many + 1)
        large = np.arange(many + 1)[1:][sizes[1:] > least]
        count, lost = count + len(large), lost + int((seen[large] == 0).sum())
    return count, lost


def against_truth(name: str, depth: int, threads: int | None) -> None:
    """Every point of a map run once (open: not settled, or chaotic); what quadtrees from coarse grids would have
    run of them, and missed."""
    begin = time.process_time()
    found = plan_of(name, depth, depth).run(threads=threads)
    truth, took = found.grid.code, time.process_time() - begin
    open_ = float((truth < 0).mean())
    print(f"{name}: {truth.size} runs, {took / truth.size * 1e3:.2f} ms of CPU each, {open_:.2%} open")
    for coarse in range(depth - 4, depth - 1):
        grid = Quadtree.refined(depth, coarse, lambda points: truth[points[:, 0], points[:, 1]])
        wrong = float((grid.code != truth).mean())
        regions = ", ".join(
            "{1} of {0} missed above {2}".format(*missed(truth, grid.code, n), n) for n in (4, 16)
        )
        print(
            f"  from {2**coarse + 1}: {len(grid.points) / truth.size:.1%} run, {wrong:.2%} wrong; regions: {regions}"
        )


def large(name: str, depth: int, points: int, threads: int | None) -> None:
    """A large map, and some of its points, drawn at random, run by themselves."""
    plan = plan_of(name, depth)
    clock, begin = time.perf_counter(), time.process_time()
    found = plan.run(threads=threads)
    clock, took = time.perf_counter() - clock, time.process_time() - begin
    share = len(found.code) / found.grid.code.size
    print(
        f"{name}, {found.size}^2: {len(found.code)} runs ({share:.1%}), {took:.1f} s of CPU, {clock:.1f} s of clock"
    )
    at = np.random.default_rng(1).integers(0, found.size, (points, 2))
    share = at / (found.size - 1)
    places = np.column_stack([axis.at(share[:, i]) for i, axis in enumerate(plan.axes)])
    wrong = plan.cells.of(places, threads)["code"] != found.grid.code[at[:, 0], at[:, 1]]
    print(f"  of {points} points {wrong.mean():.2%} have another class")


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--maps", nargs="+", choices=MAPS, default=list(MAPS))
    parser.add_argument("--depth", type=int)
    parser.add_argument("--large", action="store_true")
    parser.add_argument("--threads", type=int)
    given = parser.parse_args()
    for name in given.maps:
        if given.large:
            large(name, given.depth or 10, 12_000, given.threads)
        else:
            against_truth(name, given.depth or 8, given.threads)


if __name__ == "__main__":
    main()
