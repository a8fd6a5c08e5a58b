"""Scenes of the tests, by file name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import tarsus as ts
from tarsus.base.events import EventKind
from tarsus.base.spec import validate

SCENES = Path(__file__).parent / "scenes"


def scene(name: str, values: dict[str, Any] | None = None) -> ts.Scene:
    """The scene in ``tests/scenes/<name>.toml`` with some values changed."""
    read = ts.read_scene(SCENES / f"{name}.toml")
    return ts.with_values(read, values) if values else read


def impacts(events: np.ndarray) -> np.ndarray:
    """Bounces and captures: what the reference sequences count."""
    return events[np.isin(events["kind"], (1, 2))]


def creeping(**changes: Any) -> ts.Scene:
    """The cantilever's drive with a plain hysteresis, an element near a step's length and creep of a second."""
    law = {
        "kind": "creeping",
        "instant": {"linear": 8e-7, "thresholds": [1.0, 2.0], "weights": [2e-7, 1e-7]},
        "thresholds": [0.0, 1.5],
        "weights": [1e-7, 1e-7],
        "times": [2e-3, 1.0],
    }
    plain = {"robot.drives.pzt.history": (), "provenance": {}}
    return ts.with_values(ts.load_scene("cantilever", wave="square"), {"robot.drives.pzt.law": law | changes, **plain})


def balls(**changes: Any) -> ts.Scene:
    """Two balls that know nothing of each other, the second on a ground of its own."""
    structure = ts.Lumped(coordinates=("a", "b"), mass=[1.0, 2.0], stiffness=[0.0, 0.0])
    feet = {"a": ts.Foot(point="a", gap=1.0), "b": ts.Foot(point="b", gap=1.0, ground="soft")}
    values: dict[str, Any] = {
        "ground": {"restitution": {"coefficient": 0.8}, "gravity": {"acceleration": 9.81}},
        "grounds": {"soft": {"restitution": {"coefficient": 0.3}}},
        "duration": 2.5,
    }
    return ts.Scene(name="balls", robot=ts.Robot(structure=structure, feet=feet), **(values | changes))


def one_mode(frequency: float, damping_ratio: float, mass: float) -> dict[str, Any]:
    """A structure of one mode, with a point A."""
    numbers = {"frequencies": [frequency], "damping_ratios": [damping_ratio], "modal_masses": [mass]}
    return {"kind": "modal", **numbers, "shapes": {"A": [1.0]}}


def pushed(structure: dict[str, Any], point: str, duration: float, signal: dict[str, Any]) -> ts.Scene:
    """A structure without feet, pushed by a drive of 1 N/V."""
    drive = {"load": {"kind": "point", "weights": {point: 1.0}}, "law": {"kind": "linear", "gain": 1.0}}
    robot = {"structure": structure, "drives": {"d": drive}, "feet": {}}
    return validate(ts.Scene, {"name": "pushed", "duration": duration, "robot": robot, "signals": {"d": signal}})


def of_kind(run: ts.Run, *kinds: EventKind) -> np.ndarray:
    """The events of a run that are of these kinds."""
    return run.events[np.isin(run.events["kind"], kinds)]
