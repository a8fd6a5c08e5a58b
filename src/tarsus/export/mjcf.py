"""MuJoCo's model of a scene: joints whose sums are heights of feet, modes as tendons, contacts in pairs.

A walker is a tree: its body on slides and hinges, and every foot on two slides below its hip. Any other structure is a
chain of bodies that weigh next to nothing: the way of a foot is the sum of its joints, and each mode of the structure a
tendon over all joints that has the mode's inertia, stiffness and damping, so that the linear dynamics are those of the
scene exactly. Lengths, masses and times are scaled by powers of ten, for MuJoCo refuses masses below 1e-15.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as Xml
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq

from tarsus.base.errors import InputError
from tarsus.export.subject import Floats, Subject
from tarsus.model.structure import Walker
from tarsus.model.structure.walker import TURNS

LIGHT = 1e-9
"""Mass of the bodies of a chain, of that which moves with a foot: the robot's inertia is in its tendons."""

SOLID = 0.9999
"""MuJoCo's largest impedance: a contact is its spring and damper, and a ten thousandth of what would happen without."""

STIFF, SHALLOW = 30.0, 100.0
"""Rate of a contact's spring: at least so many times the fastest rate of the structure, and so high that a foot sinks
in by the height of flights over so many."""

PHASE = 0.05
"""Default step, as an angle of the contact's spring [rad]."""

PARTS = 64
"""Moments of touch within a step over which its restitution is averaged."""

STIFFEST = 4.0
"""Largest damping ratio: there the restitution is 0.015, and a step takes less than half of the speed."""


def stepped_restitution(ratio: float, phase: float) -> float:
    """Restitution of a damped spring that only pushes, by its damping ratio and its angle in a step [rad].

    MuJoCo lets a contact go when its force would pull, before the spring is at rest again (Schwager and Poeschel,
    Granular Matter 9, 2007, 465), and takes v += h a(x, v), x += h v: the mean over the moments of touch within a step,
    3 % less than in short steps at an angle of 0.05 and a restitution of 0.3.
    """
    x, v = -phase * (np.arange(PARTS) + 0.5) / PARTS, np.full(PARTS, -1.0)
    while np.any(inside := x < 0.0):
        v = v + phase * inside * np.maximum(-x - 2.0 * ratio * v, 0.0)
        x = x + phase * np.where(inside, v, 0.0)
        if not np.any(v[inside] > 1e-9) and np.all(np.abs(x[inside]) < 1e-6):
            break  # it creeps out
    return float(v.mean())


def damping_ratio(restitution: float, phase: float) -> float:
    """The damping ratio of a contact that has a restitution in steps of a phase [rad], at most `STIFFEST`."""
    if restitution <= stepped_restitution(STIFFEST, phase):
        return STIFFEST
    if restitution >= stepped_restitution(0.0, phase) - 1e-6:
        return 0.0
    root: Any = brentq(lambda ratio: stepped_restitution(ratio, phase) - restitution, 0.0, STIFFEST, xtol=1e-9)
    return float(root)


@dataclass(frozen=True)
class Units:
    """What MuJoCo counts in, powers of ten: length [m], mass [kg], time [s]."""

    length: float
    mass: float
    time: float

    @property
    def force(self) -> float:
        """[N]."""
        return self.mass * self.length / self.time**2

    @property
    def speed(self) -> float:
        """[m/s]."""
        return self.length / self.time


def _power(value: float) -> float:
    return 10.0 ** round(math.log10(value))


