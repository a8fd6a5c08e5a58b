"""What manufacture does to a robot: the robots to run, and what their runs say of yield and of the legs."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arguments import Counts, Quantities, Quantity, Ranges, Values
from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError, InputProblem
from tarsus.base.progress import Progress
from tarsus.base.units import parse_quantity, quantity_of
from tarsus.base.verb import verb
from tarsus.base.workers import Workers
from tarsus.files.jsontext import json_text
from tarsus.files.library import SceneLike, as_scene
from tarsus.files.output import MANIFEST
from tarsus.files.runstore import SWEEP_FILES
from tarsus.files.version import package_version
from tarsus.files.whole import write_text
from tarsus.measure.shares import share_of
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.solve import ResultCode, Run
from tarsus.study.manufacture import Saltelli, Scattered
from tarsus.study.robots import Robots
from tarsus.study.summary import read_scored
from tarsus.study.sweep import Sweep
from tarsus.study.sweeping import SweepResult, run_sweep
from tarsus.study.workunit import OUTCOMES
from tarsus.tables.numbers import amount, interval, percent, spaced
from tarsus.tables.table import ROW, Column, Table, Tabled

WALKS, BOUNCES = ("mean_speed", "cost_of_transport"), ("peak", "bounces")
"""Measures unless others are asked for: of a walker how fast it walks, and at what price; of any other robot how high
and how often its foot bounces."""

LESS = (
    "cost_of_transport",
    "electrical_energy",
    "foot_slip",
    "slip_ratio",
    "impact_speed",
    "hardest_impact",
    "vertical_amplitude",
)
"""Measures that are better the smaller they are; of all others more is better."""

SHARES = (0.99, 0.9, 0.5, 0.1)
"""Shares of robots whose requirements are listed: nearly all, nine in ten, half, and the best tenth."""

ENOUGH = 8
"""Robots below which a group has no quantiles worth printing."""


@dataclass(frozen=True)
class YieldCurve:
    """Share of robots that meet a requirement on a measure, against the requirement.

    less: whether a value below the requirement meets it; requirement, share, low, high (n,): SI, and the 95 % interval
    of the share (Wilson's, as if robots were drawn by chance; Sobol's are spread more evenly, so it is a little wide).
    """

    measure: str
    unit: str
    less: bool
    requirement: Floats
    share: Floats
    low: Floats
    high: Floats

    def met_by(self, share: float) -> float | None:
        """The hardest requirement [SI] that such a share of the robots meets; None where none is."""
        met = self.requirement[self.share >= share]
        return float(met.min() if self.less else met.max()) if len(met) else None


YIELD_FILES = (
    "yield.json",
    "report.html",
    *(f"{place}/{name}" for place in ("robots", "legs") for name in SWEEP_FILES),
)
"""Everything that a yield has in its folder, as glob patterns."""

MOST_DRAWS = 2**20
"""More draws than this are not worth naming: the two are alike."""


@dataclass(frozen=True)
class Leader:
    """The group whose scatter makes most of a measure's variance, as far as that is known.

    group, total, error: its name, total index and half-width of the 95 % interval; rivals: groups whose intervals
    overlap its own, the largest first; draws: about how many would separate it from the first rival, None where no
    number in reach would.
    """

    group: str
    total: float
    error: float
    rivals: tuple[str, ...]
    draws: int | None

    @property
    def resolved(self) -> bool:
        """Whether no interval overlaps its own."""
        return not self.rivals

    def sentence(self, measure: str) -> str:
        """What there is to say."""
        if not self.rivals:
            return f"scatter of {self.group} matters most for {measure}: {self.total:.2f} ± {self.error:.2f}"
        more = f"about {self.draws} draws would" if self.draws else "more draws would hardly"
        rival, *rest = self.rivals
        others = f" and {len(rest)} more" if rest else ""
        return (
            f"whose scatter matters most for {measure} is not resolved: {self.group} {self.total:.2f} ± "
            f"{self.error:.2f}, and the interval of {rival}{others} overlaps it; {more} separate these two"
        )


def leader_of(indices: Mapping[str, Mapping[str, float]], draws: int) -> Leader | None:
    """The leader of groups with indices as `Saltelli.indices` gives them from so many draws; None without groups.

    Half-widths shrink with the square root of the number of draws.
    """
    ranked = sorted(indices.items(), key=lambda one: -one[1]["total"])
    if not ranked:
        return None
    name, own = ranked[0]
    low = own["total"] - own["total_error"]
    rivals = [(group, one) for group, one in ranked[1:] if one["total"] + one["total_error"] >= low]
    wanted = None
    if rivals:
        apart, both = own["total"] - rivals[0][1]["total"], own["total_error"] + rivals[0][1]["total_error"]
        if apart > 0.0 and draws * (both / apart) ** 2 <= MOST_DRAWS:
            wanted = 2 ** int(np.ceil(np.log2(draws * (both / apart) ** 2)))
    return Leader(name, own["total"], own["total_error"], tuple(group for group, _ in rivals), wanted)


@dataclass(frozen=True, repr=False)
class Yield(Tabled):
    """What the runs say.

    values (nr,) of every measure by name, NaN of a robot that failed; lost (nr,) number of dead legs; curves by
    measure; outcomes: runs by how they ended; by_dead: for each number of dead legs robots, failed, and quantiles 5,
    50, 95 % of each measure; cost: by leg the mean of the first measure when it is dead, minus that when it is not, and
    its standard error; indices: by measure and group, as `Saltelli.indices`, from so many draws; required [SI] by
    measure, None where nothing is; motion: what measures are taken over, in words; settled: share of all starts from
    which robots repeat at the end, None of an episode.
    """

    robots: Robots
    measures: tuple[str, ...]
    units: Mapping[str, str]
    values: Mapping[str, Floats]
    lost: NDArray[np.int64]
    curves: Mapping[str, YieldCurve]
    outcomes: Mapping[str, int]
    by_dead: Sequence[Mapping[str, Any]]
    cost: Mapping[str, tuple[float, float]]
    indices: Mapping[str, Mapping[str, Mapping[str, float]]]
    draws: int = 0
    required: Mapping[str, float | None] = field(default_factory=dict)
    motion: str = ""
    settled: float | None = None

    @property
    def leaders(self) -> dict[str, Leader]:
        """By measure, of which indices are known."""
        found = {name: leader_of(one, self.draws) for name, one in self.indices.items()}
        return {name: one for name, one in found.items() if one is not None}

    def share(self, measure: str, requirement: float) -> tuple[float, float, float]:
        """Share of robots that meet a requirement [SI], and its 95 % interval; a failed robot meets none."""
        values = self.values[measure]
        met = values <= requirement if measure in LESS else values >= requirement
        return share_of(int(np.count_nonzero(met)), len(values))

    @property
    def shares(self) -> dict[str, tuple[float, float, float]]:
        """By measure that something is required of, as `share`."""
        return {name: self.share(name, value) for name, value in self.required.items() if value is not None}

    def table(self) -> Table:
        """The requirements that given shares of the robots meet; how runs ended, the shares that meet what is required,
        and whose scatter matters most."""
        rows = [
            (
                spaced(name),
                "at most" if curve.less else "at least",
                *(curve.met_by(share) for share in SHARES),
                self._met(name),
            )
            for name, curve in self.curves.items()
        ]
        notes = [one.sentence(name) for name, one in self.leaders.items()]
        if self.settled is not None:
            of = "measures are means over settled motions by their share of the starts"
            notes.insert(0, f"{of}; {percent(self.settled)} of the runs had settled")
        columns = ["measure", "is", *(Column(f"{share:.0%} of robots", ROW) for share in SHARES)]
        ended = Table("", ["runs", "outcome"], [(n, OUTCOMES[name]) for name, n in self.outcomes.items()])
        return Table(
            f"{self.robots.scene.name}: {len(self.lost)} robots, {self.motion}",
            [*columns, "what is required"],
            rows,
            notes=notes,
            parts=[ended],
            units=[self.units[name] for name in self.curves],
        )

    def _met(self, name: str) -> str | None:
        """The requirement on a measure, and the share of robots that meet it, in words."""
        value = self.required.get(name)
        if value is None:
            return None
        share, low, high = self.shares[name]
        return f"{amount(value, self.units[name])}: {percent(share)} ({interval(low, high, '%', 3)})"

    def to_dict(self) -> dict[str, Any]:
        """Everything but the single robots, as plain values."""
        curves = {
            name: {key: getattr(one, key) for key in ("unit", "less", "requirement", "share", "low", "high")}
            for name, one in self.curves.items()
        }
        return {
            "scene": self.robots.scene.name,
            "robots": len(self.lost),
            "motion": self.motion,
            "settled": self.settled,
            "measures": list(self.measures),
            "outcomes": dict(self.outcomes),
            "curves": curves,
            "by_dead": list(self.by_dead),
            "cost_of_a_dead_leg": {leg: {"difference": d, "error": e} for leg, (d, e) in self.cost.items()},
            "indices": {name: dict(one) for name, one in self.indices.items()},
            "shares": {name: list(one) for name, one in self.shares.items()},
            "matters_most": {name: asdict(one) | {"resolved": one.resolved} for name, one in self.leaders.items()},
        }


@verb
def yield_(
    scene: SceneLike,
    scatter: Quantities | None = None,
    over: Ranges | None = None,
    *,
    dead: Counts = (0, 0),
    weak: Counts = (0, 0),
    weakness: Quantity = "50 %",
    require: Values | None = None,
    robots: int = 1024,
    draws: int = 0,
    starts: int | None = None,
    duration: float | str | None = None,
    from_rest: float | str | None = None,
    seed: int = 0,
    output: str | os.PathLike[str] | None = None,
    chunk: int | str = "2 s",
    resume: bool = False,
    threads: Workers = None,
    progress: Progress | None = None,
) -> Yield:
    """Build many robots with the scatter of a workshop, run each on a ground of its own, and say how many are good.

    Parameters
    ----------
    scene
        The robot of the drawing: a device (see `tarsus devices`), a scene file, or a scene.
    scatter
        By path, the standard deviation of its value, SI or "2 um", or "5%" of the scene's own. `*` in a path stands for
        every leg, each of which is drawn by itself: "robot.drives.*.law.gain=10%".
    over
        By path, both ends of a range that is drawn from evenly, such as that of a ground: 0.3 and 0.5.
    dead
        Fewest and most legs whose drive does nothing.
    weak
        Fewest and most legs whose drive has only a share of its gain.
    weakness
        That share.
    require
        Measures that robots are judged by, each with the value that a good one has, or alone; when left out mean speed
        and cost of transport of a walker, peak and bounces of any other robot. Of costs, slips and impacts less is
        better, of all other measures more.
    robots
        Number of robots.
    draws
        Draws behind Sobol indices (a power of 2), which say whose scatter matters; they take (groups + 2) times as many
        further runs. 0: none.
    starts
        Starts of every robot, 4 of a walker: its measures are means over its settled motions by their share of them.
    duration
        Longest time that a run takes to settle, 1 s or more.
    from_rest
        Measure an episode of so long from the scene's own start instead, e.g. "200 ms"; what is counted by drive period
        without the first third of them.
    seed
        Of all draws.
    output
        Folder for both sweeps, yield.json and report.html; by default the scene's name with `.yield`.
    chunk
        Runs in a unit of work, or the time that one takes.
    resume
        Continue what the folder holds.
    threads
        Worker threads, by default one for each processor that this process may use, or an executor.
    progress
        Called as ``progress(runs done, runs, "robots" or "legs")``.

    Raises
    ------
    InputError
        With everything that is wrong in the scatter and the requirements; as `tarsus.sweep`; where no run reached its
        end.

    Examples
    --------
    >>> import tarsus as ts
    >>> found = ts.yield_("millipede", {"robot.drives.*.law.gain": "10%"}, dead=(0, 1), robots=16,
    ...                   require={"mean_speed": "50 um/s"})  # doctest: +SKIP
    >>> found.share("mean_speed", 50e-6)  # doctest: +SKIP
    (0.75, 0.51, 0.9)
    """
    drawing = as_scene(scene)
    share = quantity_of("weakness", weakness, "1")
    drawn = Robots.of(drawing, scatter or {}, over, dead=dead, weak=weak, weakness=share)
    options = {"chunk": chunk, "starts": starts, "duration": duration, "from_rest": from_rest, "seed": seed}
    walks = isinstance(drawing.robot.structure, Walker)
    asked = dict.fromkeys(WALKS if walks else BOUNCES) if require is None else require
    with _named():
        sweep = drawn.sweep(robots, list(asked), **options)
    required = _required(drawing, asked)
    with _named():
        legs = drawn.legs_sweep(draws, list(asked), **options) if draws else None
    if draws and legs is None:
        said = "Sobol indices compare the scatter of two legs or numbers at least; give 0 draws, or more"
        raise InputError(InputProblem.at("draws", said))
    name = scene if isinstance(scene, str | os.PathLike) else drawing.name
    folder = Path(output) if output is not None else Path(f"{Path(name).stem}.yield")
    present = sorted(one.name for one in folder.iterdir() if one.name != MANIFEST) if folder.is_dir() else []
    if resume and present and "robots" not in present:
        raise InputError(f"'{folder}' holds no yield to continue: it has {present[0]} but no robots")
    done: list[SweepResult] = []
    for part, one in (("robots", sweep), ("legs", legs)):
        if one is not None:
            place, report = folder / part, None if progress is None else partial(_report, progress, part)
            again = resume and place.exists()
            done.append(run_sweep(one, place, resume=again, threads=threads, progress=report))
    found = judged(drawn, [one for one in (sweep, legs) if one is not None], done, required)
    write_text(folder / "yield.json", json_text(found.to_dict() | {"tarsus": package_version()}) + "\n")
    return found


def _report(progress: Progress, part: str, done: int, runs: int, _: object) -> None:
    progress(done, runs, part)


def _required(scene: Scene, require: Values) -> dict[str, float | None]:
    """Requirements [SI] by measure, None where a measure has none. Raises InputError with each that is wrong."""
    known = Run.offered(scene, scene.duration)
    required: dict[str, float | None] = {}
    problems: list[str] = []
    for name, value in require.items():
        try:
            required[name] = None if value is None else parse_quantity(value, known[name].unit)  # type: ignore[arg-type]
        except InputError as error:
            problems += [InputProblem.at(name, one) for one in error.problems]
    if problems:
        raise InputError(problems)
    return required


_FIELDS = (
    ("Scattered.count", "robots"),
    ("Scattered.weakness", "weakness"),
    ("Saltelli.count", "draws"),
    ("Sweep.measures", "require"),
    ("Sweep.starts", "starts"),
    ("Sweep.from_rest", "from_rest"),
    ("Sweep.duration", "duration"),
    ("Sweep.vary", "dead, weak"),
)
"""Fields of a sweep, and the arguments that they come from."""


def _filled(name: str, values: Floats) -> Floats:
    """Values (n,) of a measure where failed runs count as the worst that was seen: SALib takes no gaps."""
    worst = np.nanmax(values) if name in LESS else np.nanmin(values)
    return np.where(np.isfinite(values), values, worst)


@contextlib.contextmanager
def _named() -> Iterator[None]:
    """Problems with fields of a sweep, said of the arguments that they come from."""
    try:
        yield
    except InputError as error:
        names = [next((own for name, own in _FIELDS if one.path.startswith(name)), "") for one in error.problems]
        problems = zip(names, error.problems, strict=True)
        raise InputError([InputProblem.at(name, one.said) if name else one for name, one in problems]) from None


def judged(
    robots: Robots, sweeps: Sequence[Sweep], done: Sequence[SweepResult], required: Mapping[str, float | None]
) -> Yield:
    """What finished runs say: those of the robots, and those of the legs where they were made.

    Raises
    ------
    InputError
        When no robot's run reached its end.
    """
    sweep, file, outcomes = sweeps[0], done[0].file, done[0].outcomes
    if not outcomes.get(ResultCode.DONE.name):
        raise InputError("no robot's run reached its end: see its sweep.nc for how they ended")
    scored, kinds = read_scored(sweep, file), Run.offered(sweep.scene, sweep.seconds)
    found, units = scored.values, {name: kinds[name].unit for name in sweep.measures}
    design = sweep.design
    assert isinstance(design, Scattered)
    dead = design.left(sweep.vary, slice(0, sweep.runs)) == 0.0
    lost = dead.sum(axis=1)
    indices, draws = {}, 0
    for legs, result in zip(sweeps[1:], done[1:], strict=True):
        assert isinstance(legs.design, Saltelli)
        draws = legs.design.count
        for name, one in read_scored(legs, result.file).values.items():
            filled = _filled(name, one)
            indices[name] = legs.design.indices(filled) if np.ptp(filled) > 0.0 else {}
    first = found[sweep.measures[0]]
    return Yield(
        robots,
        sweep.measures,
        units,
        found,
        lost,
        {name: _curve(name, units[name], one) for name, one in found.items()},
        outcomes,
        [_group(int(n), lost == n, found) for n in np.unique(lost)],
        {robots.legs.get(path, path): _difference(first, dead[:, i]) for i, path in enumerate(design.parts)},
        indices,
        draws,
        required,
        str(sweep.motion),
        scored.repeating,
    )


def _curve(name: str, unit: str, values: Floats) -> YieldCurve:
    finite = np.sort(values[np.isfinite(values)])
    at = np.unique(np.quantile(finite, np.linspace(0.0, 1.0, 101)))
    counts = [np.count_nonzero(finite <= one if name in LESS else finite >= one) for one in at]
    rows = np.array([share_of(int(met), len(values)) for met in counts])
    return YieldCurve(name, unit, name in LESS, at, rows[:, 0], rows[:, 1], rows[:, 2])


def _group(number: int, members: NDArray[np.bool_], found: Mapping[str, Floats]) -> dict[str, Any]:
    out: dict[str, Any] = {"dead": number, "robots": int(members.sum())}
    out["failed"] = int(np.isnan(next(iter(found.values()))[members]).sum())
    for name, values in found.items():
        own = values[members]
        own = own[np.isfinite(own)]
        out[name] = np.quantile(own, (0.05, 0.5, 0.95)).tolist() if len(own) >= ENOUGH else None
    return out


def _difference(values: Floats, dead: NDArray[np.bool_]) -> tuple[float, float]:
    """Mean with and without, and the standard error of the difference; NaN where one side has too few."""
    sides = [values[side & np.isfinite(values)] for side in (dead, ~dead)]
    if min(map(len, sides)) < ENOUGH:
        return np.nan, np.nan
    error = np.sqrt(sum(float(np.var(one, ddof=1)) / len(one) for one in sides))
    return float(sides[0].mean() - sides[1].mean()), float(error)
