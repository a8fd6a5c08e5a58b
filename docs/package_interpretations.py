"""Random interpretations of what the dissertation does not print of its millipede, judged: a packaged file.

    python docs/package_interpretations.py [COUNT]

draws 500 interpretations, or COUNT, and writes the counts of each score into `tarsus_reproduce`; half a day on a
processor. An interpretation draws every unprinted number from its range, and every choice from its options
(`data/unprinted.toml`); what is printed (ground of Table 2.2, ranges of Table 4.2, 14 V) stays. Each is judged as the
named variants are, on coarser studies. Interpretation number k is the same whatever the count. What the file holds of
the same ranges is not judged again.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.files.library import load_scene
from tarsus.files.whole import write_text
from tarsus.fit.unknowns import Unknowns
from tarsus.model.laws.friction import AdhesiveFriction, AnyFriction, Friction
from tarsus.model.laws.landing import AnyLanding, CaptureUnlessPulled, PullAsPrinted, RestituteFirst
from tarsus.model.scene import Initial, Scene, Standing
from tarsus_reproduce.claims import FilmUnit
from tarsus_reproduce.interpretations import CHOICES, FILE, PERIODS, SEED, UNPRINTED
from tarsus_reproduce.millipede import COUNTS, Coarse, Score, judge_scene, walker_of

COARSE = Coarse(9, (0.1, 0.5, 0.9))
"""Runs of an interpretation's studies: with nine values a direction takes a rank correlation of 0.80 (p < 0.01)."""

PRINTED = {
    "ground.restitution.coefficient": 0.378,
    "ground.adhesion.initial": 0.2743e-6,
    "ground.adhesion.rate": 1.7e-6,
}
"""Reference ground of Table 2.2 in SI, the same in every interpretation."""


def digest() -> str:
    """Of all ranges and choices, without the words that say why."""
    ranges = [(one.name, one.unit, one.low, one.high) for one in UNPRINTED]
    choices = [(one["name"], tuple(one["options"])) for one in CHOICES]
    return hashlib.sha256(repr((ranges, choices)).encode()).hexdigest()[:12]


def drawn(number: int, seed: int = SEED) -> NDArray[np.float64]:
    """One interpretation as a point (nu + nc,) of the unit cube: the unprinted numbers, then the choices."""
    return np.random.default_rng([seed, number]).random(len(UNPRINTED) + len(CHOICES))


def interpretation_values(scene: Scene, point: NDArray[np.float64]) -> dict[str, float | str]:
    """What a point of the unit cube stands for, by name; numbers in SI."""
    numbers = Unknowns.of(scene, UNPRINTED).by_name(point[: len(UNPRINTED)])
    shares = zip(CHOICES, point[len(UNPRINTED) :].tolist(), strict=True)
    return {**numbers, **{one["name"]: one["options"][int(u * len(one["options"]))] for one, u in shares}}


def interpretation_scene(base: Scene, values: Mapping[str, Any]) -> Scene:
    """A three-mass millipede with the values of an interpretation; masses and stiffness fix what the damping ratios
    mean. Raises InputError for a scene without walker or without a law that is drawn, and values that do not stand."""
    walker = walker_of(base)
    share = 2.0 * values["body mass"] / len(walker.legs)
    changes: dict[str, Any] = {**PRINTED, "robot.structure.body.mass": values["body mass"]}
    for leg in walker.legs:
        at = f"robot.structure.legs.{leg}."
        changes[f"{at}mass"] = values["leg mass"]
        for way, name in (("v", "vertical"), ("l", "lateral")):
            stiffness = values[f"{name} stiffness"]
            changes[f"{at}stiffness_{way}"] = stiffness
            changes[f"{at}damping_{way}"] = 2.0 * values[f"{name} damping ratio"] * (stiffness * share) ** 0.5
    along = values["lateral over vertical force"]
    for name in base.robot.drives:
        changes[f"robot.drives.{name}.law.gain"] = values["vertical gain"]
        weights = f"robot.drives.{name}.load.weights."
        changes |= {f"{weights}{name}_x": -along, f"{weights}{name}_hip_x": along}
    changes |= {
        "ground.friction": _friction(values),
        "ground.film.thickness": values["film thickness at contact"],
        "ground.film.coefficient": 1.747e-15 * FilmUnit(values["film reading"]).unit,
        "ground.electrostatic.offset": values["electrostatic offset"],
        "ground.electrostatic.coefficient": values["electrostatic coefficient"],
        "gait.frequency": values["drive frequency"],
        "ground.landing": _landing(values),
        "initial": Initial(standing=Standing() if values["start"] == "standing" else None),
        "provenance": {},
    }
    return with_values(base, changes)


def _friction(values: Mapping[str, Any]) -> AnyFriction:
    if values["friction bound"] == "µ f_a":
        return AdhesiveFriction(coefficient=values["friction by adhesion alone"])
    return Friction(coefficient=values["friction"])


def _landing(values: Mapping[str, Any]) -> AnyLanding:
    if values["landing"] == RestituteFirst.title:
        return RestituteFirst(speed=values["speed that may be held"])
    return PullAsPrinted() if values["landing"] == PullAsPrinted.title else CaptureUnlessPulled()


def judged(base: Scene, number: int) -> Score:
    """The score of an interpretation of a three-mass millipede, whose values it replaces."""
    values = interpretation_values(base, drawn(number))
    duration = PERIODS / float(values["drive frequency"])
    scene = interpretation_scene(base, values)
    return judge_scene("interpretation", scene, duration=duration, coarse=COARSE, scored_only=True).score


def write_scores(target: Path, count: int) -> None:
    """Add to a file what it lacks of the first interpretations, a line each; one of other ranges is begun anew."""
    head = (
        "# Random interpretations of what is not printed, in the order of their numbers from 0 on (seed "
        f"{SEED}), of the ranges {digest()}: the counts of each score.\n"
        f"# Made by `python docs/package_interpretations.py`.\n{','.join(COUNTS)}\n"
    )
    text = target.read_text(encoding="utf-8") if target.is_file() else ""
    lines = text.removeprefix(head).splitlines() if text.startswith(head) else []
    base = load_scene("millipede")
    for number in range(len(lines), count):
        lines.append(",".join(map(str, judged(base, number).values())))
        write_text(target, head + "\n".join(lines) + "\n")


def main(words: list[str]) -> int:
    """Judge the interpretations and write them into the package."""
    if len(words) > 1 or not all(one.isdecimal() for one in words):
        raise InputError(f"expected a number of interpretations; got {' '.join(words)}")
    write_scores(Path(str(files("tarsus_reproduce"))) / "data" / FILE, int(words[0]) if words else 500)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
