"""Numbers of a walker and of the ground under it, from records of its body while it walks.

A walk forgets its start at every impact, so that one simulation of the whole record has a cost that no descent goes
down. Here the record is cut into windows with a start of their own each: a first pass goes through them in order, each
starting where the fit of the one before ended, and then all starts and the numbers that they share go down together,
the starts eliminated (`tarsus.fit.normal_equations`). Windows that the first pass does not follow count for less there,
by what they leave over the noise, and the two are repeated until every window is followed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.events import CONTACT_BEGINS
from tarsus.base.spec import get_value, with_values
from tarsus.fit.normal_equations import Descent, NormalEquations, descend
from tarsus.fit.verdict import Verdict, verdict_of
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.plan.lowering import Plan, lower_scene
from tarsus.solve.contacts import Contacts
from tarsus.solve.window import Window, WindowBatch, WindowGradients, WindowStart, simulate_windows

Floats = NDArray[np.float64]

LENGTH, SPEED = 1e-6, 1e-3
"""Units of displacements and velocities of a start: a step of a small walker, and what its body has at it."""
LOOSE = (20.0, 100.0)
"""Standard deviations, in these units, of a start about the one before: wider than what any record leaves of a start
that it shows, so that only what no record shows, such as a foot's motion that has died away, stays where it was."""
FAR = 0.5
"""Longest step of the logarithm of a number."""


@dataclass(frozen=True)
class WalkRecord:
    """Channels of a walk: times (nt,) [s] after the start of the drives, in order; rows (nc, 2n): what each channel has
    of displacements and velocities; values (nc, nt); noise (nc,): standard deviations.

    Raises
    ------
    InputError
        If shapes do not fit each other, or a noise is not positive.
    """

    times: Floats
    rows: Floats
    values: Floats
    noise: Floats

    def __post_init__(self) -> None:
        shape = len(self.rows), len(self.times)
        if self.values.shape != shape or self.noise.shape != shape[:1] or not np.all(self.noise > 0.0):
            raise InputError(f"expected values of shape {shape} and {shape[0]} noises above 0")


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


