"""Reproduction of a bouncing robot: Table 3.2, motion over the ground and in the air, modes, impact maps."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import numpy as np

from tarsus.files.version import package_version
from tarsus.files.whole import write_text
from tarsus.impacts.energy import creation_warning
from tarsus.report.circular import TURNS, dials
from tarsus.report.html import (
    MISSING,
    Cell,
    Column,
    Markup,
    escape,
    figure,
    number,
    page,
    sentences,
    table,
    warning,
)
from tarsus.report.series import Series, Trace, joined, last_turns, point_trace
from tarsus.report.style import scale_of
from tarsus_reproduce.impacts import printed_column
from tarsus_reproduce.pages.cantilever import NOTABLE
from tarsus_reproduce.pages.robot_figures import (
    CRITERIA,
    height_bars,
    impact_histograms,
    mode_shapes,
    motion_of,
)
from tarsus_reproduce.predictions import Prediction
from tarsus_reproduce.robot_runs import AIR_GAP, InAir, Near, RobotRuns, share_made
from tarsus_reproduce.robots import (
    OBSERVED,
    QUANTITIES,
    SETTLE,
    WINDOW,
    RobotReproduction,
    Row,
    describe,
    relative_error,
)

SAMPLES = 720
"""Samples of a drive period in figures of motion."""

MODELS = (
    ("source", "source's model"),
    ("ours", "Tarsus"),
    ("without_small_forces", "Tarsus without small forces"),
)
"""Names in the summary -> words."""


def write_robot_report(reproduction: RobotReproduction, runs: RobotRuns, path: str | Path) -> Path:
    """Write a robot's reproduction as one self-contained HTML file and return its path.

    Raises InputError if `path` cannot be written.
    """
    target = Path(path)
    write_text(target, robot_html(reproduction, runs))
    return target


def robot_html(reproduction: RobotReproduction, runs: RobotRuns) -> str:
    """The page as text; see `write_robot_report`."""
    body = "".join(_sections(reproduction, runs))
    return page(f"{reproduction.robot} – reproduction", body)


def _sections(reproduction: RobotReproduction, runs: RobotRuns) -> Iterator[str]:
    numbers = count(1)
    yield _head(reproduction, runs)
    yield "<h2>Heights and bounces</h2>\n"
    yield _heights(reproduction, numbers)
    yield "<h2>Motion over the ground</h2>\n"
    yield _over_ground(runs, numbers)
    yield "<h2>Motion in the air</h2>\n"
    yield _in_air(reproduction, runs, numbers)
    yield "<h2>Modes and the printed impact matrix</h2>\n"
    yield _modes(reproduction, numbers)
    yield "<h2>Impact maps</h2>\n"
    yield _maps(reproduction, runs, numbers)
    yield (
        f"<footer><p>Made by Tarsus {escape(package_version())}. A bounce is a rebound whose apex clears the "
        "resolution of the published measurements, 0.1 µm; peak is the highest clearance of the foot in a drive "
        "period, mean over the periods, and mean height its clearance averaged over time."
        "</p></footer>"
    )


def _head(reproduction: RobotReproduction, runs: RobotRuns) -> str:
    problems = reproduction.problems or runs.problems
    lines = [
        f"<h1>Reproduction of the {escape(reproduction.robot)}</h1>\n",
        f'<p class="lede">Device {escape(reproduction.device)}; Tarsus {escape(package_version())}.</p>\n',
        warning(creation_warning(reproduction.scene)),
        *(warning(problem) for problem in problems),
    ]
    best = max(reproduction.modes, key=lambda mode: mode.mac, default=None)
    cells = []
    if best is not None:
        cells.append(("nearest to the printed CoR column", f"mode {best.number}", f"MAC {best.mac:.3f}"))
    summary = reproduction.summary()
    for key, title in CRITERIA:
        ours, source = summary["ours"][key], summary["source"][key]
        if ours is not None:
            words = f"{title.split(' (')[0]}, mean error"
            cells.append((words, _percent(ours), f"source's model {_percent(source)}"))
    shown = "".join(
        f'<div><dt>{escape(title)}</dt><dd>{escape(value)}</dd><dd class="about">{escape(small)}</dd></div>'
        for title, value, small in cells
    )
    return (
        "".join(lines) + (f'<dl class="key">{shown}</dl>\n' if cells else "") + sentences(reproduction.told)
    )


def _heights(reproduction: RobotReproduction, numbers: Iterator[int]) -> str:
    rows = reproduction.rows
    if not rows:
        return f"<p>The source prints no table of heights for the {escape(reproduction.robot)}.</p>\n"
    seeds = max(row.ours.seeds for row in rows)
    if not seeds:
        return f"<p>No run came to its end.</p>\n{_table_of_rows(rows)}"
    text = (
        f"<p>Every number of ours is the median over windows of {1e3 * WINDOW:g} ms, from which the table's counts in "
        f"multiples of 20 seem to be read, of {seeds} runs from random initial states, with the interval that "
        f"holds 80 % of the windows in brackets; {SETTLE:g} s are dropped and {OBSERVED:g} s observed. Mean height "
        f"is taken as {escape(reproduction.column.value)}; the mean of the flights' highest points is beside it. Error "
        f"is (measured − simulated) / measured of the median; errors beyond {100 * NOTABLE:.0f} % are coloured.</p>\n"
    )
    ground = reproduction.scene.ground
    if ground.film is None and ground.electrostatic is None and ground.leg_electrostatic is None:
        text += "<p>This device has no small forces: with and without them are the same.</p>\n"
    drawn = figure(height_bars(rows), next(numbers))
    return f"{text}{_table_of_rows(rows)}{_summary(reproduction)}{drawn}"


def _table_of_rows(rows: tuple[Row, ...]) -> str:
    columns = [
        Column("scenario", number=False),
        Column("", number=False),
        Column("measured"),
        Column("source's model"),
        Column("Tarsus"),
        Column("without small forces"),
        Column("source's error"),
        Column("our error"),
        Column("role", number=False),
    ]
    body: list[list[Cell]] = []
    for row in rows:
        scenario = row.scenario
        for k, (key, title) in enumerate(CRITERIA):
            measured, source = getattr(scenario.measured, key), getattr(scenario.source, key)
            ours = getattr(row.ours.heights, key)
            origin = "" if scenario.origin == "packaged" else f", {scenario.origin}"
            first = f"{describe(scenario)}, {number(row.freq_hz)}\u00a0Hz{origin}" if k == 0 else ""
            body.append(
                [
                    first,
                    title.replace(" height", "").replace(" ", "\u00a0"),
                    number(measured),
                    number(source),
                    _with_interval(row.ours.prediction(key)),
                    _with_interval(row.without.prediction(key)),
                    _error(relative_error(measured, source)),
                    _error(relative_error(measured, ours)),
                    row.role.replace(" ", "\u00a0") if k == 0 else "",
                ]
            )
        chance = MISSING if row.ours.p_bounce is None else f"{100.0 * row.ours.p_bounce:.0f} %"
        body.append(
            ["", "mean apex (µm)", MISSING, MISSING, _with_interval(row.ours.apex_um), "", "", "", ""]
        )
        body.append(["", "windows with a bounce", MISSING, MISSING, chance, "", "", "", ""])
    return table(columns, body)


def _summary(reproduction: RobotReproduction) -> str:
    summary = reproduction.summary()
    if all(value is None for value in summary["ours"].values()):
        return "<p>No row has a measurement: nothing to compare with.</p>\n"
    columns = [Column("mean absolute error against the measurement", number=False)]
    columns += [Column(title.split(" (")[0]) for _, title in CRITERIA]
    body: list[list[Cell]] = [
        ["source's model, all rows", *(_percent(summary["source"][key]) for key in QUANTITIES)]
    ]
    counts = []
    for role in ("calibrated on", "predicted"):
        part = reproduction.summary(role=role)
        counts.append(sum(row.role == role and bool(row.scenario.measured) for row in reproduction.rows))
        for name, words in MODELS[1:]:  # the source's model is above
            body.append([f"{words}, rows {role}", *(_percent(part[name][key]) for key in QUANTITIES)])
    note = (
        f"<p>{counts[0]} measured scenarios were calibrated on: their errors say how well the device can be fitted. "
        f"{counts[1]} measured scenarios are predicted: their errors say what the device knows.</p>\n"
    )
    return f"{table(columns, body)}{note}"


def _over_ground(runs: RobotRuns, numbers: Iterator[int]) -> str:
    traces: list[Trace] = []
    feet: list[str] = []
    whole = [near for near in runs.near if near.run.ok]
    for near in whole:
        series = last_turns(near.run, TURNS, SAMPLES)
        feet += [name for name in series.foot_points if name not in feet]
        traces += [point_trace(series, point, _title(runs, near, series, point)) for point in near.points]
    if not traces:
        return "<p>No run came to its end.</p>\n"
    which = f" {joined(sorted({near.title for near in runs.near}))}." if len(runs.near) == 1 else ""
    motion = (
        f"Height above the ground over the last drive periods of a run of {whole[0].run.duration:g} s from rest, "
        f"under the drive above.{which} Contact is shaded, the dashed line is the ground. Every run is one of many: "
        "motion with bounces forgets its start within a few impacts."
    )
    if any(not trace.contacts and trace.title not in feet for trace in traces) and len(runs.near) == 1:
        motion += (
            " Heights of points without a foot are their displacement on the bouncing foot's gap at rest; only the "
            "bouncing foot has ground below it."
        )
    plates = (motion_of(traces, "height", motion, ground=True), dials(traces))
    return "".join(figure(plate, next(numbers)) for plate in plates)


def _title(runs: RobotRuns, near: Near, series: Series, point: str) -> str:
    if len(near.points) == 1:
        return near.title
    return f"{point} (bouncing foot)" if point in series.foot_points else point


def _in_air(reproduction: RobotReproduction, runs: RobotRuns, numbers: Iterator[int]) -> str:
    traces = [trace for air in runs.air if not air.problem for trace in _air_traces(air, len(runs.air) > 1)]
    several = len(runs.air) > 1
    columns = [Column("drive", number=False), Column("point", number=False), Column("peak to peak", "µm")]
    rows: list[list[Cell]] = [
        [f"{air.volt_v:g} V square, {air.freq_hz:.4g} Hz", point, number(1e6 * float(size))]
        for air in runs.air
        if not air.problem
        for point, size in zip(air.points, air.peak_to_peak, strict=True)
    ]
    text = (
        f"<p>The foot hangs {100 * AIR_GAP:g} cm above the ground, so that nothing touches; transients have died out. "
        "The source shows these as figures only, without numbers to compare with.</p>\n"
    )
    caption = (
        f"Displacement of {'the actuated foot' if several else 'the points'} in the air under a square wave, steady "
        "periods."
    )
    drawn = figure(motion_of(traces, "displ.", caption, ground=False), next(numbers)) if traces else ""
    return f"{text}{drawn}{table(columns, rows)}"


def _air_traces(air: InAir, several: bool) -> list[Trace]:
    drive = f"{air.volt_v:g} V, {air.freq_hz:.4g} Hz"
    return [
        Trace(f"{point}, {drive}" if several else point, air.time, shift, air.volts, 1.0 / air.freq_hz)
        for point, shift in zip(air.points, air.displacement, strict=True)
    ]


def _modes(reproduction: RobotReproduction, numbers: Iterator[int]) -> str:
    if not reproduction.modes:
        return "<p>The device's points are not those of the printed matrix, so no mode can be compared.</p>\n"
    points = reproduction.scene.robot.structure.points
    plate = mode_shapes(reproduction.modes, printed_column(reproduction.robot), points)
    columns = [Column("mode"), Column("frequency", "Hz"), Column("MAC"), *(Column(point) for point in points)]
    rows: list[list[Cell]] = [
        [str(mode.number), number(mode.freq_hz), f"{mode.mac:.3f}", *(number(v, 3) for v in mode.shape)]
        for mode in reproduction.modes
    ]
    column: list[Cell] = ["printed", "", "", *(number(v, 3) for v in printed_column(reproduction.robot))]
    note = "<p>Shapes relative to the struck foot; the last line is the printed CoR column.</p>\n"
    return f"{figure(plate, next(numbers))}{table(columns, [*rows, column])}{note}"


def _maps(reproduction: RobotReproduction, runs: RobotRuns, numbers: Iterator[int]) -> str:
    columns = [
        Column("map", number=False),
        Column("restitution"),
        Column("skew"),
        Column("worst gain as it is"),
        Column("worst gain made passive"),
    ]
    rows: list[list[Cell]] = [
        [
            row.map,
            number(row.restitution),
            number(row.skew, 3),
            _gain(row.worst_gain),
            _gain(row.passive_worst_gain),
        ]
        for row in reproduction.maps
    ]
    impact = reproduction.scene.ground.impact
    acting = (
        "The device's ground has no impact map of its own: mass-weighted."
        if impact is None
        else f"The device acts through the {impact.title} map, {'made passive' if impact.passive else 'as it is'}."
    )
    text = (
        "<p>Gain is the largest factor by which one impact can multiply the kinetic energy; above 1 the map can create "
        "energy. Skew is how far the map's direction lies across that of an impulse at the foot, in the mass metric. "
        f"{escape(acting)}</p>\n"
    )
    energies = runs.energies
    out = f"{text}{table(columns, rows)}"
    if not runs.struck.run.ok:
        return out + f"<p>The run at {escape(runs.struck.title)} did not come to its end.</p>\n"
    if not len(energies.time):
        return out + f"<p>The foot did not strike the ground in the run at {escape(runs.struck.title)}.</p>\n"
    lists = {"as run": energies.actual} | {f"{k}, as it is": v for k, v in energies.by_map.items()}
    scale = scale_of(
        "J", *(np.array([values.sum(), values.max(), values.min()]) for values in lists.values())
    )
    columns = [
        Column(f"{len(energies.time)} impacts at {runs.struck.title}", number=False),
        Column("energy made, sum", scale.label),
        Column("mean of an impact", scale.label),
        Column("most made", scale.label),
        Column("most lost", scale.label),
        Column("impacts that make energy"),
    ]
    body: list[list[Cell]] = [
        [
            name,
            *(number(float(v) / scale.step, 3) for v in (values.sum(), values.mean())),
            number(_beyond(float(values.max()), values) / scale.step, 3),
            number(_beyond(-float(values.min()), values) / scale.step, 3),
            _percent(_hundred(share_made(values))),
        ]
        for name, values in lists.items()
    ]
    note = (
        "<p>Each map is asked what it would have done with the velocities just before every impact of this one run; "
        "a run under another map would meet other velocities.</p>\n"
    )
    drawn = figure(impact_histograms(energies, runs.struck.title), next(numbers))
    return f"{out}{drawn}{table(columns, body)}{note}"


def _beyond(value: float, values: np.ndarray) -> float:
    """A largest value, 0 where it is below zero or rounding."""
    return value if value > 1e-9 * float(np.abs(values).max()) else 0.0


def _gain(gain: float) -> Cell:
    return Markup(f'<td class="{"n off" if gain > 1.0 + 1e-9 else "n"}">{escape(number(gain, 3))}</td>')


def _with_interval(found: Prediction) -> str:
    if not math.isfinite(found.median):
        return MISSING
    digits = 0 if found.median >= 100.0 else 1
    return f"{found.median:.{digits}f} ({found.low:.{digits}f} to {found.high:.{digits}f})".replace(
        " ", "\u00a0"
    )


def _error(error: float | None) -> Cell:
    if error is None:
        return MISSING
    kind = "n off" if abs(error) > NOTABLE else "n"
    shown = f"{100.0 * error:+.0f} %".replace("-", "−") if abs(error) >= 0.005 else "0 %"
    return Markup(f'<td class="{kind}">{shown}</td>')


def _hundred(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def _percent(value: float | None) -> str:
    return MISSING if value is None else f"{value:.1f} %"


__all__ = ["robot_html", "write_robot_report"]