@dataclass(frozen=True)
class Mjcf:
    """The model of a scene; step [s]: as asked for, by default from the stiffness of its contacts."""

    subject: Subject
    asked_step: float | None = None

    @cached_property
    def units(self) -> Units:
        """Scales: of gaps, of what moves with a foot, of contacts, for MuJoCo resets what
        accelerates by more than 1e10."""
        return Units(_power(self.subject.height), _power(1.0 / self.mobility.max()), _power(STIFF / self.contact_rate))

    @cached_property
    def mobility(self) -> Floats:
        """Change of a foot's speed by a unit impulse (m,) [1/kg]."""
        system = self.subject.plan.system
        return np.einsum("ni,ni->i", system.normals, system.per_impulse[:, : system.normals.shape[1]])

    @property
    def contact_rate(self) -> float:
        """Rate of a contact's spring on what moves with its foot [rad/s]."""
        plan = self.subject.plan
        return max(STIFF * plan.rate, SHALLOW * self.subject.impact_speed / self.subject.height)

    @property
    def step(self) -> float:
        """Time step [s]."""
        return PHASE / self.contact_rate if self.asked_step is None else self.asked_step

    @property
    def reach(self) -> float:
        """Height [m] up to which an actuator of adhesion pulls: a tenth of the depth of hard impacts, and so low that
        springs give way there by less than 1 / 500 of the adhesion. Without it a foot would be free as soon
        as it trembles."""
        system, depth = self.subject.plan.system, self.subject.impact_speed / self.contact_rate
        pushed = system.per_impulse[:, : system.normals.shape[1]] / self.mobility
        springs = np.einsum("ni,nk,ki->i", pushed, system.stiffness, pushed).max(initial=0.0)
        return min(0.1 * depth, 2e-3 * self.subject.held_strength / springs) if springs > 0.0 else 0.1 * depth

    @property
    def restitution(self) -> float:
        """That of the scene at the speed of its hardest impact."""
        speed = self.subject.impact_speed
        return self.subject.law("rebound", speed) / speed

    @cached_property
    def tree(self) -> Tree:
        """Bodies and joints."""
        scene = self.subject.scene
        return _walker(self) if isinstance(scene.robot.structure, Walker) else _chain(self)

    @property
    def friction(self) -> float:
        """Coefficient of friction of a foot that rests and pushes: the law's bound at a margin and a strength of 1."""
        laws = self.subject.scene.ground.acting_on("friction")
        if not laws or not self.subject.scene.slides:
            return 0.0
        law = next(iter(laws.values()))
        return float(law.evaluate(1.0, 1.0, *(0.0 for _ in law.leading[2:])))

    @cached_property
    def start(self) -> tuple[Floats, Floats]:
        """Joint positions and velocities (n,) at the start, in MuJoCo's units."""
        n = len(self.subject.plan.initial) // 2
        x, v = self.subject.plan.initial[:n], self.subject.plan.initial[n:]
        own = self.tree.own_units(self.units)
        return np.linalg.solve(self.tree.moves, x) / own, np.linalg.solve(self.tree.moves, v) / own * self.units.time

    def text(self) -> str:
        """The file: XML, in MuJoCo's units, which its comment says."""
        units, root = self.units, Xml.Element("mujoco", model=self.subject.scene.name)
        said = (
            f" Lengths in {units.length:g} m, masses in {units.mass:g} kg, times in {units.time:g} s, forces in "
            f"{units.force:g} N; made by tarsus export. Controls: forces of the drives, then adhesion of the feet. "
        )
        root.append(Xml.Comment(said))
        onto, back = self.subject.plan.system.gravity if self.tree.falls else (0.0, 0.0)
        scale = -(units.time**2) / units.length
        Xml.SubElement(
            root,
            "option",
            timestep=_n(self.step / units.time),
            cone="elliptic",
            integrator="Euler",
            gravity=f"{_n(scale * back) if back else 0} 0 {_n(scale * onto)}",
            tolerance="1e-20",
            impratio="10",
        )
        Xml.SubElement(root, "compiler", inertiafromgeom="false", angle="radian", autolimits="true")
        world = Xml.SubElement(root, "worldbody")
        world.append(self.tree.top)
        contact = Xml.SubElement(root, "contact")
        tendon, actuator = Xml.SubElement(root, "tendon"), Xml.SubElement(root, "actuator")
        sensor = Xml.SubElement(root, "sensor")
        self._feet(world, contact, sensor)
        self._drives(tendon, actuator)
        self._adhesion(actuator)
        self._modes(tendon, actuator)
        frame = Xml.SubElement(root, "keyframe")
        control = {name: 0.0 for name in (one.get("name", "") for one in actuator)}
        held = self.subject.held_strength / units.force
        control |= {name: held for name in control if name.startswith("adhesion:")}
        Xml.SubElement(
            frame,
            "key",
            name="start",
            qpos=_row(self.start[0]),
            qvel=_row(self.start[1]),
            ctrl=_row([*control.values()]),
        )
        if not len(tendon):
            root.remove(tendon)
        Xml.indent(root)
        return Xml.tostring(root, encoding="unicode") + "\n"

    def _feet(self, world: Xml.Element, contact: Xml.Element, sensor: Xml.Element) -> None:
        """A plane below every foot, the contact of the two, and where the foot is."""
        ratio, rate = (
            damping_ratio(self.restitution, self.step * self.contact_rate),
            self.contact_rate * self.units.time,
        )
        spring, damper = rate * rate, 2.0 * ratio * rate
        mu = self.friction
        for name, foot in self.subject.scene.robot.feet.items():
            x, y, z = self.tree.places[name]
            height = z - foot.normal * foot.gap / self.units.length
            plane = Xml.SubElement(
                world,
                "geom",
                name=f"ground:{name}",
                type="plane",
                size=f"{_n(2.0 * self.tree.size)} {_n(2.0 * self.tree.size)} 1",
                pos=_row([x, y, height]),
                contype="0",
                conaffinity="0",
                rgba="0.8 0.8 0.8 1",
            )
            if foot.normal < 0:
                plane.set("zaxis", "0 0 -1")
            pair = Xml.SubElement(
                contact,
                "pair",
                geom1=f"ground:{name}",
                geom2=f"foot:{name}",
                condim="3" if mu else "1",
                solref=f"{_n(-spring)} {_n(-damper)}",
                solimp=f"{SOLID} {SOLID} 1 0.5 2",
            )
            if self.subject.scene.ground.holds:
                pair.set("gap", _n(self.reach / self.units.length))
            if mu:
                pair.set("friction", f"{_n(mu)} {_n(mu)} 0 0 0")
            for kind in ("framepos", "framelinvel"):
                Xml.SubElement(sensor, kind, name=f"{kind}:{name}", objtype="site", objname=f"foot:{name}")

    def _modes(self, tendon: Xml.Element, actuator: Xml.Element) -> None:
        """Inertia, springs and dampers that no joint has, as tendons; constant forces on them."""
        units = self.units
        for name, part in self.tree.parts.items():
            own = {
                "armature": part.mass / units.mass,
                "stiffness": part.stiffness / units.mass * units.time**2,
                "damping": part.damping / units.mass * units.time,
            }
            _tendon(tendon, name, part.row, self.tree.joints, **{key: one for key, one in own.items() if one})
            if part.force:
                Xml.SubElement(
                    actuator,
                    "general",
                    name=f"weight:{name}",
                    tendon=name,
                    gaintype="fixed",
                    gainprm="0",
                    biastype="affine",
                    biasprm=f"{_n(part.force / units.force)} 0 0",
                )

    def _drives(self, tendon: Xml.Element, actuator: Xml.Element) -> None:
        onto = self.tree.moves.T @ self.subject.plan.system.loads
        own = self.tree.own_units(self.units)
        for name, load in zip(self.subject.drives, (onto * (own / self.units.length)[:, None]).T, strict=True):
            _tendon(tendon, f"drive:{name}", load, self.tree.joints)
            Xml.SubElement(actuator, "motor", name=f"drive:{name}", tendon=f"drive:{name}")

    def _adhesion(self, actuator: Xml.Element) -> None:
        if not self.subject.scene.ground.holds:
            return
        most = 10.0 * self.subject.held_strength / self.units.force
        for name in self.subject.feet:
            Xml.SubElement(
                actuator,
                "adhesion",
                name=f"adhesion:{name}",
                body=f"foot:{name}",
                gain="1",
                ctrlrange=f"0 {_n(max(most, 1e-12))}",
            )

    @property
    def lost(self) -> list[str]:
        """What of the scene has no counterpart in the model, a sentence each."""
        return _lost(self)


