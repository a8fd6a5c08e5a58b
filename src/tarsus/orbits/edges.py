"""What lies between two basins: two starts, next to each other, that lead to different attractors.

Starts are bisected on the line between two of the box until they are `CLOSEST` apart. Both then follow one motion for a
while: the edge state, an unstable orbit whose only growing deviation leads to either side; or they part at once, where
one foot lands, is held or slips in one run and not in the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.events import EVENT_WORDS
from tarsus.orbits.basins import Survey
from tarsus.orbits.orbit import NEAR, Orbit, orbit_after
from tarsus.solve import SINGLE_RUN, simulate_batch
from tarsus.tables.numbers import amount

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.orbits.settling import Settling

Floats = NDArray[np.float64]

CLOSEST = 1e-10
"""Distance of starts, of the line between two, at which bisection ends: below, a run's own errors decide where it
leads."""
WATCHED = 120
"""Drive periods in which two neighbours part: a growth of 1.25 a period makes 1e-10 a difference of 1."""
MULTIPLES = (1, 2, 3, 4)
"""Multiples of the drive period that the motion at an edge is looked for with."""
TRIED = 8
"""Pairs of starts, closest first, between which an edge of two basins is looked for: others may lie between them."""
TOGETHER = 1e-2
"""Difference in time, of a drive period, up to which events of two runs are the same."""


@dataclass(frozen=True)
class Edge:
    """Between the basins of two attractors, by their numbers.

    points (2, d): starts in the unit cube of the box on either side; width: their distance; parting: the first event in
    which their runs differ, in words; together: drive periods until then; orbit: the unstable motion both follow until
    then, None where none was found.
    """

    between: tuple[int, int]
    points: Floats
    width: float
    parting: str
    together: int
    orbit: Orbit | None

    def to_dict(self) -> dict[str, object]:
        """Plain data; attractors are numbered from 1."""
        return {
            "between": [one + 1 for one in self.between],
            "points": self.points.tolist(),
            "width": self.width,
            "parting": self.parting,
            "together": self.together,
            "orbit": None if self.orbit is None else self.orbit.to_dict(),
        }


def edges_of(
    survey: Survey,
    settling: Settling,
    points: Floats,
    label: NDArray[np.intp],
    progress: Callable[[int, int, str], None] | None = None,
) -> tuple[Edge, ...]:
    """An edge of every basin towards the start next to it that leads to another one.

    points (nr, d): starts in the unit cube; label (nr,): the attractor that each leads to, below 0 to none.
    """
    ends: dict[tuple[int, int], tuple[int, int]] = {}
    for i in range(int(label.max()) + 1):
        own, others = np.flatnonzero(label == i), np.flatnonzero((label >= 0) & (label != i))
        apart = np.linalg.norm(points[own][:, None] - points[others][None], axis=2)
        a, b = np.unravel_index(int(np.argmin(apart)), apart.shape)
        start, other = int(own[a]), int(others[b])
        pair = (min(i, int(label[other])), max(i, int(label[other])))
        ends.setdefault(pair, (start, other))
    low, high = (points[[side[i] for side in ends.values()]] for i in (0, 1))
    own = label[[side[0] for side in ends.values()]]
    tell = progress or (lambda done, total, what: None)
    stand = [int(np.flatnonzero(label == i)[0]) for i in range(int(label.max()) + 1)]
    found = _bisected(survey, settling, stand, own, low, high, tell)
    edges = []
    for i, one in enumerate(found):
        tell(i, len(found), "unstable motions at edges of basins")
        edges.append(_edge(survey, *one))
    return tuple(edges)


def edge_between(
    survey: Survey, settling: Settling, points: Floats, label: NDArray[np.intp], pair: tuple[int, int]
) -> Edge | None:
    """An edge of the basins of two attractors, by their numbers; None where between the `TRIED` closest pairs of starts
    the first basin ends at another one.

    settling: a run of each attractor, in order; points, label: as `edges_of`.
    """
    one, other = (np.flatnonzero(label == i) for i in pair)
    apart = np.linalg.norm(points[one][:, None] - points[other][None], axis=2)
    a, b = np.unravel_index(np.argsort(apart, axis=None)[:TRIED], apart.shape)
    own = np.full(len(a), pair[0], dtype=np.intp)
    stand, low, high = range(len(settling.runs)), points[one[a]], points[other[b]]
    found = _bisected(survey, settling, stand, own, low, high, lambda done, total, what: None)
    return next((_edge(survey, between, ends) for between, ends in found if between == pair), None)


def _bisected(
    survey: Survey,
    settling: Settling,
    stand: Sequence[int],
    own: NDArray[np.intp],
    low: Floats,
    high: Floats,
    tell: Callable[[int, int, str], None],
) -> list[tuple[tuple[int, int], Floats]]:
    """Starts on either side of every edge, and where they lead: all edges are bisected together.

    stand: a run of every attractor; low, high (ne, d): starts that lead to the attractors ``own`` (ne,), and ones that
    lead elsewhere.
    """
    beyond = survey.known(settling, stand, high)
    halvings = round(-np.log2(CLOSEST))
    for i in range(halvings):
        tell(i, halvings, "edges of basins, by bisection")
        middle = 0.5 * (low + high)
        leads = survey.known(settling, stand, middle)
        inside = leads == own
        low[inside], high[~inside], beyond[~inside] = middle[inside], middle[~inside], leads[~inside]
    return [((int(a), int(b)), np.stack([x, y])) for a, b, x, y in zip(own, beyond, low, high, strict=True) if b >= 0]


def _edge(survey: Survey, between: tuple[int, int], points: Floats) -> Edge:
    """What parts two neighbouring starts, and what they do before."""
    values = survey.box.values(points)
    both = simulate_batch(survey.box.scene, values, WATCHED * survey.period, threads=1, accuracy=SINGLE_RUN)
    parting, time = _parting(both.events(0), both.events(1), survey)
    together = int(time / survey.period)
    width = float(np.linalg.norm(points[1] - points[0]))
    return Edge(
        between, points, width, parting, together, _unstable(survey.scene_at(points[0], together + 1), together)
    )


def _unstable(scene: Scene, together: int) -> Orbit | None:
    """The unstable orbit that a run follows before it leaves it. It comes nearest to it some time before it is seen to
    leave: that time is tried from late to early."""
    for early in range(1, together):
        try:
            orbit = orbit_after(scene, together - early, MULTIPLES, free=True, near=NEAR)
        except InputError:
            return None
        if orbit is not None and not orbit.stable:
            return orbit
    return None


def _parting(one: np.ndarray, other: np.ndarray, survey: Survey) -> tuple[str, float]:
    """The first event in which two runs differ, in words, and when it is [s]."""
    feet = list(survey.box.scene.robot.feet)
    for a, b in zip(one, other, strict=False):
        late = abs(a["time"] - b["time"]) > TOGETHER * survey.period
        if (a["foot"], a["kind"]) != (b["foot"], b["kind"]) or late:
            words = [f"{feet[e['foot']]} {EVENT_WORDS[int(e['kind'])]}" for e in (a, b)]
            time = float(min(a["time"], b["time"]))
            said = f"{words[0]} against {words[1]}" if words[0] != words[1] else f"{words[0]}, at other times"
            return f"{said}, after {amount(time, 's')}", time
    return "no event", float(min(one["time"][-1:].sum(), other["time"][-1:].sum()))
