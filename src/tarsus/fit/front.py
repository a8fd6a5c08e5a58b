"""Fronts: what no other point beats in every cost at once, how much of the space they dominate, and a search for
them.

The search is NSGA-II (Deb et al., IEEE Trans. Evol. Comput. 6, 2002) of the package pymoo; here it begins with an even
spread, unknowns whose range closes on itself (phases) move around the circle, and every point that was asked for is
returned. Only a function from points to costs is known; it is asked for many points at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats, Ints
from tarsus.fit.unknowns import even_points, inside

Costs = Callable[[Floats], Floats]
"""Costs (n, no) of points (n, nu) of the unit cube, the least the best."""

WORST = 1e30
"""Stands for a cost that is none: beyond every other, and finite, as pymoo needs it."""


@dataclass(frozen=True)
class FrontSearch:
    """How long to search. scan: points spread evenly at first; population; generations of as many points each."""

    scan: int = 1024
    population: int = 96
    generations: int = 60

    @property
    def candidates(self) -> int:
        """Points asked for in all."""
        return self.scan + self.population * self.generations


def undominated(costs: Floats) -> NDArray[np.bool_]:
    """Which of costs (n, no) no other one is at most as large as in all; of equal ones the first."""
    order = np.lexsort(costs.T[::-1])
    found = np.zeros(len(costs), dtype=bool)
    kept = np.zeros((0, costs.shape[1]))
    for row in order:
        one = costs[row]
        if np.isfinite(one).all() and not (kept <= one).all(axis=1).any():
            kept = np.vstack([kept, one])
            found[row] = True
    return found


def hypervolume(costs: Floats, reference: Floats) -> float:
    """Volume between costs (n, no) and a reference (no,) that is worse than they are; what is not better than it in
    all counts nothing."""
    import moocore

    inside = costs[(costs < reference).all(axis=1)]
    return float(moocore.hypervolume(inside, ref=reference)) if len(inside) else 0.0


def farthest(points: Floats, around: NDArray[np.bool_] | bool, count: int) -> Ints:
    """Rows of at most ``count`` distinct points (n, nu) of the unit cube, each the farthest from those before it, from
    the first one on. around (nu,): whether the range of an unknown closes on itself."""
    chosen: list[int] = []
    far = np.full(len(points), np.inf)
    while len(chosen) < count and far.any():
        chosen.append(int(np.argmax(far)))
        apart = np.abs(points - points[chosen[-1]])
        far = np.minimum(far, (np.where(around, np.minimum(apart, 1.0 - apart), apart) ** 2).sum(axis=1))
    return np.array(chosen, dtype=np.int64)


def search_front(
    costs: Costs,
    unknowns: int,
    around: NDArray[np.bool_],
    search: FrontSearch,
    seed: int,
    starts: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Search for the front of costs.

    Parameters
    ----------
    costs
        See `Costs`; asked for whole generations.
    unknowns, around
        Number of them nu, and whether (nu,) the range of each closes on itself.
    search
        How long.
    seed
        Of all that is random here.
    starts
        Points (ns, nu) to begin with beside the even spread.

    Returns
    -------
    tuple
        Every point (n, nu) that was asked for, and its costs (n, no).
    """
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.evaluator import Evaluator
    from pymoo.core.population import Population
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize
    from pymoo.problems.static import StaticProblem

    rng = np.random.default_rng([seed, 21])
    first = even_points(unknowns, search.scan, rng)
    every = [first if starts is None or not len(starts) else np.concatenate([starts, first])]
    values = [costs(every[0])]
    beyond = 0.5 * around  # half a turn further to either side, so that a range that closes has no end

    class Generations(Problem):
        def __init__(self) -> None:
            super().__init__(n_var=unknowns, n_obj=values[0].shape[1], xl=-beyond, xu=1.0 + beyond)

        def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
            every.append(inside(x, around))
            values.append(costs(every[-1]))
            out["F"] = _finite(values[-1])

    begun = Population.new("X", every[0])
    Evaluator().eval(StaticProblem(Generations(), F=_finite(values[0])), begun)
    algorithm = NSGA2(search.population, sampling=begun)  # pyright: ignore[reportArgumentType]
    minimize(Generations(), algorithm, ("n_gen", search.generations + 1), seed=int(rng.integers(2**31)))
    return np.concatenate(every), np.concatenate(values)


def _finite(costs: Floats) -> Floats:
    """Costs that are none as the worst ones."""
    return np.where(np.isfinite(costs), costs, WORST)
