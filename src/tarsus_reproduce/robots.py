"""A bouncing robot against Table 3.2: heights and bounces of its foot, with and without small forces."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tarsus.drive.waveforms import Sine, Square
from tarsus.errors import InputError
from tarsus.files.library import load_scene
from tarsus.scene import Scene
from tarsus.spec import with_values
from tarsus.study.relative import relative_error
from tarsus.study.seeds import Statistics, foot_statistics
from tarsus_reproduce.impacts import MapRow, ModeRow, map_rows, mode_rows
from tarsus_reproduce.scenarios import Heights, Scenario, packaged_scenarios, read_scenarios

SEEDS = 32
"""Initial states of every scenario."""
SETTLE, OBSERVED = 0.3, 0.7
"""Transient that is dropped and time observed after it [s], of every seed."""
QUANTITIES = ("bounces_per_s", "peak_um", "mean_um")

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Outcome:
    """Mean over the seeds and their standard deviation; problems: sentences of runs that did not end well."""

    heights: Heights
    spread: Heights
    seeds: int
    problems: tuple[str, ...]


@dataclass(frozen=True)
class Row:
    """One scenario: ours with the ground as described, and with the small forces left out."""

    scenario: Scenario
    freq_hz: float
    ours: Outcome
    without: Outcome

    @property
    def role(self) -> str:
        """Whether the device was calibrated on this row or predicts it."""
        return (
            "calibrated on" if self.scenario.origin == "packaged" and self.scenario.measured else "predicted"
        )


@dataclass(frozen=True)
class RobotValidation:
    """All scenarios of a robot, and what its impact maps do."""

    robot: str
    device: str
    scene: Scene
    rows: tuple[Row, ...]
    modes: tuple[ModeRow, ...]
    maps: tuple[MapRow, ...]

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

    def summary(self, origin: str | None = None) -> dict[str, Any]:
        """Mean absolute error [%] of each quantity over the rows with a measured value, for three models.

        ``origin`` keeps the rows from there alone: ``"packaged"``, or the name of a rows file.
        """
        rows = [row for row in self.rows if origin in (None, row.scenario.origin)]
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
        """The summary of packaged and of added rows apart, when there are both."""
        origins = dict.fromkeys(row.scenario.origin for row in self.rows)
        added = [origin for origin in origins if origin != "packaged"]
        if "packaged" not in origins or not added:
            return {}
        return {"summary_packaged": self.summary("packaged"), "summary_added": self.summary(added[0])}

    def to_dict(self) -> dict[str, Any]:
        """Plain data: `robot`, `device`, `rows`, `summary`, `modes`, `impact_maps`; lengths in um, rates in 1/s."""
        return {
            "robot": self.robot,
            "device": self.device,
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


def validate_robot(
    robot: str,
    device: str | None = None,
    rows: str | Path | None = None,
    *,
    seeds: int = SEEDS,
    progress: Progress | None = None,
) -> RobotValidation:
    """Simulate every scenario of Table 3.2, and of a rows file, over many seeds of initial state.

    Parameters
    ----------
    robot
        ``"hexapod"`` or ``"quadruped"``: whose table and printed matrices are compared.
    device
        Name or file of the device; the packaged one of that name by default.
    rows
        A file of further scenarios (see `tarsus_reproduce.scenarios.read_scenarios`).
    seeds
        Initial states of every scenario.
    progress
        Called as `progress(done, total, what)`.

    Raises
    ------
    InputError
        For an unknown device, a device without drive or foot, or a bad rows file.
    """
    name = device or robot
    scene = load_scene(name)
    scenarios = packaged_scenarios(robot) + (read_scenarios(rows) if rows is not None else [])
    done: list[Row] = []
    for number, scenario in enumerate(scenarios):
        if progress is not None:
            progress(number, len(scenarios), describe(scenario))
        done.append(_row(name, scenario, robot, seeds))
    return RobotValidation(robot, name, scene, tuple(done), mode_rows(scene, robot), map_rows(scene, robot))


def drive_frequency(robot: str, scene: Scene, wave: str) -> float:
    """Drive frequency [Hz] where a scenario does not tell: that calibrated on the packaged row of the same wave, or the
    device's own."""
    known = [s.freq_hz for s in packaged_scenarios(robot) if s.wave == wave and s.freq_hz is not None]
    period = next(iter(scene.signals.values())).period
    return known[0] if known else 1.0 / period if period else 1.0


def scenario_scene(device: str, scenario: Scenario, freq_hz: float) -> Scene:
    """The device over the scenario's gap with the scenario's drive; the first foot and every signal change.

    A signal keeps its polarity: its amplitude and offset are scaled so that its highest voltage is the scenario's.

    Raises
    ------
    InputError
        Where the device has no foot or a signal without amplitude and offset.
    """
    scene = load_scene(device)
    if not scene.robot.feet:
        raise InputError(f"{device}: a scenario needs a robot with a foot")
    foot = next(iter(scene.robot.feet))
    changes: dict[str, Any] = {f"robot.feet.{foot}.gap": scenario.gap_um * 1e-6}
    for name, signal in scene.signals.items():
        if not isinstance(signal, Sine | Square):
            raise InputError(
                f"{device}: signals.{name}: a scenario needs a sine or square wave to start from"
            )
        scale = scenario.volt_v / (abs(signal.amplitude) + abs(signal.offset))
        changes[f"signals.{name}.amplitude"] = signal.amplitude * scale
        changes[f"signals.{name}.offset"] = signal.offset * scale
    return load_scene(device, hz=freq_hz, wave=scenario.wave, **changes)


def _row(device: str, scenario: Scenario, robot: str, seeds: int) -> Row:
    freq_hz = scenario.freq_hz or drive_frequency(robot, load_scene(device), scenario.wave)
    scene = scenario_scene(device, scenario, freq_hz)
    bare = with_values(scene, {"ground.small_forces": False})
    ours, without = (
        _outcome(foot_statistics(one, seeds, duration=OBSERVED, settle=SETTLE)) for one in (scene, bare)
    )
    return Row(scenario, freq_hz, ours, without)


def _outcome(found: Statistics) -> Outcome:
    def spread(values: Any) -> float:
        return float(values.std(ddof=1)) if len(values) > 1 else math.nan

    def mean(values: Any) -> float:
        return float(values.mean()) if len(values) else math.nan

    columns = (found.bounces, found.peak * 1e6, found.mean * 1e6)
    return Outcome(
        Heights(*(mean(c) for c in columns)),
        Heights(*(spread(c) for c in columns)),
        len(found.bounces),
        found.failed,
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
        "ours": asdict(row.ours.heights),
        "ours_spread": asdict(row.ours.spread),
        "without_small_forces": asdict(row.without.heights),
        "without_small_forces_spread": asdict(row.without.spread),
        "seeds": row.ours.seeds,
        "errors": {
            q: relative_error(getattr(scenario.measured, q), getattr(row.ours.heights, q)) for q in QUANTITIES
        },
        "problems": list(row.ours.problems),
    }
