"""`tarsus simulate`: one run, its summary, and on request its data and report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tarsus.cli.options import FLAG, PAGES, UNCHANGED, Changes, Duration, MaybeFolder, Pages

if TYPE_CHECKING:
    from tarsus.model.scene import Scene


def simulate(
    scene: str,
    /,
    *,
    changes: Changes = UNCHANGED,
    duration: Duration = None,
    output: MaybeFolder = None,
    mat: Annotated[bool, FLAG] = False,
    pages: Pages = PAGES,
) -> int:
    """Simulate a device or a scene file; with -o write the run and its report.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file.
    output
        folder for scene, series, events, measures, provenance, citations and report.html.
    mat
        also write series.mat.
    """
    import tarsus
    from tarsus.base.plausible import remarks
    from tarsus.cli import console, requests
    from tarsus.inspection.runs import run_data

    the_scene = changes.scene(scene)
    seconds = requests.duration_for(the_scene, duration)
    target = None
    if output is not None:
        from tarsus.files.store import RUN_FILES

        target = pages.target(output, "simulate", RUN_FILES)
    with console.spinner("simulating"):
        run = tarsus.simulate(the_scene, duration=seconds)
    written: list[Path] = []
    if target is not None:
        with target.writing() as folder:
            written = _write(run, the_scene, seconds, folder, mat=mat, report=pages.report)
    if pages.json:
        console.print_json(run_data(run, written))
    else:
        print(run.table().text())
        console.wrote(written)
    console.note(remarks(the_scene))
    if not run.ok:
        console.complain([str(run.code.value)])
    return 0 if run.ok else 1


def _write(run: Any, scene: Scene, duration: float, folder: Path, *, mat: bool, report: bool) -> list[Path]:
    """The run's folder; the report compares energies with a run without adhesion."""
    import tarsus
    from tarsus.cli import console
    from tarsus.files.store import REPORT_FILE, write_run

    written = list(write_run(run, folder, mat=mat))
    if report:
        from tarsus.report import write_report

        with console.spinner("writing the report"):
            companion: Any = None
            if scene.ground.without_adhesion != scene.ground:
                companion = tarsus.simulate(
                    tarsus.with_values(scene, {"ground": scene.ground.without_adhesion}), duration=duration
                )
            write_report(run, folder / REPORT_FILE, companion)
        written.append(folder / REPORT_FILE)
    return written
