"""Searching the hypotheses: sets spread evenly, steps down by regressions and differential evolution, hypotheses
far behind rejected, a local search by least squares, then chains that follow the likelihood.

All randomness comes from the study's seed and the place in the sequence (row excluded, stage, hypothesis), never from
time or threads. A search knows nothing but its own problem and archive: the one without a row is a search like any
other.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats, Ints
from tarsus.calibrate.degrees import Freedom, freedom_of_best
from tarsus.calibrate.problem import Archive, HypothesisFit
from tarsus.fit.chain import chain, mixing
from tarsus.fit.front import farthest
from tarsus.fit.least_squares import least_squares_from
from tarsus.fit.regressions import STEPS, Valleys, steps
from tarsus.fit.valleys import apart

if TYPE_CHECKING:
    from tarsus.calibrate.description import Search


DOWN = 2.0 / 3.0
"""Share of a generation that is steps down; the others are children of the population by differential evolution, which
cross what a jump of the cost hides from a regression and keep the search from one valley. On the cantilever's table
steps alone ended 1.8 and 3.7 higher (seeds 1 and 2), scipy's evolution alone 4.4 (seed 1)."""
LEVEL = 0.99
"""Members of an ensemble lie inside the likelihood region of this probability (chi-squared with one degree of freedom
for each unknown). Inside that of 90 % the 95 % interval of one unknown is 1.46 standard deviations to either side:
of 400 tables of a resonance with noise it missed the truth in 42, of two and three unknowns in 7 to 9 %; so in 4 to
7 %."""
MARGIN = 10.0
"""No hypothesis is rejected for less cost than this: a likelihood ratio of 150, which a few generations may make up."""
DESCENTS, NEAR = 2, 0.1
"""Descents of the local search, from the best sets that differ by a tenth of some unknown's bounds: a small search may
have its best one next to a jump of a count."""
LOCAL = 0.1
"""A descent ends where a step is shorter than this part of a standard error: a cost of 0.01, which an ensemble does not
show."""
WITHIN = 6.0
"""A hypothesis is kept when its cost is so near the best, in units of the residual scale: a likelihood ratio of 20."""
PRESCREENING, SHORT, CHAIN = 0, 1, 4
"""Stages, for the random numbers of each."""


@dataclass(frozen=True)
class SearchResult:
    """What the search found of a hypothesis: its lowest cost, whether and why it was rejected, states (n, nu) of its
    chain, by how much the chain, which only looks about, came below the search, and how well it is mixed (`mixing`)."""

    cost: float
    rejected: str
    states: Floats | None
    gained: float
    mixing: float


@dataclass
class _Descent:
    """A hypothesis that is searched: what it fits, with how many points a generation and which random numbers; its
    population (np, nu) with costs (np,), at first the best of the visited sets."""

    fit: HypothesisFit
    size: int
    rng: np.random.Generator
    valleys: Valleys = field(default_factory=Valleys)

    def __post_init__(self) -> None:
        points, costs = self.fit.costs_visited()
        best = np.argsort(costs, kind="stable")[: self.size]
        self.population, self.costs = points[best], costs[best]

    def generation(self) -> None:
        """Steps down from the best valleys, and children of the population."""
        points, residuals = self.fit.visited()
        costs = (residuals**2).sum(axis=1)
        bases = self.valleys.bases(points, costs, max(round(DOWN * self.size / len(STEPS)), 1))
        asked = [steps(points, residuals, base, self.rng) for base in bases]
        down, members = len(STEPS) * len(bases), len(self.population)
        targets = np.resize(self.rng.permutation(members), max(self.size - down, 0))
        found = np.concatenate([*asked, _children(self.population, self.costs, targets, self.rng)])
        after = self.fit.cost_at(found)
        for base, own in zip(bases, after[:down].reshape(len(bases), len(STEPS)), strict=True):
            self.valleys.report(points[base], float(costs[base]), float(own.min()))
        for place, point, cost in zip([-1] * down + targets.tolist(), found, after, strict=True):
            own = place if place >= 0 else int(np.argmax(self.costs))  # a step down takes the place of the worst
            if cost < self.costs[own]:
                self.population[own], self.costs[own] = point, cost


