"""A study to begin with: what the ground or the drive does to a device, over numbers that the device has."""

from __future__ import annotations

import os
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.base.units import format_quantity
from tarsus.files.library import load_scene

if TYPE_CHECKING:
    from tarsus.base.spec import FloatInfo
    from tarsus.model.scene import Scene

OFTEN_VARIED = {
    "ground.restitution.coefficient": "restitution",
    "ground.film.coefficient": "film",
    "ground.friction.coefficient": "friction",
    "ground.adhesion.initial": "adhesion",
    "volts": "volts",
    "hz": "frequency",
}
"""Numbers that studies vary first, in this order, and their word in the study's name."""

MEASURES = ("bounces", "contact_duration", "impact_speed")
"""What a run of feet on a ground is scored by."""

SHARES = (0.5, 0.75, 1.0)
"""Shares of the device's own number that a list holds: at most 1, as a coefficient of restitution is."""

WIDTH = 3.0
"""A range on a logarithmic scale goes from the device's own number over this to the number times this."""

EXAMPLE = "cantilever"
"""The device of a study for which none is named."""


def study_text(device: str | None, folder: Path) -> str:
    """A study file for a folder, about a device by name or a scene file; `EXAMPLE` without one.

    Raises InputError where the device cannot be read, or holds no number that a sweep can vary.
    """
    named = device or EXAMPLE
    scene = load_scene(named)
    axes = _axes(scene)
    path = Path(named)
    template = (files("tarsus.inspection") / "templates" / "study.toml").read_text(encoding="utf-8")
    return Template(template).substitute(
        name=" and ".join(OFTEN_VARIED.get(one, one) for one in axes),
        scene=Path(os.path.relpath(path, folder)).as_posix() if path.is_file() else named,
        duration=format_quantity(scene.duration, "s"),
        measures=", ".join(f'"{one}"' for one in _measures(scene)),
        vary="\n".join(f'"{one}" = {axis}' for one, axis in axes.items()),
    )


def _axes(scene: Scene) -> dict[str, str]:
    """Up to two axes by name, as the file writes them: a list, and a range on a logarithmic scale."""
    known, words = float_paths(scene), scene.short_words()
    found: dict[str, str] = {}
    for name in (*OFTEN_VARIED, *known):
        number = known.get(words.get(name, (name,))[0])
        if number is not None and number.value > 0.0 and len(found) < 2:
            found |= _axis(scene, name, number, logarithmic=bool(found))
    if not found:
        raise InputError(f"'{scene.name}' holds no number above 0 that a sweep can vary")
    return found


def _axis(scene: Scene, name: str, number: FloatInfo, *, logarithmic: bool) -> dict[str, str]:
    """The axis of a number around its own value; none where a sweep refuses it."""
    from tarsus.study.sweep import Sweep

    def said(factor: float) -> str:
        text = format_quantity(float(f"{factor * number.value:.4g}"), number.unit)
        return text if number.unit == "1" else f'"{text}"'

    if logarithmic:
        ends = {"start": said(1.0 / WIDTH), "stop": said(WIDTH)}
        text = f'{{ kind = "logspace", start = {ends["start"]}, stop = {ends["stop"]}, count = 5 }}'
        axis: Any = {"kind": "logspace", "count": 5} | {end: one.strip('"') for end, one in ends.items()}
    else:
        values = [said(share) for share in SHARES]
        text, axis = f"[{', '.join(values)}]", [one.strip('"') for one in values]
    try:
        Sweep(name="one axis", scene=scene, vary={name: axis}, measures=_measures(scene))
    except InputError:
        return {}
    return {name: text}


def _measures(scene: Scene) -> tuple[str, ...]:
    from tarsus.solve import Run

    offered = Run.offered(scene, scene.duration)
    return tuple(one for one in MEASURES if one in offered) or tuple(offered)[:3]
