"""Searching the branches: sets spread evenly, differential evolution, hopeless branches dropped, then chains that
follow the likelihood.

All randomness comes from the study's seed and the place in the sequence (stage, branch, row left out), never from time
or threads.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from tarsus.calibrate.archive import Archive
from tarsus.calibrate.degrees import Freedom, freedom_of_best
from tarsus.calibrate.description import Search
from tarsus.calibrate.polish import polish, residuals_of
from tarsus.calibrate.problem import Problem
from tarsus.calibrate.regressed import STEPS, Valleys, steps

__all__ = [
    "Chain",
    "Found",
    "budget",
    "chain",
    "evolve",
    "screen",
    "search_branches",
    "spread_over",
]

Floats = NDArray[np.float64]

DOWN = 2.0 / 3.0
"""Share of a generation's children that are steps down; the others keep the search from one valley."""
FEWEST = 10
"""Members of a population that takes steps down: of six, two went on by evolution, and three of eight searches found
the values of a bouncing ball, where evolution alone finds them in six; of ten and sixteen both do in all eight."""
LEVEL = 0.9
"""Members of an ensemble lie inside the likelihood region of this probability (chi-squared with one degree of freedom
for each unknown)."""
MARGIN = 10.0
"""No branch is dropped for less cost than this: a likelihood ratio of 150, which a few generations may make up."""
SCREEN, SHORT, DEEP, CHAIN, LEAVE_OUT = range(5)
"""Stages, for the random numbers of each."""


@dataclass(frozen=True)
class Chain:
    """States (n, nu) that a chain was in, each as often as it was."""

    states: Floats


@dataclass(frozen=True)
class Found:
    """What the search found in a branch: its lowest cost, whether and why it was dropped, and states of its chain."""

    cost: float
    dropped: str
    chain: Chain | None


def budget(problem: Problem, search: Search) -> int:
    """Most sets that a search asks for."""
    runs = len({branch.run for branch in problem.branches})
    branches = len(problem.branches)
    later = branches * search.population * (search.short + search.generations + search.spread + 3)
    later += branches * search.polish if problem.slopes else 0
    rows = problem.trained * branches * search.leave_out_population * (2 * search.leave_out + 2)
    return runs * (search.screening + len(search.start)) + later + (rows if search.leave_out else 0)


def costs_at(
    problem: Problem, archive: Archive, branch: int, without: int | None = None
) -> tuple[Floats, Floats]:
    """Visited points (n, nu) of a branch and their costs (n,)."""
    chosen = problem.branches[branch]
    points, readings = archive.points(chosen.run)
    return points, problem.total(problem.costs(readings, chosen), points, without)


def screen(problem: Problem, archive: Archive, search: Search) -> None:
    """The same sets in every run branch: a Sobol sequence, and after it those that the study starts from."""
    power = int(np.ceil(np.log2(search.screening)))
    sobol = qmc.Sobol(len(problem.unknowns), rng=np.random.default_rng([search.seed, SCREEN]))
    points = sobol.random_base2(power)[: search.screening]
    if problem.starts is not None:
        points = np.concatenate([points, problem.starts])
    for run in sorted({branch.run for branch in problem.branches}):
        archive.evaluate(run, points)


