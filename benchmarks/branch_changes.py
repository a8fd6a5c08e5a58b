"""What branches find of the changes along a number, and what they invent: against plain runs and bisection.

    python benchmarks/branch_changes.py                     # ten ranges
    python benchmarks/branch_changes.py --ranges volts gap  # some of them

The truth knows no return map and no derivative. A run is carried along a fine grid of the number, up and down, and goes
on at each value until it repeats; where what it repeats is another class (period in drive periods, and sequence of
events) than at the value before, that is bisected. Whatever else a branch says happens is asked of plain runs on either
side of it. A doubling, beside which runs settle ever more slowly, is where a deviation changes sides and keeps its
size.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

import tarsus as ts
from tarsus.orbits.returns import FINE, drive_period
from tarsus.orbits.sequence import kept_events
from tarsus.solve import Shared
from tarsus.solve.contacts import earlier
from tarsus.solve.trajectories import Trajectories
from tarsus.solve.window import WindowStart, simulate_windows

SCENES = Path(__file__).parents[1] / "tests" / "scenes"
RANGES: dict[str, tuple[Any, str, float, float]] = {
    "volts": (SCENES / "early_cantilever.toml", "signals.pzt.amplitude", 8.0, 7.5),
    "volts-low": ("cantilever", "signals.pzt.amplitude", 6.5, 5.5),
    "gap": ("cantilever", "robot.feet.tip.gap", 60e-6, 62e-6),
    "restitution": ("cantilever", "ground.restitution.coefficient", 0.45, 0.5),
    "frequency": ("cantilever-1", "signals.pzt.frequency", 50.0, 53.0),
    "table": (SCENES / "vibrating_table.toml", "signals.table.amplitude", 1.45, 1.54),
    "shaker": (SCENES / "impact_oscillator.toml", "signals.shaker.amplitude", 0.095, 0.12),
    "shaker-hz": (SCENES / "impact_oscillator.toml", "signals.shaker.frequency", 0.15, 0.2),
    "millipede": ("millipede", "gait.high", 14.0, 14.5),
    "film": ("millipede", "ground.film.coefficient", 1.7e-24, 2.0e-24),
}
"""Scene, path, and both ends [SI]."""

GRID = 400
"""Values of a range at which a run is carried on."""
FINEST, NEAR = 1e-9, 1e-7
"""Shares of a range: to which a change is bisected, and within which two are one."""
DOUBLING = 1e-4
"""Share of a range to which plain runs tell a doubling: near it a deviation hardly changes in a thousand periods."""
EQUAL = 1e-8
"""Difference, of the motion's size, of periods that are equal: what windows' steps leave is a hundredth, and was taken
for doublings where it is a hundred times less."""
PHASE = 0.1234
"""Of the drive where periods are counted from: away from its edges, at which events are."""
CHUNK, MOST, MULTIPLE = 16, 6000, 8
"""Drive periods that a run goes on at a time, and at most; longest motion that is told from none."""

Class = tuple[int, tuple[tuple[int, int], ...]] | None
"""Period in drive periods and events of a motion that repeats."""


@dataclass(frozen=True)
class Motion:
    """A run at a value: its state (2n,) where the drives begin a period, what feet (m, k) carry on there as if that
    were at 0 s, and the class of what it repeats, None where it does not; marks (ne, 2): when its events are, in
    periods, and their approach speeds [m/s]."""

    at: float
    state: np.ndarray
    feet: np.ndarray
    kind: Class
    marks: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))


@dataclass
class Plain:
    """Plain runs of a scene that go on along one of its numbers."""

    scene: ts.Scene
    path: str
    ends: tuple[float, float]
    shared: Shared = field(init=False)
    runs: int = 0

    def __post_init__(self) -> None:
        self.shared = Shared(self.scene)
        self.longest = 4 * CHUNK * max(self.period(at) for at in self.ends)

    @property
    def span(self) -> float:
        """Length of the range."""
        return abs(self.ends[1] - self.ends[0])

    def period(self, at: float) -> float:
        """Period of the drives [s]."""
        return drive_period(ts.with_values(self.scene, {self.path: at}))

    def at(self, at: float) -> tuple[Trajectories, float]:
        """A run at a value from the scene's own start, and its drives' period [s]."""
        made = Trajectories.of(
            self.scene, {self.path: np.array([at])}, self.longest, accuracy=FINE, shared=self.shared
        )
        return made, self.period(at)

    def chunk(self, motion: Motion, count: int = CHUNK) -> tuple[Motion, np.ndarray, Any]:
        """So many periods: the motion behind them, states (count, 2n) at their ends, and events."""
        runs, period = self.at(motion.at)
        begin = (CHUNK + PHASE) * period
        runs.time[0], runs.state[0] = begin, motion.state
        runs.feet[0] = earlier(motion.feet, -begin)
        (window,) = runs.advance([begin + period * np.arange(1, count + 1)])
        states = np.concatenate([window.states.x, window.states.v]).T
        feet = earlier(runs.feet[0], float(window.times[-1]))
        events = window.events.copy()
        events["time"] = (events["time"] - begin) / period
        return Motion(motion.at, states[-1], feet, None), states, events

    def first(self, at: float) -> Motion:
        """The motion from the scene's own start on."""
        runs, period = self.at(at)
        begin = (CHUNK + PHASE) * period
        runs.advance([np.array([begin])])
        return self.settled(Motion(at, runs.state[0], earlier(runs.feet[0], begin), None), at)

    def of(self, orbit: ts.orbits.Orbit, at: float) -> Motion:
        """The motion of an orbit."""
        runs, _ = self.at(at)
        returns, n2 = orbit.map, len(runs.state[0])
        held = getattr(returns, "contacts_at", lambda state: returns.contacts)(orbit.state)
        end = (np.ceil(orbit.start / orbit.map.period - PHASE + 1e-9) + PHASE) * orbit.map.period
        start = WindowStart(orbit.state[:n2], orbit.start, [end], held)
        window = simulate_windows(runs.plan, [start], rows=runs.rows, shared=runs.tables, accuracy=FINE)[0]
        return Motion(at, window.end, earlier(window.feet, end), None)

    def settled(self, motion: Motion, at: float) -> Motion:
        """What a motion becomes at a value."""
        self.runs += 1
        motion, seen, again = replace(motion, at=at), [], False
        for _ in range(MOST // CHUNK):
            motion, states, events = self.chunk(motion)
            seen = [*seen[-1:], states]
            k = repeats(np.concatenate(seen), self.walks)
            if k and again:
                return replace(motion, **sequence(events, k))
            again = bool(k)
        return motion

    @property
    def walks(self) -> bool:
        """Whether the robot gets on, so that coordinates are those less its surge."""
        return hasattr(self.scene.robot.structure, "legs")

    def carried(self, values: np.ndarray) -> Iterator[tuple[Motion, Motion]]:
        """Changes of a run that is carried along values: the motions on both sides."""
        last = self.first(float(values[0]))
        for value in values[1:].tolist():
            while (ahead := self.settled(last, value)).kind != last.kind:
                low, high = last, ahead
                while abs(high.at - low.at) > FINEST * self.span:
                    middle = self.settled(low, 0.5 * (low.at + high.at))
                    low, high = (middle, high) if middle.kind == last.kind else (low, middle)
                yield low, high
                last = high
            last = ahead

    def doubling(self, one: Motion, k: int, near: float) -> float:
        """Where, near a value, the multiplier that doubles the period, k drive periods, of a motion is -1. Raises
        ValueError where it is so nowhere near."""
        reach, start = 1e-3 * self.span, one

        def multiplier(at: float) -> float:
            nonlocal start
            motion = replace(start, at=at)
            for _ in range(60):  # the mean of two returns, which the multiplier -1 leaves alone
                back = self.chunk(motion, k)[0]
                motion = replace(motion, state=0.5 * (motion.state + back.state))
            start = motion
            size, way = (
                np.abs(motion.state).max(),
                np.ones(len(motion.state)) * 1e-4 * np.abs(motion.state).max(),
            )
            for _ in range(40):
                up, down = (
                    self.chunk(replace(motion, state=motion.state + sign * way), k)[0].state
                    for sign in (1, -1)
                )
                out = 0.5 * (up - down)
                value = float(out @ way / (way @ way))
                way = out * 1e-4 * size / np.abs(out).max()
            return value + 1.0

        return float(brentq(multiplier, near - reach, near + reach, xtol=1e-10 * self.span))  # pyright: ignore[reportArgumentType]


def repeats(states: np.ndarray, walks: bool) -> int:
    """The smallest multiple at which states (count, 2n) at ends of periods repeat; 0 without one."""
    n = states.shape[1] // 2
    if walks:  # body and feet get on alike
        states = np.concatenate([np.diff(states[:, :n], axis=0), states[1:, n:]], axis=1)
    size = np.repeat([max(float(np.abs(part).max()), 1e-300) for part in (states[:, :n], states[:, n:])], n)
    for k in range(1, min(MULTIPLE, len(states) // 2) + 1):
        if (np.abs(states[-k:] - states[-2 * k : -k]) / size).max() <= EQUAL:
            return k
    return 0


def sequence(events: Any, k: int) -> dict[str, Any]:
    """Class and marks of the k periods before the last, from where the sequence is least."""
    kept = events[kept_events(events)]
    span = kept[(kept["time"] > CHUNK - k - 1e-9) & (kept["time"] <= CHUNK - 1e-9)]
    pairs = list(zip(span["foot"].tolist(), span["kind"].tolist(), strict=True))
    turned = min(range(max(len(pairs), 1)), key=lambda i: pairs[i:] + pairs[:i])
    marks = np.column_stack([span["time"] - CHUNK, span["speed_before"]])
    marks = np.roll(marks, -turned, axis=0)
    marks[len(marks) - turned :, 0] += k
    return {"kind": (k, tuple(pairs[turned:] + pairs[:turned])), "marks": marks}


def truth_of(plain: Plain) -> list[float]:
    """Where plain runs that are carried both ways change, in order."""
    found: list[float] = []
    for values in (np.linspace(*plain.ends, GRID + 1), np.linspace(*plain.ends[::-1], GRID + 1)):
        for low, high in plain.carried(values):
            multiples = [(one.kind or (0,))[0] for one in (low, high)]
            doubles = 0 in multiples or max(multiples) == 2 * min(multiples)
            at = 0.5 * (low.at + high.at)
            one = low if (low.kind or (9,))[0] < (high.kind or (9,))[0] else high
            if doubles and one.kind is not None:
                with suppress(ValueError):
                    at = plain.doubling(one, one.kind[0], at)
            found += [] if any(abs(at - one) <= NEAR * plain.span for one in found) else [at]
    return sorted(found)


def seen(plain: Plain, branch: ts.orbits.Branch, i: int) -> bool | None:
    """Whether plain runs on both sides of a special point of a branch differ; None where it is unstable on both."""
    here = branch.points[i]
    sides = [
        next((p for p in branch.points[i::step] if p.kind == "orbit" and p.at != here.at), None)
        for step in (-1, 1)
    ]
    told = None
    for one in sides:
        if one is None or not one.orbit.stable:
            continue
        if here.kind == "flip":
            with suppress(ValueError):
                at = plain.doubling(plain.of(one.orbit, one.at), one.orbit.multiple, here.at)
                told = told or abs(at - here.at) <= DOUBLING * plain.span
            continue
        step = np.sign(here.at - one.at) * NEAR * plain.span
        before = plain.settled(plain.of(one.orbit, one.at), here.at - 3.0 * step)
        near = plain.settled(before, here.at - step)
        beyond = plain.settled(near, here.at + step)
        told = told or near.kind != beyond.kind or jumps(before, near, beyond)
    return told


def jumps(*three: Motion) -> bool:
    """Whether marks move by far more from the second to the third of motions at equal distances than before."""
    (a, b, c) = (one.marks for one in three)
    if not len(a) == len(b) == len(c):
        return True
    before, after = (np.abs(y - x).max(axis=0, initial=0.0) for x, y in ((a, b), (b, c)))
    return bool((after > 100.0 * before + 1e-6 * np.abs(b).max(axis=0, initial=0.0)).any())


def judged(name: str) -> None:
    """One range: what is found, missed, invented, and how far off."""
    scene, path, *ends = RANGES[name]
    scene = ts.load_scene(scene) if isinstance(scene, str) else ts.read_scene(scene)
    clock = time.process_time()
    plain = Plain(scene, path, (ends[0], ends[1]))
    truth, took = truth_of(plain), time.process_time() - clock
    clock = time.process_time()
    found = ts.branch(scene, {path: (ends[0], ends[1])})
    took_branch = time.process_time() - clock
    special = [(one, i) for one in found for i, p in enumerate(one.points) if p.kind != "orbit"]
    places = np.array([one.points[i].at for one, i in special])
    off = np.array([np.abs(places - at).min(initial=np.inf) for at in truth]) / plain.span
    missed = [at for at, one in zip(truth, off, strict=True) if one > NEAR]
    print(f"{name}: {len(truth)} changes by {plain.runs} runs, {took:.0f} s of CPU time; "
          f"{len(found)} branches, {len(special)} special, {took_branch:.1f} s")  # fmt: skip
    print(
        f"  found {len(truth) - len(missed)}, largest error {off[off <= NEAR].max(initial=0.0):.1e} of the range"
    )
    print("  missed", missed)
    others = [(one, i) for (one, i), at in zip(special, places, strict=True)
              if not np.isclose(at, truth, rtol=0.0, atol=NEAR * plain.span).any()]  # fmt: skip
    says = {(one.points[i].at, one.points[i].kind): seen(plain, one, i) for one, i in others}
    for word, value in (("seen by runs on both sides of it", True), ("unstable", None), ("invented", False)):
        print(f"  {word}:", [at for at, told in says.items() if told is value])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--ranges", nargs="+", default=list(RANGES), choices=RANGES)
    for one in parser.parse_args().ranges:
        judged(one)
