"""Walkers that move across the way as well, under Coulomb's disk of friction: feet are point masses, so that the ground
acts on each foot's own coordinates.

A foot that slides with the velocity s has the friction -B s/|s|. It begins to slide in the direction of the force that
it had to bear, to which the direction of its velocity is held the harder the slower it is: below a speed `STARTS` the
two are one here, far less apart than what is compared. It has stopped where its speed is below `STOPPED`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

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
)

ON_GROUND = STUCK


STARTS, STOPPED = 1e-6, 1e-12  # [m/s]


class Disked(Simulator):
    """Each foot on the ground sticks, or slides with friction against its velocity."""

    def __init__(self, scene: Any, length: float) -> None:
        super().__init__(scene, length)
        self.ways = np.stack([self.robot.tangents, self.robot.sideways])
        self.slides, self.starts = [False] * self.m, [False] * self.m
        self.rough = self.laws.bound(1.0, 1.0) != 0.0
        self.known: dict[tuple[float, bytes, tuple[int, ...]], np.ndarray] = {}

    def applied(self, t: float, z: np.ndarray) -> np.ndarray:
        """As the other; asked for every foot, it is remembered."""
        key = t, z.tobytes(), tuple(self.contact)
        if key not in self.known:
            if len(self.known) > 100:
                self.known.clear()
            self.known[key] = super().applied(t, z)
        return self.known[key]

    def stretch(self, time: float) -> None:
        self.known.clear()
        super().stretch(time)

    def margin_of(self, i: int, t: float, push: np.ndarray) -> float:
        return self.margin(i, t, float(self.robot.normals[:, i] @ push))

    def slipping(self, i: int, z: np.ndarray) -> np.ndarray:
        """Velocity (2,) along and across the way."""
        return self.ways[:, :, i] @ z[self.n :]

    def on_foot(self, i: int, t: float, z: np.ndarray, push: np.ndarray) -> np.ndarray:
        """Friction (2,) [N] on a foot on the ground."""
        if not self.rough:
            return np.zeros(2)
        force = self.ways[:, :, i] @ push
        if not self.slides[i]:
            return -force
        slip = self.slipping(i, z)
        if self.starts[i] and np.hypot(*slip) < STARTS:
            slip = force
        return -self.laws.bound(self.margin_of(i, t, push), self.strength(i, t)) * slip / np.hypot(*slip)

    def rates(self, t: float, z: np.ndarray) -> np.ndarray:
        push = self.applied(t, z)
        out = push.copy()
        for i in range(self.m):
            if self.contact[i] != AIR:
                out -= self.robot.normals[:, i] * float(self.robot.normals[:, i] @ push)
                out += self.on_foot(i, t, z, push) @ self.ways[:, :, i]
        return np.concatenate([z[self.n :], self.inverse @ out])

    def watches(self) -> dict[Any, Callable[[float, np.ndarray], float]]:
        out: dict[Any, Callable[[float, np.ndarray], float]] = {}
        for i in range(self.m):
            if self.contact[i] == AIR:
                out[i, "touch"] = lambda t, z, i=i: self.gap(i, z)
                continue
            out[i, "leave"] = lambda t, z, i=i: self.margin_of(i, t, self.applied(t, z))
            if not self.rough:
                continue
            if not self.slides[i]:
                out[i, "slip"] = lambda t, z, i=i: self.room(i, t, z)
            elif self.starts[i]:
                out[i, "goes"] = lambda t, z, i=i: STARTS - float(np.hypot(*self.slipping(i, z)))
            else:
                out[i, "stop"] = lambda t, z, i=i: float(np.hypot(*self.slipping(i, z))) - STOPPED
        return out

    def room(self, i: int, t: float, z: np.ndarray) -> float:
        push = self.applied(t, z)
        bound = self.laws.bound(self.margin_of(i, t, push), self.strength(i, t))
        return bound - float(np.hypot(*(self.ways[:, :, i] @ push)))

    def happen(self, i: int, what: str) -> None:
        self.fresh = [False] * self.m
        if what == "touch":
            return self.touch(i)
        if what == "leave":
            self.note(i, RELEASE)
            self.contact[i], self.slides[i], self.fresh[i] = AIR, False, True
            return None
        if what == "goes":
            self.starts[i] = False
            return None
        self.z[self.n :] -= self.slipping(i, self.z) @ self.ways[:, :, i]
        sticks = what == "stop" and self.room(i, self.time, self.z) >= 0.0
        self.note(i, BEGIN_STICK if sticks else BEGIN_SLIP)
        self.slides[i] = self.starts[i] = not sticks
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

    def brake(self, i: int, change: float) -> None:
        """The friction of an impact that changes the normal velocity by ``change``."""
        slip = self.slipping(i, self.z)
        speed = float(np.hypot(*slip))
        if speed > 0.0:
            self.z[self.n :] -= min(1.0, self.laws.brakes(change, 0.0) / speed) * slip @ self.ways[:, :, i]

    def hold(self, i: int) -> None:
        self.since[i], self.fresh[i], self.contact[i] = self.time, False, ON_GROUND
        self.z[: self.n] -= self.robot.normals[:, i] * self.gap(i, self.z)
        self.slides[i] = np.hypot(*self.slipping(i, self.z)) > 1e-13 * self.length * self.rate
        self.starts[i] = False


def simulate(scene: Any, length: float) -> Found:
    """As `independent.simulator.simulate`, in three directions."""
    return Disked(scene, length).run()
