"""`tarsus export`: a scene for another tool, with what is lost."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from tarsus.cli.options import UNCHANGED, Changes, Duration, Folder, Json, Overwrite


def export(
    scene: str,
    /,
    *,
    to: str,
    output: Folder,
    step: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    changes: Changes = UNCHANGED,
    duration: Duration = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> int:
    """Write a robot for another tool: MuJoCo, MATLAB, C of a microcontroller, or any that loads a unit of FMI.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file.
    to
        mjcf, a model of MuJoCo, run after writing where that is installed, with its loss in numbers; matlab, state
        spaces, events, series, and a script that makes the run again; c, tables of the gait or of the drives; fmu, a
        unit of FMI 3.0 for co-simulation.
    output
        folder for the files.
    step
        time step of the tool, e.g. "10 ns", the timer's tick of tables in C, or the communication step that a unit
        proposes.
    """
    import tarsus
    from tarsus.base.units import parse_quantity
    from tarsus.cli import console, requests
    from tarsus.cli.options import Pages
    from tarsus.export.verb import target_of

    files = target_of(to).files
    made = changes.scene(scene)
    seconds = requests.duration_for(made, duration)
    target = Pages(overwrite=overwrite).target(output, "export", files)
    tick = None if step is None else parse_quantity(step, "s")
    with console.spinner("writing and measuring"), target.writing() as folder:
        found = tarsus.export(made, to, folder, duration=seconds, step=tick)
    return console.show(found, json, [folder / name for name in files if (folder / name).is_file()])
