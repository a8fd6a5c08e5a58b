"""Where a described float may lie at all: the bounds of its field."""

from __future__ import annotations

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import Description, float_paths, get_value
from tarsus.model.scene import Scene


def field_limits(scene: Scene, path: str) -> tuple[float, float]:
    """Smallest and largest value [SI] that the description of a float allows; infinite where it sets none.

    Raises
    ------
    InputError
        If the scene has no float at the path.
    """
    if path not in float_paths(scene):
        get_value(scene, path)  # an unknown path has a sentence of its own
        raise InputError(f"{path}: expected the path of a number")
    keys = path.split(".")
    while keys:
        name = keys.pop()
        owner = get_value(scene, ".".join(keys)) if keys else scene
        if isinstance(owner, Description):
            extra = type(owner).model_fields[name].json_schema_extra
            bounds = extra if isinstance(extra, dict) else {}
            low = bounds.get("ge", bounds.get("gt", -np.inf))
            high = bounds.get("le", bounds.get("lt", np.inf))
            return float(low), float(high)  # type: ignore[arg-type]
    raise InputError(f"{path}: expected the path of a number")
