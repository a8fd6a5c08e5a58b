"""`tarsus check`: is this file a scene?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def check(file: Path, /, *, law: Annotated[list[Path] | None, Parameter(negative=())] = None) -> int:
    """Check a scene file and name all its errors at once.

    Parameters
    ----------
    file
        a scene file (TOML).
    law
        a Python file with laws that the scene uses; may be repeated.
    """
    from tarsus.base.spec import float_paths
    from tarsus.cli.requests import laws_of
    from tarsus.files.toml import read_scene

    scene = read_scene(file, laws_of(law or ()))
    counts = (
        (len(scene.robot.drives), "drive", "drives"),
        (len(scene.robot.feet), "foot", "feet"),
        (len(float_paths(scene)), "value", "values"),
    )
    contents = ", ".join(f"{count} {one if count == 1 else many}" for count, one, many in counts)
    print(f"{file} is a good scene: {scene.name} ({contents}).")
    return 0
