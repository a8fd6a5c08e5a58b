"""A bouncing robot against Table 3.2: heights and bounces of its foot, with and without small forces."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.calibrate.prediction import Miss
from tarsus.files.library import changed
from tarsus.model.drive.waveforms import Sine, Square
from tarsus.model.scene import Scene
from tarsus_reproduce.ensembles import packaged_members, packaged_misses, packaged_told
from tarsus_reproduce.forecast import (
    CALIBRATED,
    PREDICTED,
    Forecast,
    Member,
    WeightedValues,
    forecast,
    medians,
    members_of,
    role_of,
)
from tarsus_reproduce.impacts import MapRow, ModeRow, map_rows, mode_rows
from tarsus_reproduce.reproduction import Progress
from tarsus_reproduce.rows import (
    HEIGHTS,
    PrintedRow,
    mean_percent,
    packaged_rows,
    read_rows,
    relative_error,
    relative_errors,
)
from tarsus_reproduce.seeds import Statistics, foot_statistics

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
class WindowsRow:
    """One row, forecast by an ensemble over the windows of all seeds; in the table's units by key of its quantities.

    ours, without: with the ground as described, and without the small forces; time_mean: clearance averaged over time
    [m]; p_bounce: share of the windows with a bounce; freq_hz: drive frequency [Hz] of the first member; role: whether
    the device was calibrated on this row; problems, problems_without: sentences of runs that did not end well.
    """

    printed: PrintedRow
    freq_hz: float
    ours: Mapping[str, Forecast]
    without: Mapping[str, Forecast]
    time_mean: Forecast
    p_bounce: float | None
    seeds: int
    role: str
    problems: tuple[str, ...]
    problems_without: tuple[str, ...]

    @property
    def case(self) -> str:
        """The drive in words, and the file of a row that is not the dissertation's."""
        origin = "" if self.printed.origin == "packaged" else f" ({self.printed.origin})"
        return f"{describe(self.printed)}, {self.freq_hz:.4g} Hz{origin}"

    def to_dict(self) -> dict[str, Any]:
        """Plain data; lengths in um, rates in 1/s."""
        one = self.printed
        return {
            "wave": one.wave,
            "volt_v": one.volt_v,
            "gap_um": one.gap_um,
            "freq_hz": self.freq_hz,
            "origin": one.origin,
            "role": self.role,
            "measured": one.measured,
            "source": one.source,
            "ours": {key: found.to_dict() for key, found in self.ours.items()},
            "p_bounce": self.p_bounce,
            "mean_apex_um": self.ours["mean_um"].to_dict(),
            "without_small_forces": {key: found.to_dict() for key, found in self.without.items()},
            "seeds": self.seeds,
            "errors": {
                key: relative_error((one.measured or {}).get(key), median)
                for key, median in medians(self.ours).items()
            },
            "problems": list(self.problems),
        }


