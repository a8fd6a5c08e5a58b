"""Following valleys down: how the search of one objective goes on where pulses are free, whose softest places are
narrow and many."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tarsus.design.free import Free
from tarsus.design.grounds import Grounds
from tarsus.design.problem import LOOK, DesignProblem, LastPeriod
from tarsus.fit.valleys import FIRST_STEP, NEAR, Budget, Visited, follow_down

Floats = NDArray[np.float64]

LENGTH = Budget(generations=120, offspring=10)
"""Of every strategy; of those that are begun the worse half ends again and again."""
EACH = 220
"""Points that a strategy costs, those included that end early."""
MOST = 64
"""Strategies at most."""
FIRST_LOOK = int(0.4 * LOOK)
"""Grounds of an attack below which strategies take a share of their generations, unless points are left."""
OWN, WIDE, CLOSE = (0.03, 0.05), (NEAR, FIRST_STEP), (0.06, 0.04)
"""Points of so different valleys are begun with, and the first step from them: on one ground, where valleys are narrow;
in the first search on several; and in those on more grounds, as what is best there lies close to what was best on
fewer."""
TRIED = 2, 3, 4, 6, 8
"""Lengths of a run in periods that the search may be content with: every candidate pays for them."""
SAMPLE, SHARE, SAME = 48, 0.95, 0.01
"""Candidates by chance that are looked at, the share of them that must have settled (a few grazing ones never do), and
the share within which values are the same."""


def valleys(free: Free, points: Floats, costs: Floats, count: int, near: float = CLOSE[0]) -> Floats:
    """So many points (k, nu) at most of points (n, nu) with costs (n,), the best first, each in a valley of its own."""
    return points[Visited(*free.parted(points), costs).best(count, near=near)]


def follow(
    cost: Callable[[Floats], Floats],
    free: Free,
    points: Floats,
    costs: Floats,
    count: int,
    rng: np.random.Generator,
    look: int,
    size: tuple[float, float],
) -> None:
    """Ask for costs (n,) of about ``count`` points (n, nu) on the way down from the best valleys of points (n, nu).
    look: grounds that an attack on the box looks at; size: `OWN`, `WIDE` or `CLOSE`."""
    near, step = size
    starts = valleys(free, points, costs, int(np.clip(count // EACH, 2, MOST)), near)
    numbers, rest = free.parted(starts)
    visited = Visited.empty(rest.shape[1])
    most = LENGTH.generations
    few = max(count // LENGTH.offspring, most * look // FIRST_LOOK)
    budget = replace(LENGTH, generations=min(few, most))
    follow_down(lambda which, some: cost(free.joined(which, some)), visited, numbers, rest, budget, rng, step)


def settled(request: DesignProblem) -> DesignProblem:
    """A problem that is judged by the last of some periods, with the fewest of them after which candidates by chance
    are what they are after all; any other as it is."""
    motion = request.motion
    if not isinstance(motion, LastPeriod):
        return request
    rows = request.free.values(np.random.default_rng([request.options.seed, 7]).random((SAMPLE, len(request.free))))
    own = Grounds.nominal(request.scene).crossed(rows)
    final = request.runs().each(*own)[:, 0]
    known = np.isfinite(final)
    scale = np.maximum(np.abs(final), SAME * np.abs(final[known]).max(initial=0.0))
    for periods in (one for one in TRIED if one < motion.periods):
        fewer = replace(request, motion=LastPeriod(periods * motion.duration / motion.periods, periods))
        found = fewer.runs().each(*own)[:, 0]
        if np.mean(np.abs(found - final)[known] <= SAME * scale[known]) >= SHARE:
            return fewer
    return request
