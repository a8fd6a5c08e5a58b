"""The printed law of two branches, (2.9)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.arrays import Floats
from tarsus.base.columns import columns
from tarsus.model.drive.law import Cubic, VoltageLaw
from tarsus.model.drive.parts import Parts, whole_parts
from tarsus.model.drive.plays import ROUNDING, last_directions, visited
from tarsus.model.drive.track import Track


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
        steps, ends = np.diff(way), np.full(len(way) - 1, np.abs(way).max())
        since = np.zeros(len(steps), dtype=np.intp)
        branch = last_directions(steps, -np.ones(len(steps)), ends, since)[len(past) - 1 :]
        return np.where(branch > 0.0, self.rising(v), self.falling(v))

    def small_signal_gain(self) -> Floats:
        """The mean slope of the branches: half their difference is what the direction of the last change has left."""
        mean = 0.5 * (self.rising.coefficients() + self.falling.coefficients())
        return mean[1:] * np.arange(1.0, 4.0)

    def parts(self, track: Track, history: Sequence[float]) -> Parts:
        """One part for each stretch, on the branch of its direction."""
        rising = self._rises(track, history)
        law = np.where(rising[:, None], *(track.of_run(one.coefficients()) for one in (self.rising, self.falling)))
        changed = rising != rising[track.before()]
        fresh = track.runs[:-1]
        changed[fresh[track.loops != 0]] = False
        kink = track.kink | changed
        again = np.flatnonzero(track.loops > 0)  # where a run repeats from: also on the way back
        loop = fresh[again] + track.loops[again]
        kink[loop] |= rising[loop] != rising[track.runs[again + 1] - 1]
        return whole_parts(track, law, kink)

    def _rises(self, track: Track, history: Sequence[float]) -> NDArray[np.bool_]:
        """Whether each stretch (S,) is on the rising branch."""
        past = columns((0.0, *history))
        past = np.broadcast_to(past, (len(track.loops), past.shape[-1]))
        ways = np.abs(np.stack([track.first, track.last], axis=1)).max(axis=1)
        largest = np.maximum(np.maximum.reduceat(ways, track.runs[:-1]), np.abs(past).max(axis=1))
        before = -np.ones(len(past))
        for step in np.diff(past, axis=1).T:
            before = np.where(np.abs(step) > ROUNDING * largest, np.sign(step), before)
        since = track.last[track.before()]
        since[track.runs[:-1]] = past[:, -1]
        moves = np.stack([track.first - since, track.last - track.first], axis=1).ravel()
        of, begin = np.repeat(track.run, 2), np.repeat(2 * track.runs[track.run], 2)
        return last_directions(moves, before[of], largest[of], begin)[1::2] > 0.0
