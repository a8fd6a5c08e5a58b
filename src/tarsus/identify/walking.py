"""Numbers of a walker and of the ground under it, from records of its body and its currents while it walks.

Records are taken up one after the other, as far as they are predicted and farther with every fit
(`tarsus.identify.walk_horizon`); then all windows and the numbers that they share go down together, every start tied to
the end of the window before (`tarsus.fit.record_ties`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, with_values
from tarsus.fit.record_problem import UNDER, RecordFit, RecordProblem, Seen, SeenRecord, Segment
from tarsus.fit.record_ties import Knowledge, solve_tied
from tarsus.fit.unknowns import Prior
from tarsus.fit.verdict import Verdict, verdict_of
from tarsus.identify.walk_horizon import MOST, WalkFollower, left_of, most_of, samples_of
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.solve import Output, ResultCode, output_rows, simulate

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
JUMP = 2.5
"""Standard deviations of a tie up to which starts may be off the ends before: where the model is that of the robot they
are off by 0.7 to 1.7 at most, in dozens of windows, for what ties allow is far above what a model misses; on ground
that is 0.2 um rougher than the scene says by 3.2 to 3.6, and adhesion is then off by as many of its own."""
ALL = 0.9
"""Share of the samples that are followed of which all are taken to be: the last contacts of a record may be lost."""
TIES = 40
"""Steps of a descent of all windows together."""
JOINED = 3
"""Times that windows which are not followed in the end are joined to those before them."""
APART, LEAST_APART, ROUNDS = 0.1, 0.003, 4
"""Spread of logarithms from foot to foot at first, and at least, where it is less than any interval; and how often
windows are tied and the spread is estimated again."""
UNTOLD = 9.0
"""Sum of squares over the noise below which records do not show that legs are exchanged: three standard deviations."""
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

    paths (np,); values (np,) [SI]; covariance (np, np) of the logarithms, what was known beforehand included, and the
    square of the step that a descent which ended early had ahead; prior (np,): standard deviations of the logarithms
    beforehand; edges: of the windows, by record [s]; residuals: by record, (nc, nt) over the noise, NaN outside of the
    windows; good (nw,): windows of all records that are followed to their noise; followed: share of the samples that
    are in these; settled: whether the numbers would go no further; apart: spread of logarithms from foot to foot by
    path; feet: each foot's own number [SI], with the standard deviation of its logarithm; jump: by how many standard
    deviations of its tie the start of a window is off the end before, at most.
    """

    paths: tuple[str, ...]
    values: Floats
    covariance: Floats
    prior: Floats
    edges: tuple[Floats, ...]
    residuals: tuple[Floats, ...]
    good: NDArray[np.bool_]
    followed: float
    settled: bool = True
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
        return verdict_of(
            self.interval(path), of_prior=of_prior, doubted=self.followed < ALL or self.jump > JUMP
        )


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


def _residuals(problem: RecordProblem, segments: Sequence[Segment], moved: Floats) -> tuple[Floats, ...]:
    """What windows leave over the noise, by record (nc, nt); NaN outside of them."""
    left = problem.residuals(segments, np.zeros((len(segments), len(segments[0].state))), moved)
    out = [np.full(one.values.shape, np.nan) for one in problem.records]
    for segment, mine in zip(segments, left, strict=True):
        times = problem.records[segment.record].times
        out[segment.record][:, (times > segment.span[0]) & (times <= segment.span[1])] = np.array(mine)
    return tuple(out)


def _with_noise(
    problem: RecordProblem, segments: Sequence[Segment], moved: Floats, records: Sequence[WalkRecord]
) -> RecordProblem:
    """Where the noise is not known, by the median of what the windows leave, which those few that are not followed do
    not move."""
    out = []
    for one, record, left in zip(problem.records, records, _residuals(problem, segments, moved), strict=True):
        scale = 1.4826 * np.nanmedian(np.abs(left), axis=1) if record.estimated else np.ones(len(left))
        pairs = zip(one.channels, scale.tolist(), strict=True)
        out.append(replace(one, channels=tuple(replace(c, noise=c.noise * by) for c, by in pairs)))
    return replace(problem, records=tuple(out))