@dataclass(frozen=True)
class RobotRows:
    """All rows of a robot, and what its impact maps do; told: what the packaged ensemble's calibration chose."""

    robot: str
    device: str
    scene: Scene
    rows: tuple[WindowsRow, ...]
    modes: tuple[ModeRow, ...]
    maps: tuple[MapRow, ...]
    told: tuple[str, ...] = ()

    @property
    def problems(self) -> list[str]:
        """Sentences of the runs that did not reach their end."""
        return [
            f"{describe(row.printed)}: {problem}"
            for row in self.rows
            for problem in dict.fromkeys((*row.problems, *row.problems_without))
        ]

    def summary(self, origin: str | None = None, role: str | None = None) -> dict[str, Any]:
        """Mean absolute error [%] of each quantity over the rows with a measured value, for three models.

        ``origin`` keeps the rows from there alone: ``"packaged"``, or the name of a rows file; ``role`` those that were
        "calibrated on" or are "predicted".
        """
        rows = [row for row in self.rows if origin in (None, row.printed.origin) and role in (None, row.role)]
        models = {
            "source": [row.printed.source or {} for row in rows],
            "ours": [medians(row.ours) for row in rows],
            "without_small_forces": [medians(row.without) for row in rows],
        }
        measured = [row.printed.measured or {} for row in rows]
        return {
            name: {one.key: _mean_error(measured, heights, one.key) for one in HEIGHTS.quantities}
            for name, heights in models.items()
        }

    def to_dict(self) -> dict[str, Any]:
        """Plain data: `robot`, `device`, `rows`, `summary` (also of packaged and added rows apart, when there are both,
        and of rows by their role), `modes`, `impact_maps`; lengths in um, rates in 1/s."""
        parts = {
            "summary_calibrated": self.summary(role=CALIBRATED),
            "summary_predicted": self.summary(role=PREDICTED),
        }
        origins = dict.fromkeys(row.printed.origin for row in self.rows)
        added = [origin for origin in origins if origin != "packaged"]
        if "packaged" in origins and added:
            parts |= {"summary_packaged": self.summary("packaged"), "summary_added": self.summary(added[0])}
        return {
            "robot": self.robot,
            "device": self.device,
            "mean_um_is": MEAN_HEIGHT,
            "ok": not self.problems,
            "rows": [row.to_dict() for row in self.rows],
            "summary": self.summary(),
            **parts,
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
    own_seeds = math.ceil(seeds / len(members))
    printed = printed_rows(robot) + (_added(rows) if rows is not None else [])
    done: list[WindowsRow] = []
    for number, one in enumerate(printed):
        if progress is not None:
            progress(number, len(printed), describe(one))
        done.append(_row(members, one, robot, own_seeds, misses))
    name = device if isinstance(device, str) else _named(robot, members, device is None)
    scene = members[0].scene
    told = packaged_told(robot) if device is None else ()
    modes, maps = mode_rows(scene, robot), map_rows(scene, robot)
    return RobotRows(robot, name, scene, tuple(done), modes, maps, told)


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


def _row(
    members: Sequence[Member], printed: PrintedRow, robot: str, seeds: int, misses: Mapping[str, Miss]
) -> WindowsRow:
    found: dict[bool, list[tuple[float, Statistics]]] = {True: [], False: []}
    frequencies = [printed.freq_hz or drive_frequency(robot, one.scene, printed.wave) for one in members]
    for member, freq_hz in zip(members, frequencies, strict=True):
        scene = row_scene(member.scene, printed, freq_hz)
        for near_field_forces, of_members in found.items():
            one = scene if near_field_forces else with_values(scene, {"ground.near_field_forces": False})
            statistics = foot_statistics(one, seeds, duration=OBSERVED, settle=SETTLE, window=WINDOW)
            of_members.append((member.weight, statistics))
    failed, failed_without = (
        tuple(problem for _, one in of_members for problem in one.failed) for of_members in found.values()
    )
    return WindowsRow(
        printed, frequencies[0], *(_forecasts(of_members, misses) for of_members in found.values()),
        time_mean=forecast(_joined(found[True], "mean")),
        p_bounce=_joined(found[True], "bounces").share(0.5 / WINDOW),  # half a bounce a window: any
        seeds=len(members) * seeds - len(failed),
        role=role_of(members, printed.origin == "packaged", printed.measured is not None),
        problems=failed, problems_without=failed_without,
    )  # fmt: skip


def _forecasts(found: Sequence[tuple[float, Statistics]], misses: Mapping[str, Miss]) -> dict[str, Forecast]:
    """Every quantity of the table, with what the model misses of it; the study's "mean" is a mean of apexes."""
    parts = (("bounces", "bounces"), ("peak", "peak"), ("apex", "mean"))
    return {
        one.key: forecast(_joined(found, name), misses.get(own)).scaled(one.factor)
        for one, (name, own) in zip(HEIGHTS.quantities, parts, strict=True)
    }


def _joined(found: Sequence[tuple[float, Statistics]], name: str) -> WeightedValues:
    return WeightedValues.joined([(weight, getattr(one, name)) for weight, one in found])


def _mean_error(measured: Sequence[Mapping], simulated: Sequence[Mapping], key: str) -> float | None:
    pairs = [(one.get(key), other.get(key)) for one, other in zip(measured, simulated, strict=True)]
    return mean_percent([abs(error) for error in relative_errors(pairs)])
