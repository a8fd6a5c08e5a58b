"""A bouncing robot against Table 3.2: heights and bounces of its foot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.calibrate.description import TableSampling
from tarsus.files.library import changed
from tarsus.model.drive.waveforms import Sine, Square
from tarsus.model.scene import Scene
from tarsus_reproduce.compared import ComparedTable, TableComparison
from tarsus_reproduce.reproduction import Progress
from tarsus_reproduce.rows import HEIGHTS, PrintedRow, packaged_rows, read_rows

SEEDS = 32
"""Initial states of every row, shared out over the members of an ensemble; the packaged one has more: one each."""
SETTLE, OBSERVED = 0.3, 0.7
"""Transient that is dropped and time observed after it [s], of every seed."""
WINDOW = 0.05
"""Window [s] that a number of Table 3.2 was read from: all its counts are multiples of 20 in a second."""
FASTEST = 1e5
"""Highest drive frequency of a row [Hz]: a hundred times the source's; faster ones take hours over many seeds."""

MEAN_HEIGHT = "mean of the flights' highest points"
"""What the table's "Avg. height" is taken to be; its text does not say, and the packaged calibration weighs the mean
over time against it."""


def printed_rows(robot: str) -> list[PrintedRow]:
    """The rows of Table 3.2; none for the quadruped, of which no table is printed."""
    return packaged_rows(HEIGHTS) if robot == "hexapod" else []


def robot_table(
    robot: str,
    device: str | None = None,
    rows: str | Path | None = None,
    *,
    seeds: int = SEEDS,
    progress: Progress | None = None,
) -> ComparedTable:
    """Predict every row of Table 3.2, and of a rows file, over many seeds of initial state.

    robot: ``"hexapod"`` or ``"quadruped"``, whose table is compared. Other arguments and errors as for
    `tarsus_reproduce.verb.reproduce`.
    """
    printed = printed_rows(robot) + (_added(rows) if rows is not None else [])
    return ComparedTable.of(WINDOWS, robot, device, printed, progress, draws=seeds)


def _added(path: str | Path) -> list[PrintedRow]:
    found = read_rows(path, HEIGHTS)
    fast = [one.freq_hz for one in found if one.freq_hz is not None and one.freq_hz > FASTEST]
    if fast:
        raise InputError([f"{path}: 'freq_hz' can be at most {FASTEST:g}, got {hz:g}" for hz in fast])
    return found


def drive_frequency(scene: Scene) -> float:
    """The device's own drive frequency [Hz], where a row does not tell another."""
    period = next(iter(scene.signals.values())).period
    return 1.0 / period if period else 1.0


def row_scene(scene: Scene, row: Mapping[str, Any]) -> Scene:
    """The device over the gap of a row with its drive; the first foot and every signal change.

    A signal keeps its polarity: its amplitude and offset are scaled so that its highest voltage is the row's. Raises
    InputError where the device has no foot or a signal without amplitude and offset.
    """
    if not scene.robot.feet:
        raise InputError(f"{scene.name}: a row of heights needs a robot with a foot")
    foot = next(iter(scene.robot.feet))
    changes: dict[str, Any] = {f"robot.feet.{foot}.gap": row["gap_um"] * 1e-6}
    for name, signal in scene.signals.items():
        if not isinstance(signal, Sine | Square):
            raise InputError(
                f"{scene.name}: signals.{name}: a row of heights needs a sine or square wave to start from"
            )
        scale = row["volt_v"] / (abs(signal.amplitude) + abs(signal.offset))
        changes[f"signals.{name}.amplitude"] = signal.amplitude * scale
        changes[f"signals.{name}.offset"] = signal.offset * scale
    return changed(scene, hz=row.get("freq_hz", drive_frequency(scene)), wave=row["wave"], **changes)


WINDOWS = TableComparison(
    HEIGHTS,
    "hexapod",
    row_scene,
    TableSampling(settle=SETTLE, window=WINDOW, windows=round(OBSERVED / WINDOW), accuracy=1e-8),
    "windows with a bounce",
)
"""Table 3.2, by windows of runs from random initial states of every member."""
