"""What manufacture does to a robot: the robots to run, and what their runs say of yield and of the legs."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import FloatInfo, float_paths
from tarsus.base.units import format_quantity, parse_quantity
from tarsus.model.scene import Scene
from tarsus.study.axes import Axis, Linspace, Normal
from tarsus.study.manufacture import Saltelli, Scattered
from tarsus.study.sweep import Sweep

__all__ = ["Curve", "Leader", "Robots", "Yield", "leader_of", "read_robots", "yield_of"]

Floats = NDArray[np.float64]

GAINS = "robot.drives.*.law.gain"
"""What a leg is dead by: the gain of its drive."""

LESS = (
    "cost_of_transport", "electrical_energy", "foot_slip", "slip_ratio", "impact_speed", "hardest_impact",
    "vertical_amplitude",
)  # fmt: skip
"""Measures that are better the smaller they are; of all others more is better."""

NORMAL_95 = 1.959964
"""Standard deviations of a 95 % interval."""

ENOUGH = 8
"""Robots below which a group has no quantiles worth printing."""


@dataclass(frozen=True)
class Robots:
    """A scene with what is scattered in its manufacture.

    scatter: axes of values by path; over: axes of grounds by path; legs: the leg of each path that a pattern with
    `*` named; parts: paths that are dead or weak in some; dead, weak: fewest and most; weakness: what is left of a
    weak one.
    """

    scene: Scene
    scatter: Mapping[str, Axis]
    over: Mapping[str, Axis]
    legs: Mapping[str, str]
    parts: tuple[str, ...] = ()
    dead: tuple[int, int] = (0, 0)
    weak: tuple[int, int] = (0, 0)
    weakness: float = 0.5

    def sweep(self, count: int, measures: Sequence[str], *, seed: int = 0, chunk: int | str = 64) -> Sweep:
        """Runs of so many robots, each on a ground of its own."""
        design = Scattered(
            count=count, seed=seed, parts=self.parts, dead=self.dead, weak=self.weak, weakness=self.weakness
        )
        return self._sweep("robots", design, {**self.scatter, **self.over}, measures, chunk)

    def legs_sweep(
        self, count: int, measures: Sequence[str], *, seed: int = 0, chunk: int | str = 64
    ) -> Sweep | None:
        """Runs that tell how much each leg's scatter matters, no leg being dead; None where fewer than two vary."""
        axes = {name: axis for name, axis in {**self.scatter, **self.over}.items() if np.ptp(axis.ends) > 0.0}
        groups = tuple(self.legs.get(name, name) for name in axes)
        if len(set(groups)) < 2:
            return None
        return self._sweep("legs", Saltelli(count=count, seed=seed, groups=groups), axes, measures, chunk)

    def _sweep(
        self, name: str, design: Any, axes: Mapping[str, Axis], measures: Sequence[str], chunk: Any
    ) -> Sweep:
        own: Any = dict(axes)
        return Sweep(
            name=f"{self.scene.name}: {name}", scene=self.scene, vary=own, design=design,
            measures=tuple(measures), chunk=chunk,
        )  # fmt: skip


def read_robots(
    scene: Scene,
    scatter: Sequence[str],
    over: Sequence[str] = (),
    dead: str | None = None,
    weak: str | None = None,
) -> Robots:
    """Robots from the words of a command line.

    Parameters
    ----------
    scene
        The robot of the drawing, on its ground.
    scatter
        ``PATH=5%`` (of the value) or ``PATH=2 um``: standard deviation of the value at a path; `*` in it stands for
        every leg, each of which is drawn by itself.
    over
        ``PATH=a:b``: grounds, evenly drawn.
    dead
        ``legs=0:5``: fewest and most legs whose drive does nothing.
    weak
        ``legs=0:5@60%``: as well, whose drive has so much of its gain left.

    Raises
    ------
    InputError
        With everything that is wrong in the words.
    """
    known, problems = float_paths(scene), []
    axes: dict[str, Axis] = {}
    legs: dict[str, str] = {}
    for word in scatter:
        pattern, _, text = word.partition("=")
        found = [path for path in known if fnmatch.fnmatchcase(path, pattern.strip())]
        if not found or not text.strip():
            problems.append(f"--scatter takes path=5% or path=value, got '{word}'{nearest(pattern, known)}")
        for path in found:
            try:
                axes[path] = _scattered(known[path], text.strip())
            except InputError as error:
                problems += [f"--scatter {pattern}: {one}" for one in error.problems]
                break
            legs |= _leg(pattern.strip(), path)
    grounds: dict[str, Axis] = {}
    for word in over:
        path, _, text = word.partition("=")
        first, colon, last = text.partition(":")
        if path not in known or not colon:
            problems.append(f"--over takes path=a:b, got '{word}'{nearest(path, known)}")
            continue
        try:
            ends = [parse_quantity(one.strip(), known[path].unit) for one in (first, last)]
            grounds[path] = Linspace(start=ends[0], stop=ends[1])
        except InputError as error:
            problems += [f"--over {path}: {one}" for one in error.problems]
    counts = {}
    weakness = 0.5
    for option, text in (("dead", dead), ("weak", weak)):
        counts[option], left = _counted(option, text, problems)
        weakness = left if left is not None else weakness
    gains = [path for path in known if fnmatch.fnmatchcase(path, GAINS)]
    parts = tuple(gains) if any(high for _, high in counts.values()) else ()
    for path in parts:
        axes.setdefault(path, Normal(mean=known[path].value, deviation=0.0))
        legs |= _leg(GAINS, path)
    if not axes and not problems:
        problems.append("nothing is scattered: give --scatter path=5%, or --dead legs=0:5")
    if problems:
        raise InputError(problems)
    return Robots(scene, axes, grounds, legs, parts, counts["dead"], counts["weak"], weakness)


