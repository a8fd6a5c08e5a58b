"""`tarsus movie`: a walk as a moving picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter


def movie(
    walk: str,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    periods: int = 2,
    width: int = 720,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative=())] = None,
    duration: str | None = None,
    law: Annotated[list[Path] | None, Parameter(negative=())] = None,
    json: Annotated[bool, Parameter(negative=())] = False,
) -> int:
    """Show a walk as a GIF: of a folder that `simulate` wrote, or of a device or scene that is simulated now.

    Parameters
    ----------
    walk
        a run's folder, a device (see `tarsus devices`) or a scene file.
    output
        the file, ending in .gif; one that is there is replaced.
    periods
        drive periods shown, the last ones of the run.
    width
        of the picture, in pixels.
    set_
        path=value, as for `tarsus simulate`; may be repeated. Not with a folder.
    duration
        how long to simulate; not with a folder.
    law
        a Python file with laws of your own; may be repeated.
    json
        print one JSON object: file, bytes.
    """
    import tarsus
    from tarsus.base.errors import InputError
    from tarsus.cli import console, requests
    from tarsus.files.store import read_run
    from tarsus.report.movie import write_movie

    run: Any
    if Path(walk).is_dir():
        if set_ or duration:
            raise InputError("--set and --duration are for a device or scene: a folder's run is over")
        run = read_run(walk, requests.laws_of(law or ()))
    else:
        scene = requests.scene_for(walk, requests.settings(set_ or ()), law or ())
        run = tarsus.simulate(scene, requests.duration_for(scene, duration))
    with console.spinner("drawing"):
        path = write_movie(run, output, width=width, periods=periods)
    if json:
        console.print_json({"file": str(path), "bytes": path.stat().st_size})
    else:
        print(f"wrote {path}")
    return 0