@dataclass
class _Walk:
    """A record cut at edges (nw + 1,) [s], and the numbers of its scene with their spread beforehand."""

    scene: Scene
    record: WalkRecord
    edges: Floats
    paths: tuple[str, ...]
    spread: Floats
    starts: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    contacts: list[Contacts] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.first = np.log([float(get_value(self.scene, path)) for path in self.paths])
        n = len(lower_scene(self.scene).system.mass)
        self.scale = np.repeat([LENGTH, SPEED], n)
        self.loose = np.repeat(LOOSE, n)

    def plan(self, moved: Floats) -> tuple[Scene, Plan]:
        values = np.exp(self.first + moved).tolist()
        scene = with_values(self.scene, dict(zip(self.paths, values, strict=True)))
        return scene, lower_scene(scene)

    def fixed(self, contacts: Contacts) -> list[int]:
        """Numbers of a start that held feet leave no choice."""
        walker, feet = self.scene.robot.structure, list(self.scene.robot.feet.values())
        assert isinstance(walker, Walker)
        at = [int(np.argmax(np.abs(walker.row(feet[i].point)))) for i in contacts.held]
        return at + [k + walker.size for k in at]

    def windows(
        self, plan: Plan, part: Sequence[int], own: Floats, by: WindowGradients | None
    ) -> tuple[WindowBatch, list[Floats]]:
        """Windows of those numbers, and what they leave over the noise."""
        times, starts, kept = self.record.times, [], []
        for w, start in zip(part, own, strict=True):
            inside = (times > self.edges[w]) & (times <= self.edges[w + 1])
            when = np.append(times[inside], self.edges[w + 1])
            starts.append(WindowStart(start * self.scale, self.edges[w], when, self.contacts[w]))
            kept.append(inside)
        batch, left = simulate_windows(plan, starts, gradients=by), []
        for window, inside in zip(batch, kept, strict=True):
            state = np.concatenate([window.states.x, window.states.v])[:, :-1]
            off = self.record.rows @ state - self.record.values[:, inside]
            left.append((off / self.record.noise[:, None]).ravel())
        return batch, left

    def equations(
        self, plan: Plan, part: Sequence[int], own: Floats, by: WindowGradients, values: Floats, weights: Floats
    ) -> NormalEquations:  # fmt: skip
        """Of starts, and of logarithms of numbers at values; residuals by weights (nw,) of the windows."""
        batch, left = self.windows(plan, part, own, by)
        slopes = []
        for k, (w, window) in enumerate(zip(part, batch, strict=True)):
            assert window.slopes is not None
            there = window.slopes.states
            state = np.concatenate([there.x, there.v])[:, :-1]
            rows = np.einsum("cs,stp->ctp", self.record.rows / self.record.noise[:, None], state)
            rows = rows.reshape(left[k].size, -1)
            rows[~np.isfinite(rows).all(axis=1)] = 0.0
            rows = np.hstack([rows[:, len(values) :] * self.scale, rows[:, : len(values)] * values])
            rows[:, self.fixed(self.contacts[w])] = 0.0
            about = np.hstack([np.diag(1.0 / self.loose), np.zeros((len(self.loose), len(values)))])
            left[k] = np.concatenate([left[k] * weights[w], (own[k] - self.starts[w]) / self.loose])
            slopes.append(np.vstack([rows * weights[w], about]))
        return NormalEquations.of(left, slopes, len(self.loose))

    def costs(self, plan: Plan, part: Sequence[int], own: Floats, weights: Floats) -> Floats:
        """Sums of squares alone."""
        _, left = self.windows(plan, part, own, None)
        about = (((own - self.starts[list(part)]) / self.loose) ** 2).sum(axis=1)
        return np.array([one @ one for one in left]) * weights[list(part)] ** 2 + about

    def follow(self, moved: Floats) -> Floats:
        """Starts and contacts of all windows in order; what each leaves (nw,), its mean square."""
        _, plan = self.plan(moved)
        count, none = len(self.edges) - 1, np.zeros(0)
        by, weights = WindowGradients(t0=False), np.ones(count)
        self.starts, self.contacts = np.zeros((count, len(self.scale))), [Contacts()] * count
        lead = simulate_windows(plan, [WindowStart(plan.initial, 0.0, [self.edges[0]])])[0]
        state, contacts = _end(lead, Contacts())
        left = np.zeros(count)
        for w in range(count):
            self.starts[w], self.contacts[w] = state / self.scale, contacts
            found = descend(
                lambda own, _s, _p, w=w: self.equations(plan, [w], own, by, none, weights),
                self.starts[w : w + 1],
                costs=lambda own, _s, _p, w=w: self.costs(plan, [w], own, weights),
                how=Descent(rounds=3),
            )
            self.starts[w] = found.own[0]
            batch, (off,) = self.windows(plan, [w], found.own, None)
            left[w] = off @ off / off.size
            state, contacts = _end(batch[0], contacts)
        return left

    def together(self, moved: Floats, left: Floats, rounds: int) -> tuple[Floats, Floats]:
        """Shared numbers, and information about them, of all windows by what each left."""
        weights, end = 1.0 / np.sqrt(np.maximum(1.0, left)), float(self.edges[-1])

        def equations(own: Floats, shared: Floats, part: NDArray[np.intp]) -> NormalEquations:
            scene, plan = self.plan(shared)
            by = WindowGradients.of(scene, plan, self.paths, end, t0=False)
            return self.equations(plan, part.tolist(), own, by, np.exp(self.first + shared), weights)

        def costs(own: Floats, shared: Floats, part: NDArray[np.intp]) -> Floats:
            return self.costs(self.plan(shared)[1], part.tolist(), own, weights)

        known = np.diag(self.spread**-2.0)
        found = descend(
            equations, self.starts, moved, prior=(np.zeros(len(moved)), known), costs=costs,
            how=Descent(rounds=rounds, far=FAR),
        )  # fmt: skip
        return found.shared, found.equations.reduced()[0].sum(axis=0) + known


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
    record: WalkRecord,
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
    edges = np.linspace(begin, end, int(np.ceil((end - begin) / window - 1e-9)) + 1)
    walk = _Walk(scene, record, edges, tuple(spread), np.array(list(spread.values())))
    moved, left = np.zeros(len(spread)), walk.follow(np.zeros(len(spread)))
    information = np.diag(walk.spread**-2.0)
    for _ in range(passes):
        moved, information = walk.together(moved, left, 8)
        left = walk.follow(moved)
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return WalkFit(walk.paths, np.exp(walk.first + moved), covariance, walk.spread, left)
