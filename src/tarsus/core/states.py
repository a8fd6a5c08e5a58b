"""States of a structure at sample times, as the engine by contact modes samples them (`native/modal/samples.hpp`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SampledStates:
    """State of a run at sample times: x, v (n, nt); gap, rate, resistive, smooth, pull (m, nt); held (m, nt) bool.

    resistive, smooth [N]: force on a free foot, as applied; pull [N]: structure's pull on a held foot. Of feet that know
    their way along the ground also contact, friction (m, nt): state as in `tarsus.base.events.FootState`, and friction on
    the foot along the ground [N].
    """

    x: Floats
    v: Floats
    gap: Floats
    rate: Floats
    resistive: Floats
    smooth: Floats
    pull: Floats
    held: NDArray[np.bool_]
    contact: Floats | None = None
    friction: Floats | None = None

    def part(self, at: slice | NDArray[np.intp]) -> SampledStates:
        """At some of the times."""
        along = (None if one is None else one[:, at] for one in (self.contact, self.friction))
        feet = (one[:, at] for one in (self.gap, self.rate, self.resistive, self.smooth, self.pull))
        return SampledStates(self.x[:, at], self.v[:, at], *feet, self.held[:, at], *along)


def states_of(samples: Floats, n: int, m: int, slides: bool) -> tuple[SampledStates, Floats]:
    """States by samples (nt, width) of n coordinates and m feet, which know their way along the ground or not, and what
    is behind these: energies (., nt) up to then."""
    kinds = 7 if slides else 6
    x, v, feet, energies = np.split(samples.T, [n, 2 * n, 2 * n + kinds * m])
    gap, rate, resistive, smooth, pull, contact, *friction = feet.reshape(kinds, m, len(samples))
    along = (contact, friction[0]) if friction else ()
    return SampledStates(x, v, gap, rate, resistive, smooth, pull, contact > 0.0, *along), energies
