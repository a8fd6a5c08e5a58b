"""Single moments of one run: its touchdowns, flights and departures, the volts at a moment, the speed of a point.

Unlike measures by name these take a foot, a drive or a time, and belong to one run, not to its periods.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.events import IMPACTS, EventKind
from tarsus.base.messages import nearest

if TYPE_CHECKING:
    from tarsus.base.arrays import Floats
    from tarsus.model.scene import Scene


class Recorded(Protocol):
    """What is asked: a run."""

    @property
    def events(self) -> np.ndarray: ...
    @property
    def foot_names(self) -> tuple[str, ...]: ...
    @property
    def scene(self) -> Scene: ...
    def states(self, times: Sequence[float], /) -> Any: ...


def touchdown_times(run: Recorded, foot: str) -> Floats:
    """Times (nt,) [s] at which a foot reaches the ground, those of bounces among them, in order.

    A contact that the run begins with is no touchdown. Raises InputError for an unknown foot.
    """
    return _times(run, foot, IMPACTS)


def touchdown(run: Recorded, foot: str, number: int = 1) -> float:
    """Time [s] of the touchdown of a foot with this number, from 1; NaN where the run has fewer.

    Raises InputError for an unknown foot, and a number below 1.
    """
    return _of_number(touchdown_times(run, foot), number)


def departure(run: Recorded, foot: str, number: int = 1) -> float:
    """Time [s] at which a foot leaves a contact that lasted, with this number, from 1; NaN where the run has fewer.

    Bounces, which leave at the moment of their impact, do not count. Raises InputError as `touchdown`.
    """
    return _of_number(_times(run, foot, (EventKind.RELEASE,)), number)


def flight(run: Recorded, foot: str, number: int = 1) -> float:
    """Length [s] of the flight of a foot that begins from the ground, with this number, from 1; NaN where the run has
    fewer that end by a touchdown.

    A flight that the run begins with does not count. Raises InputError as `touchdown`.
    """
    down = touchdown_times(run, foot)
    up = _times(run, foot, (EventKind.BOUNCE, EventKind.RELEASE))
    ends = np.searchsorted(down, up, side="right")
    whole = ends < len(down)
    return _of_number(down[ends[whole]] - up[whole], number)


def volts_at(run: Recorded, drive: str, time: float) -> float:
    """Voltage [V] at a drive's actuator, behind its amplifier, at a time [s]; NaN for a time that is NaN.

    Of a slow ramp, that at a touchdown is the pull-in voltage, that at a departure the pull-out voltage. Raises
    InputError for an unknown drive.
    """
    known = run.scene.actuator_volts
    if drive not in known:
        raise InputError(f"there is no drive '{drive}'{nearest(drive, known)}")
    return math.nan if math.isnan(time) else float(known[drive].volts(np.array([time]))[0])


def point_speed(run: Recorded, point: str, start: float, end: float) -> float:
    """Mean velocity [m/s] of a point of the structure between two times [s]: its way over the time.

    Raises InputError for an unknown point, and times that are not in order.
    """
    structure = run.scene.robot.structure
    if point not in structure.points:
        raise InputError(f"the structure has no point '{point}'{nearest(point, structure.points)}")
    if not start < end:
        raise InputError(f"expected a time after {start:g} s, got {end:g} s")
    before, after = structure.row(point) @ run.states([start, end]).x
    return float(after - before) / (end - start)


def _times(run: Recorded, foot: str, kinds: Sequence[EventKind]) -> Floats:
    if foot not in run.foot_names:
        raise InputError(f"there is no foot '{foot}'{nearest(foot, run.foot_names)}")
    own = run.events[run.events["foot"] == run.foot_names.index(foot)]
    return own["time"][np.isin(own["kind"], kinds)]


def _of_number(values: Floats, number: int) -> float:
    if number < 1:
        raise InputError(f"expected a number from 1, got {number}")
    return float(values[number - 1]) if len(values) >= number else math.nan
