"""Laws from voltage to force: linear, the printed two branches (2.9), and the closed hysteresis operator."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from tarsus.base.spec import quantity
from tarsus.model.drive.hysteresis import PrandtlIshlinskii, fit_branches
from tarsus.model.drive.law import Cubic, VoltageLaw
from tarsus.model.drive.parts import Parts, whole_parts
from tarsus.model.drive.plays import last_directions, visited
from tarsus.model.drive.track import Track

__all__ = [
    "Cubic",
    "ForceLaw",
    "LinearForce",
    "PrandtlIshlinskii",
    "TwoBranch",
    "VoltageLaw",
    "fit_branches",
]

Floats = NDArray[np.float64]


class LinearForce(VoltageLaw):
    """Force = offset + gain V."""

    kind: Literal["linear"] = "linear"
    gain: float = quantity("N/V", "force per volt")
    offset: float = quantity("N", "force at 0 V", default=0.0)

    @property
    def has_memory(self) -> bool:
        """False."""
        return False

    def force(self, volts: ArrayLike, history: Sequence[float] = ()) -> Floats:
        """Force [N] at `volts` [V], any shape."""
        return self.offset + self.gain * np.asarray(volts, dtype=np.float64)

    def parts(self, track: Track, history: Sequence[float]) -> Parts:
        """One part for each stretch."""
        return whole_parts(track, np.array([self.offset, self.gain, 0.0, 0.0]))


class TwoBranch(VoltageLaw):
    """One cubic while the voltage rises, another while it falls: equation (2.9) as printed.

    The branch is that of the last change of the voltage; plateaus keep it, a jump counts as a change.
    Before any change the falling branch holds (the drive has been poled). Where the branches do not meet
    the force jumps as the voltage turns, and there are no minor loops (erratum E5): `PrandtlIshlinskii` has
    neither defect.
    """

    kind: Literal["two_branch"] = "two_branch"
    rising: Cubic
    falling: Cubic

    def force(self, volts: ArrayLike, history: Sequence[float] = ()) -> Floats:
        """Force (N,) [N] along a sequence of voltages (N,) [V], on the branch by which each was reached."""
        past = visited(history)
        v = np.atleast_1d(np.asarray(volts, dtype=np.float64))
        way = np.concatenate([past, v])
        branch = last_directions(np.diff(way), -1.0, np.abs(way).max())[len(past) - 1 :]
        return np.where(branch > 0.0, self.rising(v), self.falling(v))

    def parts(self, track: Track, history: Sequence[float]) -> Parts:
        """One part for each stretch, on the branch of its direction."""
        past = visited(history)
        largest = max(float(np.abs(one).max(initial=0.0)) for one in (past, track.first, track.last))
        before = last_directions(np.diff(past), -1.0, largest)[-1] if len(past) > 1 else -1.0
        moves = np.empty(2 * track.count)
        moves[0::2] = track.first - np.append(past[-1], track.last[:-1])
        moves[1::2] = track.last - track.first
        branch = last_directions(moves, float(before), largest)[1::2]
        law = np.where((branch > 0.0)[:, None], self.rising.coefficients(), self.falling.coefficients())
        kink = track.kink.copy()
        kink[1:] |= branch[1:] != branch[:-1]
        if track.periodic:
            kink[track.loop] |= branch[track.loop] != branch[-1]  # holds for the wrap as well
        return whole_parts(track, law, kink)


ForceLaw = Annotated[LinearForce | TwoBranch | PrandtlIshlinskii, Field(discriminator="kind")]
"""Any law from volts to force; `kind` tells which."""
