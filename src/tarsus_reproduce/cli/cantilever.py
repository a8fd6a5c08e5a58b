"""What `tarsus reproduce cantilever` does: Table A.1 row by row and the summary of Table 2.3."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus_reproduce.cli.tables import interval, share

if TYPE_CHECKING:
    from tarsus_reproduce.cantilever import CantileverReproduction, Row


def run(
    device: str | None, rows: Path | None, output: Path | None, *, json: bool, quiet: bool = False
) -> int:
    """Reproduce, print and write; the exit code. Quiet: nothing is printed."""
    from tarsus.cli import console
    from tarsus_reproduce.cantilever import reproduce_cantilever

    with console.progress_bar("reproducing") as progress:
        reproduction = reproduce_cantilever(device, rows, progress)
    result = reproduction.to_dict()
    if json:
        console.print_json(result)
    elif not quiet:
        _print(reproduction, result["summary"])
    if output is not None:
        _write(reproduction, result, output, quiet=json or quiet)
    console.complain(f"{_drive(row)}: {code}" for row in reproduction.rows for code in row.codes)
    return 0 if reproduction.ok else 1


def _print(reproduction: CantileverReproduction, summary: dict[str, Any]) -> None:
    from tarsus.cli import console

    print(f"Micro-cantilever under periodic drive, device '{reproduction.device}'")
    print("source = the source's model, measured = its experiment; error = (measured - simulated)/measured")
    over = "drive periods after transients"
    if reproduction.calibration is not None:
        over += ", members of a mixture and what the model misses of a row left out"
    print(f"ours = median over {over} (interval that holds 80 %)")
    for title, cells in _tables(reproduction):
        print(f"\n{title}")
        console.table(
            ("drive", "role", "source", "measured", "ours", "source's error", "our error"),
            cells,
            numbers_from=2,
        )
    print(
        "\nperiods with a bounce: "
        + ", ".join(f"{_drive(row)} {share(row.p_bounce)}" for row in reproduction.rows)
    )
    if reproduction.calibration is not None:
        print(
            "\nThe mixture by its calibration (left out: each row as predicted by a search that never had it)"
        )
        console.table(
            ("against the measurement", "calibrated on", "left out"), _left_out(reproduction.calibration)
        )
    for title, part in _parts(summary):
        print(f"\n{title}")
        console.table(("against the measurement", "source", "ours"), _summary_rows(part))
        close = part["ours_against_source"]
        print(
            f"ours against the source's model: peak within 15 % in {close['peak_within_15_percent']} of "
            f"{close['peak']['cases']}, contact within 30 % or 1 ms in "
            f"{close['contact_within_30_percent_or_1_ms']} of {close['contact']['cases']}, "
            f"existence of bounces in {close['existence_right']} of {close['count_cases']}"
        )


def _left_out(calibration: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Errors of the packaged mixture over the rows it was fitted to, and over each row predicted without it."""
    both = [calibration["training"], calibration["left_out"]]
    held = [_whole(one["held"] if one else None) for one in both]

    def line(title: str, name: str, key: str, show: Callable[[float | None], str]) -> tuple[str, str, str]:
        first, second = (show(one["measures"][name][key] if one else None) for one in both)
        return (title, first, second)

    return [
        line("existence of bounces: Brier score", "bounces", "brier", lambda one: _number(one, 2)),
        line("mean error of the number", "bounces", "mean_absolute_error", lambda one: _number(one, 2)),
        line("peak: mean error, absolute", "peak", "mean_relative_error", _whole),
        line("contact: mean error, absolute", "contact", "mean_relative_error", _whole),
        *(
            line(f"{name}: values in the 80 % interval", name, "held", _whole)
            for name in ("bounces", "peak", "contact")
        ),
        ("all: values in the 80 % interval", held[0], held[1]),
    ]


def _whole(share: float | None) -> str:
    return "-" if share is None else f"{100.0 * share:.1f} %"


