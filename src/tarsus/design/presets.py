"""Designs of gaits that have names of their own: an objective, and what has to be kept."""

from __future__ import annotations

from typing import Any

from tarsus.base.units import parse_quantity
from tarsus.design.gait_front import GaitFront
from tarsus.design.gait_search import gait
from tarsus.design.limits import model_limit
from tarsus.files.library import SceneLike, as_scene


def steady(scene: SceneLike, free: Any, speed: float | str, **settings: Any) -> GaitFront:
    """The gait whose body oscillates least of those that go at a speed [m/s] at least, as for a camera.

    Oscillation is the highest minus the lowest heave in a drive period; ``settings`` are those of `tarsus.design.gait`.
    Raises InputError as it does.
    """
    limits = settings.pop("limits", None) or {}
    return gait(
        scene, free, "sway", limits={"mean_speed": (">", parse_quantity(speed, "m/s")), **limits}, **settings
    )


def hold(scene: SceneLike, free: Any, seconds: float | str, **settings: Any) -> GaitFront:
    """Gaits that stay longest on a wall or a ceiling, and slide least while they do, in episodes of so many seconds.

    A robot stays as long as one foot at least is on the ground. How it tumbles afterwards is not held against it: the
    limit of the model is lifted unless ``limits`` say otherwise, and gaits that leave it are named. ``settings`` are
    those of `tarsus.design.gait`. Raises InputError as it does.
    """
    scene = as_scene(scene)
    own = model_limit(scene)
    lifted = {} if own is None else {own.measure: "< inf"}
    limits = lifted | dict(settings.pop("limits", None) or {})
    return gait(scene, free, "hold,slip", limits=limits, from_rest=parse_quantity(seconds, "s"), **settings)
