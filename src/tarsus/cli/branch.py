"""`tarsus branch`: the periodic motion of a driven robot along a parameter, with all that happens to it on the way."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def branch(
    scene: str,
    /,
    *,
    along: str,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative=())] = None,
    multiple: int | None = None,
    law: Annotated[list[Path] | None, Parameter(negative=())] = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    overwrite: Annotated[bool, Parameter(negative=())] = False,
    json: Annotated[bool, Parameter(negative=())] = False,
) -> int:
    """Follow a periodic motion along a number of the scene, through folds, with flips, tori, grazing and sticking.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file; its motion at the first value is where the branch begins.
    along
        path=a:b, e.g. signals.pzt.amplitude="4 V:8 V": the number that varies, and its range.
    set_
        path=value, as for `tarsus simulate`; may be repeated.
    multiple
        period of the motion in drive periods; the smallest that repeats when left out.
    law
        a Python file with laws of your own; may be repeated.
    output
        folder for branch.nc, branch.json and report.html.
    overwrite
        replace what `branch` wrote into the folder before; other files stay.
    json
        print one JSON object instead of the summary.
    """
    from tarsus.cli import console, requests
    from tarsus.files.output import OutputFolder
    from tarsus.orbits import branch as follow
    from tarsus.orbits.files import BRANCH_FILES, write_branch

    path, (start, end) = requests.range_of(along, "--along")
    the_scene = requests.scene_for(scene, requests.settings(set_ or ()), law or ())
    unit = requests.unit_at(the_scene, path)
    low, high = requests.ends(start, end, unit, "--along")
    target = None if output is None else OutputFolder(output, "branch", BRANCH_FILES, overwrite)
    if target is not None:
        target.check()
    with console.spinner("following the motion"):
        found = follow(the_scene, path, low, high, multiple=multiple)
    written: list[Path] = []
    if target is not None:
        with target.writing() as folder:
            written = list(write_branch(found, folder))
            from tarsus.report.branch_page import write_branch_report

            written.append(write_branch_report(found, folder / "report.html"))
    if json:
        console.print_json(found.to_dict() | {"files": [str(one) for one in written]})
        return 0
    print(f"{the_scene.name}: {len(found.points)} points along {path}; {found.ended}")
    for point in found.special:
        print(f"  {point.kind:<15} at {point.at:.10g} {unit}  {point.note}")
    print(f"  from: {found.points[0].orbit.kind}")
    print(f"  to:   {found.points[-1].orbit.kind}")
    for one in written:
        print(f"wrote {one}")
    return 0
