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
    """Show a walk as a GIF or WebM: of a folder that `simulate` wrote, or of a device or scene that is simulated now.

    Parameters
    ----------
    walk
        a run's folder, a device (see `tarsus devices`) or a scene file.
    output
        the file, ending in .gif, or in .webm where ffmpeg is installed.
    periods
        drive periods shown, the last ones of the run.
    width
        of the picture, in pixels.
    """
    import tarsus
    from tarsus.base.errors import InputError
    from tarsus.cli import console, options, requests
    from tarsus.report.movie import ENDINGS

    options.check_new_file(output, ENDINGS, overwrite)
    shown: Any = walk
    seconds = None
    if not Path(walk).is_dir():
        shown = changes.scene(walk)
        seconds = requests.duration_for(shown, duration)
    elif changes.set_ or duration:
        raise InputError("--set and --duration are for a device or scene: a folder's run is over")
    with console.spinner("simulating and drawing"):
        file = tarsus.movie(
            shown, output, periods=periods, width=width, duration=seconds, law=changes.law or ()
        )
    return console.files([file], {"file": str(file), "bytes": file.stat().st_size} if json else None)
