"""Measures of many robots, taken over what is asked for: their settled motions from several starts, or episodes.

Of a settled motion every run goes on until its contacts repeat, or for all of its time; what a robot is measured by is
the mean over its starts, with what differs from start to start and from period to period.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.spec import get_value, with_values
from tarsus.base.workers import Workers
from tarsus.files.settled import repetition
from tarsus.orbits.motion import OVER_STARTS, ROUNDING, FromRest, Motion
from tarsus.orbits.starts import HEIGHT, Box
from tarsus.solve import ResultCode, simulate_batch

if TYPE_CHECKING:
    from tarsus.measure.measure import Measured
    from tarsus.model.scene import Scene
    from tarsus.solve import Batch, Shared

SOON = 0.3
"""Share of their duration after which runs are looked at first: where a robot has a gait nearly all repeat by then, and
the others begin anew, which costs as much again."""
SAME = 1e-5
"""Part of a measure below which it does not differ between starts: ten times what runs that count as settled may still
have to go."""
_GAP = re.compile(r"robot\.feet\.[^.]+\.gap")


@dataclass(frozen=True)
class Scored:
    """Measures of nr robots. code: how each one's run ended, of several starts' the first that did not reach its end;
    value, spread (nr, nm) [SI], spread from period to period; per_foot (nr, nm, m). NaN of robots that failed.

    over_starts (nr, nm): standard deviation from start to start, which is that over attractors, by share; settled (nr,)
    share of the starts whose contacts repeat at the end. Both None of an episode.
    """

    code: list[ResultCode]
    value: Floats
    spread: Floats
    per_foot: Floats
    over_starts: Floats | None = None
    settled: Floats | None = None

    def arrays(self) -> dict[str, Floats]:
        """Its numbers by name, those that there are."""
        each = {name: getattr(self, name) for name in ("value", "spread", "per_foot", *OVER_STARTS)}
        return {name: one for name, one in each.items() if one is not None}


def scored(
    motion: Motion,
    scene: Scene,
    vary: Mapping[str, Floats],
    names: Sequence[str],
    shared: Shared,
    threads: Workers = None,
) -> Scored:
    """Measures of robots with values (nr,) by path, one robot without paths, of a settled motion each from the same
    starts. Raises InputError as `Box.of` and `simulate_batch` do."""
    m = len(scene.robot.feet)
    if isinstance(motion, FromRest):
        batch = simulate_batch(scene, vary, motion.duration, threads=threads, shared=shared)
        return Scored(batch.codes, *_columns(batch.measured(names), m))
    box: Box = shared.get(("starts", scene), lambda: Box.of(scene, None))
    start, every = _placed_robots(box, vary, motion.starts)
    total = len(next(iter(every.values())))
    code, settled = [ResultCode.DONE] * total, np.zeros(total, dtype=bool)
    value, spread = np.full((2, total, len(names)), np.nan)
    feet = np.full((total, len(names), m), np.nan)
    left = np.arange(total)
    for share in (SOON, 1.0):
        own = {path: one[left] for path, one in every.items()}
        batch = simulate_batch(start, own, share * motion.duration, threads=threads, shared=shared)
        repeats, skip = _repeating(batch, share == 1.0)
        found = _columns(batch.measured(names, skip=skip), m)
        for whole, part in zip((value, spread, feet), found, strict=True):
            whole[left] = part
        settled[left] = repeats
        for i, one in zip(left.tolist(), batch.codes, strict=True):
            code[i] = one
        left = left[batch.done & ~repeats]
        if not len(left):
            break
    return _of_robots(motion.starts, code, settled, value, spread, feet)


def _placed_robots(box: Box, vary: Mapping[str, Floats], starts: int) -> tuple[Scene, dict[str, Floats]]:
    """Values (nr starts,) by path of robots, each from every start, as much higher as its feet reach down; and the
    scene that they are changes of, as high as no robot's feet reach."""
    count = len(next(iter(vary.values()), [0]))
    every = {path: np.repeat(one, starts) for path, one in vary.items()}
    points = np.tile(box.drawn(starts, 0), (count, 1))
    along = {axis: low + (high - low) * points[:, i] for i, (axis, (low, high)) in enumerate(box.ends.items())}
    deepest = np.zeros(len(points))
    for path, gaps in every.items():
        if _GAP.fullmatch(path):
            deepest = np.maximum(deepest, float(get_value(box.scene, path)) - gaps)
    above = box.placed({HEIGHT: deepest.max(keepdims=True)})
    start = with_values(box.scene, {path: float(one[0]) for path, one in above.items()})
    return start, every | box.placed(along | {HEIGHT: along[HEIGHT] + deepest})


def _of_robots(
    starts: int, code: list[ResultCode], settled: NDArray[np.bool_], value: Floats, spread: Floats, feet: Floats
) -> Scored:
    """Of all starts of each robot the mean, and spreads; nothing of a robot that failed from one of them."""
    each = [code[i : i + starts] for i in range(0, len(code), starts)]
    ended = [next((one for one in own if one is not ResultCode.DONE), ResultCode.DONE) for own in each]
    failed = np.array([one is not ResultCode.DONE for one in ended])
    by_start = value.reshape(len(each), starts, -1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a measure that no start of a robot has stays NaN
        mean, over = np.nanmean(by_start, axis=1), np.nanstd(by_start, axis=1)
        within = np.sqrt(np.nanmean(spread.reshape(by_start.shape) ** 2, axis=1))
        per_foot = np.nanmean(feet.reshape(len(each), starts, *feet.shape[1:]), axis=1)
    over[over <= SAME * np.abs(mean)] = 0.0
    for one in (mean, within, per_foot, over):
        one[failed] = np.nan
    return Scored(ended, mean, within, per_foot, over, settled.reshape(len(each), starts).mean(axis=1))


def _repeating(batch: Batch, last: bool) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Which runs (nr,) repeat at their end, and drive periods (nr,) that are left out of each. Contacts that no longer
    change tell nothing of a body that still swings: such runs go on until the ``last`` look."""
    repeats, skip = np.zeros(len(batch), dtype=bool), np.zeros(len(batch), dtype=np.intp)
    for r in range(len(batch)):
        period = float(batch.periods[r])
        found = repetition(batch.events(r), period, batch.duration)
        repeats[r] = last if found is None else bool(found.multiple)
        # contacts repeat from somewhere in the period after the last that does not
        third = (int(batch.duration / period * (1.0 + ROUNDING)) + 2) // 3
        skip[r] = found.since + 1 if found is not None and found.multiple else third
    return repeats, skip


def _columns(found: Mapping[str, Measured], feet: int) -> tuple[Floats, Floats, Floats]:
    """Values, spreads (nr, nm), and values of each foot (nr, nm, m)."""
    each = list(found.values())
    value, spread = (np.stack([getattr(one, what) for one in each], axis=1) for what in ("value", "spread"))
    per_foot = np.full((*value.shape, feet), np.nan)
    for j, one in enumerate(each):
        if one.per_foot is not None:
            per_foot[:, j] = one.per_foot
    return value, spread, per_foot