def _n(value: float) -> str:
    return f"{float(value):.17g}"


def _row(values: Sequence[float] | Floats) -> str:
    return " ".join(_n(one) for one in values)


@dataclass(frozen=True)
class TendonPart:
    """A tendon of the structure: its row over the joints (n,), mass [kg], stiffness [N/m], damping [N s/m] and constant
    force [N] along it."""

    row: Floats
    mass: float
    stiffness: float
    damping: float
    force: float


@dataclass(frozen=True)
class Tree:
    """Bodies of a model, the topmost of them; joints (n,) in the order of MuJoCo's; moves (n, n): coordinates of the
    scene per unit of each joint [m or rad]; turns (n,): which joints are hinges; places: where feet are at rest, in
    MuJoCo's units; size: of the robot, in these; falls: whether its bodies have weight; parts: see `TendonPart`."""

    top: Xml.Element
    joints: tuple[str, ...]
    moves: Floats
    turns: NDArrayBool
    places: dict[str, tuple[float, float, float]]
    size: float
    falls: bool
    parts: dict[str, TendonPart]

    def own_units(self, units: Units) -> Floats:
        """What a unit of each joint is (n,) [m or rad]."""
        return np.where(self.turns, 1.0, units.length)


NDArrayBool = np.ndarray


def _tendon(parent: Xml.Element, name: str, row: Floats, joints: Sequence[str], **numbers: float) -> None:
    one = Xml.SubElement(parent, "fixed", name=name, attrib={key: _n(value) for key, value in numbers.items()})
    for joint, share in zip(joints, row, strict=True):
        if share:
            Xml.SubElement(one, "joint", joint=joint, coef=_n(share))


