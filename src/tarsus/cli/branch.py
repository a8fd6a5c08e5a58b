"""`tarsus branch`: periodic motions of a driven robot along a number, with all that happens to them on the way."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tarsus.cli.options import PAGES, UNCHANGED, Changes, MaybeFolder, Pages, Threads, at_least


def branch(
    scene: str,
    /,
    *,
    along: str,
    starts: Annotated[int, at_least(0)] = 60,
    changes: Changes = UNCHANGED,
    multiple: Annotated[int | None, at_least(1)] = None,
    threads: Threads = None,
    output: MaybeFolder = None,
    pages: Pages = PAGES,
) -> int:
    """Follow every periodic motion along a number of the scene, through folds, with flips, tori, grazing and sticking.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file; its own motion at the first value is followed first.
    along
        path=a:b, e.g. signals.pzt.amplitude="4 V:8 V": the number that varies, and its range.
    starts
        how many starts at each end of the range are run to find the other motions that are followed; 0: the scene's
        own motion alone.
    multiple
        period of the scene's own motion in drive periods; the smallest that repeats when left out.
    output
        folder for branch.nc, branch.json and report.html.
    """
    import tarsus
    from tarsus.cli import console, requests
    from tarsus.orbits.files import BRANCH_FILES, write_branch

    span = requests.spans_of([along], "--along")
    the_scene = changes.scene(scene)
    target = None if output is None else pages.target(output, "branch", BRANCH_FILES)
    with console.spinner("following motions"):
        found = tarsus.branch(the_scene, span, starts=starts, multiple=multiple, threads=threads)
    written: list[Path] = []
    if target is not None:
        with target.writing() as folder:
            written = list(write_branch(found, folder))
            if pages.report:
                from tarsus.report.branch_page import branch_html
                from tarsus.report.pages import write_page

                written.append(write_page(branch_html(found), folder / "report.html"))
    if pages.json:
        console.print_json(found.to_dict() | {"files": [str(one) for one in written]})
        return 0
    console.table(found.table())
    console.wrote(written)
    return 0
