"""`tarsus check`: is this file a scene?"""

from __future__ import annotations

from pathlib import Path


def check(file: Path, /) -> int:
    """Check a scene file and name all its errors at once.

    Parameters
    ----------
    file
        a scene file (TOML).
    """
    from tarsus.files.toml import read_scene
    from tarsus.spec import float_paths

    scene = read_scene(file)
    feet = len(scene.robot.feet)
    print(
        f"{file} is a good scene: {scene.name}, {feet} {'foot' if feet == 1 else 'feet'}, "
        f"{len(scene.robot.drives)} drive(s), {len(float_paths(scene))} values."
    )
    return 0