def evolve(
    problem: Problem,
    archive: Archive,
    branch: int,
    start: Floats,
    generations: int,
    rng: np.random.Generator,
    without: int | None = None,
) -> Floats:
    """Differential evolution from a population (np, nu), most of whose children are steps down from the best valleys by
    regressions over all visited sets; the last population."""
    chosen, valleys, size = problem.branches[branch], Valleys(), len(start)

    def cost(points: Floats) -> Floats:
        readings = archive.evaluate(chosen.run, points)
        return problem.total(problem.costs(readings, chosen), points, without)

    population, now = start.copy(), cost(start) if generations else np.zeros(size)
    for _ in range(generations):
        points, readings = archive.points(chosen.run)
        bases: list[int] = []
        residuals = before = np.zeros(0)
        if size >= FEWEST and len(points) > 2 * (points.shape[1] + 1):
            residuals = residuals_of(problem, chosen, np.asarray(readings, dtype=float), points, without)
            before = (residuals**2).sum(axis=1)
            bases = valleys.bases(points, before, round(DOWN * size / len(STEPS)))
        targets = rng.permutation(size)[: size - len(STEPS) * len(bases)]
        asked = [steps(points, residuals, base, rng) for base in bases]
        asked.append(_children(population, int(np.argmin(now)), targets, rng))
        after = np.split(cost(np.concatenate(asked)), np.cumsum([len(one) for one in asked])[:-1])
        for base, costs in zip(bases, after[:-1], strict=True):
            valleys.tell(points[base], float(before[base]), float(costs.min()))
        places = [*[-1] * (len(STEPS) * len(bases)), *targets.tolist()]
        for place, child, low in zip(places, np.concatenate(asked), np.concatenate(after), strict=True):
            own = place if place >= 0 else int(np.argmax(now))  # a step down takes the place of the worst
            if low < now[own]:
                population[own], now[own] = child, low
    return population


def _children(population: Floats, best: int, targets: NDArray[np.int64], rng: np.random.Generator) -> Floats:
    """Children (n, nu) of members by number (n,): the best member and a difference of two, crossed with each; after
    Storn and Price (J. Glob. Optim. 11, 1997)."""
    size, nu = population.shape
    pairs = np.array([rng.choice(size, 2, replace=False) for _ in targets], dtype=int).reshape(-1, 2)
    moved = population[best] + rng.uniform(0.4, 0.9) * (population[pairs[:, 0]] - population[pairs[:, 1]])
    own = rng.random(moved.shape) >= 0.8
    own[np.arange(len(own)), rng.integers(nu, size=len(own))] = False
    moved = np.where(own, population[targets], moved)
    return np.where((moved < 0.0) | (moved > 1.0), rng.random(moved.shape), moved)


def spread_over(points: Floats, count: int, first: int = 0) -> list[int]:
    """Places of up to ``count`` of the points (n, nu), each as far from those before it as can be."""
    chosen = [first]
    distance = np.linalg.norm(points - points[first], axis=1)
    while len(chosen) < min(count, len(points)):
        place = int(np.argmax(distance))
        if distance[place] == 0.0:
            break
        chosen.append(place)
        distance = np.minimum(distance, np.linalg.norm(points - points[place], axis=1))
    return chosen


def start_of(points: Floats, costs: Floats, count: int, excess: float) -> Floats:
    """A population (count, nu): spread over the points within ``excess`` of the best, filled up with the next best."""
    order = np.argsort(costs, kind="stable")
    inside = order[costs[order] <= costs[order[0]] + excess]
    chosen = [int(inside[i]) for i in spread_over(points[inside], count)]
    taken = set(chosen)
    chosen += [int(i) for i in order if int(i) not in taken][: count - len(chosen)]
    return points[chosen]


