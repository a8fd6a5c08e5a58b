"""Numbers of a walker and of the ground under it, from records of its body and its currents while it walks.

A walk forgets its start at every impact, so that one simulation of the whole record has a cost that no descent goes
down. Here records are cut between contacts (`tarsus.identify.walk_edges`) into windows with a start of their own each.
A first pass goes through them in order, each starting where the fit of the one before ended; then all starts and the
numbers that they share go down together (`tarsus.fit.record_problem`), windows that are not followed counting for less.
In the end every start is tied to the end of the window before (`tarsus.fit.record_ties`), so that nothing is lost by
the cuts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.events import CONTACT_BEGINS
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value
from tarsus.fit.record_problem import UNDER, RecordFit, RecordProblem, Seen, SeenRecord, Segment
from tarsus.fit.record_ties import solve_tied
from tarsus.fit.unknowns import Prior
from tarsus.fit.verdict import Verdict, verdict_of
from tarsus.identify.walk_edges import AHEAD, contact_time, edge_after
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.plan.lowering import Plan
from tarsus.solve.contacts import Contacts
from tarsus.solve.outputs import Output, output_rows
from tarsus.solve.window import Window, WindowStart, simulate_windows

Floats = NDArray[np.float64]

LOOSE = (20e-6, 0.1)
"""Standard deviations [m, m/s] of a start about the one before: wider than what any record leaves of a start that it
shows, so that only what no record shows, such as a foot's motion that has died away, stays where it was."""
NEAR = (1e-6, 1e-3)
"""The same of the first start of a record that does not show the body: as far as its release from the ground moves
it."""
TIED = (20e-9, 20e-6)
"""Standard deviations [m, m/s] of a start about the end of the window before: what no model has of a motion within some
milliseconds, below the noise of any instrument that sees it."""
WIDE, TRIED = 2.0, 24
"""Factor that a number is known to beforehand from which on a record that does not show the body is tried from others,
and how many."""
SLACK = 10.0
"""Times as loose as in the end windows are tied at first, where the cost is smoother."""
ZERO = 1e-5
"""Standard deviation of the zero of a displacement [m] from record to record; of an angle over the arm."""
FOLLOWED, MOST = 1.3, 0.9
"""Mean square over the noise up to which a window is followed, for of some hundred samples it scatters by a tenth; and
share of windows of which all are taken to be: a foot that only just touches stays one apart."""
STEPS, TIES, FIRST = 12, 12, 4
"""Steps of a descent of all windows with free starts, with tied ones, and of one window alone."""
APART, LEAST_APART, ROUNDS = 0.1, 0.003, 4
"""Spread of logarithms from foot to foot at first, and at least, where it is less than any interval; and how often
windows are tied and the spread is estimated again."""
FEW = 12
"""Samples of a record below which nothing is found of it."""


