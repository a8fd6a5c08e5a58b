"""Soft landings: the preset of pulses with which a foot touches down softly (5.2.1 and Fig. 5.1 of the source)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.progress import Progress
from tarsus.base.spec import Amount, float_paths, get_value, quantity
from tarsus.base.workers import Workers
from tarsus.design.free import free_of
from tarsus.design.grounds import Grounds
from tarsus.design.judge import NOMINAL
from tarsus.design.landing_design import LandingDesign
from tarsus.design.learning import Sensor, learn
from tarsus.design.problem import LOOK, DesignProblem, DesignSettings, problem_of
from tarsus.design.pulse_train import SHORTEST, Pulses
from tarsus.design.request import OVER, SEED, Given, Seed, Settings, setting, settings_of
from tarsus.design.runs import Runs
from tarsus.design.target import KEPT
from tarsus.design.trials import Trials
from tarsus.design.verb import found_for
from tarsus.files.library import SceneLike, as_scene
from tarsus.model.scene import Scene
from tarsus.plan.lowering import still_only

MOST_PAIRS = 6
"""More pairs than this have more unknowns than a search of a minute can tell apart."""
CANDIDATES = 32000
"""That are tried at effort 1. From 0.4 on valleys are followed down to their floors; less is for a first look."""
LEAST = 1000
"""That are tried however little the effort: fewer end before a valley's floor, and take a second."""
LEAST_LOOK = 4
"""Grounds that an attack on the box looks at, however little the effort."""
KNOWN = 0.01
"""Share to either side of a frequency that states no interval: structures of one drawing differ by that, and so does
one from day to day; a landing that is soft for 0.2 % to either side is soft on no bench."""


class LandingSettings(Settings):
    """What a landing is designed for besides the scene, see `tarsus.design.landing`."""

    SECTIONS: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "objective": ("objective", "risk", "contact", "lift"),
        "search": ("effort", "seed"),
        "timer": ("tick", "shortest"),
        "learning": ("learn", "sensor"),
    }

    foot: str = setting(..., "name of the foot")
    drive: str | None = setting(None, "whose volts are designed; the only one unless given")
    pairs: Annotated[int, Field(ge=1, le=MOST_PAIRS)] = setting(2, "pairs of switchings at the step's two edges")
    levels: Any = setting(
        "free=-8V:8V",
        "any voltages between two, or listed ones as -8 V, 8 V, whatever the scene's own signal has; the lowest and "
        "the highest are held",
    )
    free: tuple[str, ...] = setting((), "paths of the switching times that alone may move, of an on-off signal")
    objective: str = setting("speed", "speed of the hardest touchdown, or one measure of feet, as least impacts")
    over: Any = setting(None, f"{OVER}; the structure's frequencies within 1 % unless given")
    risk: Any = setting(None, "worst, mean, {cvar = q}, or nominal for the scene as it is")
    contact: Amount = quantity("1", "least share of the plain step's contact", default=KEPT, ge=0, le=1)
    lift: Amount = quantity("1", "least share of its mean height", default=KEPT, ge=0, le=1)
    effort: Amount = quantity(
        "1", "factor on the length of the search; below 0.4 it is a first look", default=1.0, gt=0
    )
    seed: Seed = setting(0, SEED)
    tick: Amount = quantity("s", "of the timer that edges are rounded to", default=1e-6, gt=0)
    shortest: Amount = quantity("s", "time that a level lasts at least", default=SHORTEST, gt=0)
    learn: Annotated[int, Field(ge=0)] = setting(0, "steps in which the landing is learned on hidden grounds")
    sensor: Sensor = setting(Sensor.SPEED, "what a learner measures: speed (a scalar) or contact (one bit)")


