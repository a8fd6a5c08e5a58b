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
AHEAD = 20.0
"""Contact times that are looked ahead; a window without any contact is that long."""


def contact_time(walker: Walker) -> float:
    """How long the body's mass stands on its softest leg at a bounce [s]: half a period of one on the other."""
    softest = min(leg.stiffness_v for leg in walker.legs.values() if leg.stiffness_v > 0.0)
    return float(np.pi * np.sqrt(walker.body.mass / softest))


def edge_after(events: NDArray[np.void], begin: float, end: float, contact: float) -> float:
    """Where a window that begins at ``begin`` ends, by the events of its predicted motion up to ``end`` [s].

    In the middle of the first stretch after a contact that is quiet for so long; where there is none, of the longest
    one in the later half; without any event at the end.
    """
    times = np.unique(np.asarray(events["time"], dtype=float))
    times = times[(times > begin) & (times < end)]
    landed = np.asarray(events["time"], dtype=float)[np.isin(events["kind"], (*IMPACTS, *CONTACT_BEGINS))]
    landed = landed[landed > begin]
    if not len(times):
        return end
    bounds = np.append(times, end)
    quiet, middle = np.diff(bounds), 0.5 * (bounds[:-1] + bounds[1:])
    after = bounds[:-1] >= landed.min(initial=np.inf)
    found = np.flatnonzero(after & (quiet >= QUIET * contact))
    if len(found):
        return float(middle[found[0]])
    later = middle >= 0.5 * (begin + end)
    return float(middle[np.argmax(np.where(later, quiet, -1.0))]) if later.any() else end
