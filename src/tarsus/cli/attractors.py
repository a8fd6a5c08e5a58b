"""`tarsus attractors`: what a driven robot does in the long run, depending on how it is placed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tarsus.cli.options import PAGES, UNCHANGED, Changes, Count, Many, MaybeFolder, Pages, Seed, Threads


def attractors(
    scene: str,
    /,
    *,
    starts: Count = 60,
    over: Many = None,
    edges: Annotated[bool, Parameter(help="look for what lies between basins.")] = True,
    changes: Changes = UNCHANGED,
    seed: Seed = 0,
    threads: Threads = None,
    output: MaybeFolder = None,
    pages: Pages = PAGES,
) -> int:
    """Find every motion that a driven robot settles to, with the share of starts that lead there.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file.
    starts
        how many starts are spread over the box.
    over
        an axis of the box, PATH=a:b; may be repeated: height=0:5um and speed=-1mm/s:1mm/s of a robot that is put down
        or thrown as a whole, phase=0:360deg of all drives when it is, initial.*, a drive's history. When left out,
        heights up to those of its feet in a run, and speeds that carry it there.
    output
        folder for attractors.json, report.html, and of each attractor a device file and a page with its motion.
    """
    import tarsus
    from tarsus.cli import console, requests
    from tarsus.orbits.files import attractor_files, write_attractors

    box = requests.spans_of(over, "--over") if over else None
    the_scene = changes.scene(scene)
    target = None if output is None else pages.target(output, "attractors", attractor_files(starts))
    with console.progress_bar("attractors") as progress:
        found = tarsus.attractors(
            the_scene, starts=starts, over=box, edges=edges, seed=seed, threads=threads, progress=progress
        )
    written: list[Path] = []
    if target is not None:
        with target.writing() as folder:
            written = write_attractors(found, folder)
            if pages.report:
                from tarsus.report.attractors_page import write_pages

                written += write_pages(found, folder)
    if pages.json:
        console.print_json(found.to_dict() | {"files": [str(one) for one in written]})
        return 0
    console.table(found.table())
    console.wrote(written)
    return 0
