"""Between the events: states at any time and energies from the recorded steps of a run, which the engine solves again.

A recorded step holds its start state and the nodal inputs the engine applied. Nothing is interpolated: what is found of
them is the engine's own solution (`native/record`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.core import _native
from tarsus.core.modes import NODES, ModeBook

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


@dataclass(frozen=True)
class Integrals:
    """Energies up to the end of each recorded step, cumulative.

    time (nr,) [s]; energies (ENERGIES + np, nr) [J]: as the account of a walker has them (`tarsus.core.arrays`), and what of
    them single laws have done, of those that act together all but the last, resistive ones first. swing (m,) [m]: between
    the lowest and the highest gap of each foot at the starts of the steps.
    """

    time: Floats
    energies: Floats
    swing: Floats


def integrate(book: ModeBook, trace: Floats, acting: tuple[Any, Any, Any] | None = None) -> Integrals:
    """Energies of a recorded run of the structure of a book, with its rest gaps and gravity.

    trace (nr, width): rows as the engine records them; acting: the engine's signals and laws, and the run's row of data,
    by which it is known what drives and laws there are, and laws that act together have their shares.
    """
    system = book.system
    n, m = system.normals.shape
    parts = (system.damping, system.normals.T, system.loads.T, system.constant, system.constraints.T[m:].reshape(-1, n))
    carriers = tuple(np.ascontiguousarray(one, dtype=float) for one in parts)
    rows, swing = _native.energies_modal(
        book.native, NODES, carriers, np.ascontiguousarray(system.sources), np.ascontiguousarray(trace), acting
    )
    time, work, damping, resistive, smooth, friction, *shares = rows.T
    return Integrals(time, np.vstack([work, damping, -resistive, smooth, -friction, *shares]), swing)


def sample(sources: Floats, book: ModeBook, trace: Floats, times: Floats) -> SampledStates:
    """States and forces at ``times`` [s] by the recorded steps; times outside the run take its nearest recorded state.

    sources (m + 2,): rest gaps [m] and gravity [m/s^2] of the run.
    """
    m = len(sources) - 2
    given = (np.ascontiguousarray(one, dtype=float) for one in (sources, trace, times))
    return shown_states(_native.sample_modal(book.native, NODES, *given), m, book.slides)


def shown_states(rows: Floats, m: int, slides: bool) -> SampledStates:
    """Samples (nt, width) of the engine's of m feet, which know their way along the ground or not."""
    kinds = 7 if slides else 6
    motion, feet = np.split(rows.T, [rows.shape[1] - kinds * m])
    x, v = np.split(motion, 2)
    gap, rate, resistive, smooth, pull, contact, *friction = feet.reshape(kinds, m, len(rows))
    along = (contact, friction[0]) if friction else ()
    return SampledStates(x, v, gap, rate, resistive, smooth, pull, contact > 0.0, *along)
