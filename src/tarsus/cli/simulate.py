"""`tarsus simulate`: one run, its summary, and on request its data and report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tarsus.cli.options import FLAG, PAGES, UNCHANGED, Changes, Duration, MaybeCount, MaybeFolder, Pages

if TYPE_CHECKING:
    from tarsus.model.scene import Scene


def simulate(
    scene: str,
    /,
    *,
    changes: Changes = UNCHANGED,
    duration: Duration = None,
    starts: MaybeCount = None,
    output: MaybeFolder = None,
    mat: Annotated[bool, FLAG] = False,
    static: Annotated[bool, FLAG] = False,
    pages: Pages = PAGES,
) -> int:
    """Simulate a device or a scene file; with -o write the run and its report.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file.
    starts
        also say what the robot may do: the motions that so many other starts settle to, with their shares, and which
        of them the run's own start leads to.
    output
        folder for scene, series, events, measures, provenance, citations and report.html.
    mat
        also write series.mat.
    static
        leave the explorer out of the report, the sliders with the engine in the page.
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
    others: Any = None
    if starts is not None:
        with console.progress_bar("starts") as progress:
            others = tarsus.attractors(the_scene, starts=starts, edges=False, progress=progress)
    written: list[Path] = []
    if target is not None:
        with target.writing() as folder:
            written = _write(run, others, seconds, folder, mat=mat, report=pages.report, static=static)
    if pages.json:
        console.print_json(run_data(run, written, others))
    else:
        console.table(run.table(), *([] if others is None else [others.beside(run)]))
        console.wrote(written)
    console.note(remarks(the_scene))
    if not run.ok:
        console.complain([str(run.code.value)])
    return 0 if run.ok else 1


def _write(
    run: Any, others: Any, duration: float, folder: Path, *, mat: bool, report: bool, static: bool
) -> list[Path]:
    """The run's folder; the report compares energies with a run without adhesion, and lists what other starts lead
    to."""
    import tarsus
    from tarsus.cli import console
    from tarsus.files.store import REPORT_FILE, write_run

    scene: Scene = run.scene
    written = list(write_run(run.arrays(), folder, mat=mat))
    if report:
        from tarsus.report import write_report

        with console.spinner("writing the report"):
            companion: Any = None
            if scene.ground.without_adhesion != scene.ground and not scene.grounds:
                companion = tarsus.simulate(
                    tarsus.with_values(scene, {"ground": scene.ground.without_adhesion}), duration=duration
                )
            write_report(run, folder / REPORT_FILE, companion, others, static=static)
        written.append(folder / REPORT_FILE)
    return written
