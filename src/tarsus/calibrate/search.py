"""Searching the hypotheses: sets spread evenly, steps down by regressions beside differential evolution, hypotheses
that fall behind rejected, a local search by least squares, then chains that follow the likelihood.

All randomness comes from the study's seed and the place in the sequence (row excluded, stage, hypothesis), never from
time or threads. A search knows nothing but its own problem and archive: the one without a row is a search like any
other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats, Ints
from tarsus.calibrate.degrees import Freedom, freedom_of_best
from tarsus.calibrate.problem import Archive, HypothesisFit
from tarsus.fit.chain import chain
from tarsus.fit.front import farthest
from tarsus.fit.least_squares import least_squares
from tarsus.fit.regressions import STEPS, Valleys, steps

if TYPE_CHECKING:
    from tarsus.calibrate.description import Search


DOWN = 2.0 / 3.0
"""Share of a generation that is steps down; the others are children of the population by differential evolution, which
cross what a jump of the cost hides from a regression and keep the search from one valley."""
BOUT = 4
"""Generations after which hypotheses are compared: fewer are a matter of luck."""
PATIENCE, SETTLED = 2, 0.1
"""A start that gains less than `SETTLED` in so many bouts has found what it finds: a tenth of what one standard
deviation of one unknown costs."""
STARTS = 2
"""Starts of a hypothesis, each from sets spread evenly once the one before gains no more: of fifteen single starts on
the cantilever, of 300 sets each, fourteen ended within 4 of the median cost, and one 15 above it. The second ends as
soon as it could not come below the first any more."""
FADING = 2.0
"""Most that a hypothesis is believed to gain yet, in gains of its last bout: gains fall by a third or more from bout
to bout."""
LEVEL = 0.9
"""Members of an ensemble lie inside the likelihood region of this probability (chi-squared with one degree of freedom
for each unknown)."""
MARGIN = 10.0
"""No hypothesis is rejected for less cost than this: a likelihood ratio of 150, which a few generations may make up."""
LOCAL = 0.1
"""The local search ends where a step is shorter than this part of a standard error: a cost of 0.01, which an ensemble
does not show."""
PRESCREENING, SHORT, DEEP, CHAIN = 0, 1, 2, 4
"""Stages, for the random numbers of each."""
MEMBERS_AGAIN = 3
"""Times that members of an ensemble are asked for again, which are visited already."""


@dataclass(frozen=True)
class SearchResult:
    """What the search found of a hypothesis: its lowest cost, whether and why it was rejected, and states (n, nu) of
    its chain."""

    cost: float
    rejected: str
    states: Floats | None


@dataclass
class _Descent:
    """A hypothesis that is searched: what it fits, how, with which random numbers; starts and generations made, how
    many sets were visited before the present start, its population (np, nu) with costs (np,), and the lowest cost after
    each bout, of all starts and of it."""

    fit: HypothesisFit
    search: Search
    rng: np.random.Generator
    valleys: Valleys = field(default_factory=Valleys)
    starts: int = 1
    generations: int = 0
    before: int = 0
    history: list[float] = field(default_factory=list)
    present: list[float] = field(default_factory=list)
    population: Floats = field(init=False)
    costs: Floats = field(init=False)

    def __post_init__(self) -> None:
        self._begin()

    def _begin(self) -> None:
        """The population of the present start: the best of its sets."""
        points, costs = self.fit.costs_visited()
        best = self.before + np.argsort(costs[self.before :], kind="stable")[: self.search.population]
        self.population, self.costs = points[best], costs[best]
        self._note()

    def _note(self) -> None:
        costs = self.fit.costs_visited()[1]
        self.history.append(float(costs.min()))
        self.present.append(float(costs[self.before :].min()))

    def best(self) -> float:
        """Lowest cost of the visited sets."""
        return float(self.fit.costs_visited()[1].min())

    def advance(self, generations: int, left: int) -> None:
        """A bout of so many generations, of those that are left."""
        for _ in range(generations):
            self._generation()
        self._note()
        if self._idle() and self.starts < STARTS and left > generations:
            self.starts += 1
            self.before = len(self.fit.visited()[0])
            points = self.fit.unknowns.draws(self.search.prescreening, self.rng)
            self.fit.asked(points, f"prescreening, start {self.starts}")
            self.present = []
            self._begin()

    def _generation(self) -> None:
        """Steps down from the best valleys of the present start, and children of its population."""
        self.generations += 1
        points, residuals = self.fit.visited()
        costs, size = (residuals**2).sum(axis=1), self.search.population
        most = max(round(DOWN * size / len(STEPS)), 1)
        bases = [self.before + n for n in self.valleys.bases(points[self.before :], costs[self.before :], most)]
        asked = [steps(points, residuals, base, self.rng) for base in bases]
        down, members = len(STEPS) * len(bases), len(self.population)
        targets = np.resize(self.rng.permutation(members), max(size - down, 0))
        asked.append(_children(self.population, self.costs, targets, self.rng))
        how = [f"step down, generation {self.generations}"] * down
        how += [f"evolution, generation {self.generations}"] * len(targets)
        found = np.concatenate(asked)
        after = (self.fit.asked(found, how) ** 2).sum(axis=1)
        for base, own in zip(bases, after[:down].reshape(len(bases), len(STEPS)), strict=True):
            self.valleys.report(points[base], float(costs[base]), float(own.min()))
        for place, point, cost in zip([-1] * down + targets.tolist(), found, after, strict=True):
            own = place if place >= 0 else int(np.argmax(self.costs))  # a step down takes the place of the worst
            if cost < self.costs[own]:
                self.population[own], self.costs[own] = point, cost

    def _idle(self) -> bool:
        """Whether the present start gains no more."""
        return len(self.present) > PATIENCE and self.present[-1 - PATIENCE] - self.present[-1] < SETTLED

    def settled(self) -> bool:
        """Whether the last start gains no more, or nothing that the one before did not."""
        return self.starts == STARTS and (self._idle() or self._ahead() > self.history[-1])

    def hope(self) -> float:
        """Lowest cost that it may reach yet."""
        return min(self.history[-1], self._ahead())

    def _ahead(self) -> float:
        """Lowest cost that the present start may reach yet; none is known of one that has not made a bout."""
        if len(self.present) < 2:
            return -np.inf if self.starts > 1 else self.present[-1]
        return self.present[-1] - FADING * (self.present[-2] - self.present[-1])


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


def sets_ahead(search: Search, stage: int, hypotheses: int) -> int:
    """Most sets that so many hypotheses ask for from a stage on."""
    each = {
        SHORT: search.population * search.short,
        DEEP: search.population * search.generations + (STARTS - 1) * search.prescreening + search.local_search + 1,
        CHAIN: search.members * (search.spread + 1 + MEMBERS_AGAIN),
    }
    return hypotheses * sum(count for one, count in each.items() if one >= stage)


def search_hypotheses(archive: Archive, search: Search) -> tuple[dict[int, SearchResult], Freedom]:
    """Search all hypotheses of the archive's problem: what was found of each, and degrees of freedom of the best."""
    problem, part = archive.problem, archive.part
    fits = [HypothesisFit(archive, number) for number in range(len(problem.hypotheses))]
    runs = sorted({one.hypothesis.run for one in fits})
    archive.ahead = len(runs) * search.prescreening + sets_ahead(search, SHORT, len(fits))
    even = problem.unknowns.draws(search.prescreening, randomness(search, part, PRESCREENING))
    for run in runs:
        archive.evaluate(run, even, "prescreening")
    descents = {b: _Descent(fit, search, randomness(search, part, SHORT, b)) for b, fit in enumerate(fits)}
    for one in descents.values():
        one.advance(search.short, search.short + search.generations)
    best = {b: one.best() for b, one in descents.items()}
    most = search.rejected * min(best.values()) + MARGIN
    rejected = {
        b: f"rejected after the short search: more than {search.rejected:g} times the cost of the best"
        for b, cost in best.items()
        if cost > most
    }
    scale = _race(descents, rejected, search)
    best = {b: one.best() for b, one in descents.items()}
    near = _near(best, rejected, scale, search)
    if search.local_search:
        for b in near:
            _improved(fits[b], search.local_search)
            best[b] = descents[b].best()
    freedom = freedom_of_best(fits, best)
    near = _near(best, rejected, freedom.scale, search)
    archive.ahead = sets_ahead(search, CHAIN, len(near))
    states = {b: _chained(fits[b], search, freedom.scale) for b in near if search.spread}
    best |= {b: descents[b].best() for b in near}
    found = {b: SearchResult(best[b], rejected.get(b, ""), states.get(b)) for b in descents}
    return found, freedom_of_best(fits, best)


