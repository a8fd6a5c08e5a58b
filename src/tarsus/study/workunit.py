"""One unit of a sweep: some runs simulated together and scored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.errors import InputError
from tarsus.solve.batch import simulate_batch
from tarsus.solve.codes import ResultCode
from tarsus.solve.simulate import Shared

if TYPE_CHECKING:
    from tarsus.solve.results import Batch
    from tarsus.study.axes import Floats
    from tarsus.study.sweep import Sweep

OUTCOMES = {
    **{code.name: code.value for code in ResultCode},
    "REFUSED": "The run was not started: the scene refuses these values together.",
}
"""How a run of a sweep ended: a name, and the sentence it stands for; their order gives the numbers that are kept."""

DONE = list(OUTCOMES).index(ResultCode.DONE.name)
"""Number of the outcome of a run that reached its end."""

_NUMBERS = {name: np.int8(number) for number, name in enumerate(OUTCOMES)}


def work_unit(
    sweep: Sweep, points: Mapping[str, Floats], shared: Shared | None = None
) -> dict[str, np.ndarray]:
    """Simulate and score runs of a sweep.

    Parameters
    ----------
    sweep
        The sweep.
    points
        Values (k,) of these runs, by axis.
    shared
        What engines keep from one unit to the next.

    Returns
    -------
    dict[str, ndarray]
        code (k,) number in `OUTCOMES`; value, spread (k, nm) of every measure, SI; per_foot (k, nm, m). Runs that did
        not reach their end have NaN.
    """
    count = len(next(iter(points.values())))
    feet = list(sweep.scene.robot.feet)
    names = sweep.measures
    code = np.full(count, _NUMBERS["REFUSED"])
    value, spread = (np.full((count, len(names)), np.nan) for _ in range(2))
    per_foot = np.full((count, len(names), len(feet)), np.nan)
    for first, batch in _batches(sweep, points, count, shared or Shared()):
        part = slice(first, first + len(batch))
        code[part] = [_NUMBERS[outcome.name] for outcome in batch.codes]
        for j, measure in enumerate(batch.measured(names).values()):
            value[part, j], spread[part, j] = measure.value, measure.spread
            if measure.per_foot is not None:
                per_foot[part, j] = measure.per_foot
    return {"code": code, "value": value, "spread": spread, "per_foot": per_foot}


def _batches(
    sweep: Sweep, points: Mapping[str, Floats], count: int, shared: Shared
) -> list[tuple[int, Batch]]:
    """All runs as one batch; where the scene refuses some of them, the others one by one, with their numbers."""
    vary = {path: points[axis] for axis in sweep.vary for path in sweep.paths(axis)}
    try:
        return [(0, simulate_batch(sweep.scene, vary, sweep.seconds, threads=1, shared=shared))]
    except InputError:
        if count == 1:
            return []
    alone = []
    for k in range(count):
        one = {axis: values[k : k + 1] for axis, values in points.items()}
        alone += [(k, batch) for _, batch in _batches(sweep, one, 1, shared)]
    return alone
