"""What `tarsus validate millipede` does: every trend of section 4.4.1 with what ours does, and Fig. 4.7."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tarsus.files.output import OutputFolder
    from tarsus.study.millipede import MillipedeValidation, Outcome


def run(device: str, output: OutputFolder | None, *, json: bool) -> int:
    """Validate, print and write; the exit code. A contradicted trend is a result, not a failure."""
    from tarsus.cli import console
    from tarsus.files.library import load_scene
    from tarsus.study.millipede import validate_millipede

    console.announce_compiling(load_scene(device))
    with console.progress_bar("validating") as progress:
        validation = validate_millipede(device, progress=progress)
    result = validation.to_dict()
    if json:
        console.print_json(result)
    else:
        _print(validation)
    if output is not None:
        _write(validation, result, output, quiet=json)
    console.complain(validation.problems)
    return 0 if validation.ok else 1


def _print(validation: MillipedeValidation) -> None:
    import textwrap

    from tarsus.study.trends import CRITERION

    print(f"Walking millipede against the trends of section 4.4.1, device '{validation.device}'")
    print(textwrap.fill(f"Replicates are the restitutions of Table 4.2. {CRITERION}", 118))
    for outcome in validation.outcomes:
        _print_outcome(outcome)


def _print_outcome(outcome: Outcome) -> None:
    from tarsus.cli import console
    from tarsus.study.trends import Verdict

    variant = outcome.variant
    print(f"\n{variant.name.capitalize()}: {variant.about}")
    counts = ", ".join(f"{verdict.value} {outcome.count(verdict)}" for verdict in Verdict)
    print(f"By the measure of each figure: {counts}")
    rows = [
        (
            one.trend.figure,
            one.trend.quantity,
            one.trend.says,
            one.measure.replace("_", " "),
            one.finding.verdict.value,
            one.finding.words,
            _shown(one.finding.first, one.unit),
            _shown(one.finding.last, one.unit),
        )
        for one in outcome.trends
    ]
    headings = ("Fig.", "quantity", "source", "measure", "ours", "why", "first", "last")
    console.table(headings, rows, numbers_from=6)
    for one in outcome.examples:
        up, way = _shown(one.amplitude, "m"), _shown(one.stride, "m")
        print(f"Fig. 4.7({one.name}): the body swings {up} up and down and travels {way} a period")
    for one in outcome.comparisons:
        print(f"Fig. 4.7: {one.says}: {one.verdict.value} ({one.words})")


def _shown(value: float, unit: str) -> str:
    """A value for reading; lengths of rounding are 0."""
    from tarsus.cli.summary import short
    from tarsus.measure import STANDSTILL

    return short(0.0 if unit == "m" and abs(value) < STANDSTILL else value, unit)


def _write(
    validation: MillipedeValidation, result: Mapping[str, Any], folder: OutputFolder, *, quiet: bool
) -> None:
    import csv
    import io

    from tarsus.cli import validate_files
    from tarsus.report import write_millipede_report

    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    about = ("figure", "quantity", "says", "measure", "unit", "verdict", "words", "first", "last")
    writer.writerow(["variant", *about, "least_rho", "largest_rho"])
    for variant in result["variants"]:
        for one in variant["trends"]:
            writer.writerow(
                [variant["name"], *(one[name] for name in about), min(one["rho"]), max(one["rho"])]
            )
    validate_files.write(
        folder, lines.getvalue(), result, partial(write_millipede_report, validation), quiet=quiet
    )