@dataclass(frozen=True)
class WalkRecord:
    """Channels of a walk.

    scene: the robot as far as it is known, with the drives of the record; times (nt,) [s] after the start of the
    drives, in order; outputs (nc): what each channel sees; values (nc, nt); noise (nc,): standard deviations;
    estimated: whether these are taken from the records, and follow what fits leave; name: for messages.

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
        """Channels with a zero of their own: displacements and angles."""
        kinds = (Quantity.DISPLACEMENT, Quantity.ANGLE)
        return [k for k, one in enumerate(self.outputs) if one.quantity in kinds]

    def zero(self, channel: int) -> str:
        """Name of the zero of a channel."""
        return f"{self.name}: zero of {self.outputs[channel].name}"

    def seen(self) -> SeenRecord:
        """For the record problem."""
        zeros = {k: self.zero(k) for k in self.shifted}
        channels = (
            Seen(one, float(noise), zero=zeros.get(k, 0.0))
            for k, (one, noise) in enumerate(zip(self.outputs, self.noise, strict=True))
        )
        return SeenRecord(tuple(channels), self.times, self.values)


@dataclass(frozen=True)
class WalkFit:
    """What records determine.

    paths (np,); values (np,) [SI]; covariance (np, np) of the logarithms, what was known beforehand included; prior
    (np,): standard deviations of the logarithms beforehand; left: by record, mean square of what each window leaves
    over the noise; edges: by record [s]; residuals: by record, (nc, nt) over the noise, NaN outside of the windows;
    settled: whether the numbers would go no further; apart: spread of logarithms from foot to foot by path; feet:
    each foot's own number [SI], with the standard deviation of its logarithm.
    """

    paths: tuple[str, ...]
    values: Floats
    covariance: Floats
    prior: Floats
    left: tuple[Floats, ...]
    edges: tuple[Floats, ...]
    residuals: tuple[Floats, ...] = ()
    settled: bool = True
    apart: Mapping[str, float] = field(default_factory=dict)
    feet: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def interval(self, path: str) -> tuple[float, float]:
        """95 % interval of a number [SI]."""
        j = self.paths.index(path)
        reach = float(np.exp(1.96 * np.sqrt(self.covariance[j, j])))
        return float(self.values[j]) / reach, float(self.values[j]) * reach

    def verdict(self, path: str) -> Verdict:
        """Whether the records determine a number."""
        j = self.paths.index(path)
        of_prior = float(np.sqrt(self.covariance[j, j]) / self.prior[j])
        return verdict_of(self.interval(path), of_prior=of_prior, doubted=self.followed < MOST)

    @property
    def followed(self) -> float:
        """Share of the windows that are followed to their noise."""
        return float(np.mean(np.concatenate(self.left) < FOLLOWED))


def _sees_the_body(records: Sequence[WalkRecord]) -> bool:
    """Whether some channel of every record shows where the body is, or how fast."""
    return all(any(one.quantity in _MOTION for one in record.outputs) for record in records)


_MOTION = (Quantity.DISPLACEMENT, Quantity.VELOCITY, Quantity.ANGLE, Quantity.ANGULAR_VELOCITY)


@dataclass(frozen=True)
class _Walk:
    """A record, and its number in the problem."""

    problem: RecordProblem
    number: int

    def follow(self, moved: Floats) -> list[Segment]:
        """Windows between contacts, in order, each from where the fit of the one before ended."""
        scenes, plans = self.problem.lowered(moved)
        walker, plan = scenes[self.number].robot.structure, plans[self.number]
        last = float(self.problem.records[self.number].times[-1])
        assert isinstance(walker, Walker)
        contact, loose = contact_time(walker), _of_start(walker, LOOSE)
        begin, state, contacts = _lead(plan, contact, last)
        out = list[Segment]()
        while begin < last - contact:
            free = Segment(self.number, begin, (begin, last), state, loose, contacts)
            free = replace(free, span=(begin, self._edge(plan, free, contact, last)))
            found = self.problem.solve([free], moved, known=True, rounds=FIRST)
            out += found.segments
            state, contacts = _end(found.windows[0], contacts)
            begin = free.span[1]
        return out

    def extend(self, moved: Floats) -> tuple[list[Segment], Floats]:
        """Windows of a record that does not show the body, and numbers: one more at a time, tied to those before, from
        the state in which the walker stands; the first from several numbers, of which the best is kept."""
        out, weights, places = list[Segment](), list[float](), self._places(moved)
        last = float(self.problem.records[self.number].times[-1])
        while not out or out[-1].span[1] < last:
            tried = [self._extended(out, weights, place, last) for place in places]
            fit = min(tried, key=lambda one: float(np.log(np.maximum(1.0, _left(one))).sum()))
            out, places = list(fit.segments), [fit.moved]
            weights = (1.0 / np.sqrt(np.maximum(1.0, _left(fit)))).tolist()
        return out, places[0]

    def _places(self, moved: Floats) -> list[Floats]:
        """Numbers, and others about them of which little is known, where a first window may settle elsewhere."""
        wide = np.array([(one.factor or 1.0) > WIDE for one in self.problem.priors.values()])
        if not wide.any():
            return [moved]
        drawn = np.random.default_rng(self.number).uniform(-1.0, 1.0, (TRIED, len(moved)))
        others = [moved + np.where(wide, one, 0.0) for one in drawn]
        return [moved, *(one for one in others if self._possible(one))]

    def _possible(self, moved: Floats) -> bool:
        """Whether a robot takes these numbers."""
        try:
            self.problem.lowered(moved)
        except InputError:
            return False
        return True

    def _extended(self, before: list[Segment], weights: list[float], moved: Floats, last: float) -> RecordFit:
        """One window more."""
        plan = self.problem.lowered(moved)[1][self.number]
        walker = self.problem.scenes[self.number].robot.structure
        assert isinstance(walker, Walker)
        contact = contact_time(walker)
        near, ties = _of_start(walker, NEAR), SLACK * _of_start(walker, TIED)
        if before:
            start = WindowStart(before[-1].state, before[-1].begin, [before[-1].span[1]], before[-1].contacts)
            begin = before[-1].span[1]
            state, contacts = _end(simulate_windows(plan, [start])[0], before[-1].contacts)
        else:
            begin, state, contacts = _lead(plan, contact, last)
        free = Segment(self.number, begin, (begin, last), state, near, contacts)
        free = replace(free, span=(begin, self._edge(plan, free, contact, last)))
        return solve_tied(
            self.problem, [*before, free], moved, ties, weights=np.array([*weights, 1.0]), rounds=FIRST
        )

    @staticmethod
    def _edge(plan: Plan, segment: Segment, contact: float, last: float) -> float:
        """Where a window that starts so ends; what would be left of the record after it is taken along."""
        ahead = min(segment.begin + AHEAD * contact, last)
        start = WindowStart(segment.state, segment.begin, [ahead], segment.contacts)
        end = edge_after(simulate_windows(plan, [start])[0].events, segment.begin, ahead, contact)
        return last if end > last - contact else end


def _walker(records: Sequence[WalkRecord]) -> Walker:
    walker = records[0].scene.robot.structure
    assert isinstance(walker, Walker)
    return walker


def _arms(walker: Walker) -> dict[str, float]:
    """Distances [m] of the farthest hip from the axes that the body turns about: an angle times it is its motion."""
    legs = walker.legs.values()
    found = {"roll": max(abs(one.y) for one in legs), "pitch": max(abs(one.x) for one in legs)}
    return {name: one or walker.length or 1.0 for name, one in found.items()}


def _of_start(walker: Walker, spread: tuple[float, float]) -> Floats:
    """Standard deviations (2n,) of a start whose displacements and velocities have these: of angles over the arm."""
    arms = _arms(walker)
    over = np.ones(walker.size)
    over[: walker.body_size] = [1.0 / arms.get(name, 1.0) for name in walker.body_coordinates]
    return np.concatenate([spread[0] * over, spread[1] * over])


def _lead(plan: Plan, contact: float, last: float) -> tuple[float, Floats, Contacts]:
    """First edge, after the first events of the motion from the scene's own start, with state and contacts there."""
    ahead = min(AHEAD * contact, last)
    seen = simulate_windows(plan, [WindowStart(plan.initial, 0.0, [ahead])])[0].events
    times = np.append(np.unique(np.append(0.0, seen["time"])), ahead)
    quiet = np.flatnonzero(np.diff(times) > contact)
    edge = float(times[quiet[0]] + 0.5 * np.diff(times)[quiet[0]]) if len(quiet) else contact
    lead = simulate_windows(plan, [WindowStart(plan.initial, 0.0, [edge])])[0]
    return edge, *_end(lead, Contacts())


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


