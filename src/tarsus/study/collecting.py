"""Results of all runs of a sweep as one file, written in memory that does not grow with their number."""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.files.runstore import COLLECTED_FILE, RunStore, store_sentence
from tarsus.files.series import Put, Variable, blank, outcome_variable, write_netcdf
from tarsus.files.version import package_version
from tarsus.files.whole import part_of
from tarsus.measure.measure import measure_variables
from tarsus.solve import Run
from tarsus.study.axes import Floats, Grid
from tarsus.study.sweep import Sweep
from tarsus.study.workunit import OUTCOMES, score_shapes

BLOCK = 2**22
"""Numbers of the results that are written at a time (32 MB). Blocks do not depend on units, so that the file does not
either."""

ROOM = 1.02
"""A file needs this much of its numbers' size: attributes and tables of the format."""


def collect(sweep: Sweep, store: RunStore) -> tuple[Path, dict[str, int]]:
    """Write the collected file of a finished store: the same bytes whoever writes it, and in units of any size.

    Returns
    -------
    Path, dict[str, int]
        The file, and how many runs ended how, by name in `OUTCOMES`, those that occurred.

    Raises
    ------
    InputError
        If a unit is not done, and where the disk has no room.
    """
    shapes = score_shapes(sweep)
    width = sum(math.prod(shape) for shape in shapes.values()) + len(sweep.vary) + 1
    counts = np.zeros(len(OUTCOMES), dtype=np.int64)
    attrs = {
        "title": sweep.name,
        "source": f"tarsus {package_version()}",
        "scene": sweep.scene.name,
        "duration_s": sweep.seconds,
        "motion": str(sweep.motion),
        "plan": store.digest,
    }

    def fill(put: Put) -> None:
        for first, arrays in _blocks(store.parts(), max(BLOCK // width, 1)):
            code = arrays["code"]
            counts[:] += np.bincount(code, minlength=len(OUTCOMES))
            part = slice(first, first + len(code))
            points = {} if isinstance(sweep.design, Grid) else sweep.points(part)
            for name, values in {**points, **_columns(sweep, arrays)}.items():
                put(name, first, values)

    target = store.place / COLLECTED_FILE
    part = part_of(target)
    empty = {name: blank((sweep.runs, *shape)) for name, shape in shapes.items()}
    empty["code"] = blank((sweep.runs,), np.int8)
    # one run is too few to distinguish a blank from a value: it is filled all the same
    variables = collected_variables(sweep, {axis: blank((sweep.runs,)) for axis in sweep.vary}, empty)
    try:
        store.clear_abandoned(part)
        free = shutil.disk_usage(store.place).free
        if free < sum(one.values.nbytes for one in variables.values()) * ROOM:
            raise OSError(28, os.strerror(28))
        write_netcdf(variables, attrs, part, fill)
        try:
            os.replace(part, target)
        except FileNotFoundError:
            # of two that collect at the same time the second finds its part cleared away by the first
            if not target.exists():
                raise
        store.clear()
    except OSError as error:
        raise InputError(store_sentence(error, store.place)) from error
    finally:
        part.unlink(missing_ok=True)
    return target, {name: n for name, n in zip(OUTCOMES, counts.tolist(), strict=True) if n}


def _blocks(parts: Iterable[dict[str, np.ndarray]], runs: int) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
    """Arrays of units as arrays of so many runs, with the number of the first."""
    held: list[dict[str, np.ndarray]] = []
    first = count = 0
    for part in parts:
        held.append(part)
        count += len(part["code"])
        while count >= runs:
            whole = {name: np.concatenate([one[name] for one in held]) for name in held[0]}
            yield first, {name: values[:runs] for name, values in whole.items()}
            held = [{name: values[runs:].copy() for name, values in whole.items()}]
            first, count = first + runs, count - runs
    if count:
        yield first, {name: np.concatenate([one[name] for one in held]) for name in held[0]}


def _columns(sweep: Sweep, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Values (k, ...) of runs by the names of `collected_variables`."""
    whole = {name: arrays[name] for name in ("code", "settled") if name in arrays}
    each = {"": "value", **{f"_{name}": name for name in ("spread", "per_foot", "over_starts")}}
    if len(sweep.scene.robot.feet) == 1:
        del each["_per_foot"]
    return whole | {
        f"{name}{ending}": arrays[key][:, j]
        for j, name in enumerate(sweep.measures)
        for ending, key in each.items()
        if key in arrays
    }


def collected_variables(
    sweep: Sweep, points: Mapping[str, Floats], arrays: Mapping[str, np.ndarray]
) -> dict[str, Variable]:
    """Results of all runs as named series: one dimension an axis on a grid, else one dimension ``run``.

    Parameters
    ----------
    sweep
        The sweep.
    points
        Values (nr,) of every run, by axis.
    arrays
        Of all runs, as `tarsus.study.workunit.work_unit` gives them for a unit.
    """
    grid = isinstance(sweep.design, Grid)
    axes = {name: axis.values_on_grid() for name, axis in sweep.vary.items()} if grid else {}
    dims = tuple(axes) if grid else ("run",)
    shape = tuple(map(len, axes.values())) if grid else (sweep.runs,)
    feet = list(sweep.scene.robot.feet)
    known, definitions = float_paths(sweep.scene), Run.offered(sweep.scene, sweep.seconds)
    out: dict[str, Variable] = {}
    for name in sweep.vary:
        paths = sweep.paths(name)
        about = known[paths[0]]
        notes = {"units": about.unit, "long_name": about.doc or name, "paths": " ".join(paths)}
        out[name] = Variable((name,), axes[name], notes) if grid else Variable(dims, points[name], notes)
    # on a grid the axes are coordinates by their names; elsewhere the file has to say so
    where = {} if grid else {"coordinates": " ".join(sweep.vary)}
    out["code"] = outcome_variable(arrays["code"].reshape(shape), OUTCOMES, dims, where)
    for j, name in enumerate(sweep.measures):
        value, deviation = (arrays[key][:, j].reshape(shape) for key in ("value", "spread"))
        each = arrays["per_foot"][:, j].reshape(*shape, len(feet)) if len(feet) > 1 else None
        out |= measure_variables(name, definitions[name], dims, value, deviation, each, where)
        if "over_starts" in arrays:
            words = f"standard deviation of {name} from start to start: over attractors, by their shares"
            notes = {"units": definitions[name].unit, "long_name": words, **where}
            out[f"{name}_over_starts"] = Variable(dims, arrays["over_starts"][:, j].reshape(shape), notes)
    if "settled" in arrays:
        words = "share of the starts from which contacts repeat at the end of the run"
        notes = {"units": "1", "long_name": words, **where}
        out["settled"] = Variable(dims, arrays["settled"].reshape(shape), notes)
    if len(feet) > 1:
        out["foot"] = Variable(("foot",), np.array(feet), {})
    return out
