"""A bouncing robot against Table 3.2: heights and bounces of its foot, with and without small forces."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.files.library import changed
from tarsus.model.drive.waveforms import Sine, Square
from tarsus.model.scene import Scene
from tarsus_reproduce.compared import ComparedRow, TableComparison, summary_of
from tarsus_reproduce.ensembles import packaged_errors, packaged_members, packaged_misses
from tarsus_reproduce.forecast import Member, RowReadings, members_of
from tarsus_reproduce.impacts import MapRow, ModeRow, map_rows, mode_rows
from tarsus_reproduce.reproduction import Progress
from tarsus_reproduce.rows import HEIGHTS, PrintedRow, packaged_rows, read_rows
from tarsus_reproduce.seeds import foot_statistics

SEEDS = 32
"""Initial states of every row, shared out over the members of an ensemble; the packaged one has more: one each."""
SETTLE, OBSERVED = 0.3, 0.7
"""Transient that is dropped and time observed after it [s], of every seed."""
WINDOW = 0.05
"""Window [s] that a number of Table 3.2 was read from: all its counts are multiples of 20 in a second."""
FASTEST = 1e5
"""Highest drive frequency of a row [Hz]: a hundred times the source's; faster ones take hours over many seeds."""


MEAN_HEIGHT = "mean of the flights' highest points"
"""What the table's "Avg. height" is taken to be, as in the packaged study; its text does not say. The mean over time
stands beside it."""


@dataclass(frozen=True)
class RobotRows:
    """All rows of a robot, and what its impact maps do; calibration: what that of the packaged ensemble says."""

    robot: str
    device: str
    scene: Scene
    rows: tuple[ComparedRow, ...]
    modes: tuple[ModeRow, ...]
    maps: tuple[MapRow, ...]
    calibration: Mapping[str, Any] | None = None

    @property
    def problems(self) -> list[str]:
        """Sentences of the runs that did not reach their end."""
        return [
            f"{describe(row.printed)}: {problem}" for row in self.rows for problem in dict.fromkeys(row.problems)
        ]

    def to_dict(self) -> dict[str, Any]:
        """Plain data: `robot`, `device`, `rows`, `summary`, `modes`, `impact_maps`; lengths in um, rates in 1/s."""
        return {
            "robot": self.robot,
            "device": self.device,
            "mean_um_is": MEAN_HEIGHT,
            "ok": not self.problems,
            "rows": [row.to_dict(HEIGHTS) for row in self.rows],
            "summary": summary_of(HEIGHTS, self.rows),
            "modes": [asdict(mode) for mode in self.modes],
            "impact_maps": [asdict(one) for one in self.maps],
        }


def describe(printed: PrintedRow) -> str:
    """A row in words."""
    return f"{printed.volt_v:g} V {printed.wave}, gap {printed.gap_um:g} µm"


def printed_rows(robot: str) -> list[PrintedRow]:
    """The rows of Table 3.2; none for the quadruped, of which no table is printed."""
    return packaged_rows(HEIGHTS) if robot == "hexapod" else []


def robot_rows(
    robot: str,
    device: str | Sequence[Member] | None = None,
    rows: str | Path | None = None,
    *,
    seeds: int = SEEDS,
    progress: Progress | None = None,
) -> RobotRows:
    """Simulate every row of Table 3.2, and of a rows file, over many seeds of initial state.

    robot: ``"hexapod"`` or ``"quadruped"``, whose table and printed matrices are compared; device: also an ensemble,
    over whose members seeds are shared out, one at least for each; modes and impact maps are those of the first. Other
    arguments and errors as for `tarsus_reproduce.verb.reproduce`.
    """
    members = members_of((packaged_members(robot) or robot) if device is None else device)
    misses = packaged_misses(robot) if device is None else {}
    how = heights(robot, math.ceil(seeds / len(members)))
    printed = printed_rows(robot) + (_added(rows) if rows is not None else [])
    done = []
    for number, one in enumerate(printed):
        if progress is not None:
            progress(number, len(printed), describe(one))
        done.append(how.row(members, one, misses))
    name = device if isinstance(device, str) else _named(robot, members, device is None)
    scene = members[0].scene
    calibration = packaged_errors(robot) if device is None else None
    modes, maps = mode_rows(scene, robot), map_rows(scene, robot)
    return RobotRows(robot, name, scene, tuple(done), modes, maps, calibration)


def _added(path: str | Path) -> list[PrintedRow]:
    found = read_rows(path, HEIGHTS)
    fast = [one.freq_hz for one in found if one.freq_hz is not None and one.freq_hz > FASTEST]
    if fast:
        raise InputError([f"{path}: 'freq_hz' can be at most {FASTEST:g}, got {hz:g}" for hz in fast])
    return found


def _named(robot: str, members: Sequence[Member], packaged: bool) -> str:
    if packaged:
        return robot if len(members) == 1 else f"{robot}, a weighted ensemble of {len(members)}"
    return " + ".join(one.scene.name for one in members)


def drive_frequency(robot: str, scene: Scene, wave: str) -> float:
    """Drive frequency [Hz] where a row does not tell: that calibrated on the packaged row of the same wave, or the
    device's own."""
    known = [one.freq_hz for one in printed_rows(robot) if one.wave == wave and one.freq_hz is not None]
    period = next(iter(scene.signals.values())).period
    return known[0] if known else 1.0 / period if period else 1.0


def row_scene(scene: Scene, printed: PrintedRow, freq_hz: float) -> Scene:
    """The device over the row's gap with the row's drive; the first foot and every signal change.

    A signal keeps its polarity: its amplitude and offset are scaled so that its highest voltage is the row's. Raises
    InputError where the device has no foot or a signal without amplitude and offset.
    """
    if not scene.robot.feet:
        raise InputError(f"{scene.name}: a row of heights needs a robot with a foot")
    foot = next(iter(scene.robot.feet))
    assert printed.gap_um is not None
    changes: dict[str, Any] = {f"robot.feet.{foot}.gap": printed.gap_um * 1e-6}
    for name, signal in scene.signals.items():
        if not isinstance(signal, Sine | Square):
            raise InputError(
                f"{scene.name}: signals.{name}: a row of heights needs a sine or square wave to start from"
            )
        scale = printed.volt_v / (abs(signal.amplitude) + abs(signal.offset))
        changes[f"signals.{name}.amplitude"] = signal.amplitude * scale
        changes[f"signals.{name}.offset"] = signal.offset * scale
    return changed(scene, hz=freq_hz, wave=printed.wave, **changes)


def heights(robot: str, seeds: int) -> TableComparison:
    """How rows of heights are compared: by windows of runs from so many random initial states of every member."""

    def driven(scene: Scene, printed: PrintedRow) -> Scene:
        return row_scene(scene, printed, printed.freq_hz or drive_frequency(robot, scene, printed.wave))

    def by_window(scene: Scene, printed: PrintedRow) -> RowReadings:
        return foot_statistics(scene, seeds, duration=OBSERVED, settle=SETTLE, window=WINDOW)

    return TableComparison(
        HEIGHTS, driven, by_window, ("bounces_per_second", 0.5 / WINDOW), "windows with a bounce",
        {"ground.near_field_forces": False}, {"mean height over time": "mean_height"},
    )  # fmt: skip