def _foot(body: Xml.Element, name: str, normal: int, radius: float) -> None:
    """A sphere whose lowest point is the foot."""
    Xml.SubElement(
        body,
        "geom",
        name=f"foot:{name}",
        type="sphere",
        size=_n(radius),
        pos=f"0 0 {_n(normal * radius)}",
        contype="0",
        conaffinity="0",
        rgba="0.15 0.4 0.7 1",
    )
    Xml.SubElement(body, "site", name=f"foot:{name}", size=_n(0.1 * radius), pos=f"0 0 {_n(normal * radius)}")


def _inertial(body: Xml.Element, mass: float, turning: Sequence[float]) -> None:
    Xml.SubElement(body, "inertial", pos="0 0 0", mass=_n(mass), diaginertia=_row(turning))


def _slide(body: Xml.Element, name: str, axis: str, **numbers: float) -> None:
    Xml.SubElement(body, "joint", name=name, type="slide", axis=axis, attrib={k: _n(v) for k, v in numbers.items()})


def _walker(model: Mjcf) -> Tree:
    """Body and legs as they are described: springs and dampers are those of joints."""
    robot, units = model.subject.scene.robot, model.units
    walker = robot.structure
    assert isinstance(walker, Walker)
    if walker.body_size > walker.rigid_size:
        raise InputError("mjcf: modes of a walker's body, payloads on springs and compliant tips are not written")
    names, nb, n = walker.body_coordinates, walker.body_size, walker.size
    per_inertia = 1.0 / (units.mass * units.length**2)
    body = Xml.Element("body", name="body")
    roll, pitch = (one or 0.0 for one in (walker.body.roll_inertia, walker.body.pitch_inertia))
    least = max(roll, pitch, walker.body.mass * units.length**2)
    x, y = (one if one > 0.0 else least for one in (roll, pitch))
    _inertial(body, walker.body.mass / units.mass, [x * per_inertia, y * per_inertia, (x + y) * per_inertia])
    axes = {"surge": "1 0 0", "heave": "0 0 1", "roll": "1 0 0", "pitch": "0 1 0"}
    for name in names:
        hinge = name in TURNS
        Xml.SubElement(body, "joint", name=name, type="hinge" if hinge else "slide", axis=axes[name])
    hips = {leg: np.array([one.x, one.y, one.z]) / units.length for leg, one in walker.legs.items()}
    size = max(max(np.abs(hip[:2]).max() for hip in hips.values()), 1.0)
    Xml.SubElement(
        body,
        "geom",
        type="box",
        size=_row([size, 0.5 * size, 0.1 * size]),
        pos=f"0 0 {_n(0.4 * size)}",
        contype="0",
        conaffinity="0",
        rgba="0.6 0.6 0.6 0.5",
    )
    moves, joints = np.eye(n), list(names)
    feet = {foot.point: name for name, foot in robot.feet.items()}
    places: dict[str, tuple[float, float, float]] = {}
    for leg, one in walker.legs.items():
        own = Xml.SubElement(body, "body", name=f"foot:{feet.get(leg, leg)}", pos=_row(hips[leg]))
        mass = one.mass / units.mass
        _inertial(own, mass, [1e-6 * mass] * 3)
        for way, axis, k, c in (
            ("x", "1 0 0", one.stiffness_l, one.damping_l),
            ("z", "0 0 1", one.stiffness_v, one.damping_v),
        ):
            joints.append(f"{leg}:{way}")
            _slide(own, joints[-1], axis, stiffness=k / units.mass * units.time**2, damping=c / units.mass * units.time)
        at = walker.leg_coordinate(leg)
        moves[at, :nb], moves[at + 1, :nb] = walker.hip_row_x(leg), walker.hip_row_z(leg)
        if leg in feet:
            _foot(own, feet[leg], 1, 0.05 * size)
            places[feet[leg]] = tuple(hips[leg].tolist())
    turns = np.array([name in TURNS for name in names] + [False] * (n - nb))
    return Tree(body, tuple(joints), moves, turns, places, float(size), True, {})


