"""The events of a period that distinguish one motion from another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import EventKind

ACCUMULATED = (EventKind.REST, EventKind.AVERAGED_CONTACT)
"""Kinds of contact in which infinitely many bounces end."""


def kept_events(events: NDArray[np.void]) -> list[int]:
    """Numbers of the events of a period that distinguish one motion from another, in order.

    Bounces that accumulate to a rest are none of their own: how many of infinitely many are resolved says nothing.
    """
    return _kept(events["foot"].tolist(), events["kind"].tolist())


def sequence_of(events: NDArray[np.void]) -> tuple[tuple[int, int], ...]:
    """(foot, kind) of the events of a period that distinguish one motion from another, in order."""
    return sequence(events["foot"].tolist(), events["kind"].tolist())


def sequence(foot: Sequence[int], kind: Sequence[int]) -> tuple[tuple[int, int], ...]:
    """The same by foot and kind of each event."""
    return tuple((foot[i], kind[i]) for i in _kept(foot, kind))


def _kept(foot: Sequence[int], kind: Sequence[int]) -> list[int]:
    out: list[int] = []
    for i in range(len(foot)):
        if kind[i] in ACCUMULATED:
            while own := [k for k in out if foot[k] == foot[i]]:
                if kind[own[-1]] != EventKind.BOUNCE:
                    break
                out.remove(own[-1])
        out.append(i)
    return out
