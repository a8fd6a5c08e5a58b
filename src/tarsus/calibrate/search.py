"""Searching the branches: sets spread evenly, differential evolution, hopeless branches dropped, then chains that
follow the likelihood.

All randomness comes from the study's seed and the place in the sequence (row left out, stage, branch), never from time
or threads. A search knows nothing but its own problem and archive: the one without a row is a search like any other.
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
    "chain",
    "evolve",
    "questions",
    "randomness",
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
SCREEN, SHORT, DEEP, POLISH, CHAIN = range(5)
"""Stages, for the random numbers of each."""
MEMBERS_AGAIN = 3
"""Times that members of an ensemble are asked for again, which are visited already."""


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


def sets_ahead(search: Search, stage: int, branches: int) -> int:
    """Most sets that so many branches ask for from a stage on."""
    each = {
        SHORT: search.population * (search.short + 1), DEEP: search.population * (search.generations + 1),
        POLISH: search.polish + 1, CHAIN: search.population * (search.spread + 1) + MEMBERS_AGAIN * search.members,
    }  # fmt: skip
    return branches * sum(count for one, count in each.items() if one >= stage)


def questions(problem: Problem, search: Search) -> int:
    """Most questions that a search puts to its archive."""
    each = search.short + search.generations + 2 * search.polish + search.spread + 8
    return len(problem.branches) * (each + 1)


def randomness(search: Search, part: int, stage: int, branch: int = 0) -> np.random.Generator:
    """Random numbers of a stage: of the whole table's search (part 0), or of that without a row (1, 2 ...)."""
    return np.random.default_rng(np.random.SeedSequence(search.seed, spawn_key=(part, stage, branch)))


def costs_at(problem: Problem, archive: Archive, branch: int) -> tuple[Floats, Floats]:
    """Visited points (n, nu) of a branch and their costs (n,)."""
    chosen = problem.branches[branch]
    points, readings = archive.points(chosen.run)
    return points, problem.total(problem.costs(readings, chosen), points)


def screen(problem: Problem, archive: Archive, search: Search, part: int = 0) -> None:
    """The same sets in every run branch: a Sobol sequence."""
    power = int(np.ceil(np.log2(search.screening)))
    sobol = qmc.Sobol(len(problem.unknowns), rng=randomness(search, part, SCREEN))
    points = sobol.random_base2(power)[: search.screening]
    for run in sorted({branch.run for branch in problem.branches}):
        archive.evaluate(run, points, "screening")


