"""`tarsus calibrate`: a device fitted to a table of measures, with every hypothesis that fits and what it predicts."""

from __future__ import annotations

from pathlib import Path

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
    """Fit a device to a table of measures: unknowns and choices, an ensemble, each row excluded once.

    Parameters
    ----------
    study
        a packaged study or a study file (TOML).
    output
        folder for the visited sets, calibration.json, mixture.json, a device file of every hypothesis and report.html;
        by default the study's name with .calibration.
    """
    from tarsus.calibrate.calibrating import calibrate as run
    from tarsus.calibrate.studyfile import load_study
    from tarsus.calibrate.writing import CALIBRATION_FILES
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
        numbers = result.to_dict()
        if pages.report:
            from tarsus.report.calibrate_page import calibration_html
            from tarsus.report.pages import write_page

            write_page(calibration_html(numbers), folder / "report.html")
    console.show(result, pages.json, [folder])
    lost = any(one["failed"] >= 1.0 for row in numbers["rows"] for one in row.get("training", {}).values())
    if lost:
        console.complain(["no run of some fitted rows reached its end; the calibration means nothing there"])
    return 1 if lost else 0
