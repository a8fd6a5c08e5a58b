"""A bouncing robot against Table 3.2: heights and bounces of its foot, with and without small forces."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.calibrate.prediction import Miss
from tarsus.files.library import changed
from tarsus.model.drive.waveforms import Sine, Square
from tarsus.model.scene import Scene
from tarsus.solve.seeds import Statistics, foot_statistics
from tarsus_reproduce.cases import relative_error
from tarsus_reproduce.impacts import MapRow, ModeRow, map_rows, mode_rows
from tarsus_reproduce.mixtures import packaged_members, packaged_misses, packaged_told
from tarsus_reproduce.predictions import Member, Prediction, Samples, members_of, predict, role_of
from tarsus_reproduce.scenarios import Heights, Scenario, packaged_scenarios, read_scenarios

SEEDS = 32
"""Initial states of every scenario."""
SETTLE, OBSERVED = 0.3, 0.7
"""Transient that is dropped and time observed after it [s], of every seed."""
WINDOW = 0.05
"""Window [s] that a number of Table 3.2 was read from: all its counts are multiples of 20 in a second."""
QUANTITIES = ("bounces_per_s", "peak_um", "mean_um")

Progress = Callable[[int, int, str], None]


class HeightColumn(Enum):
    """What the table's "Avg. height" may be: its text does not say."""

    TIME_MEAN = "clearance averaged over time"
    MEAN_APEX = "mean of the flights' highest points"


@dataclass(frozen=True)
class Outcome:
    """Prediction of a mixture over the windows of all seeds: bounces [1/s], peak and mean height [um].

    apex_um: the mean of the flights' highest points, beside a mean height over time; p_bounce: share of the windows
    with a bounce; problems: sentences of runs that did not end well.
    """

    bounces_per_s: Prediction
    peak_um: Prediction
    mean_um: Prediction
    apex_um: Prediction
    p_bounce: float | None
    seeds: int
    problems: tuple[str, ...]

    @property
    def heights(self) -> Heights:
        """The medians, which are what is compared with a table; None where nothing is predicted."""
        return Heights(*(self.prediction(name).to_dict()["median"] for name in QUANTITIES))

    def prediction(self, quantity: str) -> Prediction:
        """The prediction of one of `QUANTITIES`."""
        return getattr(self, quantity)

    def to_dict(self) -> dict[str, dict[str, float | None]]:
        """Plain data of the quantities that the table has."""
        return {name: self.prediction(name).to_dict() for name in QUANTITIES}


@dataclass(frozen=True)
class Row:
    """One scenario: ours with the ground as described, and with the small forces left out.

    freq_hz: drive frequency [Hz] of the first member; role: whether the device was calibrated on this row.
    """

    scenario: Scenario
    freq_hz: float
    ours: Outcome
    without: Outcome
    role: str


@dataclass(frozen=True)
class RobotReproduction:
    """All scenarios of a robot, and what its impact maps do; told: what the packaged mixture's calibration chose."""

    robot: str
    device: str
    scene: Scene
    rows: tuple[Row, ...]
    modes: tuple[ModeRow, ...]
    maps: tuple[MapRow, ...]
    column: HeightColumn
    told: tuple[str, ...] = ()

    @property
    def problems(self) -> list[str]:
        """Sentences of the runs that did not reach their end."""
        return [
            f"{describe(row.scenario)}: {problem}"
            for row in self.rows
            for problem in dict.fromkeys((*row.ours.problems, *row.without.problems))
        ]

    @property
    def ok(self) -> bool:
        """True when every run reached its end."""
        return not self.problems

    def summary(self, origin: str | None = None, role: str | None = None) -> dict[str, Any]:
        """Mean absolute error [%] of each quantity over the rows with a measured value, for three models.

        ``origin`` keeps the rows from there alone: ``"packaged"``, or the name of a rows file; ``role`` those that were
        "calibrated on" or are "predicted".
        """
        rows = [
            row for row in self.rows if origin in (None, row.scenario.origin) and role in (None, row.role)
        ]
        models = {
            "source": [row.scenario.source for row in rows],
            "ours": [row.ours.heights for row in rows],
            "without_small_forces": [row.without.heights for row in rows],
        }
        measured = [row.scenario.measured for row in rows]
        return {
            name: {q: _mean_error(measured, heights, q) for q in QUANTITIES}
            for name, heights in models.items()
        }

    def _parts(self) -> dict[str, Any]:
        """The summary of packaged and added rows apart, when there are both, and of rows by their role."""
        roles = {
            "summary_calibrated": self.summary(role="calibrated on"),
            "summary_predicted": self.summary(role="predicted"),
        }
        origins = dict.fromkeys(row.scenario.origin for row in self.rows)
        added = [origin for origin in origins if origin != "packaged"]
        if "packaged" not in origins or not added:
            return roles
        return {
            **roles, "summary_packaged": self.summary("packaged"), "summary_added": self.summary(added[0]),
        }  # fmt: skip

    def to_dict(self) -> dict[str, Any]:
        """Plain data: `robot`, `device`, `rows`, `summary`, `modes`, `impact_maps`; lengths in um, rates in 1/s."""
        return {
            "robot": self.robot,
            "device": self.device,
            "mean_um_is": self.column.value,
            "ok": self.ok,
            "rows": [_plain(row) for row in self.rows],
            "summary": self.summary(),
            **self._parts(),
            "modes": [asdict(mode) for mode in self.modes],
            "impact_maps": [asdict(one) for one in self.maps],
        }