def evolve(
    problem: Problem,
    archive: Archive,
    branch: int,
    start: Floats,
    generations: int,
    rng: np.random.Generator,
    first: int = 1,
) -> Floats:
    """Differential evolution from a population (np, nu), most of whose children are steps down from the best valleys by
    regressions over all visited sets; the last population. first: number of the first generation."""
    chosen, valleys, size = problem.branches[branch], Valleys(), len(start)

    def cost(points: Floats, found: str | list[str]) -> Floats:
        readings = archive.evaluate(chosen.run, points, found)
        return problem.total(problem.costs(readings, chosen), points)

    population, now = start.copy(), cost(start, "random") if generations else np.zeros(size)
    for generation in range(first, first + generations):
        points, readings = archive.points(chosen.run)
        bases: list[int] = []
        residuals = before = np.zeros(0)
        if size >= FEWEST and len(points) > 2 * (points.shape[1] + 1):
            residuals = residuals_of(problem, chosen, np.asarray(readings, dtype=float), points)
            before = (residuals**2).sum(axis=1)
            bases = valleys.bases(points, before, round(DOWN * size / len(STEPS)))
        targets = rng.permutation(size)[: size - len(STEPS) * len(bases)]
        asked = [steps(points, residuals, base, rng) for base in bases]
        asked.append(_children(population, int(np.argmin(now)), targets, rng))
        how = [f"step down, generation {generation}"] * (len(STEPS) * len(bases))
        how += [f"evolution, generation {generation}"] * len(targets)
        after = np.split(cost(np.concatenate(asked), how), np.cumsum([len(one) for one in asked])[:-1])
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
) -> Chain:
    """Differential-evolution Markov chains (ter Braak 2006) whose density is exp(-cost / (2 scale)).

    They start spread over the visited points that cost as much more than the best as a state of the chain does on
    average, ``scale`` for each unknown; the first third is dropped.
    """
    chosen = problem.branches[branch]
    points, costs = costs_at(problem, archive, branch)
    nu = points.shape[1]
    now = start_of(points, costs, size, scale * nu)
    now_cost = problem.total(problem.costs(archive.evaluate(chosen.run, now), chosen), now)
    states = [now]
    for generation in range(generations):
        gamma = 1.0 if generation % 5 == 4 else 2.38 / np.sqrt(2.0 * nu)
        pairs = np.array([rng.choice(len(now), 2, replace=False) for _ in now])
        step = gamma * (now[pairs[:, 0]] - now[pairs[:, 1]]) + rng.normal(0.0, 1e-3, now.shape)
        moved = now + step
        moved = np.abs(moved)
        moved = np.where(moved > 1.0, 2.0 - moved, moved).clip(0.0, 1.0)
        readings = archive.evaluate(chosen.run, moved, f"chain, generation {generation + 1}")
        cost = problem.total(problem.costs(readings, chosen), moved)
        taken = np.log(rng.random(len(now))) < (now_cost - cost) / (2.0 * scale)
        now, now_cost = np.where(taken[:, None], moved, now), np.where(taken, cost, now_cost)
        states.append(now)
    return Chain(np.concatenate(states[len(states) // 3 :]))


def search_branches(
    problem: Problem, archive: Archive, search: Search, part: int = 0
) -> tuple[dict[int, Found], Freedom]:
    """Search all branches; what was found in each, and the degrees of freedom of the best.

    part: 0 for the search of the whole table, n + 1 for the one without row n: each has random numbers of its own.
    """
    numbers = range(len(problem.branches))
    runs = len({branch.run for branch in problem.branches})
    archive.ahead = runs * search.screening + sets_ahead(search, SHORT, len(numbers))
    screen(problem, archive, search, part)
    populations: dict[int, Floats] = {}
    for b in numbers:
        points, costs = costs_at(problem, archive, b)
        start = points[np.argsort(costs, kind="stable")[: search.population]]
        rng = randomness(search, part, SHORT, b)
        populations[b] = evolve(
            problem, archive, b, _filled(start, search.population, rng), search.short, rng
        )
    best = {b: float(costs_at(problem, archive, b)[1].min()) for b in numbers}
    hopeless = search.hopeless * min(best.values()) + MARGIN
    kept = [b for b in numbers if best[b] <= hopeless]
    archive.ahead = sets_ahead(search, DEEP, len(kept))
    for b in kept:
        rng = randomness(search, part, DEEP, b)
        evolve(problem, archive, b, populations[b], search.generations, rng, search.short + 1)
    best |= {b: float(costs_at(problem, archive, b)[1].min()) for b in kept}
    polished = _near(problem, archive, kept, best, search)[0]
    archive.ahead = sets_ahead(search, POLISH, len(polished))
    for b in polished if search.polish and problem.slopes else ():
        points, costs = costs_at(problem, archive, b)
        polish(problem, archive, b, points[int(np.argmin(costs))], search.polish)
        best[b] = float(costs_at(problem, archive, b)[1].min())
    near, scale = _near(problem, archive, kept, best, search)
    archive.ahead = sets_ahead(search, CHAIN, len(near))
    chains = {
        b: chain(
            problem, archive, b, search.spread, scale, search.population, randomness(search, part, CHAIN, b)
        )
        for b in near
        if search.spread
    }
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


def best_freedom(problem: Problem, archive: Archive, best: Mapping[int, float]) -> Freedom:
    """Degrees of freedom of the best branch, from the lowest cost of each."""
    return freedom_of_best(problem, archive, min(best, key=lambda one: (best[one], one)))