def _race(descents: Mapping[int, _Descent], rejected: dict[int, str], search: Search) -> float:
    """Take the hypotheses on, bout by bout, that first which may come lowest: those that settled rest, and those that
    could not come near the best any more are rejected. The residual scale at the end."""
    archive = next(iter(descents.values())).fit.archive
    fits = [one.fit for one in descents.values()]
    running = [b for b in descents if b not in rejected]
    archive.ahead = sets_ahead(search, DEEP, len(running))
    last = search.short + search.generations
    scale = freedom_of_best(fits, {b: one.history[-1] for b, one in descents.items()}).scale
    while running:
        first = min(running, key=lambda b: (descents[b].hope(), b))
        left = last - descents[first].generations
        descents[first].advance(min(BOUT, left), left)
        best = {b: one.history[-1] for b, one in descents.items()}
        scale = freedom_of_best(fits, best).scale
        enough = min(best.values()) + max(search.within * scale, MARGIN)
        for b in list(running):
            if descents[b].hope() > enough:
                rejected[b] = f"behind: its last bouts gained too little to come within {search.within:g} scales"
            if b in rejected or descents[b].settled() or descents[b].generations == last:
                running.remove(b)
        archive.ahead = sum(
            sets_ahead(search, DEEP, 1) - (descents[b].generations - search.short) * search.population for b in running
        )
    return scale


