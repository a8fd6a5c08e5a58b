"""What one percent of each number costs a gait, over starts: of one that rings the scatter of these is the error."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.spec import float_paths
from tarsus.design.percents import PERCENT, Ground, Percent, Percents, all_at_once, felt, numbers_of, varied

if TYPE_CHECKING:
    from tarsus.design.grounds import Grounds
    from tarsus.design.walks import Walks

BOX = 32
"""Places where all numbers are off at once: what none of so many is, is less than 9 % of the box (95 %)."""


def gait_percents(walks: Walks, point: Floats, starts: Grounds) -> Percents:
    """Of the gait at a point (nu,), in its first objective, the mean of walks from starts."""
    one, count = walks.objectives[0], len(starts)
    scene = walks.scene_of(point)
    known = float_paths(walks.scene)
    numbers = numbers_of(scene, lambda path: path.startswith("initial.") or path not in known)

    def each(ground: Ground) -> Floats:
        """Measures (n, starts), by which means are taken."""
        size = len(next(iter(ground.values()), [0]))
        own = {path: np.repeat(value, count) for path, value in ground.items()}
        own |= starts.rows(np.tile(np.arange(count), size))
        return walks.measured(np.tile(point, (size * count, 1)), own, [one.measure])[one.measure].reshape(
            size, count
        )

    def bad(values: Floats) -> float:
        """The worst of means (n,); what has no value is none."""
        return float(values.min() if one.most else values.max())

    middle = each({})[0]
    seen = varied(numbers, each, PERCENT * np.array([-1.0, 1.0]))
    own = float(middle.mean())
    worst = {name: bad(np.append(values.mean(axis=1), own)) for name, values in seen.items()}
    names = felt(worst, own, one.most)
    box = bad(all_at_once(numbers, names, lambda ground: each(ground).mean(axis=1), BOX)) if names else own
    made = tuple(Percent(name, *_slope(seen[name], middle), worst[name]) for name in names)
    return Percents(one.name, one.unit, one.most, own, box, made)


def _slope(values: Floats, middle: Floats) -> tuple[float, float]:
    """Mean over starts of the slope, of measures (2, ns) a percent below and above and (ns,) between; and what it may
    be off by: the standard error over starts, and half of what the slopes to both sides differ by."""
    below, above = values
    slopes = 0.5 * (above - below)
    bend = 0.5 * abs(float((above + below - 2.0 * middle).mean()))
    scatter = float(slopes.std(ddof=1)) / np.sqrt(len(slopes)) if len(slopes) > 1 else 0.0
    return float(slopes.mean()), float(np.hypot(scatter, bend))
