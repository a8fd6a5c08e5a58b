"""Scenes nobody chose: robots, drives and grounds drawn from a seed, within ranges that may go to the edges.

`scene_of(seed)` draws from ``EDGE``, `wide_scene(seed)` from ``WIDE``, the same with more forms, and
`plain_scene(seed, legged)` from ``PLAIN``, where another simulator can follow; `sliding_scene(seed)` has friction, and
`falling_friction(seed)` is a law of it.
A seed makes the same scene on every machine. Sizes are drawn relative to a mass, a frequency and a length, so that what
is drawn matters: a drive moves a foot to the ground, a film is felt.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import tarsus as ts
from scene_files import SCENES
from tarsus.base.spec import validate
from tarsus.model.drive.laws import Creeping, Cubic, LinearForce, PrandtlIshlinskii, TwoBranch
from tarsus.model.drive.waveforms import OnOff
from tarsus.model.scene import Scene

OWN = ts.load_laws(SCENES / "squeeze.py")
Pair = tuple[float, float]


@dataclass(frozen=True)
class Ranges:
    """From where to where numbers are drawn, most of them by their logarithm; chances are probabilities."""

    feet: tuple[int, ...]  # numbers of feet, drawn alike
    legs: tuple[int, ...]
    modes: tuple[int, int]
    length: Pair  # [m] of gaps
    damping: Pair  # damping ratio
    spread: float  # of frequencies, as a factor
    film: Pair  # C / g0^3 relative to what damps a mass critically
    thickness: Pair  # [m] of a film; relative to the length where `relative`
    attraction: Pair  # electrostatic force at contact, relative to the drive's
    adhesion: Pair  # strength relative to the drive's force
    friction: Pair
    cycles: Pair  # of the structure that a run lasts
    odd: float  # chance of each thing that is no number: no gap, no damping, feet at one place, feet that face down
    abrupt: float  # shortest of a drive's stretches, relative to its period
    relative: bool = False
    long: float = 0.0  # chance of a run of 20 s
    together: float = 0.0  # chance of feet in groups, each at one place
    crowd: float = 0.0  # chance of many feet on one or two coordinates
    bars: float = 0.0  # chance of a bar that nothing holds but its feet
    beams: float = 0.0  # chance of a cantilever with a tip
    bare: float = 0.0  # chance of no feet
    decades: float = 0.0  # over how many the gaps of one robot are spread, in a third of the scenes
    ends: float = 0.0  # chance of a restitution of 0, of 1, or next to it


PLAIN = Ranges(
    feet=(1, 1, 2, 3),
    legs=(2, 3),
    modes=(1, 3),
    length=(1e-6, 1e-5),
    damping=(0.02, 2.0),
    spread=3.0,
    film=(1e-2, 3.0),
    thickness=(0.3, 3.0),
    attraction=(1e-2, 0.3),
    adhesion=(1e-2, 1.0),
    friction=(0.1, 1.0),
    cycles=(3.0, 6.0),
    odd=0.1,
    abrupt=0.05,
    relative=True,
)
FEET = (*(1, 2) * 12, 1, 1, 1, *(3, 4, 5) * 3, 6, 9, 12, 24, 64)
LEGS = (*(2, 3, 4) * 8, 6, 6, 8, 12, 24, 64)
EDGE = Ranges(
    feet=FEET,
    legs=LEGS,
    modes=(1, 8),
    length=(1e-9, 1e-4),
    damping=(1e-6, 1e4),
    spread=100.0,
    film=(1e-4, 1e6),
    thickness=(1e-9, 1e-4),
    attraction=(1e-3, 10.0),
    adhesion=(1e-6, 1e3),
    friction=(1e-6, 1e3),
    cycles=(0.5, 5.0),
    odd=0.25,
    abrupt=1e-12,
    long=0.02,
)

WIDE = replace(
    EDGE,
    feet=(1, 1, 2, 2, 2, 3, 3, 4, 4, 5, 6, 9),
    legs=(2, 2, 3, 4, 4, 6, 6, 6, 8, 12),
    together=0.25,
    crowd=0.1,
    bars=0.15,
    beams=0.1,
    bare=0.05,
    decades=6.0,
    ends=0.4,
)


@dataclass(frozen=True)
class Scale:
    """What a scene is measured by: mass [kg], frequency [Hz], length [m], force [N] of its drives."""

    mass: float
    frequency: float
    length: float
    force: float

    @property
    def rate(self) -> float:
        return 2.0 * math.pi * self.frequency


class Dice:
    """Random numbers of one scene."""

    def __init__(self, seed: int | Sequence[int], ranges: Ranges) -> None:
        self.rng = np.random.default_rng(seed)
        self.ranges = ranges

    def log(self, low: float, high: float) -> float:
        return float(np.exp(self.rng.uniform(math.log(low), math.log(high))))

    def between(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def odd(self) -> bool:
        return self.chance(self.ranges.odd)

    def one_of(self, options: Sequence[Any]) -> Any:
        return options[int(self.rng.integers(len(options)))]


def scene_of(seed: int) -> Scene:
    """The scene of a seed at the edges: two of five have legs."""
    dice = Dice(seed, EDGE)
    return _legged(dice, f"edge {seed}") if dice.chance(0.4) else _modal(dice, f"edge {seed}")


def wide_scene(seed: int) -> Scene:
    """The scene of a seed at the edges and of more forms: bars, beams, feet in groups, many or none."""
    dice = Dice([seed, 21], WIDE)
    return _legged(dice, f"wide {seed}") if dice.chance(0.33) else _modal(dice, f"wide {seed}")


def plain_scene(seed: int, legged: bool) -> Scene:
    """The scene of a seed within what another simulator can follow."""
    dice = Dice([seed, int(legged)], PLAIN)
    return (_legged if legged else _modal)(dice, f"{'legged' if legged else 'modal'} {seed}")


def branched_scene(seed: int, legged: bool) -> Scene:
    """The plain scene of a seed with laws of two branches, that need not meet, and repeating plateaus on its drives."""
    scene = plain_scene(seed, legged)
    dice = Dice([seed, int(legged), 7], PLAIN)
    signals = dict(scene.signals)
    changes: dict[str, Any] = {"signals": signals}
    for name, drive in scene.robot.drives.items():
        if dice.chance(0.6):
            gain = drive.law.gain if isinstance(drive.law, LinearForce) else drive.law.linear
            rising = Cubic(constant=dice.between(-0.5, 0.5) * gain, linear=gain, quadratic=0.02 * gain)
            falling = Cubic(linear=0.8 * gain, quadratic=-0.01 * gain, cubic=0.002 * gain)
            changes[f"robot.drives.{name}.law"] = TwoBranch(rising=rising, falling=falling)
        if name in signals and dice.chance(0.6):
            shares = dice.rng.dirichlet(np.full(4, 2.0))
            turn = scene.duration * dice.between(0.15, 0.45)
            levels = dice.rng.uniform(-8.0, 8.0, 4).tolist()
            signals[name] = OnOff(levels=levels, durations=(turn * shares).tolist(), repeat=True)
    return ts.with_values(scene, changes)


def edge_scene(seed: int) -> Scene:
    """A modal scene whose feet adhere, under square edges, and some of them under a sine beside that."""
    ranges = replace(PLAIN, feet=(1, 1, 2, 3), adhesion=(1e-2, 3.0), cycles=(3.0, 10.0))
    dice = Dice([seed, 41], ranges)
    scene = _modal(dice, f"edges {seed}")
    made, per_run = scene.model_dump(), 1.0 / scene.duration
    for k, name in enumerate(scene.robot.drives):
        kind = dice.one_of(["square", "square", "on_off", "sine"] if k else ["square", "on_off"])
        if kind == "on_off":
            count = int(dice.rng.integers(4, 9))
            levels, parts = dice.rng.uniform(-8.0, 8.0, count), dice.rng.dirichlet(np.full(count, 1.0))
            given: dict[str, Any] = {
                "levels": levels.tolist(),
                "durations": (scene.duration * parts * 0.999).tolist(),
                "repeat": True,
            }
        elif kind == "square":
            given = {
                "amplitude": dice.between(2.0, 8.0),
                "frequency": per_run * dice.log(2.0, 40.0),
                "phase": dice.between(0.0, 6.0),
                "offset": dice.one_of([0.0, 4.0, 8.0, -8.0]),
                "duty": dice.between(0.05, 0.95),
            }
        else:
            frequency, phase = per_run * dice.log(2.0, 15.0), dice.between(0.0, 6.0)
            given = {"amplitude": 8.0, "frequency": frequency, "phase": phase, "offset": dice.one_of([0.0, 4.0])}
        made["signals"][name] = {"kind": kind, **given}
    made["ground"].pop("laws")
    made["ground"]["own"] = dict(scene.ground.laws)
    if not scene.ground.holds:
        laws = [drive.law for drive in scene.robot.drives.values()]
        force = 8.0 * max(abs(law.gain if isinstance(law, LinearForce) else law.linear) for law in laws)
        made["ground"]["adhesion"] = {
            "initial": force * dice.log(1e-2, 2.0),
            "rate": force * per_run * dice.log(1e-2, 3.0),
        }
    if dice.chance(0.8):  # edges that no amplifier rounds
        for drive in made["robot"]["drives"].values():
            drive.pop("amplifier", None)
    return _valid(made)


def creeping_scene(seed: int, legged: bool) -> Scene:
    """The plain scene of a seed whose drives creep."""
    scene = plain_scene(seed, legged)
    dice, changes = Dice([seed, int(legged), 11], PLAIN), {}
    for name, drive in scene.robot.drives.items():
        gain = drive.law.gain if isinstance(drive.law, LinearForce) else drive.law.linear
        plays = PrandtlIshlinskii(linear=gain, quadratic=0.01 * gain, thresholds=(0.5,), weights=(0.1 * gain,))
        count = 1 + int(dice.rng.integers(3))
        changes[f"robot.drives.{name}.law"] = Creeping(
            instant=plays,
            thresholds=dice.rng.uniform(0.0, 3.0, count).tolist(),
            weights=(gain * dice.rng.uniform(0.05, 0.3, count)).tolist(),
            times=(scene.duration * 10.0 ** dice.rng.uniform(-2.0, 1.0, count)).tolist(),
        )
    return ts.with_values(scene, changes)


def falling_friction(seed: int) -> dict[str, float | str]:
    """A law of a reference speed from 1e-8 to 0.1 m/s."""
    rng = np.random.default_rng([seed, 71])
    dynamic, static = sorted(np.exp(rng.uniform(math.log(0.1), 0.0, 2)).tolist())
    law = {"static": static, "dynamic": dynamic, "speed": 10.0 ** rng.uniform(-8.0, -1.0)}
    if rng.random() < 0.7:
        return {"kind": "stribeck", "exponent": float(rng.integers(1, 5)), **law}
    return {"kind": "rate_weakening", **law}


def sliding_scene(seed: int, ranges: Ranges = PLAIN) -> Scene:
    """A modal scene in which most feet know a way along the ground, that the structure couples with their normals as it
    will, with friction borne by push or adhesion."""
    dice = Dice([seed, 8], ranges)
    while True:
        scene = _modal(dice, f"sliding {seed}")
        if isinstance(scene.robot.structure, (ts.Modal, ts.Lumped)) and scene.robot.feet:
            break
    structure, feet, ways = scene.robot.structure, dict(scene.robot.feet), {}
    for i, (name, foot) in enumerate(feet.items()):
        if i and dice.chance(0.15):
            continue
        ways[f"along_{i}"] = tuple(dice.rng.normal(size=structure.size).tolist())
        feet[name] = foot.model_copy(update={"along": f"along_{i}"})
    kind = "adhesive" if scene.ground.holds and dice.chance(0.3) else "coulomb"
    friction = {"kind": kind, "coefficient": dice.log(*ranges.friction)}
    field = "shapes" if isinstance(structure, ts.Modal) else "weights"
    robot = scene.robot.model_copy(
        update={"structure": ts.with_values(structure, {field: {**getattr(structure, field), **ways}}), "feet": feet}
    )
    made = scene.model_dump() | {"robot": robot.model_dump()}
    ground = scene.ground.model_dump() | {"friction": friction, "impact": None, "own": dict(scene.ground.laws)}
    return _valid(made | {"ground": ground})


def moving_scene(seed: int) -> Scene:
    """A scene of one of three kinds (modal, legged, sliding) on ground that moves, by a waveform of any derivative."""
    dice = Dice([seed, 45], PLAIN)
    kind = seed % 3
    scene = sliding_scene(seed) if kind == 2 else plain_scene(seed, kind == 1)
    structure, feet = scene.robot.structure, scene.robot.feet.values()
    length = max([foot.gap for foot in feet], default=0.0) or 1e-6
    normal, along = dice.one_of(((True, False), (False, True), (True, True)))
    changes: dict[str, Any] = {}
    if kind != 1:
        for field, needed in (("upward", normal), ("forward", along)):
            if needed and getattr(structure, field) is None:
                changes[f"robot.structure.{field}"] = tuple(dice.rng.normal(size=structure.size).tolist())
    stays = kind != 1 and dice.chance(0.4)
    motion: dict[str, Any] = {"base": "stays" if stays else "moves"}
    for name, needed in (("normal", normal), ("along", along)):
        if needed:
            motion[name] = _shift(dice, length, scene.duration, told=0 if stays else None)
    return ts.with_values(scene, {**changes, "ground.motion": motion, "initial.in_laboratory": dice.chance(0.5)})


def _shift(dice: Dice, length: float, duration: float, told: int | None) -> dict[str, Any]:
    """How ground moves over about a length in a duration: its displacement (told = 0), a rate of it, or any of them."""
    told = dice.one_of((0, 0, 1, 2)) if told is None else told
    rate = 2.0 * math.pi * dice.between(1.0, 8.0) / duration
    size = length * dice.log(0.05, 1.0) * rate**told
    name = ("displacement", "velocity", "acceleration")[told]
    if dice.chance(0.5):
        hz = rate / (2.0 * math.pi)
        return {name: {"kind": "sine", "amplitude": size, "frequency": hz, "phase": dice.between(0, 6)}}
    count = 9
    times = (duration * np.linspace(0.0, 1.0 + 1e-3, count)).tolist()
    levels = (size * dice.rng.normal(size=count)).tolist()
    joined = "cubic" if told == 0 else "linear"
    return {name: {"kind": "sampled", "times": times, "levels": levels, "interpolation": joined}}


def wide_sliding_scene(seed: int) -> Scene:
    """The same at the edges."""
    return sliding_scene(seed, WIDE)


def _scale(dice: Dice) -> Scale:
    mass, frequency = dice.log(1e-9, 1e-5), dice.log(20.0, 2e4)
    length = dice.log(*dice.ranges.length)
    return Scale(mass, frequency, length, mass * (2.0 * math.pi * frequency) ** 2 * length * dice.log(0.5, 5.0))


def _modal(dice: Dice, name: str) -> Scene:
    """A structure by modes or by matrices, a bar or a beam, its feet at any places of it."""
    ranges, scale = dice.ranges, _scale(dice)
    structure, rows = _structure(dice, scale)
    m, n = rows.shape
    points = list(structure.get("shapes") or structure.get("weights") or ("tip", "center"))[:m]
    gaps = _gaps(dice, scale, m)
    drives = {}
    for d in range(int(dice.rng.integers(1, 3))):
        point = dice.one_of(points)
        load = {"kind": "point", "weights": {point: dice.between(0.5, 1.5)}}
        if dice.chance(0.3):
            load = {"kind": "modal", "participation": dice.rng.uniform(-1.0, 1.0, n).tolist()}
        drives[f"d{d}"] = _drive(dice, scale, load)
    feet = {
        f"f{i}": {"point": point, "gap": gaps[i], "normal": -1 if dice.chance(0.3 * ranges.odd) else 1}
        for i, point in enumerate(points)
    }
    ground = _ground(dice, scale, heavy=structure.get("stiffness") == [[0.0] * n] * n)
    if ground.get("electrostatic"):
        for foot in feet.values():
            foot["electrode"] = "d0"
    initial: dict[str, Any] = {}
    if dice.chance(0.3):
        initial["velocity"] = (dice.rng.normal(size=n) * scale.length * scale.rate).tolist()
    signals = {drive: _signal(dice, scale) for drive in drives if not dice.chance(0.1)}
    made = {
        "name": name,
        "duration": _duration(dice, scale),
        "robot": {"structure": structure, "drives": drives, "feet": feet},
        "ground": ground,
        "signals": signals,
        "initial": initial,
    }
    if dice.chance(0.2) and structure["kind"] != "beam":
        made["ground"]["impact"] = _impact_map(dice, structure, feet, rows)
    if ranges.bare and dice.chance(ranges.bare):
        feet.clear()
        for slot in ("impact", "electrostatic", "leg_electrostatic"):
            ground.pop(slot, None)
    return _valid(made)


def _structure(dice: Dice, scale: Scale) -> tuple[dict[str, Any], np.ndarray]:
    """A structure that does not walk, and the rows (m, n) of the places of its feet."""
    ranges = dice.ranges
    n = int(dice.rng.integers(ranges.modes[0], ranges.modes[1] + 1))
    m = dice.one_of(ranges.feet)
    if ranges.beams and dice.chance(ranges.beams):
        return _beam(dice, scale), np.ones((min(m, 2), 3))
    bar = bool(ranges.bars) and dice.chance(ranges.bars)
    if bar:
        n = dice.one_of((2, 2, 3))
    elif ranges.crowd and dice.chance(ranges.crowd):
        n, m = dice.one_of((1, 2)), dice.one_of((4, 6, 9, 12, 24, 64))
    rows = dice.rng.uniform(-1.0, 1.0, (m, n))
    rows[:, 0] = 1.0 if bar else dice.rng.uniform(0.5, 1.5, m)
    if bar:
        rows[:, 2:] = rows[:, 1:2] ** 2 - 1.0 / 3.0
    if dice.odd():  # feet at one place
        rows[:] = rows[dice.rng.integers(0, m, m)]
    if ranges.together and dice.chance(ranges.together):
        rows[m // 2 :] = rows[: m - m // 2]
    places = {f"p{i}": tuple(row.tolist()) for i, row in enumerate(rows)}
    if bar:
        return _bar(dice, scale, n) | {"weights": places}, rows
    if dice.chance(0.5):
        return (
            _by_modes(dice, scale, n) | {"shapes": places, "upward": (rows[0] / (rows[0] @ rows[0])).tolist()},
            rows,
        )
    return _by_matrices(dice, scale, n) | {"weights": places}, rows


def _bar(dice: Dice, scale: Scale, n: int) -> dict[str, Any]:
    """A bar in a plane: its height, its turn by the height of an end, and a bend of it; nothing else holds it up."""
    mass = np.array([1.0, dice.between(0.1, 1.0), 0.2])[:n] * scale.mass
    stiff = np.array([0.0, 0.0, scale.mass * scale.rate**2])[:n]
    damper = 2.0 * scale.mass * scale.rate * dice.log(1e-4, 1.0)
    return {
        "kind": "lumped",
        "coordinates": ["height", "turn", "bend"][:n],
        "mass": np.diag(mass).tolist(),
        "stiffness": np.diag(stiff).tolist(),
        "upward": [1.0, 0.0, 0.0][:n],
        "damping": np.diag(np.full(n, 0.0 if dice.odd() else damper)).tolist(),
    }


def _beam(dice: Dice, scale: Scale) -> dict[str, Any]:
    """A cantilever of three modes, as long and heavy as the mass and frequency ask for."""
    side = (scale.mass / 2e3 / 20.0) ** (1.0 / 3.0)
    return {
        "kind": "beam",
        "frequencies": [scale.frequency, scale.frequency * dice.between(6.5, 9.0)],
        "damping_ratios": [_ratio(dice) for _ in range(3)],
        "length": 20.0 * side,
        "tip_length": 2.0 * side,
        "tip_width": side,
        "tip_thickness": 0.5 * side,
        "tip_density": 2e3,
    }


def _valid(made: dict[str, Any]) -> Scene:
    """A drawn scene; without what its structure cannot have (a landing rule or a map that it does not tell)."""
    made["ground"]["laws"] = made["ground"].pop("own", {})
    try:
        return validate(Scene, made)
    except ts.InputError:
        made["ground"] = {slot: law for slot, law in made["ground"].items() if slot not in ("landing", "impact")}
        return validate(Scene, made)


def _by_modes(dice: Dice, scale: Scale, n: int) -> dict[str, Any]:
    frequencies = [scale.frequency * dice.log(1.0, dice.ranges.spread) for _ in range(n)]
    frequencies[0] = 0.0 if dice.odd() else scale.frequency
    return {
        "kind": "modal",
        "frequencies": frequencies,
        "damping_ratios": [_ratio(dice) for _ in range(n)],
        "modal_masses": [scale.mass * dice.log(0.3, 3.0) for _ in range(n)],
    }


def _ratio(dice: Dice) -> float:
    return 0.0 if dice.odd() else dice.log(*dice.ranges.damping)


def _by_matrices(dice: Dice, scale: Scale, n: int) -> dict[str, Any]:
    """A chain of masses on springs, with damping of the modes or in dashpots of its own."""
    mass = [scale.mass * dice.log(0.3, 3.0) for _ in range(n)]
    stiff = scale.mass * scale.rate**2
    springs = [stiff * dice.log(0.3, 0.3 * dice.ranges.spread) for _ in range(n)]
    if n > 1 and dice.odd():
        springs[0] = 0.0
    ties = np.eye(n) - np.eye(n, k=-1)  # stretch of spring i: from mass i - 1 to mass i
    out: dict[str, Any] = {
        "kind": "lumped",
        "coordinates": [f"x{i}" for i in range(n)],
        "mass": np.diag(mass).tolist(),
        "stiffness": (ties.T @ np.diag(springs) @ ties).tolist(),
    }
    if dice.chance(0.5):
        return out | {"damping_ratios": [_ratio(dice) for _ in range(n)]}
    dashpots = [2.0 * scale.mass * scale.rate * _ratio(dice) for _ in range(n)]
    return out | {"damping": (ties.T @ np.diag(dashpots) @ ties).tolist()}


def _gaps(dice: Dice, scale: Scale, m: int) -> list[float]:
    """Rest gaps: apart, all the same, or some that are zero or hardly different."""
    gaps = scale.length * dice.rng.uniform(0.3, 1.0, m)
    if dice.odd():
        gaps[:] = gaps[0]
    if dice.ranges.decades and dice.chance(1.0 / 3.0):
        gaps = scale.length * 10.0 ** -dice.rng.uniform(0.0, dice.ranges.decades, m)
    if dice.ranges.together and dice.chance(dice.ranges.together):  # as those that stand at one place
        gaps[m // 2 :] = gaps[: m - m // 2]
    for i in range(m):
        if dice.odd():
            gaps[i] = dice.one_of([0.0, gaps[0], gaps[0] * (1.0 + 1e-9), gaps[i] * 1e3])
    return gaps.tolist()


def _drive(dice: Dice, scale: Scale, load: dict[str, Any]) -> dict[str, Any]:
    gain = -scale.force / 8.0
    law: Any = {"kind": "linear", "gain": gain}
    if dice.chance(0.3):
        law = PrandtlIshlinskii(
            linear=0.6 * gain, quadratic=0.02 * gain, thresholds=(0.7, 2.3), weights=(0.2 * gain, 0.2 * gain)
        )
    out: dict[str, Any] = {"load": load, "law": law}
    if dice.chance(0.3):
        out["history"] = dice.rng.uniform(-8.0, 8.0, 2).tolist()
    if dice.chance(0.3):
        chosen = {
            "slew_rate": 8.0 * scale.frequency * dice.log(3.0, 100.0),
            "bandwidth": scale.frequency * dice.log(1.0, 30.0),
            "clip": [-dice.between(3.0, 8.0), dice.between(3.0, 8.0)],
        }
        out["amplifier"] = {key: value for key, value in chosen.items() if dice.chance(0.6)}
    return out


def _signal(dice: Dice, scale: Scale) -> dict[str, Any]:
    """A waveform of any kind, of some 8 V, at about the frequency of the structure."""
    f = scale.frequency * dice.log(0.2, 2.0)
    short = dice.log(dice.ranges.abrupt, 0.5) / f
    volts = dice.rng.uniform(-8.0, 8.0, 4).tolist()
    cycle = {"amplitude": 8.0, "frequency": f, "phase": dice.between(0.0, 6.0), "offset": dice.one_of([0.0, 4.0, 8.0])}
    sweep = {"amplitude": 8.0, "start_frequency": 0.5 * f, "stop_frequency": 2.0 * f, "duration": 4.0 / f}
    cubic = dice.chance(0.5)  # a spline through steps would swing far beyond them
    times = np.cumsum([0.1 / f, 0.6 / f if cubic else short, 1.3 / f, 0.7 / f]).tolist()
    return dice.one_of(
        [
            {"kind": "constant", "level": 8.0},
            {"kind": "sine", **cycle},
            {"kind": "square", **cycle, "duty": dice.between(0.05, 0.95)},
            {"kind": "ramped_square", **cycle, "duty": min(short * f, 1.0)},
            {"kind": "ramp", "start": volts[0], "stop": 8.0, "duration": dice.one_of([short, 2.0 / f])},
            {"kind": "on_off", "levels": volts, "durations": [0.5 / f, short, 0.3 / f, 1.1 / f]},
            {"kind": "poling", "level": 8.0, "hold": 1.0 / f, "fall": dice.one_of([0.0, short])},
            {"kind": "swept_sine", **sweep},
            {"kind": "sampled", "times": times, "levels": volts, "interpolation": "cubic" if cubic else "linear"},
        ]
    )


def _ground(dice: Dice, scale: Scale, legged: bool = False, heavy: bool = False) -> dict[str, Any]:
    """The laws of the ground, each there or not; sometimes a user's in place of a built-in one. heavy: with gravity."""
    ranges = dice.ranges
    out: dict[str, Any] = {}
    own: dict[str, Any] = {}

    def law(share: float, slot: str, own_kind: str, **values: float) -> None:
        if not dice.chance(share):
            return
        if own_kind and dice.chance(0.2):
            own[own_kind] = OWN[own_kind](**values)
        else:
            out[slot] = values

    damper = 2.0 * scale.mass * scale.rate
    thickness = dice.log(*ranges.thickness) * (scale.length if ranges.relative else 1.0)
    offset = scale.length * dice.log(0.3, 3.0)
    law(0.9, "restitution", "own_rebound", coefficient=_restitution(dice))
    law(0.4, "film", "own_film", coefficient=damper * thickness**3 * dice.log(*ranges.film), thickness=thickness)
    attraction = dice.log(*ranges.attraction) * scale.force * offset**2 / 64.0
    law(0.3, "electrostatic", "own_electrostatic", coefficient=attraction, offset=offset)
    strength = 0.0 if dice.odd() else dice.log(*ranges.adhesion) * scale.force
    law(0.5, "adhesion", "own_latch", initial=strength, rate=dice.log(*ranges.adhesion) * scale.force * scale.frequency)
    if dice.chance(0.1):
        own["magnet"] = OWN["magnet"](strength=attraction * 64.0 * offset**2, depth=offset)
    if dice.chance(0.1):
        own["drag"] = OWN["drag"](coefficient=damper * dice.log(1e-2, 1.0), height=scale.length)
    if dice.chance(0.2) and "electrostatic" in out:
        out["leg_electrostatic"] = {"coefficient": 0.3 * attraction, "offset": offset, "rest": scale.length}
    if dice.chance(0.4) or legged or heavy:
        out["gravity"] = {"acceleration": 9.81 if ranges.long else scale.rate**2 * scale.length * dice.log(0.05, 0.5)}
    if dice.chance(0.3):
        first = {"kind": "restitute_first", "speed": scale.length * scale.rate * dice.log(1e-2, 1.0)}
        out["landing"] = dice.one_of([first, {"kind": "pull_as_printed"}])
    if legged and dice.chance(0.8):
        adhesive = dice.chance(0.3) and ("adhesion" in out or "own_latch" in own)
        bound = 0.0 if dice.odd() else dice.log(*ranges.friction)
        out["friction"] = {"kind": "adhesive" if adhesive else "coulomb", "coefficient": bound}
    return out | ({"own": own} if own else {})


