"""Numbers of a walker and of the ground under it, from records of its body and its currents while it walks.

A walk forgets its start at every impact, so that one simulation of the whole record has a cost that no descent goes
down. Here records are cut between contacts (`tarsus.identify.walk_edges`) into windows with a start of their own each.
A first pass goes through them in order, each starting where the fit of the one before ended; then all starts and the
numbers that they share go down together, the starts eliminated (`tarsus.fit.normal_equations`), windows that are not
followed counting for less; in the end every start is tied to the end of the window before, as in multiple shooting
(Bock and Plitt 1984), so that nothing is lost by the cuts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.events import CONTACT_BEGINS
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, with_values
from tarsus.fit.normal_equations import Descent, NormalEquations, descend
from tarsus.fit.verdict import Verdict, verdict_of
from tarsus.identify.walk_edges import AHEAD, contact_time, edge_after
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.plan.lowering import Plan, lower_scene
from tarsus.solve.contacts import Contacts
from tarsus.solve.outputs import Output, OutputRows, output_rows, output_slopes
from tarsus.solve.window import Window, WindowGradients, WindowStart, simulate_windows

Floats = NDArray[np.float64]

LENGTH, SPEED = 1e-6, 1e-3
"""Units of displacements and velocities of a start: a step of a small walker, and what its body has at it."""
LOOSE = (20.0, 100.0)
"""Standard deviations, in these units, of a start about the one before: wider than what any record leaves of a start
that it shows, so that only what no record shows, such as a foot's motion that has died away, stays where it was."""
TIED = (0.02, 0.02)
"""Standard deviations, in these units, of a start about the end of the window before: what no model has of a motion
within some milliseconds, below the noise of any instrument that sees it."""
ZERO = 1e-5
"""Standard deviation of the zero of a displacement [m] or an angle [rad] from record to record."""
ELASTIC = 0.99
"""Largest restitution on the way: at one a foot bounces for ever."""
FAR = 0.5
"""Longest step of the logarithm of a number."""
FOLLOWED = 1.3
"""Mean square over the noise up to which a window is followed: of some hundred samples it scatters by a tenth."""
MOST = 0.9
"""Share of windows that are followed when all are taken to be: a foot that only just touches stays one apart."""
SLACK = 10.0
"""Times as loose as in the end windows are tied at first, where the cost is smoother."""
STEPS, TIES = 12, 12
"""Steps of a descent of all windows with free starts, and with tied ones."""
FEW = 12
"""Samples of a record below which nothing is found of it."""


@dataclass(frozen=True)
class WalkRecord:
    """Channels of a walk.

    scene: the robot as far as it is known, with the drives of the record; times (nt,) [s] after the start of the
    drives, in order; outputs (nc): what each channel sees; values (nc, nt); noise (nc,): standard deviations;
    estimated: whether these are taken from the records, and follow what fits leave; zeros: whether displacements and
    angles have zeros of their own; name: for messages.

    Raises
    ------
    InputError
        If shapes do not fit each other, a noise is not positive, or the robot is no walker.
    """

    scene: Scene
    times: Floats
    outputs: tuple[Output, ...]
    values: Floats
    noise: Floats
    estimated: bool = False
    zeros: bool = True
    name: str = "walk"

    def __post_init__(self) -> None:
        shape = len(self.outputs), len(self.times)
        if self.values.shape != shape or self.noise.shape != shape[:1] or not np.all(self.noise > 0.0):
            raise InputError(f"{self.name}: expected values of shape {shape} and {shape[0]} noises above 0")
        if not isinstance(self.scene.robot.structure, Walker):
            raise InputError("walks are identified of walkers: the structure is of another kind")
        if shape[1] < FEW:
            raise InputError(f"{self.name}: expected {FEW} samples or more, got {shape[1]}")

    @property
    def shifted(self) -> list[int]:
        """Channels with a zero of their own."""
        kinds = (Quantity.DISPLACEMENT, Quantity.ANGLE)
        return [k for k, one in enumerate(self.outputs) if self.zeros and one.quantity in kinds]


