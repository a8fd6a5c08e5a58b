"""What the figures need of a run, taken out once: plain arrays, contact intervals, the drive's period."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tarsus.files.store import RunLike

BOUNCE, CAPTURE, RELEASE, REST, AT_START = 1, 2, 3, 4, 5
"""Kind numbers of the event table."""

Window = tuple[float, float]
"""Start and end [s] of the stretch of time a figure shows."""


@dataclass(frozen=True)
class Series:
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

    def __getitem__(self, name: str) -> np.ndarray:
        return self.values[name]

    def inside(self, window: Window) -> slice:
        """Samples within a window, with one more on either side so that lines reach the frame."""
        first = max(int(np.searchsorted(self.time, window[0], side="right")) - 1, 0)
        last = min(int(np.searchsorted(self.time, window[1], side="left")) + 1, len(self.time))
        return slice(first, last)

    @property
    def whole(self) -> Window:
        """The whole run."""
        return (float(self.time[0]), float(self.time[-1]))

    def last_periods(self, number: int) -> Window:
        """The last `number` whole drive periods of the run; the whole run if it has no more than that."""
        if self.period is None:
            return self.whole
        complete = math.floor(self.time[-1] / self.period * (1.0 + 1e-9))
        if complete <= number:
            return self.whole
        return ((complete - number) * self.period, complete * self.period)


def series_of(run: RunLike) -> Series:
    """Collect a run's series, contact intervals and drive period."""
    variables = run.variables()
    scene = run.scene
    feet = tuple(str(name) for name in run.foot_names)
    time = np.asarray(variables["time"].values, dtype=float)
    values = {
        name: np.asarray(found) for name, (dims, found, _) in variables.items() if dims[-1:] == ("time",)
    }
    specs = [scene.robot.feet[name] for name in feet]
    return Series(
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
    )


def contact_intervals(events: np.ndarray, foot: int, end: float) -> list[Window]:
    """Stretches of time [s] in which a foot stays on the ground; `end` cuts the last if it is not left."""
    out: list[Window] = []
    since: float | None = None
    mine = events[events["foot"] == foot]
    for time, kind in zip(mine["time"].tolist(), mine["kind"].tolist(), strict=True):
        if kind in (CAPTURE, REST, AT_START) and since is None:
            since = time
        elif kind in (RELEASE, BOUNCE) and since is not None:
            out.append((since, time))
            since = None
    if since is not None:
        out.append((since, end))
    return out


def drive_period(scene: Any) -> float | None:
    """Period of the slowest periodic signal of the scene [s]; None if none repeats."""
    tracks = [signal.track() for signal in scene.signals.values()]
    return max((float(track.start[-1]) for track in tracks if track.periodic), default=None)


def ever(values: np.ndarray) -> bool:
    """Whether a series is anywhere different from zero."""
    return bool(np.any(np.nan_to_num(values) != 0.0))


def joined(names: Sequence[str]) -> str:
    """Names as a list in a sentence: "a", "a and b", "a, b and c"."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"