def _scattered(about: FloatInfo, text: str) -> Normal:
    if text.endswith("%"):
        share = parse_quantity(text[:-1].strip(), "1") / 100.0
        if about.value == 0.0:
            raise InputError(
                f"{text} of 0 is nothing: give the standard deviation as a value, such as '2 {about.unit}'"
            )
        return Normal(mean=about.value, deviation=abs(about.value) * share)
    deviation = parse_quantity(text, about.unit)
    if about.value != 0.0 and deviation > MOST_SCATTER * abs(about.value):
        own = format_quantity(about.value, about.unit)
        raise InputError(
            f"a standard deviation of {format_quantity(deviation, about.unit)} is {deviation / abs(about.value):.3g} "
            f"times the value itself, {own}; a share of it is given in percent, such as '{_percent(text)}'"
        )
    return Normal(mean=about.value, deviation=deviation)


MOST_SCATTER = 1.0
"""Standard deviation over the value beyond which a word is taken for a slip: one robot in six would have the value's
other sign."""


def _percent(text: str) -> str:
    """A plain number as the share that was probably meant."""
    plain = re.fullmatch(r"\d+(?:\.\d+)?", text)
    return f"{text}%" if plain and float(text) <= 100.0 else "10%"


def _leg(pattern: str, path: str) -> dict[str, str]:
    """The leg of a path: what the first `*` of its pattern stands for."""
    if "*" not in pattern:
        return {}
    found = re.match(re.escape(pattern).replace(r"\*", "(.*?)") + "$", path)
    return {path: found.group(1)} if found else {}


def _counted(option: str, text: str | None, problems: list[str]) -> tuple[tuple[int, int], float | None]:
    """`legs=0:5@60%`: both numbers, and the share."""
    if text is None:
        return (0, 0), None
    found = re.fullmatch(r"legs=(\d+):(\d+)(?:@(\d+(?:\.\d+)?)%)?", text.replace(" ", ""))
    if found is None or (found.group(3) and option == "dead"):
        problems.append(
            f"--{option} takes legs=fewest:most{'@60%' if option == 'weak' else ''}, got '{text}'"
        )
        return (0, 0), None
    return (int(found.group(1)), int(found.group(2))), float(found.group(3)) / 100.0 if found.group(
        3
    ) else None


@dataclass(frozen=True)
class Curve:
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


MOST_DRAWS = 2**20
"""More draws than this are not worth naming: the two are alike."""


