"""What a gait's design is asked for, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.workers import Workers
from tarsus.design.over import Over, over_of
from tarsus.design.risk import Nominal, Risk, Worst, risk_of
from tarsus.design.unknowns import Symmetry, Unknowns, unknowns_of
from tarsus.design.walk_objectives import WalkObjective, objectives_of
from tarsus.design.walks import without_legs
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker

__all__ = ["GaitOptions", "GaitRequest", "gait_request", "symmetry_of"]

T = TypeVar("T")

FEWEST = 64
"""Candidates below which no search begins."""


@dataclass(frozen=True)
class GaitOptions:
    """symmetry: of the phases, where they are free; dead: legs that do not move; candidates: gaits that are tried
    in all; look: grounds that an attack between rounds looks at in a box before it climbs, the last attack at four
    times as many, with other random numbers; loss: share of the best nominal value that the robust gait may give
    up; duration [s] of a run, the scene's when absent; seed; threads."""

    symmetry: Symmetry | str = Symmetry.NONE
    dead: tuple[str, ...] = ()
    candidates: int = 4000
    look: int = 48
    loss: float = 0.1
    duration: float | None = None
    seed: int = 0
    threads: Workers = None


@dataclass(frozen=True)
class GaitRequest:
    """A scene with its unknowns, objectives, grounds and risk, all of them checked."""

    scene: Scene
    unknowns: Unknowns
    objectives: tuple[WalkObjective, ...]
    over: Over | None
    risk: Risk
    options: GaitOptions

    @property
    def duration(self) -> float:
        """Of a run [s]."""
        return self.scene.duration if self.options.duration is None else self.options.duration

    @property
    def lines(self) -> list[str]:
        """Everything that runs depend on beside the scene, as text."""
        return [
            *(f"{n} [{u}] {lo!r} {hi!r}" for n, u, lo, hi in
              zip(self.unknowns.names, self.unknowns.units, self.unknowns.low.tolist(), self.unknowns.high.tolist(),
                  strict=True)),
            f"paths {', '.join(self.unknowns.paths)}",
            f"shares {self.unknowns.base.tolist()} {self.unknowns.share.tolist()}",
            f"objectives {', '.join(one.name for one in self.objectives)}",
            f"over {described(self.over)}", f"risk {self.risk.name}",
            f"candidates {self.options.candidates}, look {self.options.look}, duration {self.duration!r}, "
            f"loss {self.options.loss!r}, seed {self.options.seed}",
        ]  # fmt: skip


def described(over: Over | None) -> str:
    """Grounds in words that are the same for the same grounds."""
    if over is None:
        return "nothing"
    if hasattr(over, "low"):
        ends = zip(over.paths, over.low.tolist(), over.high.tolist(), strict=True)  # pyright: ignore
        return "; ".join(f"{path} {low!r} to {high!r}" for path, low, high in ends)
    return "; ".join(f"{path} {list(map(float, own))!r}" for path, own in over.values.items())  # pyright: ignore


def symmetry_of(word: Symmetry | str) -> Symmetry:
    """The symmetry of a word; raises InputError for any other."""
    try:
        return Symmetry(word)
    except ValueError:
        known = [one.value for one in Symmetry]
        raise InputError(f"symmetry: there is none called '{word}'{nearest(str(word), known)}") from None


def gait_request(
    scene: Scene,
    free: Mapping[str, Any] | Iterable[str],
    objective: str | Sequence[str | WalkObjective],
    over: Any,
    risk: str | Risk | None,
    options: GaitOptions,
) -> GaitRequest:
    """Check everything; raises InputError with every problem that can be told at once."""
    problems: list[str] = []

    def tried(made: Callable[[], T]) -> T | None:
        try:
            return made()
        except InputError as error:
            problems.extend(error.problems)
            return None

    if not isinstance(scene.robot.structure, Walker):
        raise InputError(
            f"'{scene.name}' does not walk: only a scene whose structure is a walker has a gait to design"
        )
    scene = tried(lambda: without_legs(scene, options.dead)) or scene
    objectives = tried(lambda: objectives_of(objective)) or ()
    symmetry = tried(lambda: symmetry_of(options.symmetry))
    made = None if symmetry is None else tried(lambda: unknowns_of(scene, free, symmetry))
    grounds = tried(lambda: over_of(scene, over))
    if made is not None and grounds is not None:
        problems += [
            f"{path}: is designed, so it cannot be part of the ground"
            for path in grounds.paths
            if path in made[1].paths
        ]
    chosen = tried(lambda: risk_of(risk)) if risk is not None else (Nominal() if grounds is None else Worst())
    if grounds is None and over is None and isinstance(chosen, Risk) and not isinstance(chosen, Nominal):
        problems.append(f"risk: '{chosen.name}' needs grounds to be judged on: give --over PATH=a:b")
    problems += _of_energy(scene, objectives)
    if made is not None:
        problems += _of_duration(*made, options)
    if options.candidates < FEWEST:
        problems.append(f"candidates: expected at least {FEWEST}, got {options.candidates}")
    if options.look < 1:
        problems.append(f"look: expected at least 1 ground, got {options.look}")
    if not 0.0 <= options.loss < 1.0:
        problems.append(f"loss: expected a share from 0 to below 1, got {options.loss:g}")
    if problems or made is None or chosen is None:
        raise InputError(list(dict.fromkeys(problems)))
    return GaitRequest(*made, objectives, grounds, chosen, options)


def _of_duration(scene: Scene, unknowns: Unknowns, options: GaitOptions) -> list[str]:
    """What is wrong with a duration: walks are measured by whole drive periods."""
    duration = scene.duration if options.duration is None else options.duration
    lowest = unknowns.numbers(np.zeros((1, len(unknowns)))).get("gait.frequency")
    periods = [wave.period or 0.0 for wave in scene.waveforms.values()] if lowest is None else [1.0 / float(lowest[0])]
    slowest = max(periods, default=0.0)
    if duration > 0.0 and duration >= slowest * (1.0 - 1e-9):  # but for rounding
        return []
    return [f"duration: expected at least a drive period of the slowest gait, {slowest:.4g} s, got {duration:.4g} s"]


def _of_energy(scene: Scene, objectives: Sequence[WalkObjective]) -> list[str]:
    if not any(one.priced for one in objectives):
        return []
    layout = scene.robot.layout()
    moving = [] if layout is None else [name for name, reach in layout.drives.items() if reach.legs]
    bare = [name for name in moving if scene.robot.drives[name].capacitance is None]
    names = " and ".join(one.name for one in objectives if one.priced)
    problems = [f"objective: {names} needs the capacitance of drive '{name}': set robot.drives.{name}.capacitance"
                for name in bare[:1]]  # fmt: skip
    if scene.ground.gravity is None and any(one.name == "transport" for one in objectives):
        problems.append("objective: transport needs gravity, for the weight that is carried")
    return problems
