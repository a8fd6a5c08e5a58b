"""How the model of the millipede fares over random readings of what the dissertation does not print.

So much of the walking model is unprinted that the score of any one device says little: the fair score is a
distribution. A reading draws every unprinted number from a declared range, and every choice from declared options; what
is printed (ground of Table 2.2, ranges of Table 4.2, 14 V) stays. Each is judged as the named variants are, on coarser
studies. Reading number k of a seed is the same whatever the count, and finished ones are kept in a file, one a line.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.base.workers import workers
from tarsus.files.version import package_version
from tarsus.model.laws.friction import AdhesiveFriction, AnyFriction, Friction
from tarsus.model.laws.landing import AnyLanding, CaptureUnlessPulled, PullAsPrinted, RestituteFirst
from tarsus.model.scene import Initial, Scene, Standing
from tarsus.model.structure import Walker
from tarsus_reproduce.millipede import Coarse, Score, judge_scene
from tarsus_reproduce.millipede_trends import FilmReading

__all__ = [
    "CHOICES",
    "RANGES",
    "Choice",
    "Range",
    "Reading",
    "Readings",
    "random_readings",
    "reading_scene",
]

COARSE = Coarse(9, (0.1, 0.5, 0.9))
"""Runs of a reading's studies: with nine values a direction takes a rank correlation of 0.80 (p < 0.01)."""

PERIODS = 10
"""Drive periods of a run: the packaged studies' 0.2 s at 50 Hz."""

PRINTED = {
    "ground.restitution.coefficient": 0.378,
    "ground.adhesion.initial": 0.2743e-6,
    "ground.adhesion.rate": 1.7e-6,
}
"""Reference ground of Table 2.2 in SI, the same in every reading."""


@dataclass(frozen=True)
class Range:
    """An unprinted number: its unit, the ends of its range in SI, drawn evenly in the logarithm, and why these ends."""

    name: str
    unit: str
    low: float
    high: float
    why: str


@dataclass(frozen=True)
class Choice:
    """An unprinted choice: its options, drawn with equal chance, and why these."""

    name: str
    options: tuple[str, ...]
    why: str


RANGES = (
    Range("body mass", "kg", 0.05e-6, 0.5e-6, "the payloads of Fig. 4.11"),
    Range(
        "leg mass", "kg", 0.5e-9, 20e-9, "thigh and shin of 10 µm silicon, to a tenth of the lightest body"
    ),
    Range("vertical stiffness", "N/m", 0.1, 10.0, "a tenth to ten times what Table 4.1 gives at the body"),
    Range(
        "vertical damping ratio", "1", 0.02, 1.9, "a thin film's damping to that of Table 4.1 (erratum E16)"
    ),
    Range("vertical gain", "N/V", 0.3e-6, 5e-6, "a fifth to three times what Table 4.1 gives at the body"),
    Range("lateral stiffness", "N/m", 0.1, 10.0, "as the vertical one"),
    Range("lateral damping ratio", "1", 0.02, 1.9, "as the vertical one"),
    Range(
        "lateral over vertical force", "1", 0.3, 3.0, "one voltage drives both actuators, of the same film"
    ),
    Range("friction", "1", 0.1, 1.0, "dry friction of silicon, clean to rough"),
    Range(
        "friction by adhesion alone",
        "1",
        0.1,
        10.0,
        "dry friction's coefficient to what bears a body's weight on the adhesion of Table 2.2",
    ),
    Range(
        "speed that may be held", "m/s", 1e-4, 1e-2, "a thousandth to a tenth of the speed at which feet land"
    ),
    Range("film thickness at contact", "m", 0.1e-6, 58e-6, "roughness of a wafer to the 58 µm of Table 2.2"),
    Range("electrostatic offset", "m", 1e-6, 100e-6, "an oxide's thickness to a quarter of a leg"),
    Range("electrostatic coefficient", "N m^2/V^2", 1e-21, 1e-17, "the two grounds of Fig. 4.7"),
    Range("drive frequency", "Hz", 20.0, 200.0, "slow steps of section 5.1 to the leg's own frequency"),
)
"""Numbers that the dissertation does not print for its walking model."""

CHOICES = (
    Choice("film reading", tuple(one.value for one in FilmReading), "the unit of C_sfd (erratum E4)"),
    Choice("start", ("standing", "relaxed"), "figures of whole runs depend on it, the text does not say"),
    Choice(
        "landing",
        (CaptureUnlessPulled.title, RestituteFirst.title, PullAsPrinted.title),
        "(2.13) as printed has a sign reversed (erratum E1), and nothing says when a foot that rebounds is held",
    ),
    Choice(
        "friction bound",
        ("µ (N + f_a)", "µ f_a"),
        "friction is 'assumed to be related to adhesion force', in words only",
    ),
)
"""Choices that it does not state."""


@dataclass(frozen=True)
class Reading:
    """One reading: its number, what was drawn by name, and its score; problem: why it could not be judged."""

    number: int
    values: Mapping[str, float | str]
    score: Score | None
    problem: str | None = None


