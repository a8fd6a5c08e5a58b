"""What all feet of a robot do together: when one at least is on the ground, and when none is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.measure.history import Histories
from tarsus.measure.segments import Floats, Rows


@dataclass(frozen=True)
class Stays:
    """Instants of nr robots in time order, robot after robot: robot and time [s] (ni,), which foot's stay on the ground
    begins (1) or ends (-1) then, 0 for an instant that is asked about, and how many feet are down after it."""

    robot: Rows
    time: Floats
    step: NDArray[np.int64]
    down: NDArray[np.int64]
    order: Rows

    @classmethod
    def of(cls, histories: Histories, feet: int, height: float, robots: Rows, times: Floats) -> Stays:
        """Of robots with so many feet each, flights below ``height`` [m] being contact, and instants (nq,) of
        ``robots`` (nq,) that are asked about."""
        own, start, end = histories.contacts(height)
        robot = np.concatenate([own // feet, own // feet, robots])
        time = np.concatenate([start, end, times])
        step = np.repeat([1, -1, 0], [len(start), len(end), len(times)])
        order = np.lexsort((time, robot))  # of one instant what begins comes first: no gap where feet take turns
        step = step[order]
        return cls(robot[order], time[order], step, np.cumsum(step), order)

    def all_up(self) -> Floats:
        """Time (nq,) [s] that no foot was on the ground up to each of the instants that were asked about, from a moment
        on that is the same for all of one robot."""
        same = self.robot[1:] == self.robot[:-1]
        passed = np.where(same & (self.down[:-1] == 0), np.diff(self.time), 0.0)
        total = np.concatenate([np.zeros(min(len(self.time), 1)), np.cumsum(passed)])
        found = np.empty(len(total))
        found[self.order] = total
        return found[len(found) - int((self.step == 0).sum()) :]

    def longest(self, robots: int) -> Floats:
        """The longest time (nr,) [s] without a moment at which no foot is on the ground; 0 where none ever is."""
        before = self.down - self.step
        begin, end = (self.step > 0) & (before == 0), (self.step < 0) & (self.down == 0)
        found = np.zeros(robots)
        np.maximum.at(found, self.robot[end], self.time[end] - self.time[begin])
        return found