def describe(scenario: Scenario) -> str:
    """A scenario in words."""
    return f"{scenario.volt_v:g} V {scenario.wave}, gap {scenario.gap_um:g} µm"


def reproduce_robot(
    robot: str,
    device: str | Sequence[Member] | None = None,
    rows: str | Path | None = None,
    *,
    seeds: int = SEEDS,
    column: HeightColumn = HeightColumn.MEAN_APEX,
    progress: Progress | None = None,
) -> RobotReproduction:
    """Simulate every scenario of Table 3.2, and of a rows file, over many seeds of initial state.

    Parameters
    ----------
    robot
        ``"hexapod"`` or ``"quadruped"``: whose table and printed matrices are compared.
    device
        Name or file of the device, or a mixture of devices; by default the packaged mixture of the robot, or its device
        where there is none. Modes and impact maps are those of the first.
    rows
        A file of further scenarios (see `tarsus_reproduce.scenarios.read_scenarios`).
    seeds
        Initial states of every scenario, shared out over the members of a mixture (one at least for each).
    column
        What the table's mean height is taken to be.
    progress
        Called as `progress(done, total, what)`.

    Raises
    ------
    InputError
        For an unknown device, a device without drive or foot, or a bad rows file.
    """
    members = members_of((packaged_members(robot) or robot) if device is None else device)
    misses = packaged_misses(robot) if device is None else {}
    own_seeds = math.ceil(seeds / len(members))
    scenarios = packaged_scenarios(robot) + (read_scenarios(rows) if rows is not None else [])
    done: list[Row] = []
    for number, scenario in enumerate(scenarios):
        if progress is not None:
            progress(number, len(scenarios), describe(scenario))
        done.append(_row(members, scenario, robot, own_seeds, column, misses))
    name = device if isinstance(device, str) else _named(robot, members, device is None)
    scene = members[0].scene
    return RobotReproduction(
        robot, name, scene, tuple(done), mode_rows(scene, robot), map_rows(scene, robot), column,
        packaged_told(robot) if device is None else (),
    )  # fmt: skip


def _named(robot: str, members: Sequence[Member], packaged: bool) -> str:
    if packaged:
        return robot if len(members) == 1 else f"{robot}, a mixture of {len(members)}"
    return " + ".join(one.scene.name for one in members)


def drive_frequency(robot: str, scene: Scene, wave: str) -> float:
    """Drive frequency [Hz] where a scenario does not tell: that calibrated on the packaged row of the same wave, or the
    device's own."""
    known = [s.freq_hz for s in packaged_scenarios(robot) if s.wave == wave and s.freq_hz is not None]
    period = next(iter(scene.signals.values())).period
    return known[0] if known else 1.0 / period if period else 1.0


