"""Normal equations of a chain: a link has unknowns of its own, which meet those of the next one, and all share some.

Links are eliminated one after the other, so that the cost of a step grows with the number of links and not with its
cube, as that of one dense system does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.fit.normal_equations import RIDGE, ridged


class Eliminated(NamedTuple):
    """A chain without its own unknowns: information (p, p) and score (p,) of the shared ones; of each link how its own
    ones follow from the next link's (n, q, q), from the shared ones (n, q, p), and where they lie without both (n, q).
    """

    information: Floats
    score: Floats
    onward: Floats
    across: Floats
    own: Floats

    def followed(self, shared: Floats) -> Floats:
        """Own unknowns (n, q) for a step of the shared ones (p,)."""
        out = self.own - self.across @ shared
        for k in range(len(out) - 2, -1, -1):
            out[k] -= self.onward[k] @ out[k + 1]
        return out

    @property
    def taken(self) -> Floats:
        """By how much own unknowns (n, q, p) go back where a shared one moves by one."""
        out = self.across.copy()
        for k in range(len(out) - 2, -1, -1):
            out[k] -= self.onward[k] @ out[k + 1]
        return out


@dataclass(frozen=True)
class ChainEquations:
    """Normal equations of n links with q own unknowns each and p that all share.

    own (n, q, q), onward (n, q, q): of a link's own unknowns and those of the next one, zero where a chain ends;
    across (n, q, p), shared (p, p): products of the slopes; right_own (n, q), right_shared (p,): of slopes and
    residuals, downhill; cost: sum of squared residuals; freedom: how many of these there are beyond own unknowns.
    """

    own: Floats
    onward: Floats
    across: Floats
    shared: Floats
    right_own: Floats
    right_shared: Floats
    cost: float
    freedom: float

    @property
    def scale(self) -> float:
        """Squared scatter of the residuals over their noise, at least 1."""
        return max(1.0, self.cost / max(self.freedom, 1.0))

    def eliminated(self, damping: float = 0.0) -> Eliminated:
        """The shared unknowns alone; damping: share of its diagonal that is added to the own ones' part."""
        n, q, p = self.across.shape
        onward, across, own = np.zeros((n, q, q)), np.zeros((n, q, p)), np.zeros((n, q))
        information, score = self.shared.copy(), self.right_shared.copy()
        before = np.zeros((q, q)), np.zeros((q, p)), np.zeros(q)
        own_ridged = ridged(self.own, RIDGE + damping)
        for k in range(n):
            matrix = own_ridged[k] - before[0]
            met, right = self.across[k] - before[1], self.right_own[k] - before[2]
            solved = np.linalg.solve(matrix, np.hstack([self.onward[k], met, right[:, None]]))
            onward[k], across[k], own[k] = solved[:, :q], solved[:, q : q + p], solved[:, -1]
            information -= met.T @ across[k]
            score -= met.T @ own[k]
            back = self.onward[k].T @ solved
            before = back[:, :q], back[:, q : q + p], back[:, -1]
        return Eliminated(information, score, onward, across, own)

    def step(self, damping: float, information: Floats, right: Floats) -> tuple[Floats, Floats]:
        """Steps of the own unknowns (n, q) and of the shared ones (p,); information (p, p) and right (p,): what is
        known of the shared ones besides, and which way that pulls."""
        left = self.eliminated(damping)
        whole = ridged(left.information[None], RIDGE + damping)[0] + information
        shared = np.asarray(np.linalg.solve(whole, left.score + right), dtype=np.float64)
        return left.followed(shared), shared

    def length(self, information: Floats, right: Floats) -> float:
        """How many standard errors long an undamped step is, squared, by the scatter of the residuals."""
        own, shared = self.step(0.0, information, right)
        long = float(np.sum(own * self.right_own) + shared @ (self.right_shared + right))
        return max(long, 0.0) / self.scale
