"""`tarsus simulate`: one run, its summary, and on request what other starts lead to, its data and its report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tarsus.base.errors import InputError
from tarsus.cli import console
from tarsus.cli.asked import Asked
from tarsus.cli.options import FLAG, MaybeCount

if TYPE_CHECKING:
    from tarsus.model.scene import Scene


def simulate(
    asked: Asked,
    *,
    starts: MaybeCount = None,
    mat: Annotated[bool, FLAG] = False,
    static: Annotated[bool, FLAG] = False,
) -> int:
    """With -o the run and its report are written.

    Parameters
    ----------
    starts
        Also say what the robot may do: the motions that so many other starts settle to, with their shares, and which
        of them the run's own start leads to.
    mat
        Also write series.mat.
    static
        Leave the explorer out of the report, the sliders with the engine in the page.
    """
    import tarsus
    from tarsus.base.plausible import remarks
    from tarsus.inspection.runs import run_data

    scene, folder = asked.arguments["scene"], asked.folder()
    asked.check(folder)
    if mat and folder is None:
        raise InputError("--mat writes into the run's folder: name one with -o")
    with console.spinner("simulating"), asked.calling() as function:
        run = function()
    others: Any = None
    if starts is not None:
        with console.progress_bar("starts") as progress:
            others = tarsus.attractors(scene, starts=starts, edges=False, progress=progress)
    written: list[Path] = []
    with asked.writing(folder):
        if folder is not None:
            written = _write(run, others, folder, mat=mat, report=asked.flag("report"), static=static)
    if asked.flag("json"):
        console.print_json(run_data(run, written, others))
    else:
        console.table(run.table(), *([] if others is None else [others.compared_with(run, asked.scene_words)]))
        console.wrote(written)
    console.note(remarks(scene))
    if not run.ok:
        console.complain([str(run.code.value)])
    return 0 if run.ok else 1


def _write(run: Any, others: Any, folder: Path, *, mat: bool, report: bool, static: bool) -> list[Path]:
    """The run's folder; the report compares energies with a run without adhesion, and lists what other starts lead
    to."""
    import tarsus
    from tarsus.files.store import REPORT_FILE, write_run

    scene: Scene = run.scene
    written = list(write_run(run.arrays(), folder, mat=mat))
    if report:
        from tarsus.report import write_report

        with console.spinner("writing the report"):
            companion: Any = None
            if scene.ground.without_adhesion != scene.ground and not scene.grounds:
                companion = tarsus.simulate(
                    tarsus.with_values(scene, {"ground": scene.ground.without_adhesion}), duration=run.duration
                )
            write_report(run, folder / REPORT_FILE, companion, others, static=static)
        written.append(folder / REPORT_FILE)
    return written
