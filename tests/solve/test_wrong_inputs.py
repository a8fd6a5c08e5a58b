"""Wrong inputs of runs, batches, windows, sessions, derivatives and explorers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

import tarsus as ts
import wrong_inputs
from printed_robots import hexapod
from random_scenes import scene_of as random_scene
from scene_files import scene as scene_of
from tarsus.base.quantities import Quantity
from tarsus.plan.lowering import lower_scene
from tarsus.solve.contacts import Contacts
from tarsus.solve.explored import Explored
from tarsus.solve.outputs import Output, output_rows
from tarsus.solve.packet import packet_of
from tarsus.solve.run import increasing
from tarsus.solve.window import WindowStart, simulate_windows
from tarsus.study import bench
from walking_scenes import trotter

FILM, VOLTS, GAP = "ground.film.coefficient", "signals.pzt.amplitude", "robot.feet.tip.gap"
DRIVES = [f"signals.pzt.{one}" for one in ("amplitude", "frequency", "duty", "phase")]


def chain(vary: dict[str, Any], **changes: Any) -> wrong_inputs.Ask:
    """A batch of the chain of two masses."""
    made = ts.with_values(bench.chain(2), changes)
    return lambda at: ts.simulate_batch(made, vary, 0.01)


def batch(vary: dict[str, Any], **how: Any) -> wrong_inputs.Ask:
    return lambda at: ts.simulate_batch("cantilever", vary, "2 ms", **how)


def slope(name: str) -> wrong_inputs.Ask:
    return lambda at: ts.simulate(scene_of("ball"), 1.0, gradients=["robot.feet.ball.gap"]).gradient(name)


def seed(at: Path) -> object:
    ground = {"kind": "random", "seed": 3, "rms": 2e-7, "correlation_length": 3e-5, "spacing": 1e-5, "facets": 256}
    scene = ts.with_values(trotter(1), {"ground.profile": ground})
    return ts.simulate(scene, 1e-3, gradients=["ground.profile.seed"])


def masked(at: Path) -> object:
    sim = ts.Session("cantilever", 3)
    sim.reset()
    return sim.reset(robots=[True, False])


def restored(at: Path, content: bytes | None) -> object:
    """A session that goes on from a file: of these bytes, or of another robot's."""
    sim, other, file = ts.Session("cantilever"), ts.Session("hexapod"), at / "some.npz"
    if content is None:
        other.reset()
        other.save(file)
    elif content:
        file.write_bytes(content)
    return sim.restore(file)


def window(at: Path) -> object:
    held = Contacts(held=(0, 3), since=(0.0,), leaving=(0,))
    return simulate_windows(lower_scene(scene_of("p1_n2")), [WindowStart([0.0, np.nan], -1.0, [0.3, 0.1], held)])


def many_feet(at: Path) -> object:
    plans = ((one, lower_scene(one)) for one in map(random_scene, range(400)))
    return packet_of(next(one for one, plan in plans if plan.legs is None and len(one.robot.feet) > 8), 0.01)


def output(*outputs: tuple[Quantity, str]) -> wrong_inputs.Ask:
    return lambda at: output_rows(trotter(), [Output(*one) for one in outputs], [0.0])


def explored(*drives: str) -> Explored:
    return Explored.of(ts.load_scene("cantilever"), 0.02, drives=[*drives])


