"""Ground that differs from foot to foot: whether records of a walk ask for it, how far feet are apart, and which it is.

Every foot's number lies off the ground's own, their geometric mean, by a normal deviation of the logarithm, whose
spread is estimated as well (an empirical Bayes estimate by expectation and maximisation, Dempster et al. 1977).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import chdtri

from tarsus.base.arrays import Floats
from tarsus.fit.record_problem import UNDER, RecordFit, RecordProblem
from tarsus.fit.record_ties import TiedWindows
from tarsus.fit.unknowns import Prior
from tarsus.identify.covariance import FEWEST
from tarsus.identify.draws import by_group

APART, LEAST_APART = 0.1, 0.003
"""Spread of logarithms from foot to foot at first, and at least, where it is less than any interval."""
SAME = 0.2
"""Logarithm of the ratio of two spreads that are the same: a spread of six feet is known to 0.3."""
CHANCE = 0.001
"""Probability that of ground which is the same under all feet some number is taken to differ: a trial costs as much as
all before it, and friction that is a fifth lower under one foot asks for tens of times more."""


def with_feet(problem: RecordProblem, paths: Sequence[str], apart: float = APART) -> RecordProblem:
    """The problem with factors of the ground's numbers at paths under single feet."""
    names = (f"{UNDER}{foot}: {path}" for path in paths for foot in problem.scenes[0].robot.feet)
    own = Prior(1.0, factor=float(np.exp(apart)))
    return replace(problem, priors={**problem.priors, **{name: own for name in names}})


def asked_of_feet(windows: TiedWindows, fit: RecordFit, paths: Sequence[str]) -> dict[str, float]:
    """By how many times the limit of `CHANCE` the cost would fall if the ground's number at a path differed from foot
    to foot, by path, of those beyond it. Windows that pull apart more than their noise does raise the limit: one that
    went another way than all others shows no foot."""
    scene = windows.problem.scenes[0]
    if not paths or len(scene.robot.feet) < 2 or scene.grounds:  # feet that have grounds of their own differ already
        return {}
    wider = with_feet(windows.problem, paths)
    count = len(windows.names)
    there = replace(fit, moved=np.append(fit.moved, np.zeros(len(wider.priors) - count)))
    pulls = TiedWindows(wider, windows.ties, windows).pulls(there)
    information, score = by_group(pulls.window, pulls.information, pulls.score)
    known, names = np.eye(len(wider.priors)), list(wider.priors)
    whole, before, out = information.sum(axis=0) + known, slice(count), dict[str, float]()
    beforehand = known[before, before] @ there.moved[before]
    for path in paths:
        own = np.array([k for k in range(count, len(names)) if wider.feet[names[k]][1] == path])
        way = np.zeros((len(names), len(own)))
        way[own, range(len(own))] = 1.0
        way[before] = -np.linalg.solve(whole[before, before], whole[before][:, own])
        left, inverse = score @ way, np.linalg.inv(way.T @ whole @ way)
        found = inverse @ (left.sum(axis=0) - beforehand @ way[before])
        gain = float(found @ np.linalg.solve(inverse, found))
        limit = float(chdtri(len(own) - 1, CHANCE / len(paths)))
        out[path] = gain / (limit * _scatter(way.T @ information @ way, left, inverse, found))
    return {path: gain for path, gain in out.items() if gain > 1.0}


def _scatter(information: Floats, score: Floats, inverse: Floats, found: Floats) -> float:
    """By how many times more than noise windows pull numbers (k,) apart, at least 1, from what each knows (n, k, k) and
    its score (n, k)."""
    share = inverse @ information
    freedom = float(np.trace(share.sum(axis=0)) - np.einsum("nab,nba->", share, share))
    if freedom < (1.0 - 1.0 / FEWEST) * len(found):
        return 1.0
    off = score - information @ found
    return max(float(np.einsum("na,ab,nb->", off, inverse, off)) / freedom, 1.0)


def respread(problem: RecordProblem, fit: RecordFit) -> tuple[RecordProblem, Floats]:
    """The same with the spreads from foot to foot that the deviations have: mean squares, their variances included."""
    names, priors, moved = list(problem.priors), dict(problem.priors), fit.moved.copy()
    for path in dict.fromkeys(path for _, path in problem.feet.values()):
        mine = [names.index(name) for name, (_, other) in problem.feet.items() if other == path]
        squares = moved[mine] ** 2 + np.diag(fit.covariance)[mine]  # in standard deviations beforehand
        before = float(np.log(problem.priors[names[mine[0]]].factor or 1.0))
        after = max(before * float(np.sqrt(squares.mean())), LEAST_APART)
        for j in mine:
            priors[names[j]] = Prior(1.0, factor=float(np.exp(after)))
            moved[j] *= before / after
    return replace(problem, priors=priors), moved


def alike(one: RecordProblem, other: RecordProblem) -> bool:
    """Whether spreads from foot to foot of two problems are the same to what so few feet tell of them."""
    factors = [(one.priors[name].factor or 1.0, other.priors[name].factor or 1.0) for name in one.feet]
    return all(abs(np.log(np.log(b) / np.log(a))) < SAME for a, b in factors)


def numbers_of_feet(
    problem: RecordProblem, fit: RecordFit, prior: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Spread from foot to foot by path, and each foot's own number with the standard deviation of its logarithm."""
    names, apart, own = list(problem.priors), dict[str, float](), dict[str, tuple[float, float]]()
    for name, (_, path) in problem.feet.items():
        apart[path] = float(np.log(problem.priors[name].factor or 1.0))
        both = np.array([names.index(path), names.index(name)])
        weights = np.array([prior[path], apart[path]])
        variance = float(weights @ fit.covariance[np.ix_(both, both)] @ weights)
        own[name.removeprefix(UNDER)] = fit.values[path] * fit.values[name], float(np.sqrt(variance))
    return apart, own


def odd_feet(path: str, feet: Mapping[str, tuple[float, float]]) -> list[str]:
    """The foot whose number at a path lies farthest off those of all others, in the logarithm; of two feet both."""
    own = {name.partition(": ")[0]: np.log(value) for name, (value, _) in feet.items() if name.endswith(f": {path}")}
    middle = float(np.median(list(own.values())))
    return list(own) if len(own) == 2 else [max(own, key=lambda foot: abs(own[foot] - middle))]