@dataclass(frozen=True)
class WalkFit:
    """What records determine.

    paths (np,); values (np,) [SI]; covariance (np, np) of the logarithms, what was known beforehand included; prior
    (np,): standard deviations of the logarithms beforehand; left: by record, mean square of what each window leaves
    over the noise; edges: by record [s]; residuals: by record, (nc, nt) over the noise, NaN outside of the windows.
    """

    paths: tuple[str, ...]
    values: Floats
    covariance: Floats
    prior: Floats
    left: tuple[Floats, ...]
    edges: tuple[Floats, ...]
    residuals: tuple[Floats, ...] = ()

    def interval(self, path: str) -> tuple[float, float]:
        """95 % interval of a number [SI]."""
        j = self.paths.index(path)
        reach = float(np.exp(1.96 * np.sqrt(self.covariance[j, j])))
        return float(self.values[j]) / reach, float(self.values[j]) * reach

    def verdict(self, path: str) -> Verdict:
        """Whether the records determine a number."""
        j = self.paths.index(path)
        of_prior = float(np.sqrt(self.covariance[j, j]) / self.prior[j])
        return verdict_of(self.interval(path), of_prior=of_prior)


@dataclass(frozen=True)
class _Piece:
    """A window run: what it leaves (k,) over the noise, its end state (2n,) in the units of starts, and derivatives of
    both by its start and by all shared numbers."""

    left: Floats
    end: Floats
    by_start: Floats
    by_shared: Floats
    end_by_start: Floats
    end_by_shared: Floats
    window: Window