def _chain(model: Mjcf) -> Tree:
    """One joint below the other: those of feet first, upward and where a foot rubs along the ground, then others."""
    described, units = model.subject, model.units
    system = described.plan.system
    n = len(system.mass)
    rows, ways = _foot_rows(described)
    if np.linalg.matrix_rank(rows, 1e-8 * np.abs(rows).max(initial=1e-300)) < len(rows):
        raise InputError(
            f"mjcf: the {len(rows)} ways of the feet of {described.scene.name} depend on each other, of "
            f"{n} coordinates, and joints of MuJoCo cannot: leave feet out, or add coordinates"
        )
    rest = _rest_of(rows, system.mass)
    places_of = np.vstack([rows, rest])  # heights and ways by coordinates
    # along each axis, one joint adds to the one before it
    adds, last = np.eye(n), {"z": -1, "x": -1, "y": -1}
    axes = [way for _, way in ways] + ["y"] * (n - len(rows))
    for i, axis in enumerate(axes):
        if axis != "y" and last[axis] >= 0:
            adds[i, last[axis]] = -1.0
        last[axis] = i
    moves: Floats = np.asarray(np.linalg.inv(adds @ places_of), dtype=np.float64)
    mass = LIGHT / model.mobility.max() / units.mass
    size, names = 10.0, [f"{foot}:{way}" for foot, way in ways] + [f"inner:{i}" for i in range(n - len(rows))]
    top = at = Xml.Element("body")
    places: dict[str, tuple[float, float, float]] = {}
    feet, gone = list(described.scene.robot.feet), 0.0
    for i, name in enumerate(names):
        foot = ways[i][0] if i < len(ways) else None
        begins = i == 0 or foot is None or foot != ways[i - 1][0]
        if begins and i:
            at = Xml.SubElement(at, "body")
        if begins:
            step = 4.0 * size if foot is not None and places else 0.0
            gone += step
            at.set("name", f"foot:{foot}" if foot is not None else name)
            at.set("pos", f"{_n(step)} 0 0")
            _inertial(at, mass, [mass] * 3)
        _slide(at, name, {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}[axes[i]])
        if begins and foot is not None:
            _foot(at, foot, described.scene.robot.feet[foot].normal, 0.3 * size)
            places[foot] = (gone, 0.0, 0.0)
    assert len(places) == len(feet)
    return Tree(top, tuple(names), moves, np.zeros(n, dtype=bool), places, size, False, _parts(system, moves))


def _foot_rows(described: Subject) -> tuple[Floats, list[tuple[str, str]]]:
    """Rows (k, n) of the feet's heights, and of their places along the ground where they rub; and of which foot."""
    rows: list[Floats] = []
    ways: list[tuple[str, str]] = []
    structure = described.scene.robot.structure
    for name, foot in described.scene.robot.feet.items():
        rows.append(structure.row(foot.point))
        ways.append((name, "z"))
        if foot.along is not None and described.scene.slides:
            rows.append(structure.row(foot.along))
            ways.append((name, "x"))
    return np.array(rows).reshape(len(rows), structure.size), ways