def _near(best: Mapping[int, float], rejected: dict[int, str], scale: float, search: Search) -> list[int]:
    """Hypotheses whose best set is likely beside the best of all; the others are rejected."""
    near = min(best.values()) + search.within * scale
    for b, cost in best.items():
        if cost > near:
            rejected.setdefault(b, f"more than {search.within:g} residual scales above the best ({search.reason})")
    return [b for b in best if b not in rejected]


def _improved(fit: HypothesisFit, rounds: int) -> None:
    """Go down from the best set by least squares; what is visited is kept in the archive."""
    points, costs = fit.costs_visited()
    least_squares(fit, points[int(np.argmin(costs))], rounds, LOCAL)


def _chained(fit: HypothesisFit, search: Search, scale: float) -> Floats:
    """States (n, nu) of chains as many as an ensemble has members.

    They start spread over the visited points that cost as much more than the best as a state of the chain does on
    average, ``scale`` for each unknown, filled up with the next best.
    """
    points, costs = fit.costs_visited()
    order = np.argsort(costs, kind="stable")
    inside = order[costs[order] <= costs[order[0]] + scale * points.shape[1]]
    chosen = inside[farthest(points[inside], False, search.members)].tolist()
    taken = set(chosen)
    chosen += [int(i) for i in order if int(i) not in taken][: search.members - len(chosen)]

    def asked(moved: Floats, generation: int) -> Floats:
        return fit.cost_at(moved, f"chain, generation {generation}")

    return chain(asked, points[chosen], search.spread, randomness(search, fit.archive.part, CHAIN, fit.number), scale)
