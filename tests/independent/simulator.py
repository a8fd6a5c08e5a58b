"""From event to event: a Runge-Kutta method of order 8 between them, each event by root finding on the motion itself.

A foot is in the air, stuck, or held and slipping along the ground. While feet are held, their constraints make reaction
forces; everything else is M x'' + C x' + K x = forces. Rules at the ground: docs/contact.md, docs/engine.md.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

from independent import drives, moving
from independent.bodies import robot_of
from independent.ground import Laws, passive_angle

AIR, STUCK, SLIPPING = range(3)
BOUNCE, CAPTURE, RELEASE, REST, CONTACT_AT_START, _, BEGIN_SLIP, BEGIN_STICK, AVERAGED_CONTACT = range(1, 10)
TOLERANCE = 1e-12
MOST_EVENTS = 2000
# where a step is looked at for events; close to its start too, where a foot that has just left the ground may come back
LOOKS = np.unique(np.concatenate([np.geomspace(1e-6, 1e-1, 12), np.linspace(0.1, 1.0, 10)]))
FEWER = np.append(LOOKS[:-1:3], 1.0)  # where a looser tolerance is asked for


@dataclass
class Found:
    """Events (time, foot, kind) in order of time, and the state at the end; jammed: friction left no motion, or two,
    and the end is there. undetermined [s]: from when on feet that rub share the ways that are left to them, so that the
    motion does not say what each bears; states (nt, 2n): at the times that were asked for."""

    events: list[tuple[float, int, int]] = field(default_factory=list)
    state: np.ndarray = field(default_factory=lambda: np.zeros(0))
    jammed: bool = False
    undetermined: float = math.inf
    states: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))


def tiled(line: Any, near: float) -> np.ndarray:
    """The points of a line (., 2) [m] ten of its lengths to both sides of a place [m]; level beyond its ends where it
    does not repeat."""
    points, step = line.points, line.points[-1] - line.points[0]
    if not line.repeats:
        return np.vstack([points[0] - [1.0, 0.0], points, points[-1] + [1.0, 0.0]])
    first = math.floor((near - points[0, 0]) / step[0])
    return np.vstack([*(points[:-1] + (first + k) * step for k in range(-10, 10)), points[:1] + (first + 10) * step])


def simulate(scene: Any, length: float, times: Sequence[float] = (), tolerance: float = TOLERANCE) -> Found:
    """Simulate a scene over its duration; length [m]: flights below 1e-9 of it are none, nor below
    1 pm (the rule of a rest); times [s] in order: when its state is wanted too."""
    return Simulator(scene, length, times, tolerance).run()


class Simulator:
    def __init__(self, scene: Any, length: float, times: Sequence[float] = (), tolerance: float = TOLERANCE) -> None:
        self.robot, self.laws = robot_of(scene), Laws(scene.ground)
        self.times, self.states = list(times), list[np.ndarray]()
        self.tolerance, self.exact = tolerance, tolerance == TOLERANCE
        self.onto: dict[tuple[int, ...], tuple[np.ndarray, np.ndarray, list[tuple[int, bool]], np.ndarray]] = {}
        self.known: dict[Any, dict[tuple[int, bool], float]] = {}
        self.end, self.length = scene.duration, length
        self.least = 1e-14 * length  # a gap of rounding is none
        robot = self.robot
        self.n, self.m = robot.normals.shape
        self.inverse = np.linalg.inv(robot.mass)
        feet = list(scene.robot.feet.values())
        self.rest_gap = np.array([foot.gap for foot in feet])
        rise = math.cos(self.laws.incline) * robot.up + math.sin(self.laws.incline) * robot.ahead  # against gravity
        self.weight = -self.laws.gravity * (robot.mass @ rise)
        self.forces, volts = [], {}
        for name, drive in scene.robot.drives.items():
            wave = scene.signals.get(name)
            start = drive.history[-1] if drive.history else 0.0
            told = (
                drives.command(wave, self.end)
                if wave is not None
                else drives.Signal([drives.line(0.0, math.inf, 0.0, 0.0)], self.end)
            )
            volts[name] = drives.amplified(told, drive.amplifier, start, self.end)
            self.forces.append(drives.force(volts[name], drive.law, drive.history, self.end))
        for load, signal in moving.pushes(scene, robot, self.end):
            self.robot = robot = replace(robot, loads=np.column_stack([robot.loads, load]))
            self.forces.append(signal)
        names = list(volts)
        wired = [foot.electrode for foot in feet]
        if not any(wired) and names:
            wired = [names[0]] * self.m
        self.volts = [volts.get(name) if name is not None else None for name in wired]
        signals = [*self.forces, *volts.values()]
        self.kinks = sorted({p.start for s in signals for p in s.pieces if 0.0 < p.start < self.end} | {self.end})
        stiff = np.abs(np.linalg.eigvals(self.inverse @ robot.stiffness)).max(initial=0.0)
        self.rate = max(math.sqrt(stiff), 2.0 * math.pi / self.end)
        self.no_slip = 1e-13 * length * self.rate  # nor is a slide of rounding
        self.contact, self.since = [AIR] * self.m, [0.0] * self.m
        self.sense, self.fresh = [0.0] * self.m, [False] * self.m
        self.landing = scene.ground.landing.kind if scene.ground.landing is not None else "capture_unless_pulled"
        self.restitutes_first = getattr(scene.ground.landing, "speed", 0.0)
        self.passive = scene.ground.impact is None or scene.ground.impact.passive
        self.out = Found()
        initial = scene.initial
        x = np.zeros(self.n) if initial.displacement is None else np.array(initial.displacement)
        if initial.standing is not None:
            assert not initial.standing.driven and self.laws.incline == 0.0
            x = self.stands()
        v = np.zeros(self.n) if initial.velocity is None else np.array(initial.velocity)
        if initial.in_laboratory:
            v = v - moving.start(scene, robot, self.end)
        self.time, self.z = 0.0, np.concatenate([x, v])
        self.now = [None] * len(self.forces), [None] * self.m
        self.lines: list[np.ndarray] = []
        if scene.ground.profile is not None:
            self.upward, self.along = robot.normals.copy(), robot.tangents.copy()
            self.above = self.rest_gap.copy()
            self.ahead = np.array([scene.robot.structure.legs[foot.point].x for foot in feet])
            found, which = scene.ground.profile.lines(scene.across)
            self.lines, self.facet = (
                [tiled(found[k], self.place(i, self.z)) for i, k in enumerate(which)],
                [0] * self.m,
            )
            for i, line in enumerate(self.lines):
                self.lay(i, int(np.searchsorted(line[:, 0], self.place(i, self.z))) - 1)

    def stands(self) -> np.ndarray:
        """At rest on level ground without friction, every foot down, the body where it is along the way."""
        robot, none = self.robot, np.zeros((self.m, self.m))
        balance = np.block([[robot.stiffness, -robot.normals], [robot.normals.T, none]])
        x = np.linalg.lstsq(balance, np.concatenate([self.weight, -self.rest_gap]), rcond=1e-13)[0][: self.n]
        x -= x[0] * robot.ahead
        return x - robot.normals @ (self.rest_gap + robot.normals.T @ x)  # but for rounding

    # --- forces and constraints ---------------------------------------------------------------------------------

    def stretch(self, time: float) -> None:
        """Fix the pieces of all signals from a time on, so that an integrator never looks beyond a kink."""
        self.known.clear()
        ahead = time + 1e-9 * max(min(k for k in self.kinks if k > time) - time, 0.0)
        self.now = ([s.at(ahead) for s in self.forces], [None if s is None else s.at(ahead) for s in self.volts])

    def foot_volts(self, i: int, t: float) -> float:
        piece = self.now[1][i]
        return 0.0 if piece is None else piece.value(t)

    def applied(self, t: float, z: np.ndarray) -> np.ndarray:
        """Forces (n,) on the structure but for those of the ground on held feet."""
        x, v = z[: self.n], z[self.n :]
        robot = self.robot
        out = self.weight - robot.stiffness @ x - robot.damping @ v
        out += robot.loads @ [piece.value(t) for piece in self.now[0]]
        gaps, rates = (self.rest_gap + x @ robot.normals).tolist(), (v @ robot.normals).tolist()
        forces = [0.0] * self.m
        for i in range(self.m):
            if self.contact[i] == AIR:
                gap, rate = max(gaps[i], 0.0), rates[i]
                forces[i] = self.laws.resisting(gap, rate) + self.laws.smooth(gap, rate, self.foot_volts(i, t))
        return out + robot.normals @ forces

    def gap(self, i: int, z: np.ndarray) -> float:
        return float(self.rest_gap[i] + self.robot.normals[:, i] @ z[: self.n])

    # --- uneven ground, as far as feet that slide stay on their facet ------------------------------------------

    def place(self, i: int, z: np.ndarray) -> float:
        return float(self.ahead[i] + self.along[:, i] @ z[: self.n])

    def lay(self, i: int, k: int) -> None:
        """Put a foot above facet k of its line: its ways from and along the ground are those of that facet."""
        self.facet[i] = k
        self.onto.clear()
        self.known.clear()
        (x0, z0), (x1, z1) = self.lines[i][k : k + 2]
        c, s = np.array([x1 - x0, z1 - z0]) / math.hypot(x1 - x0, z1 - z0)
        self.robot.normals[:, i] = c * self.upward[:, i] - s * self.along[:, i]
        self.robot.tangents[:, i] = c * self.along[:, i] + s * self.upward[:, i]
        self.rest_gap[i] = c * (self.above[i] - z0) - s * (self.ahead[i] - x0)

    def left(self, i: int, z: np.ndarray) -> float:
        """How far a foot is from the nearer end of its facet, along the way."""
        low, high = self.lines[i][self.facet[i] : self.facet[i] + 2, 0]
        at = self.place(i, z)
        return min(at - low, high - at)

    def pass_over(self, i: int) -> None:
        """A foot comes to a corner: in the air it passes; sliding it flies off over the next facet, or hits that."""
        k, points = self.facet[i], self.lines[i]
        low, high = points[k : k + 2, 0]
        way = 1 if self.place(i, self.z) > 0.5 * (low + high) else -1
        slopes = np.diff(points[:, 1]) / np.diff(points[:, 0])
        slides = self.contact[i] != AIR
        if slides:
            self.note(i, RELEASE)
            self.contact[i] = AIR
        self.lay(i, k + way)
        if slides and way * (slopes[k + way] - slopes[k]) > 0.0:
            self.touch(i)

    def held(self) -> tuple[np.ndarray, list[tuple[int, bool]]]:
        """Rows (n, k) of what is held, and of which foot it is, along the ground or not."""
        rows, which = [], []
        for i in range(self.m):
            if self.contact[i] != AIR:
                rows.append(self.robot.normals[:, i])
                which.append((i, False))
                if self.contact[i] == STUCK and self.rubs(i):
                    rows.append(self.robot.tangents[:, i])
                    which.append((i, True))
        return np.array(rows).reshape(len(rows), self.n).T, which

    def rubs(self, i: int) -> bool:
        return bool(self.robot.tangents[:, i].any()) and self.laws.bound(1.0, 1.0) != 0.0

    def pulls(self, t: float, z: np.ndarray, push: np.ndarray) -> dict[tuple[int, bool], float]:
        """Force [N] of the structure on each held foot, along its normal and along the ground."""
        _, onto, which, _ = self.holding()
        return dict(zip(which, (onto @ push).tolist(), strict=True))

    def holding(self) -> tuple[np.ndarray, np.ndarray, list[tuple[int, bool]], np.ndarray]:
        """Rows (n, k) of what is held, what the structure's forces pull on these (k, n), of which foot they are, and
        how far friction (m) of all feet pulls on these (k, m)."""
        key = tuple(self.contact)
        if key not in self.onto:
            rows, which = self.held()
            by = rows.T @ self.inverse
            onto = np.linalg.pinv(by @ rows, rcond=1e-11) @ by
            self.onto[key] = rows, onto, which, onto @ self.robot.tangents
        return self.onto[key]

    def loaded(self, t: float, z: np.ndarray) -> np.ndarray:
        """`applied` with the friction of feet that slide, which bears on the margin that bears it: all laws are
        straight lines of the margin, and that is one of all friction forces."""
        push = self.applied(t, z)
        slides = [i for i in range(self.m) if self.contact[i] == SLIPPING and self.sense[i] != 0.0]
        if not slides:
            return push
        matrix, right = self.by_friction(t, z, push, slides)
        return push + self.robot.tangents[:, slides] @ np.linalg.solve(matrix, right)

    def by_friction(
        self, t: float, z: np.ndarray, push: np.ndarray, slides: list[int]
    ) -> tuple[np.ndarray, np.ndarray]:
        """The equations (k, k) and (k,) of the friction forces of feet that slide."""
        _, onto, which, rubbing = self.holding()
        own = [which.index((i, False)) for i in slides]
        without, by_force = onto[own] @ push, rubbing[own][:, slides]
        matrix, right = np.eye(len(slides)), np.zeros(len(slides))
        for k, i in enumerate(slides):
            strength = self.strength(i, t)
            slip = max(self.sense[i] * float(self.robot.tangents[:, i] @ z[self.n :]), 0.0)
            flat = self.laws.bound(0.0, strength, slip)
            steep = self.laws.bound(1.0, strength, slip) - flat
            matrix[k] -= self.sense[i] * steep * by_force[k]
            right[k] = -self.sense[i] * (flat + steep * self.margin(i, t, without[k]))
        return matrix, right

    def has_one_motion(self, at_rest: bool = False) -> bool:
        """Whether feet that slide have one motion, whatever pulls on them and whichever of them rise: all principal
        minors are positive of the accelerations away from the ground by the margins that press and rub (Kellogg)."""
        slides = [i for i in range(self.m) if self.contact[i] == SLIPPING and self.sense[i] != 0.0]
        if not slides:
            return True
        inverse, rows = self.inverse, self.held_beside(slides)
        if rows.shape[1]:
            inverse = inverse - inverse @ rows @ np.linalg.pinv(rows.T @ inverse @ rows, rcond=1e-11) @ rows.T @ inverse
        steep = []
        for i in slides:
            strength = self.strength(i, self.time)
            slip = 0.0 if at_rest else max(self.sense[i] * float(self.robot.tangents[:, i] @ self.z[self.n :]), 0.0)
            steep.append(self.sense[i] * (self.laws.bound(1.0, strength, slip) - self.laws.bound(0.0, strength, slip)))
        normals, tangents = self.robot.normals[:, slides], self.robot.tangents[:, slides]
        matrix = normals.T @ inverse @ (normals - tangents * steep)
        return all(
            np.linalg.det(matrix[np.ix_(some, some)]) > 0.0
            for size in range(1, len(slides) + 1)
            for some in itertools.combinations(range(len(slides)), size)
        )

    def shares_ways(self) -> bool:
        """Whether several feet on the ground have fewer ways than constraints, were all of them to stick."""
        held = [i for i in range(self.m) if self.contact[i] != AIR]
        rows = np.hstack([self.robot.normals[:, held], self.robot.tangents[:, [i for i in held if self.rubs(i)]]])
        return len(held) > 1 and np.linalg.matrix_rank(rows, tol=1e-9 * np.abs(rows).max()) < rows.shape[1]

    def held_beside(self, slides: list[int]) -> np.ndarray:
        """Rows (n, k) of what is held but for the normals of feet that slide."""
        rows, which = self.held()
        return rows[:, [k for k, (foot, along) in enumerate(which) if along or foot not in slides]]

    def strength(self, i: int, t: float, age: float | None = None) -> float:
        """f_a of a foot, by its age unless another is given."""
        return self.laws.strength(t - self.since[i] if age is None else age, self.foot_volts(i, t))

    def no_force(self, i: int) -> float:
        """What is no force [N] on a foot, by the scales of the scene and the rounding of its sum."""
        normal = self.robot.normals[:, i]
        scale = self.length * self.rate**2 / float(normal @ self.inverse @ normal)
        return 1e-13 * scale + 1e-12 * self.parts(i)

    def parts(self, i: int) -> float:
        """What the pull on a foot is summed of [N], in size."""
        x, v = np.abs(self.z[: self.n]), np.abs(self.z[self.n :])
        pushes = np.abs(self.weight) + np.abs(self.robot.stiffness) @ x + np.abs(self.robot.damping) @ v
        for d, piece in enumerate(self.now[0]):
            pushes = pushes + np.abs(self.robot.loads[:, d] * piece.value(self.time))
        normal = self.robot.normals[:, i]
        return float(np.abs(self.inverse @ normal) @ pushes / (normal @ self.inverse @ normal))

    def reactions(self, t: float, z: np.ndarray) -> dict[tuple[int, bool], float]:
        """`pulls` with friction; all that are watched ask for those of the same moments."""
        there = t, z.tobytes(), tuple(self.contact), tuple(self.sense)
        if there not in self.known:
            if len(self.known) > 2 * len(LOOKS):
                self.known.clear()
            self.known[there] = self.pulls(t, z, self.loaded(t, z))
        return self.known[there]

    def margin(self, i: int, t: float, pull: float) -> float:
        """N + f_a of a held foot."""
        return self.strength(i, t) - pull - self.laws.smooth(0.0, 0.0, self.foot_volts(i, t))

    def rates(self, t: float, z: np.ndarray) -> np.ndarray:
        push, (rows, onto, _, _) = self.loaded(t, z), self.holding()
        push = push - rows @ (onto @ push)
        return np.concatenate([z[self.n :], self.inverse @ push])

    # --- events -------------------------------------------------------------------------------------------------

    def watches(self) -> dict[tuple[int, str], Callable[[float, np.ndarray], float]]:
        """Functions that are positive while nothing happens."""
        out: dict[tuple[int, str], Callable[[float, np.ndarray], float]] = {}
        for i in range(self.m):
            if self.contact[i] == AIR:
                out[i, "touch"] = lambda t, z, i=i: self.gap(i, z)
                if self.lines:
                    out[i, "end"] = lambda t, z, i=i: self.left(i, z)
                continue
            out[i, "leave"] = lambda t, z, i=i: self.margin(i, t, self.reactions(t, z)[i, False])
            if self.lines and self.contact[i] == SLIPPING:
                out[i, "end"] = lambda t, z, i=i: self.left(i, z)
            if self.contact[i] == STUCK and self.rubs(i):
                out[i, "slip"] = lambda t, z, i=i: self.spare(i, t, z)
            elif self.contact[i] == SLIPPING and self.sense[i] != 0.0 and self.moves_along(i):
                row = self.robot.tangents[:, i]
                out[i, "stop"] = lambda t, z, i=i, row=row: self.sense[i] * float(row @ z[self.n :])
        return out

    def moves_along(self, i: int) -> bool:
        """Whether what is held leaves foot i its way along the ground."""
        row = self.robot.tangents[:, i]
        return bool(row @ self.struck(row, self.held()[0])[1] > 1e-11 * row @ self.inverse @ row)

    def spare(self, i: int, t: float, z: np.ndarray) -> float:
        """What friction could carry beyond what it must."""
        pulls = self.reactions(t, z)
        margin, strength = self.margin(i, t, pulls[i, False]), self.strength(i, t)
        return self.laws.bound(margin, strength) - abs(pulls[i, True])

    def run(self) -> Found:
        self.stretch(0.0)
        self.due()
        while self.time < self.end:
            self.stretch(self.time)
            stop = min(k for k in self.kinks if k > self.time)
            happened = self.march(stop)
            if happened is not None:
                self.happen(*happened)
                self.due(happened[0])
                if len(self.out.events) > MOST_EVENTS:
                    break
            if self.shares_ways():
                self.out.undetermined = min(self.out.undetermined, self.time)
            self.out.jammed = self.out.jammed or not self.has_one_motion()
            if self.out.jammed:
                break
        self.out.state = self.z
        self.out.states = np.array(self.states).reshape(-1, 2 * self.n)
        later = [math.inf] * self.m  # a rest comes with the next event of its foot at the latest
        for k in reversed(range(len(self.out.events))):
            time, foot, kind = self.out.events[k]
            later[foot] = min(time, later[foot])
            self.out.events[k] = later[foot], foot, kind
        self.out.events.sort(key=lambda event: event[0])
        return self.out

    def march(self, stop: float) -> tuple[int, str] | None:
        """Integrate to ``stop`` or to the first event; says which it was."""
        scale = np.concatenate([np.full(self.n, self.length), np.full(self.n, self.length * self.rate)])
        watches = self.watches()
        none = {"touch": self.least, "stop": self.no_slip}
        solver = DOP853(
            self.rates,
            self.time,
            self.z,
            stop,
            rtol=self.tolerance,
            atol=0.1 * self.tolerance * scale,
            max_step=min((0.3 if self.exact else 1.0) / self.rate, self.end / 20.0),
        )
        begun = dict.fromkeys(watches, False)  # whether it has been seen above zero
        for key, watch in watches.items():
            starts_at_zero = self.fresh[key[0]] and key[1] in ("touch", "stop")
            begun[key] = not starts_at_zero and watch(self.time, self.z) > 0.0
            if not begun[key] and key[1] in ("leave", "slip"):
                return key  # a force has jumped
        while solver.status == "running":
            before = solver.t, solver.y.copy()
            solver.step()
            if solver.status == "failed":  # friction grows as a slide slows down, and jams before it stops
                self.time, self.z = before
                self.out.jammed = not self.has_one_motion(at_rest=True)
                assert self.out.jammed
                return None
            dense = solver.dense_output()
            first: tuple[float, tuple[int, str]] | None = None
            shares = LOOKS if self.exact else FEWER
            looks = [(float(t), dense(t)) for t in before[0] + shares * (solver.t - before[0])]
            for key, watch in watches.items():
                low = before[0]
                for t, z in looks:
                    value = watch(t, z)
                    if value > none.get(key[1], 0.0):
                        begun[key] = True
                    elif begun[key]:
                        root = t  # where it is next to none, and above zero still
                        if value <= 0.0:
                            root = brentq(lambda s: watch(s, dense(s)), low, t, xtol=1e-300, rtol=1e-15)  # noqa: B023
                        if first is None or root < first[0]:
                            first = root, key
                        break
                    low = t
            self.sample(dense, solver.t if first is None else first[0])
            if first is not None:
                self.time, self.z = first[0], dense(first[0])
                if self.exact:
                    self.polish(before, first, watches[first[1]])
                return first[1]
        self.time, self.z, self.fresh = stop, solver.y, [False] * self.m
        return None

    def sample(self, dense: Callable[[float], np.ndarray], until: float) -> None:
        """Take down the states of times that are asked for up to a time."""
        while len(self.states) < len(self.times) and self.times[len(self.states)] <= until:
            self.states.append(dense(self.times[len(self.states)]))

    def polish(self, before: tuple[float, np.ndarray], first: tuple[float, tuple[int, str]], watch: Callable) -> None:
        """Integrate straight to where the event was seen, and correct it by the motion there."""
        self.time, self.z = before
        target = first[0]
        for _ in range(3):
            self.jump(target)
            span = 1e-6 * max(target - before[0], 1e-6 / self.rate)
            ahead = self.z + span * self.rates(self.time, self.z)
            slope = (watch(self.time + span, ahead) - watch(self.time, self.z)) / span
            value = watch(self.time, self.z)
            if slope >= 0.0 or abs(value / slope) > 1e-6 / self.rate:
                return
            target -= value / slope
        self.jump(target)

    def jump(self, target: float) -> None:
        """Move the state to a time close by, forward or back, with the forces as they go on."""
        if target == self.time:
            return
        scale = np.concatenate([np.full(self.n, self.length), np.full(self.n, self.length * self.rate)])
        solver = DOP853(self.rates, self.time, self.z, target, rtol=TOLERANCE, atol=0.1 * TOLERANCE * scale)
        while solver.status == "running":
            solver.step()
        self.time, self.z = target, solver.y

    def note(self, foot: int, kind: int, time: float | None = None) -> None:
        self.known.clear()
        self.out.events.append((self.time if time is None else time, foot, kind))

    def happen(self, i: int, what: str) -> None:
        self.fresh = [False] * self.m
        if what == "touch":
            return self.touch(i)
        if what == "end":
            return self.pass_over(i)
        if what in ("leave", "slip") and self.contact[i] == STUCK and self.rubs(i):
            what = self.gives(i, what)
        if what == "leave":
            slid = self.sense[i] != 0.0
            self.note(i, RELEASE)
            self.contact[i], self.sense[i], self.fresh[i] = AIR, 0.0, True
            if slid:  # what takes it off may be its own friction, and what it is free of then its adhesion
                pressed = -self.pull_if_held(i)
                self.out.jammed = pressed > 1e-9 * self.parts(i) + self.no_force(i)
            return None
        if what in ("stop", "slip") and len(resting := self.resting(i)) > 1:
            return self.settle(resting)
        if what == "stop":
            row = self.robot.tangents[:, i]
            if self.moves_along(i):
                _, response = self.struck(row, self.held()[0])
                self.z[self.n :] -= response * (row @ self.z[self.n :]) / (row @ response)
            self.contact[i] = STUCK
            if self.spare(i, self.time, self.z) >= 0.0:
                self.note(i, BEGIN_STICK)
                return self.slides_on()
        along = self.reactions(self.time, self.z)[i, True]
        self.note(i, BEGIN_SLIP)
        self.contact[i], self.sense[i], self.fresh[i] = SLIPPING, math.copysign(1.0, along), True
        return None

    def resting(self, i: int) -> list[int]:
        """The foot, and those whose slides stop or begin at this moment, too."""
        small = 1e-12 * self.length * self.rate
        rates = np.abs(self.z[self.n :] @ self.robot.tangents)
        slides = [k for k in range(self.m) if self.contact[k] == SLIPPING and self.sense[k] != 0.0]
        return sorted({i} | {k for k in slides if rates[k] <= small})

    def settle(self, feet: list[int]) -> None:
        """Of feet that stop at one moment those that stick, and those that slide on, and how: all choices are tried.
        Some stick as friction bears it, and the others speed up as their senses say. Of several of these, as where feet
        share their ways, the fewest slide, by the least forces."""
        rows, tangents = self.held()[0], self.robot.tangents[:, feet]
        responses = np.array([self.struck(row, rows)[1] for row in tangents.T]).T
        mobility = tangents.T @ responses
        v = self.z[self.n :]
        self.z[self.n :] = v - responses @ np.linalg.pinv(mobility, rcond=1e-11) @ (tangents.T @ v)
        tried, before = [], [(self.sense[i], self.fresh[i]) for i in feet]
        for senses in itertools.product([0.0, 1.0, -1.0], repeat=len(feet)):
            self.take(feet, senses)
            pulls = self.reactions(self.time, self.z)
            bounds = [
                self.laws.bound(self.margin(i, self.time, pulls[i, False]), self.strength(i, self.time)) for i in feet
            ]
            forces = [-s * b if s else -pulls[i, True] for i, s, b in zip(feet, senses, bounds, strict=True)]
            speeds_up = senses * (tangents.T @ self.rates(self.time, self.z)[self.n :])
            tried.append((senses, np.array(bounds), np.array(forces), speeds_up))
        none = 1e-9 * max(np.abs(one[3]).max() for one in tried)
        fits = [
            (sum(map(abs, senses)), float(np.diag(mobility) @ forces**2), senses)
            for senses, bounds, forces, speeds_up in tried
            if np.all(np.abs(forces) <= bounds * (1.0 + 1e-9)) and np.all(speeds_up >= -none)
        ]
        if not fits:
            self.out.jammed = True
            return
        senses = min(fits)[2]
        for kind in (BEGIN_STICK, BEGIN_SLIP):
            for i, sense, was in zip(feet, senses, before, strict=True):
                if (sense != 0.0) == (kind == BEGIN_SLIP) and was not in ((sense, True), (0.0, sense != 0.0)):
                    self.note(i, kind)
        self.take(feet, senses)
        for i, sense in zip(feet, senses, strict=True):
            self.fresh[i] = sense != 0.0

    def take(self, feet: list[int], senses: tuple[float, ...]) -> None:
        """Feet that stick (0), or slide with a sense."""
        for i, sense in zip(feet, senses, strict=True):
            self.contact[i], self.sense[i] = SLIPPING if sense else STUCK, sense

    def due(self, but: int | None = None) -> None:
        """Feet that are at the ground at this very moment and do not rise from it; an impact of one may send others
        down again, that which it happened to (`but`) as well."""
        small = 1e-14 * self.length
        for i in range(self.m):
            if self.contact[i] != AIR or self.gap(i, self.z) > small or (i == but):
                continue
            rate = float(self.robot.normals[:, i] @ self.z[self.n :])
            if rate < -1e-13 * self.length * self.rate:
                self.touch(i)
                return self.due() if len(self.out.events) <= MOST_EVENTS else None
            elif rate <= 1e-13 * self.length * self.rate:
                if self.pull_if_held(i) <= self.strength(i, self.time, 0.0):
                    self.note(i, CONTACT_AT_START)
                    self.hold(i)
                else:
                    self.fresh[i] = True

    def gives(self, i: int, what: str) -> str:
        """What a foot that sticks does: it slides where it is pulled off only because it sticks, and leaves where
        nothing pulls it along as its margin, and friction with it, ends."""
        pulls = self.reactions(self.time, self.z)
        small = 1e-12 * max(abs(f) for f in pulls.values()) + self.no_force(i)
        if self.margin(i, self.time, pulls[i, False]) >= -small:
            return "leave" if abs(pulls[i, True]) <= small else what
        if self.spare(i, self.time, self.z) >= 0.0:
            return "leave"
        without = self.margin(i, self.time, self.pull_if_held(i, False))
        return "leave" if without < small else "slip"

    def slides_on(self) -> None:
        """After an impact: feet that it has let slide, stopped or turned."""
        for i in range(self.m):
            if self.contact[i] != SLIPPING or self.sense[i] == 0.0:
                continue
            rate = float(self.robot.tangents[:, i] @ self.z[self.n :])
            if abs(rate) <= 1e-12 * self.length * self.rate:
                if not self.fresh[i]:
                    self.happen(i, "stop")
                continue
            turned = self.sense[i] * rate < 0.0
            if turned and not self.fresh[i]:
                self.note(i, BEGIN_SLIP)
            self.sense[i], self.fresh[i] = math.copysign(1.0, rate), False

    def touch(self, i: int) -> None:
        """A foot is at the ground and approaches it."""
        normal = self.robot.normals[:, i]
        v = self.z[self.n :]
        speed = -float(normal @ v)
        rows, which = self.held()
        _, response = self.struck(normal, rows)
        mobility = float(normal @ response)
        pull = self.pull_if_held(i)
        small = max(1e-9 * self.length, 1e-12)
        after = self.laws.rebound(speed)
        if pull >= 0.0 or speed * speed >= -2.0 * pull * mobility * small:
            broken = self.broken(i, rows, which, *self.impulses(i, after))
            if broken is not None:
                foot, slides = broken
                self.note(foot, BEGIN_SLIP if slides else RELEASE)
                self.contact[foot], self.fresh[foot] = SLIPPING if slides else AIR, True
                return self.touch(i)
        kind = self.decide(i, speed, after, pull, mobility, small)
        if kind == BOUNCE:
            self.note(i, BOUNCE)
            self.z[self.n :] = v + self.answer(i, speed, after, rows, response, mobility) + self.rubbed(i, after)
            self.fresh[i] = True
            return self.slides_on()
        over = self.time - 2.0 * after / (pull * mobility) / (1.0 - after / speed) if kind == REST else self.time
        self.note(i, kind, over)
        self.z[self.n :] = v + response / mobility * speed + self.rubbed(i, 0.0)
        self.hold(i)
        return self.slides_on()

    def impulses(self, i: int, after: float) -> tuple[float, float]:
        """Impulses of an impact from which foot i departs with the speed ``after``: normal, and of friction."""
        v, normal, tangent = self.z[self.n :], self.robot.normals[:, i], self.robot.tangents[:, i]
        rows = self.held()[0]
        _, pushed = self.struck(normal, rows)
        change = after - float(normal @ v)
        straight = change / float(normal @ pushed)
        most = self.laws.brakes(change, abs(float(tangent @ v))) / change
        if most == 0.0 or not tangent.any():
            return straight, 0.0
        _, rubbed = self.struck(tangent, rows)
        less = float(normal @ rubbed) / float(normal @ pushed)  # of the normal impulse, by one along the ground
        # |p_t| <= most (straight - less p_t)
        low, high = -math.inf, math.inf
        if 1.0 + most * less > 0.0:
            high = most * straight / (1.0 + most * less)
        if 1.0 - most * less > 0.0:
            low = -most * straight / (1.0 - most * less)

        way = rubbed - pushed * less  # the kinetic energy is least where it has no slope along it
        bend = float(way @ self.robot.mass @ way)
        if bend <= 1e-13 * float(rubbed @ self.robot.mass @ rubbed):
            return straight, 0.0
        slope = float((v + pushed * straight) @ self.robot.mass @ way)
        along = min(max(-slope / bend, low), high)
        return straight - less * along, along

    def rubbed(self, i: int, after: float) -> np.ndarray:
        """Change of all velocities (n,) by the friction of that impact, its normal rate what it is without."""
        _, along = self.impulses(i, after)
        rows = self.held()[0]
        _, pushed = self.struck(self.robot.normals[:, i], rows)
        _, rubbed = self.struck(self.robot.tangents[:, i], rows)
        normal = self.robot.normals[:, i]
        return along * (rubbed - pushed * float(normal @ rubbed) / float(normal @ pushed))

    def broken(
        self, i: int, rows: np.ndarray, which: list[tuple[int, bool]], straight: float, along: float
    ) -> tuple[int, bool] | None:
        """What an impact breaks first: no adhesion carries an impulse, friction one by its share of the impact alone.
        Says which foot, and whether it slides."""
        carried = straight * self.struck(self.robot.normals[:, i], rows)[0]
        carried = carried + along * self.struck(self.robot.tangents[:, i], rows)[0]
        none = 1e-12 * (straight + abs(along))
        for k, (foot, slides) in enumerate(which):
            if not slides and carried[k] < -none:
                return foot, False
        push = {foot: max(carried[k], 0.0) for k, (foot, slides) in enumerate(which) if not slides}
        for k, (foot, slides) in enumerate(which):
            if slides and abs(carried[k]) > self.laws.bound(push[foot], 0.0) + none:
                self.sense[foot] = -math.copysign(1.0, carried[k])
                return foot, True
        return None

    def decide(self, i: int, speed: float, after: float, pull: float, mobility: float, small: float) -> int:
        """BOUNCE, CAPTURE or REST by the landing rule."""
        strength = self.strength(i, self.time, 0.0)
        low = pull < 0.0 and after * after < -2.0 * pull * mobility * small
        if self.landing == "restitute_first":
            held = pull <= strength and after <= self.restitutes_first
        elif self.landing == "pull_as_printed":
            held = self.printed(i, after) <= max(strength, 0.0)
        else:
            held = self.laws.adhesion is not None and pull <= strength
            low = low and self.laws.adhesion is None
        if held or (low and after == 0.0):
            return CAPTURE
        if not low:
            return BOUNCE
        return REST if after <= (1.0 - 1.0 / 1024.0) * speed else AVERAGED_CONTACT

    def printed(self, i: int, after: float) -> float:
        """(2.13), in the displacements of the structure's points: what the others and the drives do to foot i, and its
        own spring and damper with the sign as printed."""
        robot, normal = self.robot, self.robot.normals[:, i]
        load = self.weight + sum(robot.loads[:, d] * piece.value(self.time) for d, piece in enumerate(self.now[0]))
        p, up = robot.own_point[i]
        back = np.linalg.inv(robot.points)  # coordinates by the points' displacements
        x, v = robot.points @ self.z[: self.n], robot.points @ self.z[self.n :]
        stiffness, damping = (back.T @ matrix @ back for matrix in (robot.stiffness, robot.damping))
        others = np.arange(self.n) != p
        force = (back.T @ load)[p] - stiffness[p, others] @ x[others] - damping[p, others] @ v[others]
        assert np.allclose(robot.points[p] * up, normal)
        return up * force - stiffness[p, p] * self.rest_gap[i] + damping[p, p] * after

    def struck(self, normal: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Impulses (k,) on what is held per unit impulse on a foot, and the velocities (n,) that follow."""
        alone = self.inverse @ normal
        if not rows.shape[1]:
            return np.zeros(0), alone
        impulse = -np.linalg.lstsq(rows.T @ self.inverse @ rows, rows.T @ alone, rcond=1e-11)[0]
        return impulse, alone + self.inverse @ rows @ impulse

    def answer(
        self, i: int, speed: float, after: float, rows: np.ndarray, response: np.ndarray, mobility: float
    ) -> np.ndarray:
        """Change of all velocities (n,) by a bounce."""
        change = response / mobility * (speed + after)
        if self.robot.directions is None:
            return change
        mass, d = self.robot.mass, self.robot.directions[:, i]
        if rows.shape[1]:  # what the held feet leave of the direction
            share = np.linalg.lstsq(rows.T @ self.inverse @ rows, rows.T @ d, rcond=1e-11)[0]
            d = d - self.inverse @ rows @ share
        normal = self.robot.normals[:, i]
        if normal @ d <= 1e-9 * math.sqrt(d @ mass @ d * mobility):
            return change
        side = d / (normal @ d) - response / mobility
        size = math.sqrt(side @ mass @ side)
        skew, e = size * math.sqrt(mobility), after / speed
        if skew <= 1e-9:
            return change
        across = side / size
        angle = passive_angle(e, skew) if self.passive else 0.0
        alpha = math.cos(angle) if self.passive else 1.0
        beta = math.sqrt(1.0 - e * e) * math.sin(angle) if self.passive else (1.0 + e) * skew
        before = across @ mass @ self.z[self.n :]
        return change + across * ((alpha - 1.0) * before + beta * speed / math.sqrt(mobility))

    def hold(self, i: int) -> None:
        self.since[i], self.fresh[i] = self.time, False
        normal = self.robot.normals[:, i]
        self.z[: self.n] -= self.inverse @ normal * self.gap(i, self.z) / (normal @ self.inverse @ normal)
        self.contact[i], self.sense[i] = STUCK, 0.0
        row = self.robot.tangents[:, i]
        along = float(row @ self.z[self.n :])
        if abs(along) > 1e-13 * self.length * self.rate or not self.rubs(i):
            self.contact[i] = SLIPPING
            self.sense[i] = math.copysign(1.0, along) if self.rubs(i) else 0.0

    def pull_if_held(self, i: int, whole: bool = True) -> float:
        """Pull on a foot if it were stopped on the ground now; ``whole``: with its smooth force there."""
        normal = self.robot.normals[:, i]
        rows, _which = self.held()
        z = self.z.copy()
        if self.contact[i] == AIR:
            _, response = self.struck(normal, rows)
            z[self.n :] -= response * (normal @ z[self.n :]) / (normal @ response)
        kept = self.contact[i], self.sense[i]
        self.contact[i], self.sense[i] = SLIPPING, 0.0
        pull = self.reactions(self.time, z)[i, False]
        self.contact[i], self.sense[i] = kept
        return pull + whole * self.laws.smooth(0.0, 0.0, self.foot_volts(i, self.time))
