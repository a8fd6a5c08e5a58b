"""`tarsus calibrate`: a device fitted to a table of measures, with every branch that fits and what it predicts."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tarsus.cli.options import HERE, PAGES, LawFiles, MaybeFolder, MaybeSeed, Pages, Resume, Work


def calibrate(
    study: str,
    /,
    *,
    output: MaybeFolder = None,
    seed: MaybeSeed = None,
    work: Work = HERE,
    resume: Resume = False,
    law: LawFiles = None,
    pages: Pages = PAGES,
) -> int:
    """Fit a device to a table of measures: unknowns and choices, an ensemble, each row left out once.

    Parameters
    ----------
    study
        a packaged study or a study file (TOML).
    output
        folder for the visited sets, calibration.json, mixture.json, a device file of every branch and report.html; by
        default the study's name with .calibration.
    """
    from tarsus.calibrate.account import calibration_table
    from tarsus.calibrate.calibrating import calibrate as run
    from tarsus.calibrate.outputs import CALIBRATION_FILES
    from tarsus.calibrate.studyfile import load_study
    from tarsus.cli import console
    from tarsus.model.laws.userfile import laws_of

    described = load_study(study, laws_of(law or ()))
    folder = output if output is not None else Path(f"{Path(study).stem}.calibration")
    target = pages.target(folder, "calibrate", CALIBRATION_FILES, resume=resume)
    with (
        console.resumable(),
        target.writing(resume=resume),
        console.progress_bar("sets", time_left=True) as progress,
        work.workers() as workers,
    ):
        result = run(described, folder, seed=seed, threads=workers, resume=resume, progress=progress)
        table = calibration_table(result)
        if pages.report:
            from tarsus.report.calibrate_page import write_calibration_report

            write_calibration_report(table, folder / "report.html")
    if pages.json:
        console.print_json(table)
    else:
        _show(table)
        console.wrote([folder])
    lost = any(one["failed"] >= 1.0 for row in table["rows"] for one in row.get("training", {}).values())
    if lost:
        console.complain(["no run of some fitted rows reached its end; the calibration means nothing there"])
    return 1 if lost else 0


def _show(table: Mapping[str, Any]) -> None:
    """Branches, unknowns of the best, errors."""
    from tarsus.calibrate.account import found_sentence, options_word
    from tarsus.cli import console

    kept = [one for one in table["branches"] if not one["dropped"]]
    print(f"{table['study']}: {table['sets']} sets, {len(kept)} of {len(table['branches'])} branches kept")
    rows = [
        (options_word(one), f"{one['cost']:.4g}", f"{one['weight']:.2f}" if not one["dropped"] else "-",
         one.get("file") or "dropped")
        for one in sorted(table["branches"], key=lambda one: one["cost"])
    ]  # fmt: skip
    console.table(("branch", "cost", "weight", "device"), rows)
    for name, one in table["choices"].items():
        weights = ", ".join(f"{option} {weight:.2f}" for option, weight in one["weights"].items())
        print(f"{name}: {weights}{'; open' if one['open'] else ''}")
    best = min(kept, key=lambda one: one["cost"])
    print(f"\nunknowns of the best branch ({options_word(best)}):")
    print(f"{found_sentence(best)} Seed {table['seed']}.")
    console.table(
        ("unknown", "best", "from", "to (90 %)", "unit", "data say"),
        [
            (name, *(f"{one[key]:.4g}" for key in ("best", "low", "high")), one["unit"], one["determined"])
            for name, one in best["unknowns"].items()
        ],
    )
    print()
    rows = []
    for what, summary in table["summary"].items():
        for name, one in (summary or {"measures": {}})["measures"].items():
            rows.append(
                (name, what.replace("_", " "), _percent(one["mean_relative_error"]), _percent(one["held"]),
                 "-" if one["brier"] is None else f"{one['brier']:.2f}")
            )  # fmt: skip
    console.table(("measure", "rows", "mean error", "in 80 % interval", "Brier"), sorted(rows))


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100.0 * value:.0f} %"