def _rest_of(rows: Floats, mass: Floats) -> Floats:
    """Rows (n - k, n) that with the given ones (k, n) are a basis, without inertia in common with them."""
    if not len(rows):
        return np.eye(len(mass))
    _, _, ways = np.linalg.svd(rows)
    return ways[len(rows) :]


def _parts(system: object, moves: Floats) -> dict[str, TendonPart]:
    """The structure's modes as tendons over the joints, and dampers that are of no mode."""
    mass, stiffness, damping, constant = (
        getattr(system, name) for name in ("mass", "stiffness", "damping", "constant")
    )
    squares, shapes = eigh(stiffness, mass)
    onto = shapes.T @ mass @ moves  # modal coordinates by joints
    of_modes = shapes.T @ (0.5 * (damping + damping.T)) @ shapes
    apart = of_modes - np.diag(np.diag(of_modes))
    mixed = np.abs(apart).max(initial=0.0) > 1e-9 * np.abs(of_modes).max(initial=1e-300)
    parts: dict[str, TendonPart] = {}
    push = shapes.T @ constant
    for k, row in enumerate(onto):
        size = np.abs(row).max()
        own = 0.0 if mixed else float(of_modes[k, k]) * size**2
        spring = max(float(squares[k]), 0.0) * size**2
        parts[f"mode:{k + 1}"] = TendonPart(row / size, size**2, spring, own, float(push[k]) * size)
    if mixed:
        for k, (value, way) in enumerate(_ways(of_modes)):
            row = way @ onto
            size = np.abs(row).max()
            if value > 0.0:
                parts[f"damper:{k + 1}"] = TendonPart(row / size, 0.0, 0.0, float(value) * size**2, 0.0)
    return parts


def _ways(damping: Floats) -> Iterator[tuple[float, Floats]]:
    """Dampers (n,) that together are a damping matrix, each with its size."""
    values, ways = np.linalg.eigh(damping)
    return zip(values.tolist(), ways.T, strict=True)


LOSSES = {
    "momentum": "resistance of the air between foot and ground",
    "force": "force of the ground on the feet",
    "excess": "speed up to which a foot that lands is held: here every foot rebounds, and adhesion holds it afterwards",
}
"""What laws without a counterpart do, by their hook."""


def _lost(model: Mjcf) -> list[str]:
    described = model.subject
    ground, robot = described.scene.ground, described.scene.robot
    out = [f"{name}: {LOSSES[law.hook]}" for name, law in ground.acting_laws.items() if law.hook in LOSSES]
    if ground.holds:
        young, held = described.law("strength", 0.0), described.held_strength
        out.append(
            f"adhesion: its change with time and volts; {young:.4g} N at first contact and 0 V, the actuators "
            f"hold {held:.4g} N, what contacts held when they ended"
        )
    if ground.impact is not None:
        out.append(f"impact: the map '{ground.impact.kind}'; impacts are mass-weighted")
    for law in ground.acting_on("friction").values() if described.scene.slides else ():
        if getattr(law, "kind", "") != "coulomb":
            out.append(
                f"friction: the law '{getattr(law, 'kind', type(law).name())}'; it is Coulomb's, {model.friction:g}"
            )
    if ground.acting_on("rebound") and not hasattr(ground.restitution, "coefficient"):
        out.append(f"restitution: its change with speed; it is that at {described.impact_speed:.4g} m/s")
    damping = described.plan.system.damping
    if np.abs(damping - damping.T).max(initial=0.0) > 1e-9 * np.abs(damping).max(initial=0.0):
        out.append("damping: what of a matrix that is not symmetric takes no energy, or gives some")
    laws = {str(getattr(drive.law, "kind", "")) for drive in robot.drives.values()}
    out += [f"drives: the law '{kind}' from volts to force; drives.csv has the forces" for kind in sorted(laws)]
    if any(foot.electrode for foot in robot.feet.values()):
        out.append("electrodes: volts are not in the model")
    if ground.holds:
        out.append(f"adhesion: that it has no range; it pulls up to {model.reach:.3g} m above the ground")
    out.append(
        f"contact: it lasts {math.pi / model.contact_rate:.3g} s and is "
        f"{described.impact_speed / model.contact_rate:.3g} m deep at {described.impact_speed:.3g} m/s; here neither"
    )
    return out