def landing(
    scene: SceneLike,
    foot: str | None = None,
    *,
    request: Given = None,
    threads: Workers = None,
    progress: Progress | None = None,
    **settings: Any,
) -> LandingDesign:
    """Design an on-off signal with which a foot touches down softly, every touchdown of the period counted.

    A `tarsus.design` of `Pulses` for the least ``hardest_impact`` of the foot, which keeps shares of the plain step's
    contact and mean height, in a period of the settled motion.

    Parameters
    ----------
    scene
        A scene, or the name of a device, or a scene file. Its drive has a periodic signal: its period, and the share of
        it in which the foot stands, are kept.
    foot
        Name of the foot.
    request
        Settings as a mapping or a TOML file, see `tarsus.design.settings_text`.
    threads
        Worker threads, or an executor.
    progress
        Called as ``progress(done, total, what)``.
    settings
        In place of those of the request: pairs of switchings at the two edges of the step; levels ``"-8 V, 8 V"`` or
        more listed voltages, or ``"free=-8V:8V"``, any between; over and risk as for `tarsus.design`, and unless
        given the worst over the frequencies of the structure within their intervals, or 1 %; learn, steps in which
        the landing is learned on hidden grounds; drive, free, objective, contact, lift, effort, seed, tick, shortest,
        sensor.

    Returns
    -------
    LandingDesign
        The signal, landing speeds [m/s] of step and design, and what they are on every ground.

    Raises
    ------
    InputError
        With what is wrong with the request: an unknown foot, levels beyond the drive's law, a foot that never lands.
    """
    options = settings_of(LandingSettings, request, foot=foot, **settings)
    asked, words = landing_problem(as_scene(scene), options)
    found = found_for(asked, words, progress=progress, threads=threads)
    made = LandingDesign.of(found, options.seed, options.sensor)
    return replace(made, learning=learn(made, options.learn, threads=threads)) if options.learn else made


def landing_problem(scene: Scene, options: LandingSettings) -> tuple[DesignProblem, DesignSettings]:
    """A landing in the words of `tarsus.design`, checked; raises InputError as `landing` does."""
    still_only(scene, "feet land softly")
    drives, foot = list(scene.robot.drives), options.foot
    if options.drive is None and len(drives) != 1:
        raise InputError(f"drive: the robot has {len(drives)} drives; name the one to be designed")
    drive = options.drive or drives[0]
    if drive not in drives:
        raise InputError(f"drive: the robot has no drive '{drive}'{nearest(drive, drives)}")
    pulses = Pulses(foot, options.pairs, options.levels, options.free, options.shortest, options.tick)
    free = free_of(scene, {f"signals.{drive}": pulses})
    assert free.pulses is not None
    step, periods = free.pulses.step, free.pulses.settling(scene)
    plain = Trials(Runs(free, (), periods * step.period)).on(free.as_it_is(), Grounds({}))
    contact, lifted = float(plain.contact[0, 0]), float(plain.lifted[0, 0])
    if not plain.touchdowns[0, 0] > 0.0:
        where = "stays on the ground" if contact > 0.0 else "stays in the air"
        volts = f"{step.lift:g} V and {step.support:g} V"
        raise InputError(f"foot '{foot}' never lands: with the plain step between {volts} it {where}")
    height = lifted * (1.0 - contact / step.period)
    words = DesignSettings(
        free={f"signals.{drive}": pulses},
        objective=f"least hardest_impact.{foot}" if options.objective == "speed" else options.objective,
        limits={
            f"contact_duration.{foot}": (">", options.contact * contact),
            f"mean_height.{foot}": (">", options.lift * height),
        },
        over=borne(scene, options),
        risk=options.risk,
        candidates=max(int(CANDIDATES * options.effort), LEAST),
        look=int(np.clip(LOOK * options.effort, LEAST_LOOK, LOOK)),
        seed=options.seed,
    )
    return problem_of(scene, words, words.risk), words


def borne(scene: Scene, options: LandingSettings) -> Any:
    """What a design has to bear: what is asked for; or, unless the risk is nominal, the frequencies of the structure,
    each within its own interval, or within `KNOWN` where it states none."""
    empty = isinstance(options.over, Mapping) and not options.over  # a file's section without a number
    if not (options.over is None or empty) or options.risk in ("nominal", NOMINAL):
        return options.over
    paths = [path for path in float_paths(scene) if path.startswith("robot.structure.frequencies.")]
    values = {path: float(get_value(scene, path)) for path in paths}
    return {
        path: scene.interval(path) or ((1.0 - KNOWN) * value, (1.0 + KNOWN) * value)
        for path, value in values.items()
        if value > 0.0
    } or None
