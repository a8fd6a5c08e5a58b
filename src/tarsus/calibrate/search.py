"""Searching the hypotheses: sets spread evenly, steps down by regressions, hypotheses that fall behind rejected, a
local search with exact derivatives, then chains that follow the likelihood.

All randomness comes from the study's seed and the place in the sequence (row excluded, stage, hypothesis), never from
time or threads. A search knows nothing but its own problem and archive: the one without a row is a search like any
other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.calibrate.degrees import Freedom, freedom_of_best
from tarsus.calibrate.problem import Archive, HypothesisFit
from tarsus.fit.chain import chain, spread_over
from tarsus.fit.least_squares import least_squares
from tarsus.fit.regressions import STEPS, Valleys, steps

if TYPE_CHECKING:
    from tarsus.calibrate.description import Search

Floats = NDArray[np.float64]

DOWN = 0.8
"""Share of a generation that is steps down; the others are spread over the cube and keep the search from one valley: of
eight searches of the cantilever, 300 sets each, three ended 3 to 17 higher without them."""
BOUT = 4
"""Generations after which hypotheses are compared: fewer are a matter of luck."""
PATIENCE, SETTLED = 2, 0.1
"""A start that gains less than `SETTLED` in so many bouts has found what it finds: a tenth of what one standard
deviation of one unknown costs."""
STARTS = 2
"""Starts of a hypothesis, each from sets spread evenly once the one before gains no more: of single starts on the
cantilever, of 300 sets each, four of six ended within 2 of the lowest cost, one 4 and one 17 above it."""
FADING = 2.0
"""Most that a hypothesis is believed to gain yet, in gains of its last bout: gains fall by a third or more from bout
to bout."""
LEVEL = 0.9
"""Members of an ensemble lie inside the likelihood region of this probability (chi-squared with one degree of freedom
for each unknown)."""
MARGIN = 10.0
"""No hypothesis is rejected for less cost than this: a likelihood ratio of 150, which a few generations may make up."""
LOCAL = 0.03
"""The local search ends where a step is shorter than this part of a standard error: what an ensemble does not show."""
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
    many sets were visited before the present start, and the lowest cost after each bout, of all starts and of it."""

    fit: HypothesisFit
    search: Search
    rng: np.random.Generator
    valleys: Valleys = field(default_factory=Valleys)
    starts: int = 1
    generations: int = 0
    before: int = 0
    history: list[float] = field(default_factory=list)
    present: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
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
            points = self.fit.unknowns.draws(self.search.screening, self.rng)
            self.fit.asked(points, f"screening, start {self.starts}")
            self.present = []
            self._note()

    def _generation(self) -> None:
        """Steps down from the best valleys of the present start, and sets anywhere."""
        self.generations += 1
        points, residuals = self.fit.visited()
        costs, size = (residuals**2).sum(axis=1), self.search.population
        most = max(round(DOWN * size / len(STEPS)), 1)
        bases = [
            self.before + n for n in self.valleys.bases(points[self.before :], costs[self.before :], most)
        ]
        asked = [steps(points, residuals, base, self.rng) for base in bases]
        fresh = max(size - len(STEPS) * len(bases), 0)
        how = [f"step down, generation {self.generations}"] * (len(STEPS) * len(bases))
        how += [f"random, generation {self.generations}"] * fresh
        after = self.fit.asked(np.concatenate([*asked, self.rng.random((fresh, points.shape[1]))]), how)
        lowest = (after[: len(how) - fresh] ** 2).sum(axis=1).reshape(len(bases), len(STEPS))
        for base, found in zip(bases, lowest, strict=True):
            self.valleys.report(points[base], float(costs[base]), float(found.min()))

    def _idle(self) -> bool:
        """Whether the present start gains no more."""
        return len(self.present) > PATIENCE and self.present[-1 - PATIENCE] - self.present[-1] < SETTLED

    def settled(self) -> bool:
        """Whether the last start gains no more."""
        return self.starts == STARTS and self._idle()

    def hope(self) -> float:
        """Lowest cost that it may reach yet."""
        gain = self.present[-2] - self.present[-1] if len(self.present) > 1 else 0.0
        return min(self.history[-1], self.present[-1] - FADING * gain)


def randomness(search: Search, part: int, stage: int, hypothesis: int = 0) -> np.random.Generator:
    """Random numbers of a stage: of the whole table's search (part 0), or of that without a row (1, 2 ...)."""
    return np.random.default_rng(np.random.SeedSequence(search.seed, spawn_key=(part, stage, hypothesis)))


