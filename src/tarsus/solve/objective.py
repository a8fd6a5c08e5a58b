"""The gradient of one number of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.solve.adjoint import swept
from tarsus.solve.codes import structured_events
from tarsus.solve.directional import STEPS, EventDerivatives, directional_slopes
from tarsus.solve.engine import Accuracy, settings_of
from tarsus.solve.gradients import Gradient, GradientRun
from tarsus.solve.numbers import STATES, NumberOf, measure_seeds, number_seeds
from tarsus.solve.run import increasing
from tarsus.solve.simulate import RECORDED, simulate

if TYPE_CHECKING:
    from tarsus.files.library import SceneLike

Floats = NDArray[np.float64]


def gradient(
    objective: str | NumberOf,
    scene: SceneLike,
    wrt: Sequence[str],
    duration: float | str | None = None,
    accuracy: Accuracy | None = None,
    *,
    times: ArrayLike | None = None,
) -> Gradient:
    """Exact first derivatives of one number of a run by numbers of its scene, backwards over the run where that can be,
    which hardly costs more for many of them than for few.

    Parameters
    ----------
    objective
        Name of a measure or of a term of the ledger, as `GradientRun.gradient` takes it, or a function of the events
        (ne,) with the period marks, smooth in their numbers.
    scene
        The scene, or a device's name or a scene file's path.
    wrt
        Paths of its numbers.
    duration, accuracy
        As for `simulate`.
    times
        Times [s] (nt,), increasing: the function is one of the events and of the states then (`SampledStates`).

    Returns
    -------
    Gradient
        The derivative by each path [unit of the number over that of the path], with flags where there is none.

    Raises
    ------
    InputError
        As `simulate` and `GradientRun.gradient` do.
    """
    run = simulate(scene, duration, accuracy, gradients=wrt)
    when = None if times is None or isinstance(objective, str) else increasing(times)
    parts = [_forwards(run, objective, when)] if run.plan.legs is not None else _parts(run, objective, when)
    if len(parts) == 1:
        return parts[0]
    found = [
        {path: value for one in parts for path, value in getattr(one, name).items()}
        for name in ("by_path", "flags", "one_sided")
    ]
    return Gradient(*({path: one[path] for path in run.paths if path in one} for one in found))


def _parts(run: GradientRun, objective: str | NumberOf, times: Floats | None) -> list[Gradient]:
    """Gradients by some of a run's paths each: backwards by those that are data, as far as that goes."""
    forwards = set(run.entered.structure)
    by_period = run.entered.data.period[0]
    rows = run.log.events
    log = EventDerivatives(rows, np.zeros((*rows.shape, 1)), run.end_time, run.period, by_period)
    if isinstance(objective, str):
        data = run.entered.data
        edges_move = any(one.any() for one in (data.begin, data.end, data.loops))
        seeds = measure_seeds(log, run.foot_names, objective, edges_move)
    elif times is None:
        seeds = number_seeds(log, objective, np.zeros(0), None)
    else:
        seeds = number_seeds(log, objective, times, run.states(times))
    # what feet bring along from contact to contact, and what slides, has no way back
    if seeds is None or run.plan.laws.remembers or run.plan.system.tangents is not None:
        return [_forwards(run, objective, times)]
    moved = by_period != 0.0
    if np.isnan(seeds.period):
        forwards |= set(np.flatnonzero(moved).tolist())
    backwards = run.along([p for p in range(len(run.paths)) if p not in forwards])
    settings = settings_of(run.plan, run.duration, run.accuracy or RECORDED, record=True)
    found = (
        swept(run.plan, run.raw.book, backwards.entered, run.raw, settings, seeds)
        if backwards.paths
        else None
    )
    if found is None:
        return [_forwards(run, objective, times)]
    values, flags = found
    count = len(backwards.paths)
    doubts = [[(event, reason) for event, reason, of in flags if of in (-1, p)] for p in range(count)]
    jumps = backwards.entered.data.period[0].astype(bool) & np.isinf(seeds.period)
    out = [backwards.gradient_from(values, jumps, doubts)]
    return [*out, _forwards(run.along(sorted(forwards)), objective, times)] if forwards else out


def _forwards(run: GradientRun, objective: str | NumberOf, times: Floats | None) -> Gradient:
    if isinstance(objective, str):
        return run.gradient(objective)
    if times is None:
        return run.gradient_of(objective)
    states, moved = run.states(times), run.state_gradients(times)

    def values(rows: Floats, periods: Floats, along: Floats) -> Floats:
        out = []
        for n, one in enumerate(rows):
            by = moved[run.paths[n // len(STEPS)]]
            there = {name: getattr(states, name) + along.ravel()[n] * getattr(by, name) for name in STATES}
            out.append(
                float(objective(structured_events(np.ascontiguousarray(one)), replace(states, **there)))
            )
        return np.array(out)

    return run.gradient_along(lambda log: directional_slopes(log, values))
