"""The problem of a walker's gait: a design of a scene whose legs may be dead and whose phases are tied."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tarsus.base.errors import InputError
from tarsus.design.free import PHASES, Symmetry
from tarsus.design.problem import DesignProblem, SearchSettings, problem_of
from tarsus.design.problems import Problems
from tarsus.design.runs import without_legs
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker

TIED = "of free phases: none, mirror, pairs or wave"
DEAD = "legs that do not move"


def gait_problem(scene: Scene, options: SearchSettings, risk: Any) -> DesignProblem:
    """The problem of a walker's gait, checked; raises InputError with every problem that can be found at once."""
    if not isinstance(scene.robot.structure, Walker):
        raise InputError(f"'{scene.name}' does not walk: only a scene whose structure is a walker has a gait to design")
    problems = Problems()
    dead, symmetry = getattr(options, "dead", ()), getattr(options, "symmetry", None)
    lame = problems.tried(lambda: without_legs(scene, dead)) or scene
    free = options.free if isinstance(options.free, Mapping) else dict.fromkeys(options.free)
    if symmetry is not None and PHASES in free and free[PHASES] is None:
        free = {**free, PHASES: symmetry}
    elif symmetry not in (None, Symmetry.NONE) and PHASES not in free:
        problems.append(f"symmetry: '{symmetry.value}' ties phases, so {PHASES} has to be free")
    tied = options.model_copy(update={"free": free})
    made = problems.tried(lambda: problem_of(lame, tied, risk))
    if problems or made is None:
        raise InputError(problems)
    return made
