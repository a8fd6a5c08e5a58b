"""A design to begin with: two numbers of a device's drive, what they can be best for, and every other setting."""

from __future__ import annotations

import os
from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.base.units import format_quantity
from tarsus.design.problem import DesignSettings, problem_of
from tarsus.design.request import settings_text
from tarsus.files.library import load_scene
from tarsus.inspection.begin_study import EXAMPLE, OFTEN_VARIED
from tarsus.model.scene import Scene

OBJECTIVES = ("most mean_speed", "most mean_apex")
"""What is wanted: of a walker its speed, of feet that bounce how high they do."""


def design_text(device: str | None, folder: Path) -> str:
    """A design file for a folder, about a device by name or a scene file; `EXAMPLE` without one.

    Raises InputError where the device cannot be read, or its drives have no number with a usual range.
    """
    named = device or EXAMPLE
    scene, path = load_scene(named), Path(named)
    paths, objective = _asked(scene)
    given = {
        "# scene =": f'scene = "{Path(os.path.relpath(path, folder)).as_posix() if path.is_file() else named}"',
        "# of =": f'of = "{objective}"',
        '# "PATH" = [low, high]': "\n".join(f'"{one}" = "usual"' for one in paths),
    }
    text = settings_text("design")
    for begin, line in given.items():
        text = text.replace(begin, line, 1)
    text = text.replace('"PATH" = [low, high]', _ground(scene))
    return f"# A design to begin with: `tarsus design FILE -o FOLDER` searches it.\n{text}"


def _ground(scene: Scene) -> str:
    """A range about the first number of the ground that is often not known."""
    known = float_paths(scene)
    path = next(one for one in (*OFTEN_VARIED, *known) if one in known and known[one].value > 0.0)
    low, high = (format_quantity(float(f"{x * known[path].value:.4g}"), known[path].unit) for x in (0.8, 1.0))
    return f'"{path}" = ["{low}", "{high}"]'


def _asked(scene: Scene) -> tuple[list[str], str]:
    """Up to two numbers of the drives, and what they can be best for."""
    words = [path for paths in scene.short_words().values() for path in paths]
    drives = [path for path in float_paths(scene) if path.startswith(("signals.", "gait."))]
    for free in (words, *([one] for one in drives)):
        for objective in OBJECTIVES if free else ():
            try:
                problem_of(scene, DesignSettings(free=free, objective=objective), None)
            except InputError:
                continue
            return free, objective
    raise InputError(f"'{scene.name}' has no drive with a number that a design can choose")
