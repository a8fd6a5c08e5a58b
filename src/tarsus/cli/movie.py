"""`tarsus movie`: a walk as a moving picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tarsus.cli.options import UNCHANGED, Changes, Count, Duration, Folder, Json, Overwrite


def movie(
    walk: str,
    /,
    *,
    output: Folder,
    periods: Count = 2,
    width: int = 720,
    changes: Changes = UNCHANGED,
    duration: Duration = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> int:
    """Show a walk as a GIF: of a folder that `simulate` wrote, or of a device or scene that is simulated now.

    Parameters
    ----------
    walk
        a run's folder, a device (see `tarsus devices`) or a scene file.
    output
        the file, ending in .gif.
    periods
        drive periods shown, the last ones of the run.
    width
        of the picture, in pixels.
    """
    import tarsus
    from tarsus.base.errors import InputError
    from tarsus.cli import console, options, requests
    from tarsus.files.store import read_run
    from tarsus.report.movie import write_movie

    options.check_new_file(output, (".gif",), overwrite)
    run: Any
    if Path(walk).is_dir():
        if changes.set_ or duration:
            raise InputError("--set and --duration are for a device or scene: a folder's run is over")
        run = read_run(walk, changes.laws())
    else:
        scene = changes.scene(walk)
        seconds = requests.duration_for(scene, duration)
        with console.spinner("simulating"):
            run = tarsus.simulate(scene, seconds)
    with console.spinner("drawing"):
        path = write_movie(run, output, width=width, periods=periods)
    if json:
        console.print_json({"file": str(path), "bytes": path.stat().st_size})
    else:
        console.wrote([path])
    return 0