def _tables(reproduction: CantileverReproduction) -> list[tuple[str, list[tuple[str, ...]]]]:
    """The three quantities of Table A.1, each with a row per case."""
    quantities = (
        ("bounces per period", "bounces", "count", 2),
        ("peak oscillation amplitude [µm]", "peak_um", "peak", 1),
        ("contact duration per period [ms]", "contact_ms", "contact", 2),
    )
    tables = []
    for title, field, error, digits in quantities:
        cells = []
        for row in reproduction.rows:
            case = row.case
            drive = _drive(row) + ("" if case.origin == "packaged" else " *")
            source, measured = (getattr(where, field) for where in (case.source, case.measured))
            ours = getattr(row.predictions, field).to_dict()
            wrong = [getattr(errors, error) for errors in (row.source_errors, row.our_errors)]
            texts = [_number(one, digits) if error == "count" else _percent(one) for one in wrong]
            shown = ("-" if one is None else f"{one:g}" for one in (source, measured))
            cells.append((drive, row.role, *shown, interval(ours, digits), *texts))
        tables.append((title, cells))
    if any(row.case.origin != "packaged" for row in reproduction.rows):
        tables[-1] = (tables[-1][0] + "  (* = from the rows file)", tables[-1][1])
    return tables


def _drive(row: Row) -> str:
    return f"{row.case.freq_hz:g} Hz, {row.case.volt_v:g} V, {row.case.wave}"


def _parts(summary: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    parts = [(f"Summary of {summary['rows']} rows (Table 2.3 of the source)", summary)]
    for key, words in (
        ("packaged_rows", "packaged rows alone"),
        ("added_rows", "rows of the file alone"),
        ("calibrated_rows", "rows calibrated on"),
        ("predicted_rows", "rows predicted"),
    ):
        if key in summary:
            parts.append((f"Summary of the {summary[key]['rows']} {words}", summary[key]))
    return parts


def _summary_rows(summary: dict[str, Any]) -> list[tuple[str, str, str]]:
    both = (summary["source"], summary["ours"])

    def line(title: str, *texts: str) -> tuple[str, str, str]:
        return (title, texts[0], texts[1])

    lines = [
        line(
            "existence of bounces right",
            *(f"{one['existence_right']} of {one['count_cases']}" for one in both),
        ),
        line("number of bounces right", *(f"{one['count_right']} of {one['count_cases']}" for one in both)),
        line("mean error of the number", *(_number(one["mean_count_error"], 2) for one in both)),
    ]
    for key in ("peak", "contact"):
        lines += [
            line(
                f"{key}: mean error, signed",
                *(_percent(one[key]["mean_signed_percent"], 1.0) for one in both),
            ),
            line(
                f"{key}: mean error, absolute",
                *(_unsigned(one[key]["mean_absolute_percent"]) for one in both),
            ),
            line(
                f"{key}: errors below 30 %",
                *(f"{one[key]['below_30_percent']} of {one[key]['cases']}" for one in both),
            ),
        ]
    return lines


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None or value != value else f"{value:.{digits}f}"


def _percent(value: float | None, scale: float = 100.0) -> str:
    return "-" if value is None or value != value else f"{value * scale:+.1f} %"


def _unsigned(percent: float | None) -> str:
    return "-" if percent is None else f"{percent:.1f} %"


def _write(
    reproduction: CantileverReproduction, result: dict[str, Any], folder: Path, *, quiet: bool
) -> None:
    import csv
    import io

    from tarsus_reproduce.cli import outputs
    from tarsus_reproduce.pages.cantilever import write_cantilever_report

    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    names = ("bounces", "peak_um", "contact_ms")
    who = ("source", "measured", "ours", "ours_low", "ours_high")
    about = ("freq_hz", "volt_v", "wave", "role", "p_bounce")
    writer.writerow([*about, *(f"{name}_{one}" for name in names for one in who)])
    for row in result["rows"]:
        numbers = []
        for name in names:
            numbers += [(row[one] or {}).get(name) for one in ("source", "measured")]
            numbers += [row["ours"][name][end] for end in ("median", "low", "high")]
        writer.writerow([*(row[name] for name in about), *numbers])
    outputs.write(folder, lines.getvalue(), result, partial(write_cantilever_report, result), quiet=quiet)