@dataclass
class _Walk:
    """A record cut into windows: edges (nw + 1,) [s]; starts (nw, 2n) in their units; contacts at them.

    paths (np,): the shared numbers, of which `first` (np,) are the logarithms beforehand; zero: place of its zeros
    among the shared ones, count: of those.
    """

    record: WalkRecord
    paths: tuple[str, ...]
    zero: int
    count: int
    edges: Floats = field(default_factory=lambda: np.zeros(0))
    starts: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    contacts: list[Contacts] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.first = np.log([float(get_value(self.record.scene, path)) for path in self.paths])
        n = len(lower_scene(self.record.scene).system.mass)
        self.scale, self.loose = np.repeat([LENGTH, SPEED], n), np.repeat(LOOSE, n)
        self.noise = self.record.noise.copy()
        self._kept: tuple[Floats, Scene, Plan, OutputRows] | None = None

    def plan(self, shared: Floats) -> tuple[Scene, Plan, OutputRows]:
        """The scene of shared numbers, its plan, and the rows of its outputs at all times of the record."""
        moved = shared[: len(self.paths)]
        if self._kept is None or not np.array_equal(self._kept[0], moved):
            scene = with_values(
                self.record.scene, dict(zip(self.paths, self.values(moved).tolist(), strict=True))
            )
            rows = output_rows(scene, self.record.outputs, self.record.times)
            self._kept = moved.copy(), scene, lower_scene(scene), rows
        return self._kept[1:]

    def values(self, moved: Floats) -> Floats:
        """Numbers (np,) by how far their logarithms moved; a restitution is below one."""
        values = np.exp(self.first + moved)
        bounded = np.array([path.startswith("ground.restitution.") for path in self.paths])
        return np.where(bounded, np.minimum(values, ELASTIC), values)

    def fixed(self, contacts: Contacts) -> list[int]:
        """Numbers of a start that held feet leave no choice."""
        walker, feet = self.record.scene.robot.structure, list(self.record.scene.robot.feet.values())
        assert isinstance(walker, Walker)
        at = [int(np.argmax(np.abs(walker.row(feet[i].point)))) for i in contacts.held]
        return at + [k + walker.size for k in at]

    @cached_property
    def shown(self) -> list[str]:
        """Paths that outputs themselves depend on, beside the motion."""
        kinds = {one.quantity for one in self.record.outputs}
        if Quantity.ACCELERATION in kinds:
            return [path for path in self.paths if path.startswith(("robot.", "ground.gravity."))]
        driven = kinds & {Quantity.CHARGE, Quantity.CURRENT}
        return [path for path in self.paths if driven and path.startswith("robot.drives.")]

    def run(
        self, shared: Floats, part: Sequence[int], own: Floats, by: WindowGradients | None
    ) -> list[_Piece]:
        """Windows of those numbers from those starts."""
        _, plan, _ = self.plan(shared)
        starts, inside = [], []
        for w, start in zip(part, own, strict=True):
            begin, end = self.edges[w : w + 2]
            inside.append(np.flatnonzero((self.record.times > begin) & (self.record.times <= end)))
            when = np.append(self.record.times[inside[-1]], end)
            starts.append(WindowStart(start * self.scale, begin, when, self.contacts[w]))
        batch = simulate_windows(plan, starts, gradients=by)
        return [self._piece(shared, window, at, w) for window, at, w in zip(batch, inside, part, strict=True)]

    def _piece(self, shared: Floats, window: Window, at: NDArray[np.intp], w: int) -> _Piece:
        scene, _, rows = self.plan(shared)
        zeros = np.zeros(len(self.record.outputs))
        zeros[self.record.shifted] = shared[self.zero : self.zero + len(self.record.shifted)]
        seen = replace(
            rows, known=rows.known[:, at], x_gain=_at(rows.x_gain, at), v_gain=_at(rows.v_gain, at)
        )
        inner = slice(0, len(at))
        states, size = window.states.part(inner), len(self.scale)
        off = seen.values(states) + zeros[:, None] - self.record.values[:, at]
        left = (off / self.noise[:, None]).ravel()
        end = np.concatenate([window.states.x[:, -1], window.states.v[:, -1]]) / self.scale
        if window.slopes is None:
            none = np.zeros((0, 0))
            return _Piece(left, end, none, none, none, none, window)
        slopes = replace(window.slopes, states=window.slopes.states.part(inner))
        if self.shown:
            out = output_slopes(scene, self.record.outputs, window.times[inner], states, slopes, self.shown)
        else:
            out = seen.slopes(slopes.states)
        out = (out / self.noise[:, None, None]).reshape(left.size, -1)
        whole = window.slopes.states
        final = np.concatenate([whole.x[:, -1], whole.v[:, -1]]) / self.scale[:, None]
        out[~np.isfinite(out).all(axis=1)] = 0.0
        final[~np.isfinite(final).all(axis=1)] = 0.0
        numbers = out.shape[1] - size
        values = self.values(shared[: len(self.paths)])
        by_shared, end_by = np.zeros((left.size, self.count)), np.zeros((size, self.count))
        by_shared[:, :numbers], end_by[:, :numbers] = (
            out[:, :numbers] * values[:numbers],
            final[:, :numbers] * values[:numbers],
        )
        for j, channel in enumerate(self.record.shifted):
            own = slice(channel * len(at), (channel + 1) * len(at))
            by_shared[own, self.zero + j] = 1.0 / self.noise[channel]
        by_start, end_by_start = out[:, numbers:] * self.scale, final[:, numbers:] * self.scale
        held = self.fixed(self.contacts[w])
        by_start[:, held] = end_by_start[:, held] = 0.0
        return _Piece(left, end, by_start, by_shared, end_by_start, end_by, window)

    def gradients(self, shared: Floats) -> WindowGradients:
        """By all numbers and by the start."""
        scene, plan, _ = self.plan(shared)
        return WindowGradients.of(scene, plan, self.paths, float(self.record.times[-1]), t0=False)

    def first_zeros(self) -> Floats:
        """Zeros by the first sample, where the walker stands as it does before its drives begin."""
        _, plan, rows = self.plan(np.zeros(self.count))
        there = rows.x @ plan.initial[: len(self.scale) // 2]
        return (self.record.values[:, 0] - there)[self.record.shifted]

    def follow(self, shared: Floats, tight: Floats) -> Floats:
        """Edges, starts and contacts of all windows in order; what each leaves (nw,), its mean square."""
        scene, plan, _ = self.plan(shared)
        walker, last = scene.robot.structure, float(self.record.times[-1])
        assert isinstance(walker, Walker)
        contact = contact_time(walker)
        by, weight = WindowGradients(t0=False), np.ones(1)
        state, held, edge = plan.initial, Contacts(), 0.0
        edge, state, held = self._lead(plan, state, contact, last)
        edges, starts, contacts, left = [edge], [], [], []
        while edge < last - contact:
            ahead = min(edge + AHEAD * contact, last)
            found = state
            for _ in range(2):
                foreseen = simulate_windows(plan, [WindowStart(found, edge, [ahead], held)])[0]
                end = (
                    ahead
                    if ahead >= last and not len(foreseen.events)
                    else edge_after(foreseen.events, edge, ahead, contact)
                )
                end = last if end > last - contact else end
                self.edges, self.contacts = np.array([edge, end]), [held]
                self.starts = (state / self.scale)[None]
                fitted = descend(
                    lambda own, _s, _p: self._alone(shared, own, by, tight, weight),
                    found[None] / self.scale,
                    costs=lambda own, _s, _p: self._alone_cost(shared, own, tight),
                    how=Descent(rounds=4),
                )
                found = fitted.own[0] * self.scale
            piece = self.run(shared, [0], fitted.own, None)[0]
            starts.append(fitted.own[0])
            contacts.append(held)
            left.append(float(piece.left @ piece.left) / max(piece.left.size, 1))
            state, held = _end(piece.window, held)
            edge = end
            edges.append(edge)
        self.edges, self.starts, self.contacts = np.array(edges), np.array(starts), contacts
        return np.array(left)

    def _lead(self, plan: Plan, state: Floats, contact: float, last: float) -> tuple[float, Floats, Contacts]:
        """First edge, between contacts of the motion from the scene's own start, with state and contacts there."""
        seen = simulate_windows(plan, [WindowStart(state, 0.0, [min(AHEAD * contact, last)])])[0]
        after = seen.events[np.asarray(seen.events["time"]) > 0.0]
        edge = edge_after(after, 0.0, min(AHEAD * contact, last), contact) if len(after) else contact
        times = np.append(0.0, np.unique(np.asarray(after["time"], dtype=float)))
        quiet = np.flatnonzero(np.diff(times) > contact)
        if len(quiet):
            edge = min(edge, float(times[quiet[0]] + 0.5 * np.diff(times)[quiet[0]]))
        lead = simulate_windows(plan, [WindowStart(state, 0.0, [edge])])[0]
        return edge, *_end(lead, Contacts())

    def unexplained(self, pieces: Sequence[_Piece]) -> Floats:
        """What windows leave (nc, nt) over the noise; NaN outside of them."""
        out = np.full(self.record.values.shape, np.nan)
        for piece, begin, end in zip(pieces, self.edges[:-1], self.edges[1:], strict=True):
            inside = (self.record.times > begin) & (self.record.times <= end)
            out[:, inside] = piece.left.reshape(len(out), -1)
        return out

    def learn_noise(self, shared: Floats) -> None:
        """Where the noise is not known, by what the windows leave in their middle half of values, which those few that
        are not followed do not move."""
        if self.record.estimated:
            left = self.unexplained(self.run(shared, range(len(self.starts)), self.starts, None))
            self.noise = self.noise * 1.4826 * np.nanmedian(np.abs(left), axis=1)

    def _alone(
        self, shared: Floats, own: Floats, by: WindowGradients, tight: Floats, weight: Floats
    ) -> NormalEquations:
        piece = self.run(shared, [0], own, by)[0]
        left = np.concatenate([piece.left * weight, (own[0] - self.starts[0]) / tight])
        return NormalEquations.of(
            [left], [np.vstack([piece.by_start * weight, np.diag(1.0 / tight)])], len(tight)
        )

    def _alone_cost(self, shared: Floats, own: Floats, tight: Floats) -> Floats:
        piece = self.run(shared, [0], own, None)[0]
        about = (own[0] - self.starts[0]) / tight
        return np.array([piece.left @ piece.left + about @ about])


def _at(gain: Floats, at: NDArray[np.intp]) -> Floats:
    return gain if gain.shape[1] == 1 else gain[:, at]


@dataclass
class _AllWalks:
    """Records of one walker with what they share: logarithms of numbers, and zeros of all records."""

    walks: list[_Walk]
    known: Floats
    weights: list[Floats] = field(default_factory=list)

    @cached_property
    def size(self) -> int:
        return len(self.walks[0].scale)

    def pieces(self, own: Floats, shared: Floats, slopes: bool) -> list[list[_Piece]]:
        """All windows of all records from starts (nr, most windows * 2n)."""
        out = []
        for walk, mine in zip(self.walks, own, strict=True):
            count = len(walk.starts)
            by = walk.gradients(shared) if slopes else None
            out.append(walk.run(shared, range(count), mine[: count * self.size].reshape(count, -1), by))
        return out

    def starts(self) -> Floats:
        """Of all windows of each record, end to end, (nr, most windows * 2n)."""
        most = max(len(walk.starts) for walk in self.walks)
        return np.array(
            [np.pad(walk.starts.ravel(), (0, (most - len(walk.starts)) * self.size)) for walk in self.walks]
        )

    def _about(self, walk: _Walk, own: Floats, pieces: Sequence[_Piece], tied: Floats | None) -> list[Floats]:
        """Starts about the followed ones, or about the ends of the windows before, over what is allowed."""
        mine = own.reshape(-1, self.size)
        about = [(mine[0] - walk.starts[0]) / walk.loose]
        for w in range(1, len(pieces)):
            free = (mine[w] - walk.starts[w]) / walk.loose
            about.append(free if tied is None else (mine[w] - pieces[w - 1].end) / tied)
        return about

    def costs(self, own: Floats, shared: Floats, tied: Floats | None) -> Floats:
        """Sums of squares of the records."""
        out = []
        for walk, weights, mine, pieces in zip(
            self.walks, self.weights, own, self.pieces(own, shared, False), strict=True
        ):
            about = self._about(walk, mine[: len(pieces) * self.size], pieces, tied)
            cost = sum(float(one.left @ one.left) * w**2 for one, w in zip(pieces, weights, strict=True))
            out.append(cost + sum(float(one @ one) for one in about))
        return np.array(out)

    def equations(self, own: Floats, shared: Floats, tied: Floats | None) -> NormalEquations:
        """Of all starts and what is shared."""
        left, slopes, size, wide = [], [], self.size, own.shape[1]
        for walk, weights, mine, pieces in zip(
            self.walks, self.weights, own, self.pieces(own, shared, True), strict=True
        ):
            about = self._about(walk, mine[: len(pieces) * size], pieces, tied)
            rows, off = [], []
            for w, (piece, weight) in enumerate(zip(pieces, weights, strict=True)):
                row = np.zeros((piece.left.size, wide + walk.count))
                row[:, w * size : (w + 1) * size] = piece.by_start * weight
                row[:, wide:] = piece.by_shared * weight
                tie = np.zeros((size, wide + walk.count))
                allowed = walk.loose if w == 0 or tied is None else tied
                tie[:, w * size : (w + 1) * size] = np.diag(1.0 / allowed)
                if w and tied is not None:
                    before = pieces[w - 1]
                    tie[:, (w - 1) * size : w * size] = -before.end_by_start / tied[:, None]
                    tie[:, wide:] = -before.end_by_shared / tied[:, None]
                rows += [row, tie]
                off += [piece.left * weight, about[w]]
            left.append(np.concatenate(off))
            slopes.append(np.vstack(rows))
        return NormalEquations.of(left, slopes, wide)

    def follow(self, shared: Floats) -> list[Floats]:
        """All windows of all records in order: what each leaves; windows that are not followed count for less."""
        left = [walk.follow(shared, walk.loose) for walk in self.walks]
        self.weights = [1.0 / np.sqrt(np.maximum(1.0, one)) for one in left]
        return left

    def weigh(self, shared: Floats) -> bool:
        """Weigh windows by what they leave with their starts as they are; whether most are followed."""
        left = [
            np.array([float(p.left @ p.left) / max(p.left.size, 1) for p in some])
            for some in self.pieces(self.starts(), shared, False)
        ]
        self.weights = [1.0 / np.sqrt(np.maximum(1.0, one)) for one in left]
        return float(np.mean(np.concatenate(left) < FOLLOWED)) >= MOST

    def together(self, shared: Floats, rounds: int, tied: Floats | None) -> tuple[Floats, Floats, bool]:
        """Shared numbers of all windows, the information about them, and whether they would go no further."""
        known = np.diag(self.known**-2.0)
        found = descend(
            lambda own, at, _: self.equations(own, at, tied),
            self.starts(), shared, prior=(np.zeros(len(shared)), known),
            costs=lambda own, at, _: self.costs(own, at, tied), how=Descent(rounds=rounds, far=FAR),
        )  # fmt: skip
        for walk, mine in zip(self.walks, found.own, strict=True):
            count = len(walk.starts)
            walk.starts = mine[: count * self.size].reshape(count, -1)
        return found.shared, found.equations.reduced()[0].sum(axis=0) + known, bool(found.settled.all())


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


def identify_walk(records: Sequence[WalkRecord], spread: Mapping[str, float], *, passes: int = 5) -> WalkFit:
    """Find numbers of a walker and its ground from records that begin with its drives.

    Parameters
    ----------
    records
        Of one walker, whose scenes differ in their drives.
    spread
        Paths of what is not known exactly, with standard deviations of their logarithms.
    passes
        How often windows are followed and numbers found.

    Raises
    ------
    InputError
        Without records, and for a record that ends before its second contact.
    """
    if not records:
        raise InputError("expected records of a walk, got none")
    paths, zero, walks = tuple(spread), len(spread), []
    total = zero + sum(len(one.shifted) for one in records)
    for one in records:
        walks.append(_Walk(one, paths, zero, total))
        zero += len(one.shifted)
    known = np.concatenate([list(spread.values()), np.full(total - len(spread), ZERO)])
    shared = np.concatenate([np.zeros(len(paths)), *(walk.first_zeros() for walk in walks)])
    found = _AllWalks(walks, known)
    found.follow(shared)
    for _ in range(passes):
        shared, _, settled = found.together(shared, STEPS, None)
        if found.weigh(shared):
            if settled:
                break
        else:
            found.follow(shared)
    for walk in walks:
        walk.learn_noise(shared)
    tied = np.repeat(TIED, found.size // 2)
    for wider in (SLACK, 1.0):
        shared, information, _ = found.together(shared, TIES, wider * tied)
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)[: len(paths), : len(paths)]
    pieces = found.pieces(found.starts(), shared, False)
    left = [np.array([float(p.left @ p.left) / max(p.left.size, 1) for p in some]) for some in pieces]
    return WalkFit(
        paths, walks[0].values(shared[: len(paths)]), covariance, np.array(list(spread.values())), tuple(left),
        tuple(walk.edges for walk in walks), tuple(w.unexplained(p) for w, p in zip(walks, pieces, strict=True)),
    )  # fmt: skip
