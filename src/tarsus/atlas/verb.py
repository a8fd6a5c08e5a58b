"""The verb `tarsus.atlas`: a map of what a robot does, level by level, kept as it grows."""

from __future__ import annotations

import json
import os
import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.atlas.axis import MapAxis, axes_of
from tarsus.atlas.cells import MOST_PERIODS, Arrays, CellRuns
from tarsus.atlas.quadtree import Ints, Quadtree
from tarsus.atlas.result import ATLAS_FILES, Atlas
from tarsus.base.arguments import Axis
from tarsus.base.errors import InputError, InputProblem
from tarsus.base.progress import Progress
from tarsus.base.spec import with_values
from tarsus.base.workers import Workers, is_executor, workers
from tarsus.files.jsontext import read_json
from tarsus.files.library import SceneLike, as_scene
from tarsus.files.runstore import PLAN_FILE, UNIT_FILES, RunStore
from tarsus.files.toml import SCENE_FILE, read_scene, scene_texts
from tarsus.model.laws.base import Law
from tarsus.model.scene import Scene
from tarsus.orbits.returns import drive_period
from tarsus.plan.lowering import ahead_only
from tarsus.solve import Trajectories
from tarsus.study.studyfile import load_sweep
from tarsus.study.sweep import Sweep

REQUEST = "atlas-request.json"
"""What is asked besides the scene, in the folder."""

OnProgress = Callable[[int, int, str], None]

FILES = (*ATLAS_FILES, "report.html", SCENE_FILE, REQUEST, PLAN_FILE, "laws/*.py", *UNIT_FILES)
"""Everything that an atlas has in its folder, as glob patterns."""

DEEPEST = 12
"""Depth of the largest grid, of 4097 points each way: its classes alone take 100 MB."""

FINER, COARSEST = 2, 7
"""Without another word the coarse grid is two levels below the finest, where a map of 257 points each way lost no
region of more than 16; and at most of 129 points each way, a third of the runs of a map of 1025."""

UNIT = 2048
"""Runs that a process takes at a time: at 1 ms a run of a beam and 20 ms of a walker, seconds to a minute. A kill costs
those that its threads are at."""


def atlas(
    scene: SceneLike | Sweep,
    *,
    x: Axis | None = None,
    y: Axis | None = None,
    depth: int = 8,
    starts: int = 1,
    coarse: int | None = None,
    periods: int = MOST_PERIODS,
    output: str | os.PathLike[str] | None = None,
    resume: bool = False,
    threads: Workers = None,
    progress: Progress | None = None,
) -> Atlas:
    """Map what a driven robot does over two of its numbers: classes of settled motions, refined where they change.

    Parameters
    ----------
    scene
        A scene, or a device's name or a scene file's path. Its drives are periodic. Without axes a study of two
        numbers, packaged or a file, which has the scene, both axes, and what is drawn.
    x, y
        An axis: path of a number, its least and its most, SI or texts with a unit, and "log" where values go by equal
        factors.
    depth
        The grid has 2^depth + 1 points each way.
    starts
        Starts of a cell: 1, the scene's own, or so many spread over the box that `tarsus.attractors` has by default.
    coarse
        Every point of a grid of 2^coarse + 1 each way is run; by default two levels below the depth, at most 7.
    periods
        Drive periods after which a run that does not repeat counts as not settled, or as chaotic.
    output
        Folder for what is found and its page, and of finished runs, from which an atlas that was killed goes on with
        `resume`; in Python of runs alone, ``write`` adds the rest. Several processes may work in one.
    resume
        Continue what the folder holds.
    threads
        Worker threads; by default one for each processor. Or an executor of ``concurrent.futures``.
    progress
        Called with runs done, runs that are known to be needed, and a word.

    Returns
    -------
    Atlas
        The class of every point of the grid, measures [SI] of every run, shares of starts; `table()`, `write(folder)`.

    Raises
    ------
    InputError
        For unknown paths, ends of axes that the scene refuses, drives without a common period, feet that remember
        their contacts, and a folder that holds another atlas.

    Examples
    --------
    >>> import tarsus as ts
    >>> gap, volts = ("robot.feet.tip.gap", "50 um", "90 um"), ("signals.pzt.amplitude", "4 V", "10 V")
    >>> found = ts.atlas("cantilever", x=gap, y=volts, depth=3, coarse=2)
    >>> found.grid.code.shape, found.class_at(70e-6, 8.0)
    ((9, 9), 'period 1, held')
    """
    if (x is None) != (y is None):
        raise InputError("x, y: an atlas has two axes; give both, or a study of two numbers and neither")
    if periods < 1:
        raise InputError(InputProblem.at("periods", f"expected 1 or more, got {periods}"))
    draw: tuple[str, ...] = ()
    if x is None or y is None:
        if isinstance(scene, Scene):
            raise InputError("x, y: expected both axes of the scene's map")
        study = scene if isinstance(scene, Sweep) else load_sweep(scene)
        scene, draw, (x, y) = study.scene, study.draw, axes_of(study)
    elif isinstance(scene, Sweep):
        scene = scene.scene
    plan = AtlasPlan.of(as_scene(scene), x, y, depth=depth, starts=starts, coarse=coarse, periods=periods)
    return plan.run(output, resume=resume, threads=threads, progress=progress).overlaid(*draw)


