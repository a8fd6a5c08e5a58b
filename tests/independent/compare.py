"""Runs of the library against those of the second simulator, event by event, as far as rounding lets them.

How far that is, is measured: the library runs the scene once more with every rest gap raised by `NUDGE` of the length
to which its tolerances refer, as much as a step may err. How far an event moves then is how much an error of that size
makes of itself up to there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import tarsus as ts
from independent.simulator import Found, simulate
from tarsus.model.scene import Scene
from tarsus.solve import ResultCode

NUDGE = 1e-10
FAR = 1e-5
"""Events that the nudge moves by more, in radians of the fastest mode, end the comparison: it has grown 1e5 times."""
LEAST = 2e-9
"""Times [radians of the fastest mode] and states (of length and rate) agree to this at least, or to `TIMES` of what the
nudge moves them."""
TIMES = 20.0


@dataclass(frozen=True)
class Comparison:
    """compared: so many of the ``events`` are the same, the rest lies beyond the horizon; wrong: what is not.
    undetermined: there is a difference, but the motion has not said what each foot bears (`Found`)."""

    events: int
    compared: int
    wrong: str | None
    undetermined: bool = False


def nudged(scene: Scene, by: float) -> Scene:
    """The scene with its feet higher above the ground by a length [m]; those on it stay there."""
    changes = {f"robot.feet.{name}.gap": foot.gap + by for name, foot in scene.robot.feet.items() if foot.gap > 0.0}
    return ts.with_values(scene, changes) if changes else scene


def compare(scene: Scene, accuracy: ts.Accuracy | None = None, least: float = LEAST, stops: float = 0.0) -> Comparison:
    """Simulate a scene three times, and say what differs within the horizon by more than ``least`` and the
    nudge. A run that friction jams is one where it does so here."""
    run = ts.simulate(scene, accuracy=accuracy)
    jammed = run.code is ResultCode.JAMMED
    assert run.ok or jammed, run.code
    length, rate = run.plan.length, run.plan.rate
    moved = ts.simulate(nudged(scene, NUDGE * length), accuracy=accuracy)
    found = simulate(scene, max(length, *(foot.gap for foot in scene.robot.feet.values())))  # no flights: by the widest
    at_once = LEAST / rate
    events, others = (in_order(one.events, one.events["time"], one.events["foot"], at_once) for one in (run, moved))
    known = len(found.events)
    seen = in_order(found.events, [one[0] for one in found.events], [one[1] for one in found.events], at_once)

    def ends(i: int, wrong: str) -> Comparison:
        shared = found.undetermined <= (events[i]["time"] if i < len(events) else run.end_time) * (1.0 + 1e-12)
        return Comparison(len(events), i, None if shared else wrong, shared)

    for i, event in enumerate(events):
        if i >= len(others) or any(others[i][part] != event[part] for part in ("foot", "kind")):
            return Comparison(len(events), i, None)
        off = abs(others[i]["time"] - event["time"]) * rate
        if off > FAR:
            return Comparison(len(events), i, None)
        if i >= known:
            return ends(i, f"event {i} of foot {event['foot']}, kind {event['kind']}, is not there")
        time, foot, kind = seen[i]
        if (foot, kind) != (event["foot"], event["kind"]):
            return ends(i, f"event {i} at {event['time']}: {event['foot'], event['kind']} is {foot, kind}")
        wrong = abs(time - event["time"]) * rate
        if wrong > least + TIMES * off:
            return ends(i, f"event {i} is off by {wrong:.1e} rad, where the nudge moves it {off:.1e}")
    if known != len(events):
        return ends(len(events), f"{known - len(events)} events more at the end")
    if jammed != found.jammed:
        return ends(len(events), f"it jams: {jammed}, here: {found.jammed}")
    if jammed:
        return Comparison(len(events), len(events), None)
    return Comparison(len(events), len(events), state_differs(run, moved, found))


def in_order(events: Sequence[Any], times: Sequence[float], feet: Sequence[int], at_once: float) -> list[Any]:
    """Events with those of one moment [s] in the order of feet, and of one foot as they are."""
    moments, first = [], -np.inf
    for time in times:
        first = first if time - first <= at_once else time
        moments.append(first)
    return [events[k] for k in sorted(range(len(events)), key=lambda k: (moments[k], feet[k]))]


def state_differs(run: ts.Run, moved: ts.Run, found: Found) -> str | None:
    """Whether the states at the end differ by more than the nudge explains."""
    one, other = (end_of(made) for made in (run, moved))
    n, length, rate = len(one) // 2, run.plan.length, run.plan.rate
    scale = np.concatenate([np.full(n, length), np.full(n, length * rate)])
    off, wrong = np.abs(other - one) / scale, np.abs(found.state - one) / scale
    size = LEAST * max(1.0, float(np.abs(one / scale).max()))
    if off.max() > FAR or np.all(wrong <= size + TIMES * off.max()):
        return None
    return f"the state at the end is off by {wrong.max():.1e}, where the nudge moves it {off.max():.1e}"


def end_of(run: ts.Run) -> np.ndarray:
    """Displacements and velocities (2n,) at the end of a run."""
    state = run.at(np.array([run.end_time])).state
    return np.concatenate([state.x[:, 0], state.v[:, 0]])
