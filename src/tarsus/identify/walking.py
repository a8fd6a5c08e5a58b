"""Numbers of a walker and of the ground under it, from records of its body and its currents while it walks.

Records are taken up one after the other, as far as they are predicted and farther with every fit
(`tarsus.identify.walk_horizon`); then all windows and the numbers that they share go down together, every start tied to
the end of the window before (`tarsus.fit.record_ties`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value
from tarsus.base.threads import single_threaded
from tarsus.fit.record_problem import RecordFit, RecordProblem, Seen, SeenRecord, Segment
from tarsus.fit.record_ties import Knowledge, TiedWindows
from tarsus.fit.unknowns import Prior
from tarsus.fit.verdict import Verdict, verdict_of
from tarsus.identify.covariance import scatter_over_noise
from tarsus.identify.influence import Influence
from tarsus.identify.walk_feet import alike, asked_of_feet, numbers_of_feet, respread, with_feet
from tarsus.identify.walk_horizon import MOST, WalkFollower, most_of, samples_of
from tarsus.identify.walk_influence import influence_of
from tarsus.identify.walk_symmetry import arms_of, mirrored
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.solve import Output, output_rows

REST = (1e-7, 1e-5)
"""Standard deviations [m, m/s] of a first start about the walker at rest: as far as legs that are stiffer or softer by
what is known of them move it (a tenth of a sag of a micrometre), and friction that holds feet aside; what shakes a
table is slower. Where a start may be ten times as far off, and a hundred times as fast, a descent finds feet that slip
otherwise at first, and friction on the wrong side of its limit."""
NEAR = (1e-6, 1e-3)
"""The same of the first of the windows that are still fitted, about where it was found: nothing is kept of it."""
TIED = (3e-9, 3e-6)
"""Standard deviations [m, m/s] of a start about the end of the window before: what no model has of a motion within a
millisecond, far below the noise of any instrument that sees it, for a record has dozens of windows."""
SLACK = 60.0
"""Times as loose as in the end windows are tied at first, where the cost is smoother."""
ZERO = 1e-5
"""Standard deviation of the zero of a displacement [m] from record to record; of an angle over the arm."""
FOLLOWED = 1.3
"""Mean square over the noise, but for its scatter, up to which a window is followed: an estimate is good to a tenth."""
STRAY = 6.0
"""Times its noise up to which each sample of a window is when it is followed: noise is beyond once in 5e8 samples. An
impact at another moment than in the record leaves one sample of a current or a velocity far off, which hardly moves the
mean square: a restitution wrong by 11 %, by 0.2 % in its own account, left one of 8 and one of 10 among 12,000."""
JUMP = 2.5
"""Standard deviations of a tie up to which starts may differ from the ends before: where the model is that of the robot
they do by 0.7 to 1.7 at most, in dozens of windows, for what ties allow is far above what a model misses; on ground
that is 0.2 um rougher than the scene says by 3.2 to 3.6, and adhesion then errs by as many of its own."""
ALL = 0.9
"""Share of the samples that are followed of which all are taken to be: the last contacts of a record may be lost."""
TIES = 40
"""Steps of a descent of all windows together."""
JOINED = 3
"""Times that windows which are not followed in the end, or jump, are joined to those before them."""
ROUNDS = 4
"""How often windows are tied and the spread from foot to foot is estimated again."""
STARTS = 2
"""How often records are taken up, each time from other numbers that are drawn, where windows are not followed, jump, or
ask for more unknowns: of seven robots one ended in another minimum at its first start."""
FEW = 12
"""Samples of a record below which nothing is found of it."""


@dataclass(frozen=True)
class WalkRecord:
    """Channels of a walk.

    scene: the robot as far as it is known, with the drives of the record; times (nt,) [s] after the start of the
    drives, in order; outputs (nc): what each channel sees; values (nc, nt); noise (nc,): standard deviations;
    estimated: whether these are taken from the records, and follow what fits leave; name: for messages; set: the set
    that it is of.

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
    set: str = ""

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

    def volts(self, times: Floats) -> float:
        """Highest voltage [V] of its drives at some times [s]."""
        return max(float(np.abs(one.volts(times)).max()) for one in self.scene.actuator_volts.values())

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

    paths (np,); values (np,) [SI]; covariance (np, np) of the logarithms, what was known beforehand included, as noise
    leaves it and windows, records and sets scatter beyond it, and the square of the step that a descent which ended
    early had ahead; prior (np,): standard deviations of the logarithms beforehand; influence: of windows; edges: of the
    windows, by record [s]; residuals: by record, (nc, nt) over the noise, NaN outside of the windows; good (nw,):
    windows of all records that are followed to their noise; followed: share of the samples that are in these; settled:
    whether the numbers would go no further; asked: by how many times the limit records ask for ground that differs from
    foot to foot, by path; apart: spread of logarithms from foot to foot by path; feet: each foot's own number [SI],
    with the standard deviation of its logarithm; jump: by how many standard deviations of its tie the start of a window
    is off the end before, at most.
    """

    paths: tuple[str, ...]
    values: Floats
    covariance: Floats
    prior: Floats
    influence: Influence
    edges: tuple[Floats, ...]
    residuals: tuple[Floats, ...]
    good: NDArray[np.bool_]
    followed: float
    settled: bool = True
    asked: Mapping[str, float] = field(default_factory=dict)
    apart: Mapping[str, float] = field(default_factory=dict)
    feet: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    jump: float = 0.0

    def interval(self, path: str) -> tuple[float, float]:
        """95 % interval of a number [SI]."""
        j = self.paths.index(path)
        reach = float(np.exp(1.96 * np.sqrt(self.covariance[j, j])))
        return float(self.values[j]) / reach, float(self.values[j]) * reach

    def verdict(self, path: str) -> Verdict:
        """Whether the records determine a number."""
        j = self.paths.index(path)
        of_prior = float(np.sqrt(self.covariance[j, j]) / self.prior[j])
        return verdict_of(self.interval(path), of_prior=of_prior, doubted=self.followed < ALL or self.jump > JUMP)


def _walker(records: Sequence[WalkRecord]) -> Walker:
    walker = records[0].scene.robot.structure
    assert isinstance(walker, Walker)
    return walker


def _of_start(walker: Walker, spread: tuple[float, float]) -> Floats:
    """Standard deviations (2n,) of a start whose displacements and velocities have these: of angles over the arm."""
    arms = arms_of(walker)
    over = np.ones(walker.size)
    over[: walker.body_size] = [1.0 / arms.get(name, 1.0) for name in walker.body_coordinates]
    return np.concatenate([spread[0] * over, spread[1] * over])


def _problem(records: Sequence[WalkRecord], spread: Mapping[str, float]) -> RecordProblem:
    """Numbers of the walker and its ground, and zeros of the records about those of their first samples, where the
    walker stands as before its drives begin."""
    scenes = tuple(one.scene for one in records)
    priors = {path: Prior(float(get_value(scenes[0], path)), factor=float(np.exp(one))) for path, one in spread.items()}
    problem = RecordProblem(scenes, tuple(one.seen() for one in records), priors)
    plans = [problem.lowered(np.zeros(len(priors)), number)[1] for number in range(len(records))]
    for one, plan in zip(records, plans, strict=True):
        there = output_rows(one.scene, one.outputs, one.times[:1]).x @ plan.initial[: len(plan.initial) // 2]
        priors |= {
            one.zero(k): Prior(
                float(one.values[k, 0] - there[k]), sd=ZERO / arms_of(_walker(records)).get(one.outputs[k].at, 1.0)
            )
            for k in one.shifted
        }
    return replace(problem, priors=priors)


def _residuals(problem: RecordProblem, segments: Sequence[Segment], moved: Floats) -> tuple[Floats, ...]:
    """What windows leave over the noise, by record (nc, nt); NaN outside of them."""
    left = problem.residuals(segments, np.zeros((len(segments), len(segments[0].state))), moved)
    out = [np.full(one.values.shape, np.nan) for one in problem.records]
    for segment, mine in zip(segments, left, strict=True):
        times = problem.records[segment.record].times
        out[segment.record][:, (times > segment.span[0]) & (times <= segment.span[1])] = mine
    return tuple(out)


def _with_noise(
    problem: RecordProblem, segments: Sequence[Segment], moved: Floats, records: Sequence[WalkRecord]
) -> RecordProblem:
    """Where the noise is not known, by the median of what the windows leave, which those few that are not followed do
    not move."""
    if not any(one.estimated for one in records):
        return problem
    out = []
    for one, record, left in zip(problem.records, records, _residuals(problem, segments, moved), strict=True):
        scale = 1.4826 * np.nanmedian(np.abs(left), axis=1) if record.estimated else np.ones(len(left))
        pairs = zip(one.channels, scale.tolist(), strict=True)
        out.append(replace(one, channels=tuple(replace(c, noise=c.noise * by) for c, by in pairs)))
    return replace(problem, records=tuple(out))


@single_threaded
def identify_walk(
    records: Sequence[WalkRecord], spread: Mapping[str, float], *, differing: Sequence[str] = (), differ: bool = False
) -> WalkFit:
    """Find numbers of a walker and its ground from records that begin with its drives.

    Parameters
    ----------
    records
        Of one walker, whose scenes differ in their drives, and their names from each other.
    spread
        Paths of what is not known exactly, with standard deviations of their logarithms.
    differing
        Paths among them that may differ from foot to foot, where the records ask for it: the ground's number is then
        their geometric mean (`tarsus.identify.walk_feet`).
    differ
        Whether they are known to.

    Raises
    ------
    InputError
        Without records.
    """
    if not records:
        raise InputError("expected records of a walk, got none")
    problem = _problem(records, spread)
    begun = np.zeros(len(problem.priors))
    segments, moved, windows = _taken_up(problem, records, begun)
    problem = _with_noise(problem, segments, moved, records)
    ties, asked = _of_start(_walker(records), TIED), dict[str, float]()
    joint = _together(TiedWindows(problem, ties, windows), segments, moved)
    more = dict[str, float]()
    for seed in range(STARTS):  # another start is the simpler answer than ground that differs from foot to foot
        joint = _again(joint, records, begun, seed) if seed else joint
        more = {} if differ else asked_of_feet(*joint, differing)
        if not more and not joint.missing(records) and joint.jump <= JUMP:
            break
    if differ and differing:
        joint = _by_foot(joint, records, differing)
    while more:
        path = max(more, key=lambda one: more[one])
        other = _by_foot(joint, records, [path])
        # named where what is left is noise: a window that went another way asks for many things, and none mends it
        if other.missing(records) > joint.missing(records) or other.jump > JUMP:
            break
        joint, asked = other, {**asked, path: more[path]}
        more = asked_of_feet(*joint, [path for path in differing if path not in asked])
    return _found(records, spread, joint, asked)


class _Joint(NamedTuple):
    """All windows, and where they went down together."""

    windows: TiedWindows
    fit: RecordFit

    @property
    def good(self) -> NDArray[np.bool_]:
        """Windows (nw,) that are followed to their noise, every sample of them."""
        near = self.fit.farthest < STRAY
        return near & (self.fit.left < most_of(self.windows.problem, self.fit.segments, FOLLOWED))

    @property
    def followed(self) -> float:
        """Samples in windows that are followed to their noise."""
        return float(samples_of(self.windows.problem, self.fit.segments) @ self.good)

    @property
    def tied(self) -> NDArray[np.bool_]:
        """Windows (nw,) that start where the one before ended, within `JUMP`."""
        of = [None, *(one.record for one in self.fit.segments)]
        later = [before == own for before, own in pairwise(of)]
        out = np.ones(len(later), dtype=np.bool_)
        out[later] = np.abs(self.fit.jumps).reshape(-1, len(self.windows.ties)).max(axis=1) <= JUMP
        return out

    @property
    def jump(self) -> float:
        """By how many standard deviations of its tie the start of a window is off the end before, at most."""
        return float(np.abs(self.fit.jumps).max(initial=0.0))

    def missing(self, records: Sequence[WalkRecord]) -> float:
        """Samples that would have to be followed for all to be taken to be."""
        return max(ALL * sum(len(one.times) for one in records) - self.followed, 0.0)


def _together(windows: TiedWindows, segments: Sequence[Segment], moved: Floats) -> _Joint:
    """All windows after a descent; those that are not followed, or jump, are joined to the ones before them."""
    joint = _Joint(windows, windows.solve(segments, moved, rounds=TIES, exact=True))
    for _ in range(JOINED):
        joined = _joined(joint.fit.segments, joint.good & joint.tied)
        if len(joined) == len(joint.fit.segments):
            break
        other = _Joint(windows, windows.solve(joined, joint.fit.moved, rounds=TIES, exact=True))
        if (-other.followed, other.jump) >= (-joint.followed, joint.jump):
            break
        joint = other
    return joint


def _by_foot(joint: _Joint, records: Sequence[WalkRecord], paths: Sequence[str]) -> _Joint:
    """The same where the ground's numbers at paths differ from foot to foot, as far as they are found to; records that
    were not followed to their ends are taken up again."""
    problem = with_feet(joint.windows.problem, paths)
    moved = np.append(joint.fit.moved, np.zeros(len(problem.priors) - len(joint.fit.moved)))
    joint = _together(TiedWindows(problem, joint.windows.ties, joint.windows), joint.fit.segments, moved)
    if joint.missing(records) > 0.0:
        joint = _again(joint, records, joint.fit.moved)
    for _ in range(ROUNDS - 1):
        other, moved = respread(joint.windows.problem, joint.fit)
        if alike(joint.windows.problem, other):
            break
        joint = _together(TiedWindows(other, joint.windows.ties, joint.windows), joint.fit.segments, moved)
    return joint


def _again(joint: _Joint, records: Sequence[WalkRecord], moved: Floats, seed: int = 0) -> _Joint:
    """Records taken up again from numbers (np,), or the joint descent as it is, whichever leaves less in doubt; where
    neither leaves any, whichever leaves less."""
    problem, ties = joint.windows.problem, joint.windows.ties
    segments, moved, windows = _taken_up(problem, records, moved, seed)
    other = _together(TiedWindows(problem, ties, windows), segments, moved)
    return min(joint, other, key=lambda one: (one.missing(records), max(one.jump, JUMP), one.fit.cost))


def _found(
    records: Sequence[WalkRecord], spread: Mapping[str, float], joint: _Joint, asked: Mapping[str, float]
) -> WalkFit:
    """What all windows together say."""
    fit, problem = joint.fit, joint.windows.problem
    paths, prior = tuple(spread), np.array(list(spread.values()))
    influence, known = influence_of(records, fit, joint.windows.pulls(fit), paths, prior)
    ahead = fit.ahead[: len(paths)] * prior
    values = {path: fit.values[path] for path in paths}
    alike = mirrored(_walker(records), records, values)
    covariance = scatter_over_noise(influence, known) + np.outer(ahead, ahead) + alike
    ends = [[one.span for one in fit.segments if one.record == k] for k in range(len(records))]
    count = sum(len(one.times) for one in records)
    return WalkFit(
        paths,
        np.array(list(values.values())),
        covariance,
        prior,
        influence,
        tuple(np.array([one[0][0], *(end for _, end in one)]) for one in ends),
        _residuals(problem, fit.segments, fit.moved),
        joint.good,
        joint.followed / count,
        fit.settled,
        asked,
        *numbers_of_feet(problem, fit, spread),
        joint.jump,
    )


def _joined(segments: Sequence[Segment], good: NDArray[np.bool_]) -> list[Segment]:
    """The windows, each that is not good as part of the one before it in its record: with numbers that all others tell,
    what comes before predicts it better than a start of its own, from which a foot goes another way."""
    out = list[Segment]()
    for one, followed in zip(segments, good, strict=True):
        if not followed and out and out[-1].record == one.record:
            out[-1] = replace(out[-1], span=(out[-1].span[0], one.span[1]))
        else:
            out.append(one)
    return out


def _taken_up(
    problem: RecordProblem, records: Sequence[WalkRecord], moved: Floats, seed: int = 0
) -> tuple[list[Segment], Floats, TiedWindows]:
    """Windows of all records, taken up one after the other, each from the numbers that those before leave, the first
    from some (np,) or what is drawn about them; numbers; and what ties them."""
    walker = _walker(records)
    rest, near, ties = (_of_start(walker, one) for one in (REST, NEAR, TIED))
    known, windows = Knowledge.beforehand(len(problem.priors)), TiedWindows(problem, SLACK * ties)
    segments = list[Segment]()
    for number in range(len(records)):
        most = FOLLOWED if records[number].estimated else MOST
        at = WalkFollower(windows, number, rest, near, most, seed).follow(moved, known)
        moved, known = at.moved, Knowledge.of(at.moved, at.covariance)
        segments += at.segments
    return segments, moved, windows
