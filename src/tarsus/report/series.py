"""What the figures need of a run, taken out once: plain arrays, contact intervals, the drive's period."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tarsus.base.events import CONTACT_BEGINS, EventKind
from tarsus.files.series import Variables
from tarsus.files.settled import drive_period
from tarsus.model.laws.base import Law
from tarsus.report.panels import Window
from tarsus.report.style import samples_inside
from tarsus.solve import Run


@dataclass(frozen=True)
class RunSeries:
    """Arrays of one run in SI units: `time` [samples]; `values` [samples] or [names, samples]."""

    time: np.ndarray
    values: dict[str, np.ndarray]
    drives: tuple[str, ...]
    points: tuple[str, ...]
    feet: tuple[str, ...]
    foot_points: tuple[str, ...]
    ground_levels: tuple[float, ...]
    """Displacement of each foot's point at which the foot touches [m]."""
    contacts: tuple[list[Window], ...]
    """Per foot, the stretches of time in contact [s]."""
    period: float | None
    """Drive period [s]; None if no drive repeats."""
    duration: float
    laws: Mapping[str, Law]
    """Laws that act on the feet with a force, by name; theirs are the series `<name>_force` and `<name>_work`."""

    def __getitem__(self, name: str) -> np.ndarray:
        return self.values[name]

    def inside(self, window: Window) -> slice:
        """See `samples_inside`."""
        return samples_inside(self.time, window)

    @property
    def whole(self) -> Window:
        """The whole run."""
        return (float(self.time[0]), float(self.time[-1]))

    @property
    def complete(self) -> int:
        """Drive periods that the run reached the end of; 0 if none repeats."""
        return math.floor(self.time[-1] / self.period * (1.0 + 1e-9)) if self.period is not None else 0

    def last_periods(self, number: int) -> Window:
        """The last `number` whole drive periods of the run; the whole run if it has no more than that."""
        if self.period is None or self.complete <= number:
            return self.whole
        return ((self.complete - number) * self.period, self.complete * self.period)


def series_of(run: Run, variables: Variables | None = None) -> RunSeries:
    """A run's series, contact intervals and drive period; variables: those of the run, if at hand."""
    return _series(run, run.variables() if variables is None else variables)


def last_turns(run: Run, turns: int, samples: int) -> RunSeries:
    """The same over the last whole drive periods of a run, `turns` of them at most, with `samples` in each."""
    period = drive_period(run.scene)
    if period is None or run.end_time < period:
        return series_of(run)
    last = math.floor(run.end_time / period * (1.0 + 1e-9))
    first = max(last - turns, 0)
    times = np.linspace(first * period, min(last * period, run.end_time), (last - first) * samples + 1)
    return _series(run, run.variables(times))


def _series(run: Any, variables: Variables) -> RunSeries:
    scene = run.scene
    feet = tuple(str(name) for name in run.foot_names)
    time = np.asarray(variables["time"].values, dtype=float)
    values = {name: np.asarray(found) for name, (dims, found, _) in variables.items() if dims[-1:] == ("time",)}
    specs = [scene.robot.feet[name] for name in feet]
    return RunSeries(
        time=time,
        values=values,
        drives=tuple(str(name) for name in variables["drive"].values),
        points=tuple(str(name) for name in variables["point"].values),
        feet=feet,
        foot_points=tuple(str(foot.point) for foot in specs),
        ground_levels=tuple(-float(foot.gap) / float(foot.normal) for foot in specs),
        contacts=tuple(contact_intervals(run.events, foot, float(run.duration)) for foot in range(len(feet))),
        period=drive_period(scene),
        duration=float(run.duration),
        laws={name: law for name, law in scene.ground.acting_laws.items() if f"{name}_work" in values},
    )


def contact_intervals(events: np.ndarray, foot: int, end: float) -> list[Window]:
    """Stretches of time [s] in which a foot stays on the ground; `end` cuts the last if it is not left."""
    out: list[Window] = []
    since: float | None = None
    mine = events[events["foot"] == foot]
    for time, kind in zip(mine["time"].tolist(), mine["kind"].tolist(), strict=True):
        if kind in CONTACT_BEGINS and since is None:
            since = time
        elif kind in (EventKind.RELEASE, EventKind.BOUNCE) and since is not None:
            out.append((since, time))
            since = None
    if since is not None:
        out.append((since, end))
    return out


def ever(values: np.ndarray) -> bool:
    """Whether a series is anywhere different from zero."""
    return bool(np.any(np.nan_to_num(values) != 0.0))


def joined(names: Sequence[str]) -> str:
    """Names as a list in a sentence: "a", "a and b", "a, b and c"."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"
