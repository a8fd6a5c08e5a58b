"""Designs that have names of their own: a scene of a kind, an objective, and what has to be kept."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tarsus.base.progress import Progress
from tarsus.base.units import parse_quantity
from tarsus.base.workers import Workers
from tarsus.design.free import Symmetry
from tarsus.design.front import Design
from tarsus.design.judge import Risk
from tarsus.design.measures import DesignObjective
from tarsus.design.problem import DesignSettings
from tarsus.design.request import Given, setting, settings_of
from tarsus.design.verb import found_for
from tarsus.design.walker_problem import DEAD, TIED, gait_problem
from tarsus.files.library import SceneLike, as_scene
from tarsus.measure.limits import model_range


class GaitSettings(DesignSettings):
    """What a gait is designed for besides the scene: a design, and words of walkers."""

    objective: Any = setting("speed,energy", DesignSettings.model_fields["objective"].description or "")
    symmetry: Symmetry | None = setting(None, TIED)
    dead: tuple[str, ...] = setting((), DEAD)


def gait(
    scene: SceneLike,
    free: Mapping[str, Any] | Iterable[str] | None = None,
    objective: str | Sequence[str | DesignObjective] | None = None,
    over: Any = None,
    risk: str | Risk | None = None,
    *,
    request: Given = None,
    output: str | Path | None = None,
    resume: bool = False,
    threads: Workers = None,
    progress: Progress | None = None,
    **settings: Any,
) -> Design:
    """Design gaits: the front of what no other gait beats in all objectives at once.

    A `tarsus.design` of a walker, with its words in the order of their use here.

    Parameters
    ----------
    scene
        A scene, or a device's name or a scene file's path. It is a walker with a gait.
    free, objective, over, risk, request, resume, threads, progress
        As for `tarsus.design`; speed and energy unless an objective is given.
    output
        Folder for what is found and its page, and of finished runs, from which a design that was killed goes on with
        `resume`; in Python of runs alone, ``write`` adds the rest.
    settings
        Those of `tarsus.design`, and symmetry, that ties free phases, and dead, legs that do not move.

    Returns
    -------
    Design
        One list of gaits, all judged alike: the front under the risk, of which the first is the robust gait, and the
        nominal optimum.

    Raises
    ------
    InputError
        With every problem of the request.
    """
    options = settings_of(GaitSettings, request, free=free, objective=objective, over=over, risk=risk, **settings)
    asked = gait_problem(as_scene(scene), options, options.risk)
    return found_for(asked, options, output, progress, threads=threads, resume=resume)


def steady(scene: SceneLike, free: Any, speed: float | str, **settings: Any) -> Design:
    """The gait whose body oscillates least of those that go at a speed [m/s] at least, as for a camera.

    Oscillation is the highest minus the lowest heave in a drive period; ``settings`` are those of `tarsus.design.gait`.
    Raises InputError as it does.
    """
    kept = {"mean_speed": (">", parse_quantity(speed, "m/s")), **(settings.pop("limits", None) or {})}
    return gait(scene, free, "least vertical_amplitude", limits=kept, **settings)


def hold(scene: SceneLike, free: Any, seconds: float | str, **settings: Any) -> Design:
    """Gaits that stay longest on a wall or a ceiling, and slide least while they do, in episodes of so many seconds.

    A robot stays as long as one foot at least is on the ground; how it slides is seen after the first third of the
    drive periods. How it tumbles afterwards is not held against it: the limit of the model is lifted unless ``limits``
    say otherwise, and gaits that leave it are named. ``settings`` are those of `tarsus.design.gait`. Raises InputError
    as it does.
    """
    own = model_range(as_scene(scene))
    kept = ({} if own is None else {own.measure: "< inf"}) | dict(settings.pop("limits", None) or {})
    wanted = "most longest_hold, least foot_slip"
    return gait(scene, free, wanted, limits=kept, from_rest=parse_quantity(seconds, "s"), **settings)
