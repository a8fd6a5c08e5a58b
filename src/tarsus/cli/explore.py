"""`tarsus explore`: a page with the engine inside, whose sliders change a scene's numbers."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import Parameter

from tarsus.cli.options import UNCHANGED, Changes, Duration, Folder, Json, Many, Overwrite


def explore(
    scene: str,
    /,
    *,
    output: Folder,
    over: Annotated[Many, Parameter(name="--over")] = None,
    drive: Annotated[Many, Parameter(name="--drive")] = None,
    changes: Changes = UNCHANGED,
    duration: Duration = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> int:
    """Turn the numbers of a device or a scene file by sliders: one page that works offline, with the engine inside.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file.
    output
        the page, a file ending in .html.
    over
        PATH=a:b, the ends of a slider; may be repeated. Or a draws.npz of `tarsus identify`.
    drive
        PATH of a number of a signal, a gait or a drive that is to be a slider, three at most.
    """
    from dataclasses import replace

    import tarsus
    from tarsus.cli import console, options, requests
    from tarsus.solve import compiled_engine, engine_bytes

    options.check_new_file(output, (".html",), overwrite)
    the_scene = changes.scene(scene)
    seconds = requests.duration_for(the_scene, duration)
    if engine_bytes() is None:
        with console.spinner("compiling the engine for pages, once (a minute or two)"):
            compiled_engine()
    with console.spinner("making the explorer"):
        found = tarsus.explore(the_scene, duration=seconds, over=requests.grounds_of(over or ()), drive=drive)
        words = requests.texts_of(changes.set_ or (), "--set")
        found = replace(found, name="" if changes.law else scene, words=words)
        file = found.write(output)
    about: dict[str, Any] = {"file": str(file), "bytes": file.stat().st_size, "sliders": list(found.sliders)}
    return console.files([file], about if json else None)
