"""Numbers of a walker and of the ground under it, from records of its body while it walks.

A walk forgets its start at every impact, so that one simulation of the whole record has a cost that no descent goes
down. Here the record is cut into windows with a start of their own each: a first pass goes through them in order, each
starting where the fit of the one before ended, and then all starts and the numbers that they share go down together,
the starts eliminated (`tarsus.fit.normal_equations`). Windows that the first pass does not follow count for less there,
by what they leave over the noise, and the two are repeated until every window is followed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.events import CONTACT_BEGINS
from tarsus.base.spec import get_value, with_values
from tarsus.fit.record_problem import RecordProblem, SeenRecord, Segment
from tarsus.fit.unknowns import Prior
from tarsus.fit.verdict import Verdict, verdict_of
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.plan.lowering import lower_scene
from tarsus.solve.contacts import Contacts
from tarsus.solve.window import Window, WindowStart, simulate_windows

Floats = NDArray[np.float64]

LOOSE = (20e-6, 0.1)
"""Standard deviations [m, m/s] of a start about the one before: wider than what any record leaves of a start that it
shows, so that only what no record shows, such as a foot's motion that has died away, stays where it was."""


@dataclass(frozen=True)
class WalkFit:
    """What a record determines.

    paths (np,); values (np,) [SI]; covariance (np, np) of the logarithms, what was known beforehand included; prior
    (np,): standard deviations of the logarithms beforehand; left (nw,): mean square of what each window leaves over the
    noise.
    """

    paths: tuple[str, ...]
    values: Floats
    covariance: Floats
    prior: Floats
    left: Floats

    def interval(self, path: str) -> tuple[float, float]:
        """95 % interval of a number [SI]."""
        j = self.paths.index(path)
        reach = float(np.exp(1.96 * np.sqrt(self.covariance[j, j])))
        return float(self.values[j]) / reach, float(self.values[j]) * reach

    def verdict(self, path: str) -> Verdict:
        """Whether the record determines a number."""
        j = self.paths.index(path)
        of_prior = float(np.sqrt(self.covariance[j, j]) / self.prior[j])
        return verdict_of(self.interval(path), of_prior=of_prior)


@dataclass(frozen=True)
class _Walk:
    """A record cut at edges (nw + 1,) [s]."""

    problem: RecordProblem
    edges: Floats

    def follow(self, moved: Floats) -> tuple[list[Segment], Floats]:
        """Segments in order, each from where the fit of the one before ended, and what each leaves (nw,), its mean
        square."""
        plan = lower_scene(with_values(self.problem.scenes[0], self.problem.values(moved)))
        loose = np.repeat(LOOSE, len(plan.system.mass))
        lead = simulate_windows(plan, [WindowStart(plan.initial, 0.0, [self.edges[0]])])[0]
        state, contacts = _end(lead, Contacts())
        segments, left = list[Segment](), np.zeros(len(self.edges) - 1)
        for w, (begin, end) in enumerate(pairwise(self.edges.tolist())):
            segment = Segment(0, begin, (begin, end), state, loose, contacts)
            found = self.problem.solve([segment], moved, known=True, rounds=3)
            segments += found.segments
            left[w] = np.nanmean(found.left[0])
            state, contacts = _end(found.windows[0], contacts)
        return segments, left


def _end(window: Window, before: Contacts) -> tuple[Floats, Contacts]:
    """State (2n,) at the end of a window, and which feet are held since when."""
    states, events = window.states, window.events
    held = [int(i) for i in np.flatnonzero(states.held[:, -1])]
    known = dict(zip(before.held, before.since or [], strict=False))
    begun = events[np.isin(events["kind"], CONTACT_BEGINS)]
    since = []
    for i in held:
        times = begun["time"][begun["foot"] == i]
        since.append(float(times[-1]) if len(times) else known.get(i, float(window.times[0])))
    return np.concatenate([states.x[:, -1], states.v[:, -1]]), Contacts(held, since)


def identify_walk(
    scene: Scene,
    record: SeenRecord,
    spread: Mapping[str, float],
    *,
    begin: float,
    window: float,
    passes: int = 3,
) -> WalkFit:
    """Find numbers of a walker and its ground from a record that begins with its drives.

    Parameters
    ----------
    scene
        The robot as far as it is known, with the drives of the record.
    record
        Its channels, which must show the body's motion: displacement and velocity.
    spread
        Paths of what is not known exactly, with standard deviations of their logarithms.
    begin
        Time [s] at which the first window begins; before, the scene is simulated from its own start.
    window
        Length [s] of a window at most: a touchdown or two. Longer ones show friction and adhesion better, and
        are not followed from numbers that are far off.
    passes
        How often windows are followed and numbers found.

    Raises
    ------
    InputError
        For a robot that is no walker, and a record that is shorter than a window.
    """
    if not isinstance(scene.robot.structure, Walker):
        raise InputError("walks are identified of walkers: the structure is of another kind")
    end = float(record.times[-1])
    if end - begin < window:
        raise InputError(
            f"the record ends at {end:g} s, less than a window of {window:g} s after {begin:g} s"
        )
    sigma = np.array(list(spread.values()))
    priors = {
        path: Prior(float(get_value(scene, path)), factor=float(np.exp(one))) for path, one in spread.items()
    }
    edges = np.linspace(begin, end, int(np.ceil((end - begin) / window - 1e-9)) + 1)
    problem = RecordProblem((scene,), (record,), priors)
    walk, moved = _Walk(problem, edges), np.zeros(len(sigma))
    segments, left = walk.follow(moved)
    covariance = np.diag(sigma**2)
    for _ in range(passes):
        found = problem.solve(segments, moved, weights=1.0 / np.sqrt(np.maximum(1.0, left)), rounds=8)
        moved, covariance = found.moved, found.covariance * np.outer(sigma, sigma)
        segments, left = walk.follow(moved)
    return WalkFit(tuple(spread), np.array(list(found.values.values())), covariance, sigma, left)
