"""Runs of the library against those of the second simulator, event by event, as far as rounding lets them.

How far that is, is measured: the library runs the scene once more with every rest gap raised by `NUDGE` of the length
to which its tolerances refer, as much as a step may err. How far an event moves then is how much an error of that size
makes of itself up to there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import tarsus as ts
from independent.simulator import BEGIN_STICK, Found, simulate
from tarsus.model.scene import Scene

NUDGE = 1e-10
FAR = 1e-5
"""Events that the nudge moves by more, in radians of the fastest mode, end the comparison: it has grown 1e5 times."""
LEAST = 2e-9
"""Times [radians of the fastest mode] and states (of length and rate) agree to this at least, or to `TIMES` of what the
nudge moves them."""
TIMES = 20.0


@dataclass(frozen=True)
class Comparison:
    """compared: so many of the ``events`` are the same, the rest lies beyond the horizon; wrong: what is not."""

    events: int
    compared: int
    wrong: str | None


def nudged(scene: Scene, by: float) -> Scene:
    """The scene with its feet higher above the ground by a length [m]; those on it stay there."""
    changes = {
        f"robot.feet.{name}.gap": foot.gap + by for name, foot in scene.robot.feet.items() if foot.gap > 0.0
    }
    return ts.with_values(scene, changes) if changes else scene


def compare(
    scene: Scene, accuracy: ts.Accuracy | None = None, least: float = LEAST, stops: float = 0.0
) -> Comparison:
    """Simulate a scene three times, and say what differs within the horizon by more than ``least``, of the begin of
    sticking by more than ``stops``, and the nudge."""
    run = ts.simulate(scene, accuracy=accuracy)
    assert run.ok, run.code
    length, rate = run.plan.length, run.plan.rate
    moved = ts.simulate(nudged(scene, NUDGE * length), accuracy=accuracy)
    found = simulate(
        scene, max(length, *(foot.gap for foot in scene.robot.feet.values()))
    )  # no flights: by the widest
    events, others = run.events, moved.events
    known = len(found.events)
    for i, event in enumerate(events):
        if i >= len(others) or any(others[i][part] != event[part] for part in ("foot", "kind")):
            return Comparison(len(events), i, None)
        off = abs(others[i]["time"] - event["time"]) * rate
        if off > FAR:
            return Comparison(len(events), i, None)
        if i >= known:
            return Comparison(
                len(events), i, f"event {i} of foot {event['foot']}, kind {event['kind']}, is not there"
            )
        time, foot, kind = found.events[i]
        if (foot, kind) != (event["foot"], event["kind"]):
            return Comparison(
                len(events),
                i,
                f"event {i} at {event['time']}: {event['foot'], event['kind']} is {foot, kind}",
            )
        wrong = abs(time - event["time"]) * rate
        if wrong > max(least, stops * (kind == BEGIN_STICK)) + TIMES * off:
            return Comparison(
                len(events), i, f"event {i} is off by {wrong:.1e} rad, where the nudge moves it {off:.1e}"
            )
    if known != len(events):
        return Comparison(len(events), known, f"{known - len(events)} events more at the end")
    return Comparison(len(events), len(events), state_differs(run, moved, found))


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
