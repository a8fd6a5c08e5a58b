"""Where a walk is cut into windows: between contacts, never within one.

A window that ends while a foot bounces gives the next one a start that a step of the impact's time changes by more than
any noise; between contacts, in flight or standing, a start moves smoothly with everything.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import CONTACT_BEGINS, IMPACTS
from tarsus.model.structure import Walker

Floats = NDArray[np.float64]

QUIET = 2.0
"""Contact times without any event that part two contacts: within a contact, while a foot is held, one passes."""
SOON = 3.0
"""Contact times after the first contact within which one is cut that never is so quiet: what is longer is not followed
from numbers that are far off."""
AHEAD = 20.0
"""Contact times that are looked ahead; a window without any contact is that long."""


def contact_time(walker: Walker) -> float:
    """How long the body's mass stands on its softest leg at a bounce [s]: half a period of one on the other."""
    softest = min(leg.stiffness_v for leg in walker.legs.values() if leg.stiffness_v > 0.0)
    return float(np.pi * np.sqrt(walker.body.mass / softest))


def edge_after(events: NDArray[np.void], begin: float, end: float, contact: float) -> float:
    """Where a window that begins at ``begin`` ends, by the events of its predicted motion up to ``end`` [s].

    In the middle of the first stretch after a contact that is quiet for so long; where there is none, of the longest
    one that begins within `SOON` contact times of the first contact; without any contact at the end.
    """
    times = np.unique(np.asarray(events["time"], dtype=float))
    times = times[(times > begin) & (times < end)]
    landed = np.asarray(events["time"], dtype=float)[np.isin(events["kind"], (*IMPACTS, *CONTACT_BEGINS))]
    landed = landed[(landed > begin) & (landed < end)]
    if not len(landed):
        return end
    first = landed.min()
    bounds = np.append(times[times >= first], end)
    quiet, middle = np.diff(bounds), 0.5 * (bounds[:-1] + bounds[1:])
    found = np.flatnonzero(quiet >= QUIET * contact)
    if len(found):
        return float(middle[found[0]])
    soon = bounds[:-1] <= first + SOON * contact
    return float(middle[np.argmax(np.where(soon, quiet, -1.0))])
