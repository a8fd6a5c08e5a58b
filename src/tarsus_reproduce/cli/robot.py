"""What `tarsus reproduce hexapod|quadruped` does: Table 3.2 side by side, modes, motion in the air, impact maps."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus_reproduce.cli.tables import interval, share

if TYPE_CHECKING:
    from tarsus_reproduce.robot_runs import RobotRuns
    from tarsus_reproduce.robots import RobotReproduction

QUANTITIES = (
    ("bounces_per_s", "bounces per second", 1),
    ("peak_um", "peak height [µm]", 2),
    ("mean_um", "mean height [µm]", 2),
)


def run(
    robot: str,
    device: str | None,
    rows: Path | None,
    seeds: int | None,
    output: Path | None,
    *,
    json: bool,
    quiet: bool = False,
) -> int:
    """Reproduce, print and write; the exit code. Quiet: nothing is printed."""
    from tarsus.cli import console
    from tarsus.files.library import load_scene
    from tarsus_reproduce.robot_runs import check_device, robot_runs
    from tarsus_reproduce.robots import SEEDS, reproduce_robot

    check_device(load_scene(device or robot), device or robot)
    with console.progress_bar("reproducing") as progress:
        reproduction = reproduce_robot(robot, device, rows, seeds=seeds or SEEDS, progress=progress)
        runs = robot_runs(robot, device, progress=progress)
    problems = [*reproduction.problems, *runs.problems]
    result = {**reproduction.to_dict(), **runs.to_dict(), "ok": not problems}
    if json:
        console.print_json(result)
    elif not quiet:
        _print(reproduction, runs, result)
    if output is not None:
        _write(reproduction, runs, result, output, quiet=json or quiet)
    console.complain(problems)
    return 1 if problems else 0


def _print(reproduction: RobotReproduction, runs: RobotRuns, result: Mapping[str, Any]) -> None:
    from tarsus.cli import console
    from tarsus.cli.summary import short
    from tarsus.impacts.energy import creation_warning

    print(f"Bouncing foot of the {reproduction.robot}, device '{reproduction.device}'")
    caution = creation_warning(reproduction.scene)
    if caution:
        print(caution)
    rows = result["rows"]
    if rows:
        _print_rows(rows, result)
    else:
        print("the source prints no table of heights for this robot")
    if reproduction.modes:
        print("\nModes beside the printed CoR column (MAC, 1 = the same shape)")
        cells = [(str(mode.number), f"{mode.freq_hz:.1f}", f"{mode.mac:.3f}") for mode in reproduction.modes]
        console.table(("mode", "Hz", "MAC"), cells)
    print(
        f"\nImpact maps: worst gain of kinetic energy in one impact; sum over the run at {runs.struck.title}"
    )
    energies = result["impact_energies"]
    cells = [
        (
            row.map,
            f"{row.worst_gain:.3g}",
            f"{row.passive_worst_gain:.3g}",
            short(energies["by_map"][row.map]["sum_j"], "J"),
        )
        for row in reproduction.maps
    ]
    console.table(("map", "as it is", "passive", "would have made"), cells)
    print(f"the run's own {energies['impacts']} impacts made {short(energies['own_sum_j'], 'J')}")
    print("\nIn the air, steady square wave: peak to peak [µm]")
    cells = [
        (f"{air['volt_v']:g} V, {air['freq_hz']:.4g} Hz", point, f"{size:.1f}")
        for air in result["in_air"]
        for point, size in air["peak_to_peak_um"].items()
    ]
    console.table(("drive", "point", "peak to peak"), cells, numbers_from=2)


def _print_rows(rows: list[dict[str, Any]], result: Mapping[str, Any]) -> None:
    from tarsus.cli import console
    from tarsus_reproduce.cases import relative_error
    from tarsus_reproduce.robots import WINDOW

    print(
        f"source = the source's model, measured = its experiment, ours = median over windows of {1e3 * WINDOW:g} ms of "
        f"{max(row['seeds'] for row in rows)} seeds (interval of 80 %), bare = ours without small forces; "
        "error = (measured - simulated)/measured"
    )
    for key, title, digits in QUANTITIES:
        cells = []
        for row in rows:
            source, measured = ((row[who] or {}).get(key) for who in ("source", "measured"))
            ours, bare = row["ours"][key], row["without_small_forces"][key]
            cells.append(
                (
                    _scenario(row),
                    row["role"],
                    _plain(measured),
                    _plain(source),
                    interval(ours, digits),
                    interval(bare, digits),
                    _percent(relative_error(measured, source)),
                    _percent(relative_error(measured, ours["median"])),
                )
            )
        print(f"\n{title}")
        headings = ("scenario", "role", "measured", "source", "ours", "bare", "source's error", "our error")
        console.table(headings, cells, numbers_from=2)
    print(f"\nmean height is read as: {result['mean_um_is']}; beside it, and how sure a bounce is")
    cells = [(_scenario(row), interval(row["mean_apex_um"], 2), share(row["p_bounce"])) for row in rows]
    console.table(("scenario", "mean apex [µm]", "windows with a bounce"), cells)
    print("\nMean absolute error against the measurement")
    cells = [("source's model", *(_unsigned(result["summary"]["source"][key]) for key, _, _ in QUANTITIES))]
    for part, words in (("summary_calibrated", "calibrated on"), ("summary_predicted", "predicted")):
        for name, model in (("ours", "ours"), ("without_small_forces", "bare")):
            errors = result[part][name]
            cells.append((f"{model}, rows {words}", *(_unsigned(errors[key]) for key, _, _ in QUANTITIES)))
    console.table(("model", "bounces", "peak", "mean height"), cells)


def _scenario(row: Mapping[str, Any]) -> str:
    text = f"{row['volt_v']:g} V {row['wave']}, gap {row['gap_um']:g} µm, {row['freq_hz']:.4g} Hz"
    return text if row["origin"] == "packaged" else f"{text} ({row['origin']})"


def _plain(value: float | None) -> str:
    return "-" if value is None else f"{value:g}"


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100.0 * value:+.1f} %"


def _unsigned(percent: float | None) -> str:
    return "-" if percent is None else f"{percent:.1f} %"


def _write(
    reproduction: RobotReproduction, runs: RobotRuns, result: Mapping[str, Any], folder: Path, *, quiet: bool
) -> None:
    import csv
    import io

    from tarsus_reproduce.cli import outputs
    from tarsus_reproduce.pages.robot import write_robot_report

    about = ("wave", "volt_v", "gap_um", "freq_hz", "origin", "role", "seeds", "p_bounce")
    tables, ours = ("measured", "source"), ("ours", "without_small_forces")
    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    columns = [f"{key}_{one}" for key, _, _ in QUANTITIES for one in tables]
    columns += [
        f"{key}_{one}{end}" for key, _, _ in QUANTITIES for one in ours for end in ("", "_low", "_high")
    ]
    writer.writerow([*about, *columns])
    for row in result["rows"]:
        numbers = [(row[one] or {}).get(key) for key, _, _ in QUANTITIES for one in tables]
        numbers += [
            row[one][key][end]
            for key, _, _ in QUANTITIES
            for one in ours
            for end in ("median", "low", "high")
        ]
        writer.writerow([*(row[name] for name in about), *numbers])
    outputs.write(
        folder, lines.getvalue(), result, partial(write_robot_report, reproduction, runs), quiet=quiet
    )