@dataclass(frozen=True)
class AtlasPlan:
    """What is asked of an atlas: the runs of its cells, its axes, and levels of its coarse and its finest grid."""

    cells: CellRuns
    axes: tuple[MapAxis, MapAxis]
    depth: int
    coarse: int

    @classmethod
    def of(
        cls,
        scene: Scene,
        x: tuple[Any, ...],
        y: tuple[Any, ...],
        *,
        depth: int = 8,
        starts: int = 1,
        coarse: int | None = None,
        periods: int = MOST_PERIODS,
    ) -> AtlasPlan:
        """As `atlas` takes them. Raises InputError unless the scene takes the corners of the map, which suffices, for
        bounds are intervals, and unless its runs can go on."""
        coarse = max(min(depth - FINER, COARSEST), 1) if coarse is None else coarse
        if not 1 <= coarse <= depth <= DEEPEST:
            raise InputError(f"depth: expected 1 to {DEEPEST}, and none below the coarse grid's, got {depth}")
        if starts < 1:
            raise InputError(f"starts: expected 1 or more, got {starts}")
        axes = MapAxis.of(scene, x), MapAxis.of(scene, y)
        paths = axes[0].path, axes[1].path
        if paths[0] == paths[1]:
            raise InputError(f"{paths[0]}: is both axes; an atlas has two")
        ends = product(*((axis.low, axis.high) for axis in axes))
        corners = [with_values(scene, dict(zip(paths, corner, strict=True))) for corner in ends]
        tried = Trajectories.of(corners[0], {}, min(map(drive_period, corners)))
        ahead_only(tried.plan, "an atlas maps robots")
        return cls(CellRuns(scene, paths, starts, periods), axes, depth, coarse)

    def texts(self) -> dict[str, str]:
        """Everything that the results depend on, as files of a folder."""
        x, y = (axis.to_dict() for axis in self.axes)
        rest = {"depth": self.depth, "starts": self.cells.starts, "coarse": self.coarse}
        request = {"x": x, "y": y, **rest, "periods": self.cells.periods}
        return {**scene_texts(self.cells.scene), REQUEST: json.dumps(request, indent=1) + "\n"}

    def run(
        self,
        output: str | os.PathLike[str] | None = None,
        *,
        resume: bool = False,
        threads: Workers = None,
        progress: OnProgress | None = None,
    ) -> Atlas:
        """The atlas; words as those of `atlas`. Raises InputError for a folder that holds another one."""
        folder = None if output is None else Path(output)
        store = RunStore.open(folder, self.texts(), resume=resume, what="atlas")
        asked = _Asked(store, self, threads, progress)
        grid = Quadtree.refined(self.depth, self.coarse, asked)
        found = asked.kept(grid.points)
        measures = dict(zip(self.cells.names, found["measures"].T, strict=True))
        return Atlas(self.cells.scene, *self.axes, self.cells.starts, grid, found["code"], found["codes"], measures)


class _Asked:
    """Classes at points of the grid: asked of the store, a unit after the other, each by all workers.

    Units are taken in an order of the process's own: processes that share a folder then do different ones, and read
    what the others have done.
    """

    def __init__(self, store: RunStore, plan: AtlasPlan, threads: Workers, progress: OnProgress | None) -> None:
        self._store, self._plan, self._threads, self._progress = store, plan, threads, progress
        self._done = 0

    def values(self, points: Ints) -> NDArray[np.float64]:
        """Values (k, 2) [SI] of both axes at points of the grid."""
        share = points / 2**self._plan.depth
        return np.column_stack([axis.at(share[:, i]) for i, axis in enumerate(self._plan.axes)])

    def kept(self, points: Ints) -> Arrays:
        """What is known of points that were asked for."""
        return self._store.evaluate(self.values(points), self._plan.cells.of)

    def __call__(self, points: Ints) -> NDArray[np.int16]:
        values, size = self.values(points), max(UNIT // self._plan.cells.starts, 1)
        units = [values[first : first + size] for first in range(0, len(values), size)]
        planned = self._done + len(values)
        for unit in random.sample(units, len(units)):
            self._evaluate(unit)
            self._done += len(unit)
            if self._progress is not None:
                self._progress(self._done, planned, "")
        return self.kept(points)["code"]

    def _evaluate(self, unit: NDArray[np.float64]) -> None:
        """Have the runs of a unit made and kept: of threads each keeps what it has finished."""
        cells, threads = self._plan.cells, self._threads
        if is_executor(threads):
            self._store.evaluate(unit, lambda rows: cells.of(rows, threads))
        else:
            self._store.evaluate(unit, cells.of, chunk=cells.together, threads=workers(threads))


def read_atlas(folder: Path, laws: Mapping[str, type[Law]] | None = None) -> Atlas:
    """The atlas that a folder holds, from its finished runs; what is missing is run. Raises InputError as `atlas`."""
    asked, axes = read_json(folder / REQUEST), []
    try:
        for one in (asked["x"], asked["y"]):
            axes.append((one["path"], one["from"], one["to"], "log" if one["log"] else ""))
        rest = {name: int(asked[name]) for name in ("depth", "starts", "coarse", "periods")}
    except (KeyError, TypeError, ValueError):
        raise InputError(f"{folder / REQUEST} is damaged: it says no atlas") from None
    return AtlasPlan.of(read_scene(folder / SCENE_FILE, laws), *axes, **rest).run(folder, resume=True)
