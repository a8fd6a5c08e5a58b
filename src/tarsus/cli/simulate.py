"""`tarsus simulate`: one run, its summary, and on request its data and report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

if TYPE_CHECKING:
    from tarsus.model.scene import Scene


def simulate(
    scene: str,
    /,
    *,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative=())] = None,
    duration: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    law: Annotated[list[Path] | None, Parameter(negative=())] = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    mat: Annotated[bool, Parameter(negative=())] = False,
    overwrite: Annotated[bool, Parameter(negative=())] = False,
    report: bool = True,
    json: Annotated[bool, Parameter(negative=())] = False,
) -> int:
    """Simulate a device or a scene file; with -o write the run and its report.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file.
    set_
        path=value, e.g. robot.feet.tip.gap="60 um", or volts=6, hz=50, wave=sine; may be repeated.
    duration
        how long, e.g. "200 ms"; the scene's own when left out.
    law
        a Python file with laws of your own; may be repeated.
    output
        folder for scene, series, events, measures, provenance, citations and report.html.
    overwrite
        replace what `simulate` wrote into the folder before; other files stay.
    mat
        also write series.mat.
    report
        write the report with -o.
    json
        print one JSON object instead of the summary.
    """
    import tarsus
    from tarsus.base.plausible import remarks
    from tarsus.cli import console, requests, summary
    from tarsus.files.output import OutputFolder

    the_scene = requests.scene_for(scene, requests.settings(set_ or ()), law or ())
    seconds = requests.duration_for(the_scene, duration)
    target = None
    if output is not None:
        from tarsus.files.store import RUN_FILES

        target = OutputFolder(output, "simulate", RUN_FILES, overwrite)
        target.check()
    with console.spinner("simulating"):
        run = tarsus.simulate(the_scene, duration=seconds)
    written: list[Path] = []
    if target is not None:
        with target.writing() as folder:
            written = _write(run, the_scene, seconds, folder, mat=mat, report=report)
    if json:
        console.print_json(summary.run_object(run, written))
    else:
        summary.print_run(run, written)
    console.complain([f"note: {remark}" for remark in remarks(the_scene)])
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
