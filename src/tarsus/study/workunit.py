"""One unit of a sweep: some runs simulated together and scored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.errors import InputError
from tarsus.orbits.motion import OVER_STARTS, SettledMotion
from tarsus.solve import ResultCode, Shared

if TYPE_CHECKING:
    from tarsus.orbits.scored import Scored
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


def work_unit(sweep: Sweep, points: Mapping[str, Floats], shared: Shared | None = None) -> dict[str, np.ndarray]:
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
        code (k,) number in `OUTCOMES`; value, spread (k, nm) of every measure, SI; per_foot (k, nm, m); of a settled
        motion also over_starts (k, nm) and settled (k,), see `tarsus.orbits.scored.Scored`. Runs that did not reach
        their end have NaN.
    """
    count = len(next(iter(points.values())))
    out = {"code": np.full(count, _NUMBERS["REFUSED"]), **_unknown(sweep, count)}
    for first, made in _batches(sweep, points, count, shared or Shared()):
        part = slice(first, first + len(made.code))
        out["code"][part] = [_NUMBERS[outcome.name] for outcome in made.code]
        for name, values in made.arrays().items():
            out[name][part] = values
    return out


def score_shapes(sweep: Sweep) -> dict[str, tuple[int, ...]]:
    """Shape of what `work_unit` finds of a run, by name."""
    many, feet = len(sweep.measures), len(sweep.scene.robot.feet)
    shapes: dict[str, tuple[int, ...]] = {"value": (many,), "spread": (many,), "per_foot": (many, feet)}
    of_starts = zip(OVER_STARTS, ((many,), ()), strict=True)
    return {**shapes, **(dict(of_starts) if isinstance(sweep.motion, SettledMotion) else {})}


def _unknown(sweep: Sweep, count: int) -> dict[str, Floats]:
    """What there is to tell of so many runs before it is known."""
    return {name: np.full((count, *shape), np.nan) for name, shape in score_shapes(sweep).items()}


def _batches(sweep: Sweep, points: Mapping[str, Floats], count: int, shared: Shared) -> list[tuple[int, Scored]]:
    """All runs as one batch; where the scene refuses some of them, the others one by one, with their numbers."""
    from tarsus.orbits.scored import scored

    vary = {path: points[axis] for axis in sweep.vary for path in sweep.paths(axis)}
    try:
        return [(0, scored(sweep.motion, sweep.scene, vary, sweep.measures, shared, threads=1))]
    except InputError:
        if count == 1:
            return []
    alone = []
    for k in range(count):
        one = {axis: values[k : k + 1] for axis, values in points.items()}
        alone += [(k, made) for _, made in _batches(sweep, one, 1, shared)]
    return alone