def _restitution(dice: Dice) -> float:
    ends = dice.ranges.ends
    if ends and dice.chance(ends):
        return dice.one_of([0.0, 0.0, 1.0, 1.0, 1.0 - dice.log(1e-9, 1e-2), dice.log(1e-9, 1e-2)])
    return dice.one_of([0.0, 1.0, 0.5]) if dice.odd() else dice.between(0.1, 0.9)


def _impact_map(dice: Dice, structure: dict[str, Any], feet: dict[str, Any], rows: np.ndarray) -> dict[str, Any]:
    """A map that is not mass-weighted: of one mode, or where coordinates are points any."""
    if structure["kind"] == "modal" or dice.chance(0.5):
        return {"kind": "dominant_mode"}
    columns = {}
    for (name, foot), row in zip(feet.items(), rows, strict=True):
        way = row + 0.3 * dice.rng.normal(size=len(row))
        columns[name] = dict(zip(structure["coordinates"], (foot["normal"] * way / (row @ way)).tolist(), strict=True))
    return {"kind": "given", "columns": columns}


def _duration(dice: Dice, scale: Scale) -> float:
    return 20.0 if dice.chance(dice.ranges.long) else dice.log(*dice.ranges.cycles) / scale.frequency


def _legged(dice: Dice, name: str) -> Scene:
    """A body on legs, each with its own foot, most of them driven."""
    ranges, scale = dice.ranges, _scale(dice)
    legs, drives, feet, signals = {}, {}, {}, {}
    count = dice.one_of(ranges.legs)
    stiff = scale.mass * scale.rate**2
    reach = dice.log(10.0, 1e3) * max(scale.length, 1e-7)

    def spring(size: float) -> dict[str, float]:
        k = stiff * dice.log(0.5, 2.0)
        vertical = {"stiffness_v": k, "damping_v": 2.0 * math.sqrt(k * scale.mass) * _ratio(dice)}
        k *= size
        loose = dice.chance(0.3 * ranges.odd)
        lateral = {"stiffness_l": 0.0 if loose else k, "damping_l": 2.0 * math.sqrt(k * scale.mass) * _ratio(dice)}
        return vertical | lateral

    gaps = _gaps(dice, scale, count)
    alike = spring(1.0) if dice.odd() else None
    for i in range(count):
        leg = f"l{i}"
        legs[leg] = {
            "x": reach * (i // 2 - (count - 1) / 4),
            "y": 0.4 * reach * (-1) ** i,
            "z": -0.1 * reach,
            "mass": scale.mass * dice.log(0.5, 2.0),
            **(alike or spring(dice.log(0.3, 3.0))),
        }
        if dice.chance(0.1):
            continue  # a leg that just swings, or stands
        weights = {leg: 1.0, f"{leg}_hip": -1.0}
        if dice.chance(0.6):
            weights |= {f"{leg}_x": 0.7, f"{leg}_hip_x": -0.7}
        drives[leg] = _drive(dice, scale, {"kind": "point", "weights": weights})
        if not dice.chance(0.1):
            signals[leg] = _signal(dice, scale)
    for i, leg in enumerate(legs):
        if i < 1 or not dice.chance(0.1):
            feet[leg] = {"point": leg, "gap": gaps[i]}
    heavy = scale.mass * count * dice.log(0.5, 20.0)
    body: dict[str, float] = {"mass": heavy}
    if dice.chance(0.6):
        body |= {"roll_inertia": 0.1 * heavy * reach**2, "pitch_inertia": 0.2 * heavy * (reach * count / 4) ** 2}
    ground = _ground(dice, scale, legged=True)
    if ground.get("electrostatic") and drives:
        for leg, foot in feet.items():
            foot["electrode"] = leg if leg in drives else next(iter(drives))
    else:
        ground.pop("electrostatic", None)
        ground.pop("leg_electrostatic", None)
    made = {
        "name": name,
        "duration": _duration(dice, scale),
        "ground": ground,
        "signals": signals,
        "robot": {"structure": {"kind": "walker", "body": body, "legs": legs}, "drives": drives, "feet": feet},
    }
    return _valid(made)