WRONG: dict[str, tuple[wrong_inputs.Ask, wrong_inputs.Said]] = {
    "device": (lambda at: ts.simulate("cantlever"), "did you mean 'cantilever'"),
    "unit of a duration": (lambda at: ts.simulate("cantilever", "10 mm"), ("duration: ", "'10 mm'")),
    "negative duration": (
        lambda at: ts.simulate("cantilever", "-10 ms"),
        "duration: expected a time above 0 s, got -0.01 s",
    ),
    "duration that is no number": (lambda at: ts.simulate("cantilever", math.nan), "expected a time above 0 s"),
    "time before the start": (lambda at: ts.simulate("cantilever", 0.01).at(np.array([-1e-3, 0.0])), "time"),
    "time after the end": (lambda at: ts.simulate("cantilever", 0.01).states([0.0, 0.02]), "one of 0.01 s, got 0.02 s"),
    "one time": (lambda at: increasing(0.01), "a row of times"),
    "times out of order": (lambda at: increasing([0.01, 0.005]), "in order"),
    "rows of two lengths": (batch({FILM: [4e-21] * 3, VOLTS: [8.0, 10.0]}), (f"has 3, {VOLTS} has 2", "grid=True")),
    "no run of a grid": (batch({FILM: [4e-21], VOLTS: []}, grid=True), "expected at least one run, got none"),
    "no number": (batch({FILM: [1e-21, math.nan]}), f"{FILM}: every value must be a finite number"),
    "a table": (batch({FILM: [[1e-21]]}), "expected a list of numbers, got an array of 2 dimensions"),
    "misspelt path": (batch({"robot.feet.tp.gap": ["70 um"]}), "robot.feet.tp.gap: unknown path; did you mean"),
    "unit of a value": (batch({GAP: ["70 V"]}), f"{GAP}: expected a length"),
    "measure of a batch": (
        lambda at: ts.simulate_batch("cantilever", {FILM: [4e-21]}, "2 ms").measure("peek"),
        "no measure 'peek'; did you mean 'peak'",
    ),
    "volts of a slot": (
        chain({"signals.pull.amplitude": [8.0, -1.0]}),
        "signals.pull.amplitude: expected a voltage (V) of at least 0",
    ),
    "gap of a slot": (chain({GAP: [1e-5, -1e-6]}), f"{GAP}: foot below ground at rest"),
    "two slots together": (
        chain(
            {GAP: [1e-5, 0.0], "initial.displacement.0": [0.0, -1e-6]},
            initial=ts.Initial(displacement=(0.0, 0.0), velocity=(0.0, 0.0)),
        ),
        "in run 1 foot 'tip'",
    ),
    "gait of a slot": (
        lambda at: ts.simulate_batch("millipede", {"gait.low": [0.0, 20.0]}, 0.01),
        "gait.high: the upper voltage 14 V is below the lower one",
    ),
    "measure of a derivative": (slope("contact_durations"), "there is no measure 'contact_durations'"),
    "term of a derivative": (slope("ledger.glue"), "no such term"),
    "derivative by half of a pair": (
        lambda at: ts.simulate(hexapod(signal=ts.Constant(level=-10.0)), 1e-4, gradients=["robot.structure.mass.0.1"]),
        "robot.structure.mass.0.1: there is no derivative by it, for it does not vary by itself",
    ),
    "derivative by a seed": (seed, "ground.profile.seed: there is no derivative by it"),
    "parts of a plan of its own": (
        lambda at: ts.Session("millipede").trajectories({"robot.structure.body.mass": [1e-7, 2e-7]}, 1.0),
        ("robot.structure", "makes a plan of its own"),
    ),
    "window": (
        window,
        (
            "state: expected 4 finite",
            "t0: expected",
            "times: expected",
            "no foot number 3",
            "cannot be held and be",
            "since: expected",
        ),
    ),
    "step before a reset": (lambda at: ts.Session("cantilever").step({"pzt": 1.0}), "call reset first"),
    "robots to reset": (masked, "robots: expected numbers below 3, or 3 truths"),
    "half a robot": (lambda at: ts.Session("cantilever", 2.5), "robots: expected one or more, got 2.5"),
    "session's file": (lambda at: restored(at, b"PK nothing"), "no file of a session"),
    "session's file that is gone": (lambda at: restored(at, b""), "some.npz"),
    "session's file of another": (lambda at: restored(at, None), "of another scene"),
    "outputs": (
        output((Quantity.CHARGE, "leg9"), (Quantity.ANGLE, "surge"), (Quantity.VELOCITY, "roll")),
        ("no drive 'leg9'", "no angle of a body 'surge'", "no point 'roll'"),
    ),
    "number of no drive": (lambda at: explored(FILM), f"{FILM}: is not a number that a drive takes"),
    "four numbers of drives": (lambda at: explored(*DRIVES), "3 numbers of drives at most"),
    "value that was not lowered": (
        lambda at: explored(VOLTS).place({VOLTS: 7.77777}),
        "none of the values that were lowered",
    ),
    "slider": (lambda at: explored(VOLTS).changed({"robot.structure.length": 1.0}), "there is no such slider"),
    "number of a scene": (
        lambda at: ts.explore("cantilever", duration=0.02, over={"robot.feet.toe.gap": (0.0, 1.0)}),
        "the scene has no such number",
    ),
    "feet of an explorer": (many_feet, "contact modes: an explorer holds 256"),
}


@wrong_inputs.cases(WRONG)
def test_wrong_input_is_a_sentence(ask: wrong_inputs.Ask, said: wrong_inputs.Said, tmp_path: Path) -> None:
    wrong_inputs.is_refused(ask, said, tmp_path)
