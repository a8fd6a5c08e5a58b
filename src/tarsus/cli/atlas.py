"""`tarsus atlas`: a map of what a driven robot does over two of its numbers."""

from __future__ import annotations

from tarsus.cli.options import HERE, UNCHANGED, Changes, Count, Folder, Json, Overwrite, Resume, Work


def atlas(
    scene: str,
    /,
    *,
    x: str | None = None,
    y: str | None = None,
    depth: Count = 8,
    starts: Count = 1,
    output: Folder,
    changes: Changes = UNCHANGED,
    work: Work = HERE,
    resume: Resume = False,
    overwrite: Overwrite = False,
    json: Json = False,
) -> int:
    """Map what a driven robot does over two of its numbers: how often its motion repeats, and what its feet do.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file; without --x and --y a study of two numbers, packaged or a file,
        such as millipede-map.
    x
        PATH=a:b or PATH=a:b:log, e.g. robot.feet.tip.gap="50 um:90 um": the number along the map.
    y
        the same: the number up the map.
    depth
        the map has 2^DEPTH + 1 points each way, of which those near a change of class are run.
    starts
        starts of a cell, spread as `tarsus attractors` does; 1 is the scene's own.
    output
        folder for atlas.json, atlas.nc, cells.csv, report.html, and the finished runs.
    """
    from tarsus.atlas.verb import FILES, AtlasPlan
    from tarsus.cli import console, requests
    from tarsus.cli.options import Pages
    from tarsus.report.atlas_page import write_atlas

    made, axes, draw = requests.map_of(scene, x, y, changes)
    plan = AtlasPlan.of(made, *axes, depth=depth, starts=starts)
    target = Pages(overwrite=overwrite).target(output, "atlas", FILES, resume=resume)
    with (
        work.workers() as workers,
        console.resumable(),
        target.writing(resume=resume) as folder,
        console.progress_bar("runs") as progress,
    ):
        found = plan.run(folder, resume=resume, threads=workers, progress=progress).overlaid(*draw)
        written = write_atlas(found, folder)
    return console.show(found, json, written)
