"""The events of a period that distinguish one motion from another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import EventKind

ACCUMULATED = (EventKind.REST, EventKind.AVERAGED_CONTACT)
"""Kinds of contact in which infinitely many bounces end."""


def kept_events(events: NDArray[np.void]) -> list[int]:
    """Numbers of the events of a period that distinguish one motion from another, in order.

    Bounces that accumulate to a rest are none of their own: how many of infinitely many are resolved says nothing.
    """
    foot, kind, out = events["foot"].tolist(), events["kind"].tolist(), list[int]()
    for i in range(len(foot)):
        if kind[i] in ACCUMULATED:
            while own := [k for k in out if foot[k] == foot[i]]:
                if kind[own[-1]] != EventKind.BOUNCE:
                    break
                out.remove(own[-1])
        out.append(i)
    return out


def sequence_of(events: NDArray[np.void]) -> tuple[tuple[int, int], ...]:
    """(foot, kind) of the events of a period that distinguish one motion from another, in order."""
    kept = events[kept_events(events)]
    return tuple(zip(kept["foot"].tolist(), kept["kind"].tolist(), strict=True))