def chain(
    problem: Problem,
    archive: Archive,
    branch: int,
    generations: int,
    scale: float,
    size: int,
    rng: np.random.Generator,
    without: int | None = None,
) -> Chain:
    """Differential-evolution Markov chains (ter Braak 2006) whose density is exp(-cost / (2 scale)).

    They start spread over the visited points that cost as much more than the best as a state of the chain does on
    average, ``scale`` for each unknown; the first third is dropped.
    """
    chosen = problem.branches[branch]
    points, costs = costs_at(problem, archive, branch, without)
    nu = points.shape[1]
    now = start_of(points, costs, size, scale * nu)
    now_cost = problem.total(problem.costs(archive.evaluate(chosen.run, now), chosen), now, without)
    states = [now]
    for generation in range(generations):
        gamma = 1.0 if generation % 5 == 4 else 2.38 / np.sqrt(2.0 * nu)
        pairs = np.array([rng.choice(len(now), 2, replace=False) for _ in now])
        step = gamma * (now[pairs[:, 0]] - now[pairs[:, 1]]) + rng.normal(0.0, 1e-3, now.shape)
        moved = now + step
        moved = np.abs(moved)
        moved = np.where(moved > 1.0, 2.0 - moved, moved).clip(0.0, 1.0)
        cost = problem.total(problem.costs(archive.evaluate(chosen.run, moved), chosen), moved, without)
        taken = np.log(rng.random(len(now))) < (now_cost - cost) / (2.0 * scale)
        now, now_cost = np.where(taken[:, None], moved, now), np.where(taken, cost, now_cost)
        states.append(now)
    return Chain(np.concatenate(states[len(states) // 3 :]))


def search_branches(problem: Problem, archive: Archive, search: Search) -> tuple[dict[int, Found], Freedom]:
    """Search all branches; what was found in each, and the degrees of freedom of the best."""
    screen(problem, archive, search)
    numbers = range(len(problem.branches))
    populations: dict[int, Floats] = {}
    for b in numbers:
        points, costs = costs_at(problem, archive, b)
        start = points[np.argsort(costs, kind="stable")[: search.population]]
        rng = np.random.default_rng([search.seed, SHORT, b])
        populations[b] = evolve(
            problem, archive, b, _filled(start, search.population, rng), search.short, rng
        )
    best = {b: float(costs_at(problem, archive, b)[1].min()) for b in numbers}
    hopeless = search.hopeless * min(best.values()) + MARGIN
    kept = [b for b in numbers if best[b] <= hopeless]
    for b in kept:
        rng = np.random.default_rng([search.seed, DEEP, b])
        evolve(problem, archive, b, populations[b], search.generations, rng)
    best |= {b: float(costs_at(problem, archive, b)[1].min()) for b in kept}
    for b in _near(problem, archive, kept, best, search)[0] if search.polish and problem.slopes else ():
        points, costs = costs_at(problem, archive, b)
        polish(problem, archive, b, points[int(np.argmin(costs))], search.polish)
        best[b] = float(costs_at(problem, archive, b)[1].min())
    near, scale = _near(problem, archive, kept, best, search)
    chains = {
        b: chain(
            problem, archive, b, search.spread, scale, search.population,
            np.random.default_rng([search.seed, CHAIN, b]),
        )
        for b in near
        if search.spread
    }  # fmt: skip
    best |= {b: float(costs_at(problem, archive, b)[1].min()) for b in near}
    return {
        b: Found(best[b], _reason(b, kept, near, search), chains.get(b)) for b in numbers
    }, best_freedom(problem, archive, best)  # fmt: skip


def _near(
    problem: Problem, archive: Archive, kept: list[int], best: Mapping[int, float], search: Search
) -> tuple[list[int], float]:
    """Branches whose best set is likely beside the best of all, and the residual scale."""
    scale = best_freedom(problem, archive, best).scale
    return [b for b in kept if best[b] <= min(best.values()) + search.within * scale], scale


def _reason(branch: int, kept: list[int], near: list[int], search: Search) -> str:
    if branch not in kept:
        return f"hopeless after the short search: more than {search.hopeless:g} times the cost of the best"
    if branch not in near:
        return f"more than {search.within:g} residual scales above the best ({search.reason})"
    return ""


def _filled(start: Floats, count: int, rng: np.random.Generator) -> Floats:
    """A population of this size; random points where too few are known."""
    missing = count - len(start)
    return start if missing <= 0 else np.concatenate([start, rng.random((missing, start.shape[1]))])


def best_freedom(
    problem: Problem, archive: Archive, best: Mapping[int, float], without: int | None = None
) -> Freedom:
    """Degrees of freedom of the best branch, from the lowest cost of each."""
    return freedom_of_best(problem, archive, min(best, key=lambda one: (best[one], one)), without)