def identify_walk(
    records: Sequence[WalkRecord],
    spread: Mapping[str, float],
    *,
    differing: Sequence[str] = (),
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

    Raises
    ------
    InputError
        Without records.
    """
    if not records:
        raise InputError("expected records of a walk, got none")
    problem = _problem(records, spread)
    segments, moved = _taken_up(problem, records)
    problem = _with_noise(problem, segments, moved, records)
    if differing:
        problem = replace(problem, priors={**problem.priors, **_of_feet(records[0].scene, differing, APART)})
        moved = np.append(moved, np.zeros(len(problem.feet)))
    fit, ties = None, _of_start(_walker(records), TIED)
    for _ in range(ROUNDS if differing else 1):
        if fit is not None:
            problem, moved = _respread(problem, fit)
        fit = solve_tied(problem, segments, moved, ties, rounds=TIES)
        for _ in range(JOINED):
            joined = _joined(fit.segments, _good(problem, fit))
            if len(joined) == len(fit.segments):
                break
            other = solve_tied(problem, joined, fit.moved, ties, rounds=TIES)
            if _lost(problem, other) >= _lost(problem, fit):
                break
            fit = other
        segments, moved = list(fit.segments), fit.moved
    assert fit is not None
    paths, prior = tuple(spread), np.array(list(spread.values()))
    ends = [[one.span for one in segments if one.record == k] for k in range(len(records))]
    residuals, good = _residuals(problem, segments, fit.moved), _good(problem, fit)
    return WalkFit(
        paths, np.array([fit.values[path] for path in paths]),
        (fit.covariance + np.outer(fit.ahead, fit.ahead))[: len(paths), : len(paths)] * np.outer(prior, prior)
        + _untold(records, {path: fit.values[path] for path in paths}), prior,
        tuple(np.array([one[0][0], *(end for _, end in one)]) for one in ends), residuals,
        good, float(samples_of(problem, segments) @ good) / sum(len(one.times) for one in records), fit.settled,
        *_feet(problem, fit, spread), float(np.abs(fit.jumps).max(initial=0.0)),
    )  # fmt: skip


def _joined(segments: Sequence[Segment], good: NDArray[np.bool_]) -> list[Segment]:
    """The windows, each that is not followed as part of the one before it in its record: with numbers that all others
    tell, what comes before predicts it better than a start of its own, from which a foot goes another way."""
    out = list[Segment]()
    for one, followed in zip(segments, good, strict=True):
        if not followed and out and out[-1].record == one.record:
            out[-1] = replace(out[-1], span=(out[-1].span[0], one.span[1]))
        else:
            out.append(one)
    return out


def _good(problem: RecordProblem, fit: RecordFit) -> NDArray[np.bool_]:
    """Windows (nw,) that are followed to their noise."""
    return left_of(fit) < most_of(problem, fit.segments, FOLLOWED)


def _lost(problem: RecordProblem, fit: RecordFit) -> float:
    """Samples in windows that are not followed."""
    return float(samples_of(problem, fit.segments) @ np.logical_not(_good(problem, fit)))


def _taken_up(problem: RecordProblem, records: Sequence[WalkRecord]) -> tuple[list[Segment], Floats]:
    """Windows of all records, taken up one after the other, each from the numbers that those before leave; and
    numbers."""
    walker = _walker(records)
    rest, near, ties = (_of_start(walker, one) for one in (REST, NEAR, TIED))
    moved, known = np.zeros(len(problem.priors)), Knowledge.beforehand(len(problem.priors))
    segments = list[Segment]()
    for number in range(len(records)):
        most = FOLLOWED if records[number].estimated else MOST
        at = WalkFollower(problem, number, rest, near, SLACK * ties, most).follow(moved, known)
        moved, known = at.moved, Knowledge.of(at.moved, at.covariance)
        segments += at.segments
    return segments, moved


def _untold(records: Sequence[WalkRecord], values: Mapping[str, float]) -> Floats:
    """What it adds to the covariance (np, np) of logarithms that records show no difference when legs are exchanged, as
    surge and heave do not where legs that face each other across the middle go together: of two answers that are as
    likely the second moment about one is half the square of the distance."""
    paths, logs = list(values), np.log(list(values.values()))
    out = np.zeros((len(paths), len(paths)))

    def shown(numbers: Mapping[str, float]) -> list[Floats] | None:
        runs = [simulate(with_values(one.scene, numbers), float(one.times[-1])) for one in records]
        if any(one.ended is not ResultCode.DONE for one in runs):
            return None
        return [
            run.outputs(list(one.outputs), one.times) / one.noise[:, None]
            for run, one in zip(runs, records, strict=True)
        ]

    for to in _exchanges(_walker(records)):
        other = [_of_other(path, to) for path in paths]
        if set(other) != set(paths):
            continue
        exchanged = {path: values[at] for path, at in zip(paths, other, strict=True)}
        one, two = shown(values), shown(exchanged)
        off = np.log(list(exchanged.values())) - logs
        if one and two and sum(float(np.sum((a - b) ** 2)) for a, b in zip(one, two, strict=True)) < UNTOLD:
            out += 0.5 * np.outer(off, off)
    return out


def _exchanges(walker: Walker) -> list[dict[str, str]]:
    """In whose place each leg stands when the robot is turned half round, or mirrored in its middle or its axis."""
    legs, out = walker.legs, list[dict[str, str]]()
    near = 1e-3 * max(_arms(walker).values())
    for x, y in ((-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0)):
        to = {
            name: next(
                (k for k, at in legs.items() if np.hypot(at.x - x * one.x, at.y - y * one.y) < near), ""
            )
            for name, one in legs.items()
        }
        if set(to.values()) == set(legs) and any(name != at for name, at in to.items()):
            out.append(to)
    return out


def _of_other(path: str, to: Mapping[str, str]) -> str:
    """The path of the same number of the leg in whose place one stands; other paths as they are."""
    begin, _, rest = path.partition("robot.structure.legs.")
    leg, dot, name = rest.partition(".")
    return path if begin or leg not in to else f"robot.structure.legs.{to[leg]}{dot}{name}"


def _of_feet(scene: Scene, paths: Sequence[str], apart: float) -> dict[str, Prior]:
    """Factors of the ground's numbers under single feet."""
    names = (f"{UNDER}{foot}: {path}" for path in paths for foot in scene.robot.feet)
    return dict.fromkeys(names, Prior(1.0, factor=float(np.exp(apart))))


def _respread(problem: RecordProblem, fit: RecordFit) -> tuple[RecordProblem, Floats]:
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
    return replace(problem, priors=priors), moved


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
