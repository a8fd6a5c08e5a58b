"""Every kind of part that a scene may have comes back from its file as it was, and is written the same again."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import tarsus as ts
from drive_cases import PRINTED, WAVEFORMS
from example_laws import EXAMPLES, OWN
from printed_robots import hexapod, printed_map
from scene_files import balls, creeping, scene
from tarsus.base.messages import alternatives, kind_of
from tarsus.base.spec import float_paths
from tarsus.files.library import device_names
from tarsus.files.toml import parse_scene, scene_text
from tarsus.model.drive.gait import AnyGait
from tarsus.model.drive.laws import ForceLaw, PrandtlIshlinskii
from tarsus.model.drive.waveforms import Sampled, Waveform
from tarsus.model.laws import FrictionLaw, Law
from tarsus.model.laws.impact_map import AnyImpactMap
from tarsus.model.profile import AnyProfile
from tarsus.model.scene import Scene
from tarsus.model.structure import AnyStructure
from turning_scenes import turning_walk
from walking_scenes import trotter

Made = dict[str, Callable[[], Scene]]


def beam(**values: Any) -> Scene:
    """The cantilever with other values; two underscores stand for the dot of a path."""
    paths = {path.replace("__", "."): value for path, value in values.items()}
    return ts.with_values(ts.load_scene("cantilever"), paths | {"provenance": {}})


def six(**gait: Any) -> Scene:
    """A robot of six legs with another gait."""
    made = ts.load_scene("hexapod-walker").model_copy(update={"provenance": {}})
    legs = made.robot.structure.legs
    phases = {"phases": {leg: i / len(legs) for i, leg in enumerate(legs)}} if gait["kind"] == "free" else {}
    return ts.with_values(made, {"gait": {"frequency": 50.0, "high": "14 V"} | gait | phases})


def on(law: Law) -> Scene:
    """A scene whose ground has the law, in its slot or by its name."""
    if isinstance(law, FrictionLaw):
        walker = ts.load_scene("millipede").model_copy(update={"provenance": {}})  # of other friction
        return ts.with_values(walker, {"ground.friction": law})
    base = scene("sticky_feet" if law.needs_electrode else "damped_chain")
    slotted = law.name() in ("film", "electrostatic", "leg_electrostatic", "adhesion", "restitution")
    return ts.with_values(base, {f"ground.{law.name()}": law} if slotted else {"ground.laws": {law.name(): law}})


def many() -> Scene:
    """Eight masses, whose stiffnesses have no last digit."""
    stiffness = (2.0 * np.eye(8) - np.eye(8, k=1) - np.eye(8, k=-1)) / 3.0
    structure = ts.Lumped(coordinates=[f"m{k}" for k in range(8)], mass=["1 mg"] * 8, stiffness=stiffness)
    return Scene(
        name="many", duration=1.0, robot=ts.Robot(structure=structure, feet={"a": ts.Foot(point="m0", gap=0.0)})
    )


def other_digits() -> Scene:
    device, rng = ts.load_scene("cantilever"), np.random.default_rng(1)
    return ts.with_values(device, {p: one.value * rng.uniform(1.0, 1.1) for p, one in float_paths(device).items()})


LONG = Sampled(times=tuple(0.1 * k for k in range(200)), levels=tuple(1 / (k + 1) for k in range(200)))
PROFILES = {
    "polyline": {"given": [[0.0, 0.0], [1e-3, 1e-6]]},
    "staircase": {"tread": 1e-3, "rise": 1e-7, "friction": [1.0, 0.5]},
    "pits": {"spacing": 3e-4, "width": 1.2e-4, "depth": 2e-8},
    "sawtooth": {"length": 9e-5, "height": 2e-7},
    "random": {"seed": 3, "rms": 2e-7, "correlation_length": 3e-5, "spacing": 1.3e-5, "facets": 64},
    "feet": {"feet": {side: {"kind": "sawtooth", "length": 9e-5, "height": 2e-7} for side in ("left", "right")}},
}
SHIFT = {"displacement": {"kind": "sine", "amplitude": 1e-6, "frequency": 100.0}}
RULES = ({"kind": "capture_unless_pulled"}, {"kind": "restitute_first", "speed": 0.02}, {"kind": "pull_as_printed"})
SCENES: Made = {
    **{name: lambda name=name: ts.load_scene(name) for name in device_names()},
    **{f"signal, {name}": lambda wave=wave: beam(signals__pzt=wave) for name, wave in WAVEFORMS.items()},
    "signal, long": lambda: beam(signals__pzt=LONG),
    **{f"gait, {kind_of(one)}": lambda one=one: six(kind=kind_of(one)) for one in alternatives(AnyGait)},
    **{f"law, {law.name()}": lambda law=law: on(law) for law in EXAMPLES},
    **{f"rule, {rule['kind']}": lambda rule=rule: beam(ground__landing=rule) for rule in RULES},
    "impact, mass-weighted": lambda: ts.with_values(trotter(2), {"ground.impact": {"kind": "mass_weighted"}}),
    "impact, measured": lambda: hexapod(signal=WAVEFORMS["sine"], impact=printed_map()),
    "impact, mode": lambda: hexapod(signal=WAVEFORMS["sine"], impact=ts.laws.DominantMode(mode=2)),
    "drive, branches": lambda: beam(robot__drives__pzt__law=PRINTED),
    "drive, plays": lambda: beam(
        robot__drives__pzt__law=PrandtlIshlinskii(linear=1e-6, thresholds=(1.0, 2.0), weights=(1e-7, 2e-7))
    ),
    "drive, creep": creeping,
    "drive, amplifier": lambda: beam(
        robot__drives__pzt__amplifier={"slew_rate": "10 V/ms", "bandwidth": "1 kHz", "clip": ["-5 V", "7 V"]}
    ),
    **{
        f"profile, {kind}": lambda kind=kind, of=of: ts.with_values(trotter(2), {"ground.profile": {"kind": kind} | of})
        for kind, of in PROFILES.items()
    },
    "ground that moves": lambda: ts.with_values(trotter(2), {"ground.motion": {"normal": SHIFT, "along": SHIFT}}),
    "grounds by foot": balls,
    "legs that move across": lambda: turning_walk(1),
    "start, standing": lambda: ts.with_values(trotter(2), {"initial": {"standing": {}}}),
    "start, standing under its volts": lambda: ts.with_values(trotter(2), {"initial.standing": {"driven": True}}),
    "many masses": many,
    "other digits": other_digits,
}


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_comes_back_from_its_file(name: str) -> None:
    made = SCENES[name]()
    text = scene_text(made)
    again = parse_scene(text, laws=OWN)
    assert again == made and scene_text(again) == text


def kinds(part: Any) -> Iterator[str]:
    """Of a description, and of all in it."""
    for value in part.values() if isinstance(part, dict) else part if isinstance(part, (list, tuple)) else ():
        yield from kinds(value)
    if isinstance(part, dict) and isinstance(part.get("kind"), str):
        yield part["kind"]


def test_every_kind_is_among_them() -> None:
    """But the structure of bars and joints and ground from a file, which are written in tests of their own."""
    found = {kind for make in SCENES.values() for kind in kinds(make().model_dump())}
    every = (AnyGait, ForceLaw, Waveform, AnyImpactMap, AnyProfile, AnyStructure)
    assert {kind_of(one) for union in every for one in alternatives(union)} - found <= {"linkage", "file"}
