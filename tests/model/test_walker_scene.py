"""Walkers in scenes: what a gait sends to which drive, and every bad scene refused in a sentence with its path."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import tomlkit

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.files.toml import parse_scene
from tarsus.model.drive.gait import Reach
from tarsus.model.robot import ModalLoad
from tarsus.model.scene import Scene

BASE = """
name = "two legs"
duration = "0.1 s"

[robot.structure]
kind = "walker"
body = { mass = "0.2 mg" }

[robot.structure.legs]
a = { mass = "1 ug", stiffness_v = 1.2, damping_v = "1 mN s/m", stiffness_l = "1.2 N/m", damping_l = 4e-4 }
b = { mass = "1 ug", stiffness_v = 1.2, damping_v = "1 mN s/m", stiffness_l = "1.2 N/m", damping_l = 4e-4 }

[robot.drives.a]
load = { kind = "point", weights = { a = -1.0, a_hip = 1.0, a_x = -1.0, a_hip_x = 1.0 } }
law = { kind = "linear", gain = "1.5 uN/V" }
capacitance = "0.4 nF"

[robot.drives.b]
load = { kind = "point", weights = { b = -1.0, b_hip = 1.0 } }
law = { kind = "linear", gain = "1.5 uN/V" }

[robot.drives.b_way]
load = { kind = "point", weights = { b_x = -1.0, b_hip_x = 1.0 } }
law = { kind = "linear", gain = "1.5 uN/V" }

[robot.feet]
a = { point = "a", gap = "0 um" }
b = { point = "b", gap = "1 um" }

[ground]
gravity = { acceleration = "9.81 m/s^2" }
friction = { coefficient = 0.4 }

