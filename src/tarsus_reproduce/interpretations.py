"""How the model of the millipede fares over random interpretations of what the dissertation does not print.

So much of the walking model is unprinted that the score of any one device says little: the fair score is a
distribution. An interpretation draws every unprinted number from a declared range, and every choice from declared
options; what is printed (ground of Table 2.2, ranges of Table 4.2, 14 V) stays. Each is judged as the named variants
are, on coarser studies. Interpretation number k of a seed is the same whatever the count.

500 interpretations come with the package, so that a page draws the distribution without computing it: ``tarsus
reproduce millipede --readings 500 --seed 1`` computes them again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.files.rows import parse_rows
from tarsus.files.runstore import PLAN_FILE, UNIT_FILES, RunStore
from tarsus.files.toml import scene_texts
from tarsus.fit.unknowns import Unknown, Unknowns
from tarsus.model.laws.friction import AdhesiveFriction, AnyFriction, Friction
from tarsus.model.laws.landing import AnyLanding, CaptureUnlessPulled, PullAsPrinted, RestituteFirst
from tarsus.model.scene import Initial, Scene, Standing
from tarsus_reproduce.claims import FilmUnit
from tarsus_reproduce.millipede import COUNTS, Coarse, Score, judge_scene, walker_of
from tarsus_reproduce.packaged import data_table, data_text
from tarsus_reproduce.reproduction import PAGE_FILES

COARSE = Coarse(9, (0.1, 0.5, 0.9))
"""Runs of an interpretation's studies: with nine values a direction takes a rank correlation of 0.80 (p < 0.01)."""

PERIODS = 10
"""Drive periods of a run: the packaged studies' 0.2 s at 50 Hz."""

PRINTED = {
    "ground.restitution.coefficient": 0.378,
    "ground.adhesion.initial": 0.2743e-6,
    "ground.adhesion.rate": 1.7e-6,
}
"""Reference ground of Table 2.2 in SI, the same in every interpretation."""

FILE = "millipede_interpretations.csv"
"""The packaged interpretations, those of seed 1."""

STORE = "interpretations"
"""Folder of finished interpretations, in the output folder of `tarsus reproduce`."""

_EACH = (*PAGE_FILES, *(f"{STORE}/{name}" for name in ("scene.toml", "judging.txt", PLAN_FILE, *UNIT_FILES)))
FILES = ("index.html", *_EACH, *(f"*/{name}" for name in _EACH))
"""What the output folder may hold of one experiment or several, as glob patterns."""


def _unprinted() -> tuple[tuple[Unknown, ...], tuple[Mapping[str, Any], ...]]:
    """Numbers and choices of `data/unprinted.toml`."""
    table = data_table("unprinted.toml")
    return tuple(Unknown(**one, scale="log") for one in table["number"]), tuple(table["choice"])


UNPRINTED, CHOICES = _unprinted()
"""Numbers that the dissertation does not print for its walking model, and choices that it does not state: their names,
options, drawn with equal chance, and why these."""


@dataclass(frozen=True)
class Interpretations:
    """Interpretations 0 to n - 1 of a seed, in order: the score of each, None where it could not be judged."""

    seed: int
    scores: tuple[Score | None, ...]

    @property
    def judged(self) -> list[Score]:
        """Of those that could be judged."""
        return [one for one in self.scores if one is not None]

    def to_dict(self) -> dict[str, Any]:
        """Plain data: how many were judged, and of every count of a score mean, median, 95 % quantile and histogram."""
        scores = self.judged
        table: dict[str, Any] = {"seed": self.seed, "count": len(self.scores), "judged": len(scores)}
        for name in COUNTS[:-1] if scores else ():
            counts = np.array([score[name] for score in scores], dtype=int)
            table[name] = {
                "mean": float(counts.mean()),
                "median": float(np.median(counts)),
                "quantile_95": float(np.quantile(counts, 0.95)),
                "histogram": np.bincount(counts).tolist(),
            }
        table["ranges"] = [
            {"name": one.name, "unit": one.unit, "low": one.low, "high": one.high, "why": one.meaning}
            for one in UNPRINTED
        ]
        table["choices"] = list(CHOICES)
        return table


def packaged_interpretations() -> Interpretations:
    """The interpretations that come with the package."""
    rows = parse_rows(data_text(FILE), FILE).rows
    return Interpretations(1, tuple({name: int(row[name]) for name in COUNTS} for row in rows))


def _digest() -> str:
    """Of all ranges and choices, without the words that say why."""
    ranges = [(one.name, one.unit, one.low, one.high) for one in UNPRINTED]
    choices = [(one["name"], tuple(one["options"])) for one in CHOICES]
    return hashlib.sha256(repr((ranges, choices)).encode()).hexdigest()[:12]


def drawn(seed: int, number: int) -> NDArray[np.float64]:
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


def judged_interpretations(
    base: Scene,
    count: int,
    seed: int,
    *,
    folder: Path | None = None,
    resume: bool = True,
    threads: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> Interpretations:
    """Judge interpretations 0 to ``count`` - 1 of a seed on a three-mass millipede, whose values they replace.

    Those that `folder` holds already (`RunStore`) are not run again; other arguments as for
    `tarsus_reproduce.verb.reproduce`. Raises InputError if the folder holds something else, and for a base that is no
    millipede.
    """
    walker_of(base)
    texts = {**scene_texts(base), "judging.txt": f"{COARSE}, {PERIODS} periods, ranges {_digest()}\n"}
    place = None if folder is None else folder / STORE
    there = resume and place is not None and place.exists()
    store = RunStore.open(place, texts, resume=there, what="set of interpretations")

    def say(done: int, new: int) -> None:
        if progress is not None:
            progress(count - new + done, count, "interpretations")

    points = np.array([drawn(seed, number) for number in range(count)])
    found = store.evaluate(points, lambda some: {"counts": _judged(base, some)}, chunk=1, threads=threads, progress=say)
    rows = found["counts"].tolist()
    return Interpretations(seed, tuple(dict(zip(COUNTS, one, strict=True)) if one[0] >= 0 else None for one in rows))


def _judged(base: Scene, points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Counts (n, 6) of interpretations; -1 where one cannot be judged."""
    return np.array([list(_score(base, point).values()) for point in points])


def _score(base: Scene, point: NDArray[np.float64]) -> Score:
    values = interpretation_values(base, point)
    try:
        scene = interpretation_scene(base, values)
        duration = PERIODS / float(values["drive frequency"])
        return judge_scene("interpretation", scene, duration=duration, coarse=COARSE, scored_only=True).score
    except InputError:
        return dict.fromkeys(COUNTS, -1)