def scenario_scene(scene: Scene, scenario: Scenario, freq_hz: float) -> Scene:
    """The device over the scenario's gap with the scenario's drive; the first foot and every signal change.

    A signal keeps its polarity: its amplitude and offset are scaled so that its highest voltage is the scenario's.

    Raises
    ------
    InputError
        Where the device has no foot or a signal without amplitude and offset.
    """
    if not scene.robot.feet:
        raise InputError(f"{scene.name}: a scenario needs a robot with a foot")
    foot = next(iter(scene.robot.feet))
    changes: dict[str, Any] = {f"robot.feet.{foot}.gap": scenario.gap_um * 1e-6}
    for name, signal in scene.signals.items():
        if not isinstance(signal, Sine | Square):
            raise InputError(
                f"{scene.name}: signals.{name}: a scenario needs a sine or square wave to start from"
            )
        scale = scenario.volt_v / (abs(signal.amplitude) + abs(signal.offset))
        changes[f"signals.{name}.amplitude"] = signal.amplitude * scale
        changes[f"signals.{name}.offset"] = signal.offset * scale
    return changed(scene, hz=freq_hz, wave=scenario.wave, **changes)


def _row(
    members: Sequence[Member],
    scenario: Scenario,
    robot: str,
    seeds: int,
    column: HeightColumn,
    misses: Mapping[str, Miss],
) -> Row:
    found: dict[bool, list[tuple[float, Statistics]]] = {True: [], False: []}
    frequencies = [scenario.freq_hz or drive_frequency(robot, one.scene, scenario.wave) for one in members]
    for member, freq_hz in zip(members, frequencies, strict=True):
        scene = scenario_scene(member.scene, scenario, freq_hz)
        for near_field_forces, of_members in found.items():
            one = scene if near_field_forces else with_values(scene, {"ground.near_field_forces": False})
            statistics = foot_statistics(one, seeds, duration=OBSERVED, settle=SETTLE, window=WINDOW)
            of_members.append((member.weight, statistics))
    ours, without = (_outcome(of_members, seeds, column, misses) for of_members in found.values())
    return Row(
        scenario, frequencies[0], ours, without, role_of(members, scenario.origin, bool(scenario.measured))
    )


def _outcome(
    found: Sequence[tuple[float, Statistics]], seeds: int, column: HeightColumn, misses: Mapping[str, Miss]
) -> Outcome:
    """The study's "mean" is a mean of apexes: what it misses says nothing of a mean over time."""
    bounces, peak, mean, apex = (
        Samples.joined([(weight, getattr(one, name)) for weight, one in found])
        for name in ("bounces", "peak", "mean", "apex")
    )
    failed = tuple(problem for _, one in found for problem in one.failed)
    apexes = predict(apex, misses.get("mean")).scaled(1e6)
    return Outcome(
        predict(bounces, misses.get("bounces")),
        predict(peak, misses.get("peak")).scaled(1e6),
        predict(mean).scaled(1e6) if column is HeightColumn.TIME_MEAN else apexes,
        apexes,
        bounces.share(0.5 / WINDOW),  # half a bounce a window: any
        len(found) * seeds - len(failed),
        failed,
    )


def _mean_error(measured: Sequence[Heights], simulated: Sequence[Heights], quantity: str) -> float | None:
    errors = [
        relative_error(getattr(m, quantity), getattr(s, quantity))
        for m, s in zip(measured, simulated, strict=True)
    ]
    known = [abs(e) for e in errors if e is not None]
    return 100.0 * math.fsum(known) / len(known) if known else None


def _plain(row: Row) -> dict[str, Any]:
    scenario = row.scenario
    return {
        "wave": scenario.wave,
        "volt_v": scenario.volt_v,
        "gap_um": scenario.gap_um,
        "freq_hz": row.freq_hz,
        "origin": scenario.origin,
        "role": row.role,
        "measured": asdict(scenario.measured) if scenario.measured else None,
        "source": asdict(scenario.source) if scenario.source else None,
        "ours": row.ours.to_dict(),
        "p_bounce": row.ours.p_bounce,
        "mean_apex_um": row.ours.apex_um.to_dict(),
        "without_small_forces": row.without.to_dict(),
        "seeds": row.ours.seeds,
        "errors": {
            q: relative_error(getattr(scenario.measured, q), getattr(row.ours.heights, q)) for q in QUANTITIES
        },
        "problems": list(row.ours.problems),
    }
