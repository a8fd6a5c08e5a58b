"""Which starts lead to which motion: runs from a box go on until they repeat, and settled ones are distinguished."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.spec import with_values
from tarsus.base.workers import Workers
from tarsus.model.scene import Scene
from tarsus.model.structure.walker import Walker
from tarsus.orbits.returns import drive_period
from tarsus.orbits.settling import Settling
from tarsus.orbits.starts import Box
from tarsus.plan.lowering import ahead_only
from tarsus.solve import SINGLE_RUN, Accuracy, Trajectories

Floats = NDArray[np.float64]

MOST_PERIODS = 480
"""Drive periods after which a run counts as not settled: a multiplier of 0.97 has made 1e-6 of a deviation by then."""

CHAOTIC, UNSETTLED, FAILED = -1, -2, -3
OTHERS = {
    CHAOTIC: "not settled: twins part, as in chaos",
    UNSETTLED: "not settled, and twins stay together",
    FAILED: "the run did not reach its end",
}
"""Labels of starts whose runs do not repeat."""


@dataclass(frozen=True)
class Survey:
    """Runs from the starts of a box, to be made until they repeat."""

    box: Box
    period: float
    threads: Workers

    @classmethod
    def of(cls, box: Box, threads: Workers) -> Survey:
        """Of a box, whose scene has a drive period."""
        return cls(box, drive_period(box.scene), threads)

    def settled(
        self, points: Floats, accuracy: Accuracy | None = None, progress: Callable[[int, int, str], None] | None = None
    ) -> Settling:
        """Runs from starts at points (nr, d) of the unit cube, after they have settled or not."""
        values = self.box.values(points)
        offset = np.mod(-self.box.late(points), self.period)
        longest = (MOST_PERIODS + 200) * self.period
        runs = Trajectories.of(self.box.scene, values, longest, accuracy=accuracy)
        ahead_only(runs.plan, "motions repeat")
        walks = isinstance(self.box.scene.robot.structure, Walker)
        made = Settling(runs, self.period, offset, walks, self.threads)
        made.settle(MOST_PERIODS, progress)
        return made

    def scene_at(self, point: Floats, periods: int) -> Scene:
        """The scene with the start at a point (d,) of the unit cube, which lasts so many drive periods."""
        values = {path: float(one[0]) for path, one in self.box.values(point[None]).items()}
        return with_values(self.box.scene, values | {"duration": periods * self.period})

    def known(self, settling: Settling, stand: Sequence[int], points: Floats) -> NDArray[np.intp]:
        """To which attractors, by the runs that stand for them, starts at points lead at the accuracy of single runs;
        -1 to none of them."""
        made = self.settled(points, SINGLE_RUN)
        return np.array(
            [next((i for i, r in enumerate(stand) if settling.alike(r, made, q)), -1) for q in range(len(points))]
        )


def motions_of(settling: Settling, chosen: NDArray[np.intp]) -> list[list[int]]:
    """Numbers of those of some settled runs that are one motion, for each motion, most first."""
    groups: list[list[int]] = []
    for r in chosen.tolist():
        own = next((one for one in groups if settling.alike(one[0], settling, r)), None)
        if own is None:
            groups.append([r])
        else:
            own.append(r)
    groups.sort(key=lambda one: (-len(one), one[0]))
    return groups


def classified(settling: Settling) -> tuple[NDArray[np.intp], list[NDArray[np.intp]]]:
    """Label of every run, and the numbers of those of each attractor, most first."""
    label = np.full(len(settling.runs), UNSETTLED, dtype=np.intp)
    groups = motions_of(settling, np.flatnonzero(settling.multiple))
    for i, one in enumerate(groups):
        label[one] = i
    label[~settling.runs.done] = FAILED
    open_ = np.flatnonzero(label == UNSETTLED)
    label[open_[settling.chaotic(open_)]] = CHAOTIC
    return label, [np.array(one) for one in groups]
