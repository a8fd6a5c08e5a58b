"""What `tarsus validate cantilever` does: Table A.1 row by row and the summary of Table 2.3."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tarsus.files.output import OutputFolder
    from tarsus.study.validation import Validation


def run(device: str, rows: Path | None, output: OutputFolder | None, *, json: bool) -> int:
    """Validate, print and write; the exit code."""
    from tarsus.cli import console
    from tarsus.study.validation import validate_cantilever

    console.announce_compiling()
    with console.progress_bar("validating") as progress:
        validation = validate_cantilever(device, rows, progress)
    result = validation.to_dict()
    if json:
        console.print_json(result)
    else:
        _print(validation, result["summary"])
    if output is not None:
        _write(validation, result, output, quiet=json)
    if not validation.ok:
        console.complain(
            f"{row.case.freq_hz:g} Hz, {row.case.volt_v:g} V, {row.case.wave}: {row.code}"
            for row in validation.rows
            if not row.ok
        )
    return 0 if validation.ok else 1


def _print(validation: Validation, summary: dict[str, Any]) -> None:
    from tarsus.cli import console

    print(f"Micro-cantilever under periodic drive, device '{validation.device}'")
    print("source = the source's model, measured = its experiment; error = (measured - simulated)/measured")
    for title, cells in _tables(validation):
        print(f"\n{title}")
        console.table(("drive", "source", "measured", "ours", "±", "source's error", "our error"), cells)
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


def _tables(validation: Validation) -> list[tuple[str, list[tuple[str, ...]]]]:
    """The three quantities of Table A.1, each with a row per case."""
    quantities = (
        ("bounces per period", "bounces", "count", 2),
        ("peak oscillation amplitude [µm]", "peak_um", "peak", 1),
        ("contact duration per period [ms]", "contact_ms", "contact", 2),
    )
    tables = []
    for title, field, error, digits in quantities:
        cells = []
        for row in validation.rows:
            case = row.case
            drive = f"{case.freq_hz:g} Hz, {case.volt_v:g} V, {case.wave}" + (
                "" if case.origin == "packaged" else " *"
            )
            found = [getattr(where, field) for where in (case.source, case.measured, row.ours, row.spread)]
            wrong = [getattr(errors, error) for errors in (row.source_errors, row.our_errors)]
            texts = (
                [_number(value, digits) for value in wrong]
                if error == "count"
                else [_percent(v) for v in wrong]
            )
            shown = (
                f"{found[0]:g}" if found[0] is not None else "-",
                f"{found[1]:g}" if found[1] is not None else "-",
            )
            cells.append((drive, *shown, _number(found[2], digits), _number(found[3], digits), *texts))
        tables.append((title, cells))
    if any(row.case.origin != "packaged" for row in validation.rows):
        tables[-1] = (tables[-1][0] + "  (* = from the rows file)", tables[-1][1])
    return tables


def _parts(summary: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    parts = [(f"Summary of {summary['rows']} rows (Table 2.3 of the source)", summary)]
    for key, words in (("packaged_rows", "packaged rows alone"), ("added_rows", "rows of the file alone")):
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


def _write(validation: Validation, result: dict[str, Any], folder: OutputFolder, *, quiet: bool) -> None:
    import csv
    import io

    from tarsus.cli import validate_files
    from tarsus.report import write_validation_report

    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    names = ("bounces", "peak_um", "contact_ms")
    writer.writerow(
        [
            "freq_hz",
            "volt_v",
            "wave",
            *(f"{name}_{who}" for name in names for who in ("source", "measured", "ours")),
        ]
    )
    for row in validation.rows:
        case = row.case
        who = (case.source, case.measured, row.ours)
        writer.writerow(
            [case.freq_hz, case.volt_v, case.wave, *(getattr(one, name) for name in names for one in who)]
        )
    validate_files.write(
        folder, lines.getvalue(), result, partial(write_validation_report, result), quiet=quiet
    )
