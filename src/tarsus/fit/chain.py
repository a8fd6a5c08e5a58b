"""Sets that follow the likelihood: differential-evolution Markov chains.

emcee, which has the same move (``moves.DEMove``), makes long chains from anywhere, where a cost that takes a second
leaves room for a few generations from known good points.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tarsus.base.arrays import Floats

JUMP = 5
"""Every fifth generation takes whole differences, which carry a chain from one mode to another (ter Braak 2006)."""
BURNT = 3
"""The first third of the states is dropped: the start is spread over the likelihood already."""
MIXED = 1.5
"""Largest `mixing` of chains that say how wide a likelihood is: smooth ones of four unknowns come below it in 20
generations, of eight in 40. Where bounces make the likelihood rugged, chains were at 1.9 after 10, and held a number
within 5 % that 60 leave open to a factor of 10."""


def mixing(states: Floats, chains: int) -> float:
    """Spread between so many chains compared with that of each: R-hat of Gelman and Rubin (Stat. Sci. 7, 1992), the
    largest of the unknowns, 1 where all have seen the whole likelihood; states (n, nu) as `chain` gives them."""
    own = states.reshape(-1, chains, states.shape[1])
    within, between = own.var(axis=0, ddof=1).mean(axis=0), own.mean(axis=0).var(axis=0, ddof=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.sqrt(1.0 - 1.0 / len(own) + np.nan_to_num(between / within, nan=np.inf).max()))


def chain(
    costs: Callable[[Floats], Floats], start: Floats, generations: int, rng: np.random.Generator, scale: float = 1.0
) -> Floats:
    """States (n, nu) of chains in the unit cube whose density is exp(-cost / (2 scale)), each as often as a chain was
    in it (ter Braak, Stat. Comput. 16, 2006); points that leave the cube are reflected at its sides.

    Parameters
    ----------
    costs
        Costs (m,) of points (m, nu).
    start
        First states (m, nu), spread over what is likely.
    generations
        How often every chain is moved.
    rng
        Of all that is random.
    scale
        Cost that counts as one half of a squared standard deviation.
    """
    now, nu = start, start.shape[1]
    now_cost = costs(now)
    states = [now]
    for generation in range(generations):
        gamma = 1.0 if generation % JUMP == JUMP - 1 else 2.38 / np.sqrt(2.0 * nu)
        pairs = np.array([rng.choice(len(now), 2, replace=False) for _ in now])
        moved = np.abs(now + gamma * (now[pairs[:, 0]] - now[pairs[:, 1]]) + rng.normal(0.0, 1e-3, now.shape))
        moved = np.where(moved > 1.0, 2.0 - moved, moved).clip(0.0, 1.0)
        cost = costs(moved)
        taken = np.log(rng.random(len(now))) < (now_cost - cost) / (2.0 * scale)
        now, now_cost = np.where(taken[:, None], moved, now), np.where(taken, cost, now_cost)
        states.append(now)
    return np.concatenate(states[len(states) // BURNT :])