@dataclass(frozen=True)
class Leader:
    """The group whose scatter makes most of a measure's variance, as far as that is known.

    group, total, error: its name, total index and half-width of the 95 % interval; rivals: groups whose intervals
    overlap its own, the largest first; draws: about how many would tell it from the first rival, None where no
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
        own = f"{self.group} {self.total:.2f} ± {self.error:.2f}"
        if not self.rivals:
            return f"scatter of {self.group} matters most for {measure}: {self.total:.2f} ± {self.error:.2f}"
        more = (
            f"about {self.draws} draws would tell these two" if self.draws else "more draws would hardly tell"
        )
        rival, *rest = self.rivals
        others = f" and {len(rest)} more" if rest else ""
        return (
            f"whose scatter matters most for {measure} is not resolved: {own}, and the interval of {rival}{others} "
            f"overlaps it; {more}"
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


@dataclass(frozen=True)
class Yield:
    """What the runs say.

    values (nr,) of every measure by name, NaN of a robot that failed; lost (nr,) number of dead legs; curves by
    measure; outcomes: runs by how they ended; by_dead: for each number of dead legs robots, failed, and quantiles 5,
    50, 95 % of each measure; cost: by leg the mean of the first measure when it is dead, minus that when it is not, and
    its standard error; indices: by measure and group, as `Saltelli.indices`, from so many draws.
    """

    robots: Robots
    measures: tuple[str, ...]
    units: Mapping[str, str]
    values: Mapping[str, Floats]
    lost: NDArray[np.int64]
    curves: Mapping[str, Curve]
    outcomes: Mapping[str, int]
    by_dead: Sequence[Mapping[str, Any]]
    cost: Mapping[str, tuple[float, float]]
    indices: Mapping[str, Mapping[str, Mapping[str, float]]]
    draws: int = 0

    @property
    def leaders(self) -> dict[str, Leader]:
        """By measure, of which indices are known."""
        found = {name: leader_of(one, self.draws) for name, one in self.indices.items()}
        return {name: one for name, one in found.items() if one is not None}

    def share(self, measure: str, requirement: float) -> tuple[float, float, float]:
        """Share of robots that meet a requirement [SI], and its 95 % interval; a failed robot meets none."""
        values = self.values[measure]
        met = values <= requirement if measure in LESS else values >= requirement
        return _wilson(int(np.count_nonzero(met)), len(values))

    def table(self) -> dict[str, Any]:
        """Everything but the single robots, as plain values."""
        curves = {
            name: {key: getattr(one, key) for key in ("unit", "less", "requirement", "share", "low", "high")}
            for name, one in self.curves.items()
        }
        return {
            "scene": self.robots.scene.name, "robots": len(self.lost), "measures": list(self.measures),
            "outcomes": dict(self.outcomes), "curves": curves, "by_dead": list(self.by_dead),
            "cost_of_a_dead_leg": {leg: {"difference": d, "error": e} for leg, (d, e) in self.cost.items()},
            "indices": {name: dict(one) for name, one in self.indices.items()},
            "matters_most": {name: asdict(one) | {"resolved": one.resolved} for name, one in self.leaders.items()},
        }  # fmt: skip


def yield_of(robots: Robots, sweep: Sweep, file: Path, legs: tuple[Sweep, Path] | None = None) -> Yield:
    """What finished runs say: those of the robots, and those of the legs where they were made.

    Raises
    ------
    InputError
        When no robot's run reached its end.
    """
    from tarsus.study.workunit import DONE

    code, found, units = _results(sweep, file)
    if not (code == DONE).any():
        raise InputError("no robot's run reached its end: see its sweep.nc for how they ended")
    outcomes = _outcomes(code)
    design = sweep.design
    assert isinstance(design, Scattered)
    left = design.left(sweep.vary, slice(0, sweep.runs))
    dead = left == 0.0
    lost = dead.sum(axis=1)
    first = found[sweep.measures[0]]
    indices = {}
    if legs is not None:
        assert isinstance(legs[0].design, Saltelli)
        for name, one in _results(*legs)[1].items():
            # a failed run counts as the worst that was seen: SALib takes no gaps
            worst = np.nanmax(one) if name in LESS else np.nanmin(one)
            filled = np.where(np.isfinite(one), one, worst)
            indices[name] = legs[0].design.indices(filled) if np.ptp(filled) > 0.0 else {}
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
        legs[0].design.count if legs is not None and isinstance(legs[0].design, Saltelli) else 0,
    )


def _results(sweep: Sweep, file: Path) -> tuple[NDArray[np.int8], dict[str, Floats], dict[str, str]]:
    """How runs ended, measures by name and their units."""
    import h5py

    with h5py.File(file) as stored:

        def read(name: str) -> np.ndarray:
            return np.asarray(stored[name])  # pyright: ignore[reportCallIssue, reportArgumentType]

        units = {name: str(stored[name].attrs["units"]) for name in sweep.measures}
        return read("code"), {name: read(name) for name in sweep.measures}, units


def _outcomes(code: NDArray[np.int8]) -> dict[str, int]:
    from tarsus.study.workunit import OUTCOMES

    counts = np.bincount(code, minlength=len(OUTCOMES)).tolist()
    return {name: n for name, n in zip(OUTCOMES, counts, strict=True) if n}


def _wilson(met: int, count: int) -> tuple[float, float, float]:
    """A share and its 95 % interval (Wilson 1927), which holds near 0 and 1 as well."""
    p, z = met / count, NORMAL_95**2 / count
    middle, half = (p + z / 2.0) / (1.0 + z), np.sqrt(p * (1.0 - p) * z + z**2 / 4.0) / (1.0 + z)
    return p, max(float(middle - half), 0.0), min(float(middle + half), 1.0)


def _curve(name: str, unit: str, values: Floats) -> Curve:
    finite = np.sort(values[np.isfinite(values)])
    at = np.unique(np.quantile(finite, np.linspace(0.0, 1.0, 101)))
    counts = [np.count_nonzero(finite <= one if name in LESS else finite >= one) for one in at]
    rows = np.array([_wilson(int(met), len(values)) for met in counts])
    return Curve(name, unit, name in LESS, at, rows[:, 0], rows[:, 1], rows[:, 2])


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