@dataclass(frozen=True)
class Readings:
    """Readings 0 to n - 1 of a seed, in order."""

    seed: int
    readings: tuple[Reading, ...]

    @property
    def scores(self) -> list[Score]:
        """Of the readings that could be judged."""
        return [one.score for one in self.readings if one.score is not None]

    def to_dict(self) -> dict[str, Any]:
        """Plain data: how many were judged, and of every count of a score mean, median, 95 % quantile and histogram."""
        scores = self.scores
        table: dict[str, Any] = {"seed": self.seed, "count": len(self.readings), "judged": len(scores)}
        for name in ("agree", "contradict", "insensitive", "not_determined", "directional_agree"):
            counts = np.array([getattr(score, name) for score in scores], dtype=int)
            if len(counts):
                table[name] = {
                    "mean": float(counts.mean()),
                    "median": float(np.median(counts)),
                    "quantile_95": float(np.quantile(counts, 0.95)),
                    "histogram": np.bincount(counts).tolist(),
                }
        table["ranges"] = [asdict(one) for one in RANGES]
        table["choices"] = [asdict(one) for one in CHOICES]
        return table


def drawn(seed: int, number: int) -> dict[str, float | str]:
    """Values of one reading by name, SI."""
    shares = np.random.default_rng([seed, number]).random(len(RANGES) + len(CHOICES)).tolist()
    numbers = {one.name: one.low * (one.high / one.low) ** u for one, u in zip(RANGES, shares, strict=False)}
    chosen = {
        one.name: one.options[int(u * len(one.options))]
        for one, u in zip(CHOICES, shares[len(RANGES) :], strict=True)
    }
    return {**numbers, **chosen}


def reading_scene(base: Scene, values: Mapping[str, Any]) -> Scene:
    """A three-mass millipede with the values of a reading; masses and stiffness fix what the damping ratios mean.

    Raises
    ------
    InputError
        For a scene without walker or without a law that is read, and values that do not stand.
    """
    walker = base.robot.structure
    if not isinstance(walker, Walker):
        raise InputError(f"{base.name}: readings are of a millipede, which is a walker")
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
    film = FilmReading(values["film reading"])
    changes |= {
        "ground.friction": _friction(values),
        "ground.film.thickness": values["film thickness at contact"],
        "ground.film.coefficient": 1.747e-15 * film.unit,
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


def judged_reading(base: Scene, seed: int, number: int) -> Reading:
    """Draw, build and judge one reading."""
    values = drawn(seed, number)
    try:
        scene = reading_scene(base, values)
        duration = PERIODS / float(values["drive frequency"])
        score = judge_scene("reading", scene, duration=duration, coarse=COARSE, scored_only=True).score
    except InputError as error:
        return Reading(number, values, None, str(error))
    return Reading(number, values, score)


def random_readings(
    base: Scene,
    count: int,
    seed: int,
    *,
    file: Path | None = None,
    threads: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> Readings:
    """Judge readings 0 to ``count`` - 1 of a seed.

    Parameters
    ----------
    base
        A three-mass millipede; what a reading draws replaces its own values.
    count, seed
        How many, and the seed of their draws.
    file
        Where finished readings are kept; those that are there already, of the same seed and version, are not run again.
    threads
        Readings that are judged at a time; by default one for each processor that this process may use.
    progress
        Called as ``progress(done, count, what)``.

    Raises
    ------
    InputError
        If the file holds something else.
    """
    done = {} if file is None else _kept(file, seed)
    missing = [number for number in range(count) if number not in done]
    if missing:
        done[missing[0]] = judged_reading(base, seed, missing[0])  # compiles before the threads start
        _keep(file, seed, done[missing[0]])
    with ThreadPoolExecutor(workers(threads)) as pool:
        work = [pool.submit(judged_reading, base, seed, number) for number in missing[1:]]
        try:
            for future in as_completed(work):
                found = future.result()
                done[found.number] = found
                _keep(file, seed, found)
                if progress is not None:
                    progress(len(done), count, "readings")
        finally:
            pool.shutdown(cancel_futures=True)
    return Readings(seed, tuple(done[number] for number in range(count)))


def _kept(file: Path, seed: int) -> dict[int, Reading]:
    """Finished readings of a file; a last line that was cut off is dropped."""
    if not file.exists():
        return {}
    found: dict[int, Reading] = {}
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    whole = [line for line in lines if line.endswith("\n")]
    for line in whole:
        try:
            table = json.loads(line)
            score = table["score"] and Score(**table["score"])
            one = Reading(table["number"], table["values"], score, table["problem"])
            same = table["seed"] == seed and table["version"] == package_version()
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(f"{file}: is no file of readings ({error})") from None
        if same and one.values == drawn(seed, one.number):
            found[one.number] = one
    if len(whole) < len(lines):
        file.write_text("".join(whole), encoding="utf-8")
    return found


def _keep(file: Path | None, seed: int, one: Reading) -> None:
    if file is None:
        return
    file.parent.mkdir(parents=True, exist_ok=True)
    table = {**asdict(one), "seed": seed, "version": package_version()}
    with file.open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(table) + "\n")
