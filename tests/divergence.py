"""Scenes moved by their last digits: whether runs of them stay together, and how fast they part.

A run is a function of numbers that nobody knows to sixteen digits. Where it decides by physical scales, moving them in
the fifteenth digit moves its events as little and changes none. Only where differences grow by themselves, as in chaos,
may two such runs part, and then they have grown before they do: `parting` tells the two apart.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

import tarsus as ts
from tarsus.base.spec import float_paths, get_value
from tarsus.solve.codes import CLOSED

MOVED = re.compile(
    r"robot\.(structure\.(mass|stiffness|damping|frequencies|damping_ratios|modal_masses|length|tip_length|tip_density)\b"
    r"|structure\.body\.(mass|roll_inertia|pitch_inertia)|structure\.legs\.[^.]+\.(mass|stiffness_|damping_)"
    r"|feet\.[^.]+\.gap|drives\.[^.]+\.law\.(gain|linear|quadratic|cubic))"
)
"""Paths of what is moved: structure, gaps and gains; not where feet stand, or those at one place would part."""
TOGETHER = 1e-9
"""Events of different feet that lie closer than this part of the run are simultaneous; their order means nothing."""
GROWN = 1e-7
"""Distance of two runs, relative to their motion, from which on events may differ: 1e6 times the larger move."""
TIMES = 400


def moved(scene: ts.Scene, size: float, seed: int) -> ts.Scene:
    """The scene with its structure, gaps and gains moved by up to ``size``, relative.

    Symmetric matrices stay so, and equal gaps equal: of two feet at one place the higher would never land.
    """
    changes: dict[str, Any] = {}
    for path in float_paths(scene):
        if not MOVED.match(path):
            continue
        matrix = re.fullmatch(r"(robot\.structure\.(?:mass|stiffness|damping))\.(\d+)\.(\d+)", path)
        key = f"{matrix[1]}.{sorted((int(matrix[2]), int(matrix[3])))}" if matrix else path
        value = get_value(scene, path)
        key = f"gap of {value!r}" if path.endswith(".gap") else key
        share = np.random.default_rng([seed, *key.encode()]).uniform(-1.0, 1.0)
        if value:
            changes[path] = value * (1.0 + size * share)
    return ts.with_values(scene, changes)


def sequence(events: np.ndarray, duration: float) -> list[tuple[int, int]]:
    """Kind and foot of every event in order of time; of simultaneous ones in order of feet."""
    group = np.concatenate([[0], np.cumsum(np.diff(events["time"]) > TOGETHER * duration)])[: len(events)]
    order = np.lexsort((np.arange(len(events)), events["foot"], group))
    return [(int(events["kind"][i]), int(events["foot"][i])) for i in order]


@dataclass(frozen=True)
class Pair:
    """Two runs that should be one."""

    one: ts.Run
    other: ts.Run

    @cached_property
    def differ(self) -> list[str]:
        """What differs of the two, in words: code, verdict of the ledger, sequence of events."""
        said = []
        if self.one.ended is not self.other.ended:
            said.append(f"ended {self.one.ended.name} and {self.other.ended.name}")
        closed = [bool(run.ledger.closure <= CLOSED) for run in (self.one, self.other)]
        if closed[0] != closed[1]:
            said.append(f"closure {self.one.ledger.closure:.1e} and {self.other.ledger.closure:.1e}")
        if np.isfinite(self.parted):
            said.append(f"events differ from {self.parted / self.one.duration:.4f} of the run on")
        return said

    @cached_property
    def parted(self) -> float:
        """When [s] the first event came that the other has not; infinite where they have the same."""
        said = [sequence(run.events, run.duration) for run in (self.one, self.other)]
        if said[0] == said[1]:
            return np.inf
        same = 0
        while same < min(map(len, said)) and said[0][same] == said[1][same]:
            same += 1
        times = [run.events["time"][same] for run in (self.one, self.other) if same < len(run.events)]
        return float(min(times))

    @cached_property
    def distances(self) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] up to the parting, and how far apart the runs had been by then: of their displacements, by mass,
        relative to the largest."""
        end = min(self.one.end_time, self.other.end_time, self.parted)
        times = np.linspace(0.0, end, TIMES)
        mass = self.one.plan.system.mass
        places = [run.at(times).state.x.T for run in (self.one, self.other)]

        def size(x: np.ndarray) -> np.ndarray:
            return np.sqrt(np.einsum("ti,ij,tj->t", x, mass, x))

        motion = size(places[0]).max(initial=0.0)
        apart = size(places[1] - places[0]) / (motion or 1.0)
        return times, np.maximum.accumulate(apart)

    @property
    def grown(self) -> float:
        """How far apart the two were before the first event that differs."""
        return float(self.distances[1][-1])

    @property
    def folds(self) -> float:
        """Growth of the distance over the run, as a number of e-folds: the exponent of divergence times the time, by
        least squares of the logarithm from where there is a distance at all."""
        times, apart = self.distances
        apart_at = apart > 0.0
        if apart_at.sum() < 3 or times[-1] <= 0.0:
            return 0.0
        rate = np.polyfit(times[apart_at], np.log(apart[apart_at]), 1)[0]
        return float(rate * (times[apart_at][-1] - times[apart_at][0]))

    @property
    def chaotic(self) -> bool:
        """Whether the two had parted by growth before any event differed."""
        return self.grown > GROWN and self.folds > 5.0

    def __str__(self) -> str:
        return f"{'; '.join(self.differ) or 'alike'}: {self.grown:.1e} apart by then, {self.folds:.1f} e-folds"
