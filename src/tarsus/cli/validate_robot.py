"""What `tarsus validate hexapod|quadruped` does: Table 3.2 side by side, modes, motion in the air, impact maps."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tarsus.files.output import OutputFolder
    from tarsus.study.robot_runs import RobotRuns
    from tarsus.study.robots import RobotValidation

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
    output: OutputFolder | None,
    *,
    json: bool,
) -> int:
    """Validate, print and write; the exit code."""
    from tarsus.cli import console
    from tarsus.files.library import load_scene
    from tarsus.study.robot_runs import check_device, robot_runs
    from tarsus.study.robots import SEEDS, validate_robot

    check_device(load_scene(device or robot), device or robot)
    console.announce_compiling()
    with console.progress_bar("validating") as progress:
        validation = validate_robot(robot, device, rows, seeds=seeds or SEEDS, progress=progress)
        runs = robot_runs(robot, device, progress=progress)
    problems = [*validation.problems, *runs.problems]
    result = {**validation.to_dict(), **runs.to_dict(), "ok": not problems}
    if json:
        console.print_json(result)
    else:
        _print(validation, runs, result)
    if output is not None:
        _write(validation, runs, result, output, quiet=json)
    console.complain(problems)
    return 1 if problems else 0


def _print(validation: RobotValidation, runs: RobotRuns, result: Mapping[str, Any]) -> None:
    from tarsus.cli import console
    from tarsus.cli.summary import short
    from tarsus.study.impacts import creation_warning

    print(f"Bouncing foot of the {validation.robot}, device '{validation.device}'")
    caution = creation_warning(validation.scene)
    if caution:
        print(caution)
    rows = result["rows"]
    if rows:
        _print_rows(rows, result["summary"])
    else:
        print("the source prints no table of heights for this robot")
    if validation.modes:
        print("\nModes beside the printed CoR column (MAC, 1 = the same shape)")
        cells = [(str(mode.number), f"{mode.freq_hz:.1f}", f"{mode.mac:.3f}") for mode in validation.modes]
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
        for row in validation.maps
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


def _print_rows(rows: list[dict[str, Any]], summary: Mapping[str, Any]) -> None:
    from tarsus.cli import console
    from tarsus.study.relative import relative_error

    print(
        f"source = the source's model, measured = its experiment, ours = mean of {max(row['seeds'] for row in rows)} "
        "seeds ± standard deviation of one, bare = ours without small forces; error = (measured - simulated)/measured"
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
                    _number(ours, digits),
                    _number(row["ours_spread"][key], digits),
                    _number(bare, digits),
                    _number(row["without_small_forces_spread"][key], digits),
                    _percent(relative_error(measured, source)),
                    _percent(relative_error(measured, ours)),
                )
            )
        print(f"\n{title}")
        headings = (
            "scenario",
            "role",
            "measured",
            "source",
            "ours",
            "±",
            "bare",
            "±",
            "source's error",
            "our error",
        )
        console.table(headings, cells, numbers_from=2)
    print("\nMean absolute error against the measurement")
    models = (("source", "source's model"), ("ours", "ours"), ("without_small_forces", "bare"))
    console.table(
        ("model", "bounces", "peak", "mean height"),
        [(words, *(_unsigned(summary[name][key]) for key, _, _ in QUANTITIES)) for name, words in models],
    )


def _scenario(row: Mapping[str, Any]) -> str:
    text = f"{row['volt_v']:g} V {row['wave']}, gap {row['gap_um']:g} µm, {row['freq_hz']:.4g} Hz"
    return text if row["origin"] == "packaged" else f"{text} ({row['origin']})"


def _plain(value: float | None) -> str:
    return "-" if value is None else f"{value:g}"


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None or value != value else f"{value:.{digits}f}"


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100.0 * value:+.1f} %"


def _unsigned(percent: float | None) -> str:
    return "-" if percent is None else f"{percent:.1f} %"


def _write(
    validation: RobotValidation,
    runs: RobotRuns,
    result: Mapping[str, Any],
    folder: OutputFolder,
    *,
    quiet: bool,
) -> None:
    import csv
    import io

    from tarsus.cli import validate_files
    from tarsus.report import write_robot_report

    who = ("measured", "source", "ours", "ours_spread", "without_small_forces", "without_small_forces_spread")
    about = ("wave", "volt_v", "gap_um", "freq_hz", "origin", "role", "seeds")
    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow([*about, *(f"{key}_{one}" for key, _, _ in QUANTITIES for one in who)])
    for row in result["rows"]:
        numbers = [(row[one] or {}).get(key) for key, _, _ in QUANTITIES for one in who]
        writer.writerow([*(row[name] for name in about), *("" if v != v else v for v in numbers)])
    validate_files.write(
        folder, lines.getvalue(), result, partial(write_robot_report, validation, runs), quiet=quiet
    )