def _children(population: Floats, costs: Floats, targets: Ints, rng: np.random.Generator) -> Floats:
    """Children (n, nu) of members (np, nu) of these costs by their numbers (n,): the best member and a difference of
    two, crossed with each; where one leaves the cube it is drawn anew. After Storn and Price (J. Glob. Optim. 11,
    1997); scipy's own evolution takes no points that another method finds while it goes on."""
    if len(population) < 2:
        return rng.random((len(targets), population.shape[1]))
    pairs = np.array([rng.choice(len(population), 2, replace=False) for _ in targets], dtype=int).reshape(-1, 2)
    best = population[int(np.argmin(costs))]
    moved = best + rng.uniform(0.4, 0.9) * (population[pairs[:, 0]] - population[pairs[:, 1]])
    own = rng.random(moved.shape) >= 0.8
    own[np.arange(len(own)), rng.integers(moved.shape[1], size=len(own))] = False
    moved = np.where(own, population[targets], moved)
    return np.where((moved < 0.0) | (moved > 1.0), rng.random(moved.shape), moved)


def randomness(search: Search, part: int, stage: int, hypothesis: int = 0) -> np.random.Generator:
    """Random numbers of a stage: of the whole table's search (part 0), or of that without a row (1, 2 ...)."""
    return np.random.default_rng(np.random.SeedSequence(search.seed, spawn_key=(part, stage, hypothesis)))


def most_sets(search: Search, runs: int, hypotheses: int) -> int:
    """Most sets that a search of so many variants of the runs and hypotheses visits."""
    evolved = search.population * (search.short + search.generations)
    chained = search.members * (search.spread + 1)
    return runs * search.prescreening + hypotheses * (evolved + DESCENTS * (search.local_search + 1) + chained)


def search_hypotheses(archive: Archive, search: Search) -> tuple[dict[int, SearchResult], Freedom]:
    """Search all hypotheses of the archive's problem: what was found of each, and degrees of freedom of the best."""
    problem, part = archive.problem, archive.part
    fits = [HypothesisFit(archive, number) for number in range(len(problem.hypotheses))]
    even = problem.unknowns.draws(search.prescreening, randomness(search, part, PRESCREENING))
    for run in sorted({one.hypothesis.run for one in fits}):
        archive.evaluate(run, even)
    descents = [_Descent(one, search.population, randomness(search, part, SHORT, one.number)) for one in fits]
    for _ in range(search.short):
        for one in descents:
            one.generation()
    best = {one.number: one.lowest() for one in fits}
    most = search.rejected * min(best.values()) + MARGIN
    why = f"rejected after the short search: more than {search.rejected:g} times the cost of the best"
    rejected = {b: why for b, cost in best.items() if cost > most}
    for one in (one for one in descents if one.fit.number not in rejected):
        for _ in range(search.generations):
            one.generation()
    _reject(fits, rejected, MARGIN)
    for one in (one for one in fits if one.number not in rejected and search.local_search):
        points, costs = one.costs_visited()
        starts = apart(points, np.argsort(costs, kind="stable"), NEAR, DESCENTS)
        least_squares_from(one, points[starts], search.local_search, LOCAL)
    freedom = _reject(fits, rejected)
    best = {one.number: one.lowest() for one in fits}
    chains = {b: _chained(fits[b], search, freedom.scale) for b in best if search.spread and b not in rejected}
    least = {b: fits[b].lowest() if b in chains else cost for b, cost in best.items()}
    found = {}
    for b, cost in best.items():
        states, mixed = chains.get(b, (None, 1.0))
        found[b] = SearchResult(least[b], rejected.get(b, ""), states, cost - least[b], mixed)
    return found, freedom_of_best(fits, least)


def _reject(fits: list[HypothesisFit], rejected: dict[int, str], least: float = 0.0) -> Freedom:
    """Reject the hypotheses whose best set is not likely against the best of all, by a cost of so much at least;
    degrees of freedom of that."""
    best = {one.number: one.lowest() for one in fits}
    freedom = freedom_of_best(fits, best)
    near = min(best.values()) + max(WITHIN * freedom.scale, least)
    why = f"more than {WITHIN:g} residual scales above the best: a likelihood ratio of 20 to 1"
    rejected |= {b: why for b, cost in best.items() if cost > near and b not in rejected}
    return freedom


def _chained(fit: HypothesisFit, search: Search, scale: float) -> tuple[Floats, float]:
    """States (n, nu) of chains as many as an ensemble has members, and how well these are mixed.

    They start spread over the visited points that cost as much more than the best as a state of the chain does on
    average, ``scale`` for each unknown, filled up with the next best.
    """
    points, costs = fit.costs_visited()
    order = np.argsort(costs, kind="stable")
    inside = order[costs[order] <= costs[order[0]] + scale * points.shape[1]]
    chosen = inside[farthest(points[inside], False, search.members)].tolist()
    taken = set(chosen)
    chosen += [int(i) for i in order if int(i) not in taken][: search.members - len(chosen)]
    rng = randomness(search, fit.archive.part, CHAIN, fit.number)
    states = chain(fit.cost_at, points[chosen], search.spread, rng, scale)
    return states, mixing(states, len(chosen))