def _problem(records: Sequence[WalkRecord], spread: Mapping[str, float]) -> RecordProblem:
    """Numbers of the walker and its ground, and zeros of the records about those of their first samples, where the
    walker stands as before its drives begin."""
    scenes = tuple(one.scene for one in records)
    priors = {
        path: Prior(float(get_value(scenes[0], path)), factor=float(np.exp(one)))
        for path, one in spread.items()
    }
    problem = RecordProblem(scenes, tuple(one.seen() for one in records), priors)
    _, plans = problem.lowered(np.zeros(len(priors)))
    for one, plan in zip(records, plans, strict=True):
        there = output_rows(one.scene, one.outputs, one.times[:1]).x @ plan.initial[: len(plan.initial) // 2]
        priors |= {
            one.zero(k): Prior(
                float(one.values[k, 0] - there[k]),
                sd=ZERO / _arms(_walker(records)).get(one.outputs[k].at, 1.0),
            )
            for k in one.shifted
        }
    return replace(problem, priors=priors)


def _left(fit: RecordFit) -> Floats:
    """Mean square (nw,) of what each window leaves."""
    return np.asarray(np.nanmean(fit.left, axis=1), dtype=np.float64)


def _residuals(problem: RecordProblem, fit: RecordFit) -> tuple[Floats, ...]:
    """What windows leave over the noise, by record (nc, nt); NaN outside of them."""
    size = len(fit.segments[0].state)
    left = problem.residuals(fit.segments, np.zeros((len(fit.segments), size)), fit.moved)
    out = [np.full(one.values.shape, np.nan) for one in problem.records]
    for segment, mine in zip(fit.segments, left, strict=True):
        times = problem.records[segment.record].times
        out[segment.record][:, (times > segment.span[0]) & (times <= segment.span[1])] = np.array(mine)
    return tuple(out)


def _with_noise(problem: RecordProblem, fit: RecordFit, records: Sequence[WalkRecord]) -> RecordProblem:
    """Where the noise is not known, by the median of what the windows leave, which those few that are not followed do
    not move."""
    out = []
    for one, record, left in zip(problem.records, records, _residuals(problem, fit), strict=True):
        scale = 1.4826 * np.nanmedian(np.abs(left), axis=1) if record.estimated else np.ones(len(left))
        pairs = zip(one.channels, scale.tolist(), strict=True)
        out.append(replace(one, channels=tuple(replace(c, noise=c.noise * by) for c, by in pairs)))
    return replace(problem, records=tuple(out))


def identify_walk(
    records: Sequence[WalkRecord],
    spread: Mapping[str, float],
    *,
    differing: Sequence[str] = (),
    passes: int = 5,
) -> WalkFit:
    """Find numbers of a walker and its ground from records that begin with its drives.

    Parameters
    ----------
    records
        Of one walker, whose scenes differ in their drives, and their names from each other.
    spread
        Paths of what is not known exactly, with standard deviations of their logarithms.
    differing
        Paths among them that may differ from foot to foot: the ground's number is then their geometric mean, and each
        foot's own lies off it by a normal deviation of the logarithm, whose spread is estimated as well (an empirical
        Bayes estimate by expectation and maximisation, Dempster et al. 1977).
    passes
        How often windows are followed and numbers found, at most.

    Raises
    ------
    InputError
        Without records.
    """
    if not records:
        raise InputError("expected records of a walk, got none")
    problem = _problem(records, spread)
    moved, fit, segments, weights = np.zeros(len(problem.priors)), None, None, np.zeros(0)
    seen = _sees_the_body(records)
    for _ in range(passes):
        if segments is None:
            segments = []
            for walk in (_Walk(problem, k) for k in range(len(records))):
                windows, moved = (walk.follow(moved), moved) if seen else walk.extend(moved)
                segments += windows
            zeros = np.zeros((len(segments), len(segments[0].state)))
            left = problem.residuals(segments, zeros, moved)
            weights = 1.0 / np.sqrt(np.maximum(1.0, [np.mean(np.concatenate(one) ** 2) for one in left]))
        ties = SLACK * _of_start(_walker(records), TIED)
        fit = (
            problem.solve(segments, moved, weights=weights, rounds=STEPS)
            if seen
            else solve_tied(problem, segments, moved, ties, weights=weights, rounds=STEPS)
        )
        moved, left = fit.moved, _left(fit)
        weights, segments = 1.0 / np.sqrt(np.maximum(1.0, left)), list(fit.segments)
        if np.mean(left < FOLLOWED) < MOST:
            segments = None
        elif fit.settled:
            break
    assert fit is not None
    problem, segments = _with_noise(problem, fit, records), list(fit.segments)
    if differing:
        problem = replace(problem, priors={**problem.priors, **_of_feet(records[0].scene, differing, APART)})
        fit = replace(fit, moved=np.append(fit.moved, np.zeros(len(problem.feet))))
    for turn, wider in enumerate((SLACK, *[1.0] * (ROUNDS if differing else 1))):
        if differing and turn:
            problem, fit = _respread(problem, fit)
        ties = wider * _of_start(_walker(records), TIED)
        fit = solve_tied(problem, segments, fit.moved, ties, weights=weights, rounds=TIES)
        segments = list(fit.segments)
    paths, prior = tuple(spread), np.array(list(spread.values()))
    left, of = _left(fit), np.array([one.record for one in segments])
    ends = [[one.span for one in segments if one.record == k] for k in range(len(records))]
    return WalkFit(
        paths, np.array([fit.values[path] for path in paths]),
        fit.covariance[: len(paths), : len(paths)] * np.outer(prior, prior), prior,
        tuple(left[of == k] for k in range(len(records))),
        tuple(np.array([one[0][0], *(end for _, end in one)]) for one in ends), _residuals(problem, fit), fit.settled,
        *_feet(problem, fit, spread),
    )  # fmt: skip


def _of_feet(scene: Scene, paths: Sequence[str], apart: float) -> dict[str, Prior]:
    """Factors of the ground's numbers under single feet."""
    names = (f"{UNDER}{foot}: {path}" for path in paths for foot in scene.robot.feet)
    return dict.fromkeys(names, Prior(1.0, factor=float(np.exp(apart))))


def _respread(problem: RecordProblem, fit: RecordFit) -> tuple[RecordProblem, RecordFit]:
    """The same with the spreads from foot to foot that the deviations have: mean squares, their variances included."""
    names, priors, moved = list(problem.priors), dict(problem.priors), fit.moved.copy()
    for path in dict.fromkeys(path for _, path in problem.feet.values()):
        mine = [names.index(name) for name, (_, other) in problem.feet.items() if other == path]
        squares = moved[mine] ** 2 + np.diag(fit.covariance)[mine]  # in standard deviations beforehand
        before = float(np.log(problem.priors[names[mine[0]]].factor or 1.0))
        after = max(before * float(np.sqrt(squares.mean())), LEAST_APART)
        for j in mine:
            priors[names[j]] = Prior(1.0, factor=float(np.exp(after)))
            moved[j] *= before / after
    return replace(problem, priors=priors), replace(fit, moved=moved)


def _feet(
    problem: RecordProblem, fit: RecordFit, prior: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Spread from foot to foot by path, and each foot's own number with the standard deviation of its logarithm."""
    names, apart, own = list(problem.priors), dict[str, float](), dict[str, tuple[float, float]]()
    for name, (_, path) in problem.feet.items():
        apart[path] = float(np.log(problem.priors[name].factor or 1.0))
        both = np.array([names.index(path), names.index(name)])
        weights = np.array([prior[path], apart[path]])
        variance = float(weights @ fit.covariance[np.ix_(both, both)] @ weights)
        own[name.removeprefix(UNDER)] = fit.values[path] * fit.values[name], float(np.sqrt(variance))
    return apart, own
