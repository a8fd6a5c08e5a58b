"""Walkers that move across the way as well, under friction in a box or in a disk: feet are point masses, so that the
ground acts on each foot's own coordinates.

A box bounds the friction along and across the way each by itself, as the library does; a disk bounds the length of both
together, made smooth at a slip speed that is none.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import LSODA
from scipy.optimize import brentq

from independent.simulator import (
    AIR,
    BEGIN_SLIP,
    BEGIN_STICK,
    BOUNCE,
    CONTACT_AT_START,
    RELEASE,
    REST,
    STUCK,
    Found,
    Simulator,
)  # fmt: skip

ON_GROUND = STUCK


class Boxed(Simulator):
    """Each foot on the ground sticks or slides along the way, and sticks or slides across it."""

    def __init__(self, scene: Any, length: float) -> None:
        super().__init__(scene, length)
        self.ways = (self.robot.tangents, self.robot.sideways)
        self.senses = np.zeros((self.m, 2))  # of feet on the ground; 0: sticks, where anything rubs
        self.rough = self.laws.bound(1.0, 1.0) != 0.0
        self.known: dict[tuple[float, bytes, tuple[int, ...]], np.ndarray] = {}

    def applied(self, t: float, z: np.ndarray) -> np.ndarray:
        """As the other; asked once for every foot and way, it is remembered."""
        key = t, z.tobytes(), tuple(self.contact)
        if key not in self.known:
            if len(self.known) > 100:
                self.known.clear()
            self.known[key] = super().applied(t, z)
        return self.known[key]

    def stretch(self, time: float) -> None:
        self.known.clear()
        super().stretch(time)

    def shares(self, i: int, t: float, z: np.ndarray, push: np.ndarray) -> tuple[float, list[float]]:
        """Margin N + f_a of a foot on the ground, and what friction would have to bear along and across."""
        margin = self.margin(i, t, float(self.robot.normals[:, i] @ push))
        return margin, [float(rows[:, i] @ push) for rows in self.ways]

    def bound(self, i: int, t: float, margin: float) -> float:
        return self.laws.bound(margin, self.strength(i, t))

    def on_foot(self, i: int, t: float, z: np.ndarray, push: np.ndarray) -> np.ndarray:
        """Friction (2,) [N] on a foot on the ground."""
        if not self.rough:
            return np.zeros(2)
        margin, force = self.shares(i, t, z, push)
        most = self.bound(i, t, margin)
        return np.array([-f if s == 0.0 else -s * most for f, s in zip(force, self.senses[i], strict=True)])

    def rates(self, t: float, z: np.ndarray) -> np.ndarray:
        push = self.applied(t, z)
        out = push.copy()
        for i in range(self.m):
            if self.contact[i] == AIR:
                continue
            out -= self.robot.normals[:, i] * float(self.robot.normals[:, i] @ push)
            for rows, force in zip(self.ways, self.on_foot(i, t, z, push), strict=True):
                out += rows[:, i] * force
        return np.concatenate([z[self.n :], self.inverse @ out])

    def watches(self) -> dict[Any, Callable[[float, np.ndarray], float]]:
        out: dict[Any, Callable[[float, np.ndarray], float]] = {}
        for i in range(self.m):
            if self.contact[i] == AIR:
                out[i, "touch"] = lambda t, z, i=i: self.gap(i, z)
                continue
            out[i, "leave"] = lambda t, z, i=i: self.shares(i, t, z, self.applied(t, z))[0]
            for d, rows in enumerate(self.ways if self.rough else ()):
                if self.senses[i, d] == 0.0:
                    out[i, "slip", d] = lambda t, z, i=i, d=d: self.room(i, d, t, z)
                else:
                    row = self.senses[i, d] * rows[:, i]
                    out[i, "stop", d] = lambda t, z, row=row: float(row @ z[self.n :])
        return out

    def room(self, i: int, d: int, t: float, z: np.ndarray) -> float:
        margin, force = self.shares(i, t, z, self.applied(t, z))
        return self.bound(i, t, margin) - abs(force[d])

    def happen(self, i: int, what: str, d: int = 0) -> None:
        self.fresh = [False] * self.m
        if what == "touch":
            return self.touch(i)
        self.fresh[i] = True
        if what == "leave":
            self.note(i, RELEASE)
            self.contact[i] = AIR
            return None
        _, force = self.shares(i, self.time, self.z, self.applied(self.time, self.z))
        self.z[self.n + int(np.argmax(self.ways[d][:, i]))] = 0.0
        if what == "stop" and self.room(i, d, self.time, self.z) >= 0.0:
            self.note(i, BEGIN_STICK)
            self.senses[i, d], self.fresh[i] = 0.0, False
            return None
        self.note(i, BEGIN_SLIP)
        self.senses[i, d] = math.copysign(1.0, force[d])
        return None

    def due(self, but: int | None = None) -> None:
        small, still = 1e-14 * self.length, 1e-13 * self.length * self.rate
        for i in range(self.m):
            if self.contact[i] != AIR or self.gap(i, self.z) > small or i == but:
                continue
            rate = float(self.robot.normals[:, i] @ self.z[self.n :])
            if rate < -still:
                self.touch(i)
            elif rate <= still and self.pull_if_held(i) <= self.strength(i, self.time, 0.0):
                self.note(i, CONTACT_AT_START)
                self.hold(i)

    def pull_if_held(self, i: int, whole: bool = True) -> float:
        z = self.z.copy()
        z[self.n + int(np.argmax(self.robot.normals[:, i]))] = 0.0
        kept, self.contact[i] = self.contact[i], ON_GROUND
        pull = float(self.robot.normals[:, i] @ self.applied(self.time, z))
        self.contact[i] = kept
        return pull

    def touch(self, i: int) -> None:
        normal = self.robot.normals[:, i]
        speed = -float(normal @ self.z[self.n :])
        mobility = float(normal @ self.inverse @ normal)
        after, pull = self.laws.rebound(speed), self.pull_if_held(i)
        kind = self.decide(i, speed, after, pull, mobility, max(1e-9 * self.length, 1e-12))
        over = self.time - 2.0 * after / (pull * mobility) / (1.0 - after / speed) if kind == REST else None
        self.note(i, kind, over)
        left = after if kind == BOUNCE else 0.0
        self.z[self.n :] += normal * (speed + left)
        self.brake(i, speed + left)
        if kind == BOUNCE:
            self.fresh[i] = True
        else:
            self.hold(i)

    def slipping(self, i: int) -> np.ndarray:
        """Speeds (2,) along and across the way."""
        return np.array([rows[:, i] @ self.z[self.n :] for rows in self.ways])

    def brake(self, i: int, change: float) -> None:
        """The friction of an impact that changes the normal velocity by ``change``."""
        slip = self.slipping(i)
        left = np.sign(slip) * np.maximum(np.abs(slip) - self.laws.brakes(change, 0.0), 0.0)
        for rows, by in zip(self.ways, left - slip, strict=True):
            self.z[self.n :] += rows[:, i] * by

    def hold(self, i: int) -> None:
        self.since[i], self.fresh[i], self.contact[i] = self.time, False, ON_GROUND
        self.z[: self.n] -= self.robot.normals[:, i] * self.gap(i, self.z)
        if not self.rough:
            return
        slip = self.slipping(i)
        self.senses[i] = np.where(np.abs(slip) > 1e-13 * self.length * self.rate, np.sign(slip), 0.0)


class Disked(Boxed):
    """Friction against the slip velocity, in full from a slip speed ``full`` [m/s] on, by a method for stiff
    equations."""

    full, box = 1e-4, False

    def on_foot(self, i: int, t: float, z: np.ndarray, push: np.ndarray) -> np.ndarray:
        margin, _ = self.shares(i, t, z, push)
        slip = np.array([rows[:, i] @ z[self.n :] for rows in self.ways])
        size = np.abs(slip) if self.box else np.linalg.norm(slip)
        return -max(self.bound(i, t, margin), 0.0) * slip / np.hypot(size, self.full)

    def watches(self) -> dict[Any, Callable[[float, np.ndarray], float]]:
        return {key: watch for key, watch in super().watches().items() if key[1] in ("touch", "leave")}

    def brake(self, i: int, change: float) -> None:
        if self.box:
            return super().brake(i, change)
        slip = self.slipping(i)
        size = float(np.linalg.norm(slip))
        by = -slip * min(1.0, self.laws.brakes(change, 0.0) / size) if size > 0.0 else slip
        for rows, one in zip(self.ways, by, strict=True):
            self.z[self.n :] += rows[:, i] * one
        return None

    def march(self, stop: float) -> tuple[int, str] | None:
        scale = np.concatenate([np.full(self.n, self.length), np.full(self.n, self.length * self.rate)])
        solver = LSODA(
            self.rates, self.time, self.z, stop, max_step=1.0 / self.rate, rtol=1e-7,
            atol=1e-8 * scale,  # pyright: ignore[reportArgumentType]
        )  # fmt: skip
        watches, begun = self.watches(), dict.fromkeys(self.watches(), False)
        for key, watch in watches.items():
            begun[key] = not (self.fresh[key[0]] and key[1] == "touch") and watch(self.time, self.z) > 0.0
            if not begun[key] and key[1] == "leave":
                return key
        while solver.status == "running":
            before = solver.t
            solver.step()
            assert solver.status != "failed"
            dense = solver.dense_output()
            roots = []
            for key, watch in watches.items():
                if watch(solver.t, solver.y) > 0.0:
                    begun[key] = True
                elif begun[key]:
                    roots.append((brentq(lambda s: watch(s, dense(s)), before, solver.t), key))  # noqa: B023
            if roots:
                self.time, key = min(roots, key=lambda one: one[0])
                self.z = dense(self.time)
                return key
        self.time, self.z, self.fresh = stop, solver.y, [False] * self.m
        return None


def simulate(scene: Any, length: float) -> Found:
    """As `independent.simulator.simulate`, in three directions, with friction in a box."""
    return Boxed(scene, length).run()