[gait]
kind = "alternating"
frequency = "50 Hz"
high = "14 V"
"""


def table() -> dict[str, Any]:
    return tomllib.loads(BASE)


def put(path: str, value: Any) -> Callable[[dict[str, Any]], None]:
    """Sets, or with None removes, what stands at a path of the raw tables."""

    def change(tables: dict[str, Any]) -> None:
        *parents, last = path.split(".")
        for key in parents:
            tables = tables.setdefault(key, {})
        if value is None:
            del tables[last]
        else:
            tables[last] = copy.deepcopy(value)

    return change


def refusals(*changes: Callable[[dict[str, Any]], None]) -> list[str]:
    """Problems of the file, among them those of the same scene built from Python, which is looked at once only."""
    tables = table()
    for change in changes:
        change(tables)
    with pytest.raises(InputError) as from_file:
        parse_scene(tomlkit.dumps(tables))
    with pytest.raises(InputError) as from_python:
        Scene(**tables)
    assert {f"Scene.{one}" for one in from_file.value.problems} >= set(from_python.value.problems)
    return from_file.value.problems


def test_drives_are_known_by_what_they_move() -> None:
    scene = parse_scene(BASE)
    layout = scene.robot.layout()
    assert layout.hips == {"a": (0.0, 0.0), "b": (0.0, 0.0)}
    assert layout.drives == {"a": Reach(("a",)), "b": Reach(("b",)), "b_way": Reach(("b",), lateral=True)}
    volts = {name: wave.volts(np.array([2.5, 7.5, 12.5, 17.5]) * 1e-3) for name, wave in scene.waveforms.items()}
    assert {name: list(v) for name, v in volts.items()} == {
        "a": [14.0, 14.0, 0.0, 0.0],
        "b": [0.0, 0.0, 14.0, 14.0],
        "b_way": [14.0, 0.0, 0.0, 14.0],
    }


def test_loads_by_coordinate_and_loads_that_move_no_foot() -> None:
    scene = parse_scene(BASE)
    law = {"kind": "linear", "gain": 1e-6}
    drives = {
        "both": {"load": ModalLoad(participation=[0, 2, 0, -1, 0, -1]), "law": law},
        "along": {"load": ModalLoad(participation=[1, 0, 0, 0, -1, 0]), "law": law},
        "hips": {"load": {"kind": "point", "weights": {"body": -1.0, "a_hip": 1.0}}, "law": law},
        "dead": {"load": {"kind": "point", "weights": {"a": 0.0}}, "law": law},
    }
    other = ts.with_values(scene, {"gait": None, "robot.drives": drives})
    assert other.robot.layout().drives == {
        "both": Reach(("a", "b")),
        "along": Reach(("b",), lateral=True),
        "hips": Reach(()),
        "dead": Reach(("a",)),
    }


def test_signals_prevail_over_the_gait_and_add_to_it() -> None:
    scene = parse_scene(BASE)
    assert scene.signals == {} and set(scene.waveforms) == {"a", "b", "b_way"}
    held = ts.with_values(scene, {"signals.b": ts.Constant(level=3.0)})
    assert held.waveforms["b"] == ts.Constant(level=3.0)
    assert {name: held.waveforms[name] for name in ("a", "b_way")} == {
        name: scene.waveforms[name] for name in ("a", "b_way")
    }
    without = ts.with_values(held, {"gait": None})
    assert without.waveforms == {"b": ts.Constant(level=3.0)}


BLOCK = {
    "structure": {"kind": "lumped", "coordinates": ["a"], "mass": ["1 ug"], "stiffness": ["1 N/m"]},
    "feet": {"a": {"point": "a", "gap": 0.0}},
}
BAD: dict[str, tuple[list[Callable[[dict[str, Any]], None]], dict[str, str]]] = {
    "a foot below the ground": (
        [put("robot.feet.a.gap", "-1 um"), put("robot.structure.legs.b.mass", "-1 ug")],
        {"robot.structure.legs.b.mass": "above 0, got -1 ug", "robot.feet.a.gap": "foot below ground at rest"},
    ),
    "no legs": ([put("robot.structure.legs", {})], {"robot.structure.legs": "at least one leg"}),
    "no feet": ([put("robot.feet", None)], {"robot.feet": "at least one foot"}),
    "a gait with a missing and an unknown leg": (
        [put("gait.kind", "free"), put("gait.phases", {"a": 0.0, "c": 0.5})],
        {"gait.phases.c": "no leg 'c'", "gait.phases": "leg 'b' has no phase"},
    ),
    "a ground above, a hip, a body and a way as feet": (
        [
            put("robot.feet.a.normal", -1),
            put("robot.feet.b.point", "b_hip"),
            put("robot.feet.c", {"point": "body", "gap": 0.0}),
            put("robot.feet.d", {"point": "b_x", "gap": 0.0}),
            put("robot.feet.e", {"point": "bb", "gap": 0.0}),
        ],
        {
            "robot.feet.e.point": "did you mean 'b'",
            "robot.feet.a.normal": "expected 1, got -1",
            "robot.feet.b.point": "got 'b_hip'; did you mean 'b'",
            "robot.feet.c.point": "got 'body'",
            "robot.feet.d.point": "got 'b_x'",
        },
    ),
    "two feet on one leg": ([put("robot.feet.b.point", "a")], {"robot.feet.b.point": "has a foot already"}),
    "no walker": ([put("robot", BLOCK)], {"gait": "", "ground.friction": ""}),
    "all at once": (
        [
            put("gait.kind", "tripod"),
            put("ground.impact", {"kind": "dominant_mode"}),
            put("initial.displacement", [0.0, 0.0, 0.0, -1e-6, 0.0, 0.0]),
            put("signals.c", {"kind": "constant", "level": "1 V"}),
        ],
        {"signals.c": "", "initial.displacement": "", "gait.kind": "six legs", "ground.impact": ""},
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_scenes(name: str) -> None:
    changes, words = BAD[name]
    said = dict(one.split(": ", 1) for one in refusals(*changes))
    assert list(said) == list(words)
    assert [path for path, word in words.items() if word not in said[path]] == []
