"""What `tarsus reproduce millipede` does: every trend of section 4.4.1 with what ours does, and Fig. 4.7."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tarsus_reproduce.millipede import MillipedeReproduction, Outcome
    from tarsus_reproduce.readings import Readings


@dataclass(frozen=True)
class Asked:
    """Numbers of random readings (0: the packaged ones) and of neighbours of every device, their seed, threads."""

    readings: int = 0
    scatter: int = 0
    seed: int = 1
    threads: int | None = None


READINGS_FILE = "readings-{seed}.jsonl"
"""Finished readings of a seed, in the output folder."""


def run(device: str | None, output: Path | None, asked: Asked, *, json: bool, quiet: bool = False) -> int:
    """Reproduce, print and write; the exit code. Quiet: nothing is printed. A contradicted trend is no failure."""
    from tarsus.cli import console
    from tarsus_reproduce.millipede import VARIANTS, reproduce_millipede

    with console.progress_bar("reproducing", time_left=asked.readings > 0) as progress:
        reproduction = reproduce_millipede(device or VARIANTS, progress=progress)
        drawn = _readings(device or VARIANTS[0], output, asked, progress)
        near = _scatter(reproduction, asked, progress) if asked.scatter else {}
    result: dict[str, Any] = reproduction.to_dict() | {
        "readings": drawn.to_dict() | {"packaged": not asked.readings}
    }
    for name, table in near.items():
        result["variants"][name]["scatter"] = table
    if json:
        console.print_json(result)
    elif not quiet:
        _print(reproduction, result)
    if output is not None:
        _write(reproduction, drawn, result, output, quiet=json or quiet)
    console.complain(reproduction.problems)
    return 0 if reproduction.ok else 1


def _readings(device: str, output: Path | None, asked: Asked, progress: Any) -> Readings:
    """As many as are asked for, judged; without a number, those that come with the package."""
    from tarsus.files.library import load_scene
    from tarsus_reproduce.packaged_readings import packaged_readings
    from tarsus_reproduce.readings import random_readings

    if not asked.readings:
        return packaged_readings()
    file = None if output is None else output / READINGS_FILE.format(seed=asked.seed)
    return random_readings(
        load_scene(device), asked.readings, asked.seed, file=file, threads=asked.threads, progress=progress
    )


def _scatter(reproduction: MillipedeReproduction, asked: Asked, progress: Any) -> dict[str, Any]:
    from tarsus_reproduce.scatter import scatter_scores, scatter_table

    return {
        one.name: scatter_table(scatter_scores(one, asked.scatter, asked.seed, progress=progress))
        for one in reproduction.outcomes
    }


def _print(reproduction: MillipedeReproduction, result: Mapping[str, Any]) -> None:
    import textwrap

    from tarsus.cli import console
    from tarsus_reproduce.trends import CRITERION

    print("Walking millipede against the trends of section 4.4.1")
    print(textwrap.fill(f"Replicates are the restitutions of Table 4.2. {CRITERION}", 118))
    for outcome in reproduction.outcomes:
        _print_outcome(outcome)
    print("\nScore of each device over 15 trends and Fig. 4.7; film in its own reading")
    rows = []
    for outcome in reproduction.outcomes:
        one = outcome.score
        directional = f"{one.directional_agree} of {one.directional_total}"
        rows.append(
            (
                outcome.name,
                *map(str, (one.agree, one.contradict, one.insensitive, one.not_determined)),
                directional,
            )
        )
    headings = ("device", "agrees", "contradicts", "insensitive", "not determined", "directional agree")
    console.table(headings, rows)
    for name, variant in result["variants"].items():
        near = variant.get("scatter", {})
        if "agree" in near:
            spans = ", ".join(
                f"{near[key]['least']} to {near[key]['most']} {words}"
                for key, words in (
                    ("agree", "agree"), ("contradict", "contradict"), ("directional_agree", "directional ones agree"),
                )
            )  # fmt: skip
            print(
                f"{name}, unprinted numbers scattered by {near['spread']:.0%} ({near['judged']} draws): {spans}"
            )
    found = result["readings"]
    print(
        f"\n{found['judged']} of {found['count']} random readings of what is not printed, seed {found['seed']}"
        + (", as packaged" if found["packaged"] else "")
    )
    rows = [
        (
            name.replace("_", " "),
            *(f"{found[name][key]:.3g}" for key in ("mean", "median", "quantile_95")),
        )
        for name in ("agree", "contradict", "insensitive", "not_determined", "directional_agree")
        if name in found
    ]
    console.table(("trends that", "mean", "median", "95 % at most"), rows)


def _print_outcome(outcome: Outcome) -> None:
    from tarsus.cli import console
    from tarsus_reproduce.millipede_trends import scored_trends

    print(f"\n{outcome.name}: {outcome.about}")
    scored = scored_trends(outcome.reading)
    rows = [
        (
            one.trend.figure + ("" if one.trend in scored else " *"),
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
    print("* = the film's other reading, not scored")
    for one in outcome.examples:
        up, way = _shown(one.amplitude, "m"), _shown(one.stride, "m")
        print(f"Fig. 4.7({one.name}): the body swings {up} up and down and travels {way} a period")
    for one in outcome.comparisons:
        print(f"Fig. 4.7: {one.says}: {one.verdict.value} ({one.words})")


def _shown(value: float, unit: str) -> str:
    """A value for reading; lengths of rounding are 0."""
    from tarsus.measure import STANDSTILL
    from tarsus.tables.numbers import amount as short

    return short(0.0 if unit == "m" and abs(value) < STANDSTILL else value, unit)


def _write(
    reproduction: MillipedeReproduction,
    readings: Readings,
    result: Mapping[str, Any],
    folder: Path,
    *,
    quiet: bool,
) -> None:
    import csv
    import io

    from tarsus_reproduce.cli import outputs
    from tarsus_reproduce.pages.millipede import write_millipede_report

    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    about = (
        "figure", "quantity", "says", "directional", "scored", "measure", "unit", "verdict", "words", "first", "last",
    )  # fmt: skip
    writer.writerow(["variant", *about, "least_rho", "largest_rho"])
    for name, variant in result["variants"].items():
        for one in variant["trends"]:
            writer.writerow([name, *(one[column] for column in about), min(one["rho"]), max(one["rho"])])
    outputs.write(
        folder,
        lines.getvalue(),
        result,
        partial(write_millipede_report, reproduction, readings=readings),
        quiet=quiet,
    )