def sets_ahead(search: Search, stage: int, hypotheses: int) -> int:
    """Most sets that so many hypotheses ask for from a stage on."""
    each = {
        SHORT: search.population * search.short,
        DEEP: search.population * search.generations + (STARTS - 1) * search.screening + search.polish + 1,
        CHAIN: search.members * (search.spread + 1 + MEMBERS_AGAIN),
    }  # fmt: skip
    return hypotheses * sum(count for one, count in each.items() if one >= stage)


def search_hypotheses(archive: Archive, search: Search) -> tuple[dict[int, SearchResult], Freedom]:
    """Search all hypotheses of the archive's problem: what was found of each, and degrees of freedom of the best."""
    problem, part = archive.problem, archive.part
    fits = [HypothesisFit(archive, number) for number in range(len(problem.hypotheses))]
    runs = sorted({one.hypothesis.run for one in fits})
    archive.ahead = len(runs) * search.screening + sets_ahead(search, SHORT, len(fits))
    even = problem.unknowns.draws(search.screening, randomness(search, part, PRESCREENING))
    for run in runs:
        archive.evaluate(run, even, "screening")
    descents = {b: _Descent(fit, search, randomness(search, part, SHORT, b)) for b, fit in enumerate(fits)}
    for one in descents.values():
        one.advance(search.short, search.short + search.generations)
    best = {b: one.best() for b, one in descents.items()}
    most = search.hopeless * min(best.values()) + MARGIN
    rejected = {
        b: f"hopeless after the short search: more than {search.hopeless:g} times the cost of the best"
        for b, cost in best.items()
        if cost > most
    }
    scale = _race(descents, rejected, search)
    best = {b: one.best() for b, one in descents.items()}
    near = _near(best, rejected, scale, search)
    if search.polish and problem.slopes:
        for b in near:
            _improved(fits[b], search.polish)
            best[b] = descents[b].best()
    freedom = freedom_of_best(fits, best)
    near = _near(best, rejected, freedom.scale, search)
    archive.ahead = sets_ahead(search, CHAIN, len(near))
    states = {b: _chained(fits[b], search, freedom.scale) for b in near if search.spread}
    best |= {b: descents[b].best() for b in near}
    found = {b: SearchResult(best[b], rejected.get(b, ""), states.get(b)) for b in descents}
    return found, freedom_of_best(fits, best)


def _race(descents: Mapping[int, _Descent], rejected: dict[int, str], search: Search) -> float:
    """Take the hypotheses on, bout by bout: those that settled rest, and those that could not come near the best in the
    bouts that are left are rejected. The residual scale at the end."""
    archive = next(iter(descents.values())).fit.archive
    fits = [one.fit for one in descents.values()]
    running = [b for b in descents if b not in rejected]
    archive.ahead = sets_ahead(search, DEEP, len(running))
    last = search.short + search.generations
    scale = freedom_of_best(fits, {b: one.history[-1] for b, one in descents.items()}).scale
    while running:
        for b in running:
            left = last - descents[b].generations
            descents[b].advance(min(BOUT, left), left)
        best = {b: one.history[-1] for b, one in descents.items()}
        scale = freedom_of_best(fits, best).scale
        enough = min(best.values()) + max(search.within * scale, MARGIN)
        for b in list(running):
            left = -(-(last - descents[b].generations) // BOUT)
            if descents[b].hope() > enough:
                rejected[b] = (
                    f"behind: its last bouts gained too little to come within {search.within:g} scales"
                )
            if b in rejected or descents[b].settled() or not left:
                running.remove(b)
        archive.ahead = sum(
            sets_ahead(search, DEEP, 1) - descents[b].generations * search.population for b in running
        )
    return scale


def _near(best: Mapping[int, float], rejected: dict[int, str], scale: float, search: Search) -> list[int]:
    """Hypotheses whose best set is likely beside the best of all; the others are rejected."""
    near = min(best.values()) + search.within * scale
    for b, cost in best.items():
        if cost > near:
            rejected.setdefault(
                b, f"more than {search.within:g} residual scales above the best ({search.reason})"
            )
    return [b for b in best if b not in rejected]


def _improved(fit: HypothesisFit, rounds: int) -> None:
    """Go down from the best set by exact derivatives; what is visited is kept in the archive."""
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
    chosen = [int(inside[i]) for i in spread_over(points[inside], search.members)]
    taken = set(chosen)
    chosen += [int(i) for i in order if int(i) not in taken][: search.members - len(chosen)]

    def asked(moved: Floats, generation: int) -> Floats:
        return fit.cost_at(moved, f"chain, generation {generation}")

    return chain(
        asked, points[chosen], search.spread, randomness(search, fit.archive.part, CHAIN, fit.number), scale
    )
