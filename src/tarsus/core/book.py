"""The contact modes that runs of one structure have met, with their step tables; the native engine keeps them."""

from __future__ import annotations

import math
from functools import partial
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.core import _native, nodes
from tarsus.core.modes import ContactMode, LinearSystem, unbiased_mode

Floats = NDArray[np.float64]

CLASSES = 48
"""Step lengths halve so often: a time within a run is known to 1e-16 of its end, and 2^-47 is 7e-15."""

NODES = _native.Nodes(nodes)


def step_lengths(horizon: float) -> Floats:
    """Step lengths (CLASSES,) [s]: the power of two at or above ``horizon`` and its halvings."""
    return 2.0 ** (math.ceil(math.log2(horizon)) - np.arange(CLASSES))


class ModeBook:
    """Contact modes of a linear structure, made when a run first meets them; safe between threads.

    lengths (nk,) [s] halve from entry to entry. rates: whether a law asks for gap rates at the nodes of a step.
    shared: the book of a structure that differs in rest gaps and gravity at most, whose tables serve this one as well.
    """

    def __init__(
        self, system: LinearSystem, lengths: Floats, rates: bool = True, *, shared: ModeBook | None = None
    ) -> None:
        self.lengths = np.ascontiguousarray(lengths, dtype=float)
        self.sources = system.sources
        self.slides = system.tangents is not None
        self._modes: list[ContactMode] = []
        self._lock = Lock()
        n, m = system.normals.shape
        tangents = np.zeros((0, n)) if system.tangents is None else np.ascontiguousarray(system.tangents.T)
        self.native: Any = shared.native if shared is not None else _native.Book(
            self.lengths, m, system.loads.shape[1], n, rates, tangents, NODES, nodes, partial(unbiased_mode, system)
        )  # fmt: skip

    @property
    def modes(self) -> list[ContactMode]:
        """The contact modes in the order in which they were met, by which recorded steps number them."""
        with self._lock:  # each is added once, whoever asks first
            met = self.native.modes
            self._modes += [mode.biased(self.sources) for mode in met[len(self._modes) :]]
            return self._modes

    def require(self, mask: int) -> int:
        """Number of the contact mode whose held constraints are the bits of ``mask``; made now if no run has met it."""
        return self.native.require(mask)
