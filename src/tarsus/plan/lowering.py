"""Scene to arrays: the one place that knows both the descriptions and the kernels."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from itertools import accumulate
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.linear import largest_of, product, solve
from tarsus.base.spec import get_value
from tarsus.base.units import format_quantity
from tarsus.core import _native
from tarsus.core.arrays import Body as LeggedBody
from tarsus.core.modes import Floats, LinearSystem
from tarsus.model.drive.lower import lower
from tarsus.model.drive.pieces import Channels, Pieces
from tarsus.model.laws.base import Law, SmoothLaw
from tarsus.model.laws.impact_map import Body, MassWeighted
from tarsus.model.laws.landing import PullAsPrinted
from tarsus.model.laws.translate import translate
from tarsus.model.profile import heights_of
from tarsus.model.standing import Stance, stance_of
from tarsus.model.structure.walker import STRAIGHT_AHEAD, Walker, add_springs
from tarsus.plan.moving import ground_forces, shifts_of, velocities_at_start
from tarsus.plan.rows import Rows

if TYPE_CHECKING:
    from tarsus.model.laws.program import Program
    from tarsus.model.scene import Ground, Scene
    from tarsus.model.structure.base import Matrices


def without_native(of: Any) -> dict[str, Any]:
    """What is pickled: the fields; what the native engine holds of them is made again where it is needed."""
    return {name: of.__dict__[name] for name in of.__dataclass_fields__}


@dataclass(frozen=True)
class FootLaws:
    """Laws of every foot: flags (m,), parameters (m, np), volts channel (m,).

    acting: the laws by name; switched: those that do not act on all feet, whose parameters end with 1 or 0; columns:
    where in the parameter row each one's parameters start; terms: the same for the engine, (hook, twin, number of a
    program, first column) each.
    """

    flags: np.ndarray
    parameters: np.ndarray
    volts: np.ndarray
    acting: Mapping[str, Law]
    columns: Mapping[str, int]
    terms: tuple[tuple[int, int, int, int], ...]
    programs: tuple[Program, ...]
    switched: frozenset[str] = frozenset()

    def __getstate__(self) -> dict[str, Any]:
        return without_native(self)

    def of_row(self, row: Sequence[float]) -> dict[str, Law]:
        """The laws that act on a foot, with its row of parameters (np,)."""
        out = {}
        for name, law in self.acting.items():
            own = row[self.columns[name] :]
            if name not in self.switched or own[len(law.names())]:
                out[name] = law.model_copy(update=dict(zip(law.names(), own, strict=False)))
        return out

    @property
    def use_rates(self) -> bool:
        """Whether a law of a foot in the air asks for its gap rate."""
        return bool(np.any(self.flags & _native.FLAGS["uses_rate"]))

    @property
    def remembers(self) -> bool:
        """Whether what a contact holds goes by those before it."""
        return any(hook == _native.HOOKS.index("remaining") for hook, *_ in self.terms)

    @cached_property
    def native(self) -> _native.Laws:
        """The laws as the engine holds them; their parameters come with every batch."""
        return _native.Laws(self.arrays(self.terms, self.programs))

    def arrays(self, terms: Sequence[Sequence[int]], programs: Sequence[Program]) -> dict[str, Any]:
        """The laws as the engine takes them, by name."""
        scales = [
            (dimension, number, self.columns[name] + law.names().index(field))
            for number, (name, law) in enumerate(self.acting.items())
            for dimension, fields in enumerate((law.length_scale, law.force_scale))
            for field in fields
        ]
        out = {"flags": self.flags, "volts": self.volts, "columns": self.parameters.shape[1]}
        out |= {"terms": np.array(terms, dtype=np.int64), "scales": np.array(scales, dtype=np.int64)}
        for i, one in enumerate(programs):
            out |= {f"{i}.code": one.code.astype(np.int64), f"{i}.constants": one.constants}
            out[f"{i}.sizes"] = np.array([one.arguments, one.parameters])
        return out


@dataclass(frozen=True)
class Legs:
    """A walker's body and legs as arrays.

    body: see `tarsus.core.arrays`; blocks (nt, 3): mass, stiffness and damping of the different legs, upward
    and along the way.
    """

    body: LeggedBody
    blocks: np.ndarray

    @classmethod
    def of(cls, body: LeggedBody) -> Legs:
        """Those of a body, whose legs are distinguished."""
        ways = body.directions
        values = np.stack([np.repeat(body.mass[:, None], ways, axis=1), body.stiffness, body.damping], axis=2)
        blocks, kind = np.unique(values.reshape(-1, 3), axis=0, return_inverse=True)
        return cls(body._replace(kind=kind.reshape(-1, ways).astype(np.int64)), blocks)

    def __getstate__(self) -> dict[str, Any]:
        return without_native(self)

    @property
    def sways(self) -> bool:
        """Whether legs move across the way too."""
        return self.body.directions > 2

    @cached_property
    def native(self) -> _native.LeggedBody:
        """The body as the engine holds it: its weights are those of unit gravity, its gaps those of no run."""
        return _native.LeggedBody(self.body._asdict())


@dataclass(frozen=True)
class Plan:
    """A scene as arrays, ready for the engine.

    system: the linear structure; laws: flags, parameters and volts channel per foot; channels: forces of the drives
    and of ground that moves, then volts of those of ``charged``; initial (2n,): displacements and velocities at t = 0;
    periods (nd,) [s]: of the signals, NaN where one does not repeat. length [m], force [N], rate [1/s]: scales that
    turn relative tolerances into absolute ones. legs: of a structure that walks, its body and legs; None for any other.
    stance: of a walker that starts standing, how. profile: of uneven ground, see `lower_profile`. lift (n,):
    displacements of a robot that is lifted by 1 m, where uneven ground is to lift it; else empty. idle (nd,) [N]:
    forces of drives without volts, after their history, and of the ground, which stays until t = 0.
    """

    system: LinearSystem
    laws: FootLaws
    channels: tuple[Pieces, ...]
    charged: tuple[int, ...]
    initial: np.ndarray
    periods: np.ndarray
    length: float
    force: float
    rate: float
    legs: Legs | None = None
    stance: Stance | None = None
    profile: np.ndarray = field(default_factory=lambda: np.zeros(0))
    lift: np.ndarray = field(default_factory=lambda: np.zeros(0))
    idle: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __getstate__(self) -> dict[str, Any]:
        return without_native(self)

    @property
    def feet(self) -> int:
        return self.system.normals.shape[1]

    @property
    def drives(self) -> int:
        return self.system.loads.shape[1]

    def channels_of(self, drive: int) -> list[int]:
        """Number of the channel of a drive's force, and of that of its volts where laws see them."""
        return [drive, *(self.drives + k for k, d in enumerate(self.charged) if d == drive)]

    @cached_property
    def signals(self) -> _native.Signals:
        """The drive channels as the engine holds them."""
        return _native.Signals(Channels.of(self.channels).arrays)

    @cached_property
    def rules(self) -> _native.StartRules:
        """What the data of a run determine before it begins, as the engine holds it."""
        return _native.StartRules(self.start_arrays)

    @property
    def start_arrays(self) -> dict[str, Any]:
        """The same as the engine takes it, by name."""
        system, stance = self.system, self.stance
        out = {
            name: np.ascontiguousarray(getattr(system, name)) for name in ("normals", "stiffness", "weight", "loads")
        }
        none = np.zeros(0, dtype=np.int64)
        return out | {
            "feet": self.feet,
            "drives": self.drives,
            "driven": int(stance is not None and stance.driven),
            "stance": np.zeros(0) if stance is None else stance.per_source,
            **{name: none if stance is None else getattr(stance, name) for name in ("heights", "ways", "loose")},
        }


def lower_scene(scene: Scene, drive: Callable[..., tuple[Pieces, Pieces]] = lower) -> Plan:
    """Lower a scene to arrays; ``drive`` lowers its drives.

    Raises InputError where a law of the user cannot be compiled, and where a walker that is to start standing cannot.
    """
    system = lower_system(scene)
    names = list(scene.robot.drives)
    forces, volts, periods, signals = [], [], [], scene.actuator_volts
    for name, one in scene.robot.drives.items():
        force, volt = drive(signals[name], one.law, one.history)
        forces.append(force)
        volts.append(volt)
        periods.append(signals[name].period or np.nan)
    feet = list(scene.robot.feet.values())
    driven_by_ground = [] if scene.ground.motion is None else ground_forces(scene, system)
    periods += [one.shift.wave.period or np.nan for one in driven_by_ground]
    laws = lower_laws(scene)
    if scene.ground.makes_energy:
        laws.flags[:] |= _native.FLAGS["map_as_is"]
    sees = any(law.by_volts() for law in laws.acting.values())
    # where no foot has an electrode, users' laws see the volts of the first drive
    rest = names[0] if names and not any(f.electrode for f in feet) else None
    wired = [f.electrode if f.electrode is not None else rest for f in feet]
    used = sorted({names.index(w) for w in wired if sees and w is not None})
    for i, w in enumerate(wired):
        if sees and w is not None:
            laws.volts[i] = system.loads.shape[1] + used.index(names.index(w))
    channels = (*forces, *(one.pieces for one in driven_by_ground), *(volts[d] for d in used))
    lift = scene.robot.structure.vertical() if scene.initial.lifted else None
    plan = Plan(
        system,
        laws,
        channels,
        tuple(used),
        _initial(scene, len(system.mass)),
        np.array(periods),
        math.nan,
        math.nan,
        _rate(system),
        lower_legs(scene, system),
        lower_stance(scene, system),
        lower_profile(scene.ground, scene.across),
        np.zeros(0) if lift is None else np.asarray(lift),
        np.array([one.exerted() for one in scene.robot.drives.values()] + [0.0] * len(driven_by_ground)),
    )
    return _at_start(plan, list(scene.robot.feet))


def _initial(scene: Scene, n: int) -> Floats:
    """Displacements and velocities (2n,) that a scene gives."""
    initial = np.zeros(2 * n)
    if scene.initial.displacement is not None:
        initial[:n] = scene.initial.displacement
    if scene.initial.velocity is not None:
        initial[n:] = scene.initial.velocity
    if scene.initial.in_laboratory:
        waves = {direction: one.wave for direction, one in shifts_of(scene).items()}
        initial[n:] -= velocities_at_start(scene, waves)[0]
    return initial


def _at_start(plan: Plan, feet: Sequence[str]) -> Plan:
    """The same plan with the state in which it starts, and its scales. Raises InputError as `started`."""
    row: Any = SimpleNamespace(
        signals=plan.signals,
        parameters=plan.laws.parameters[None],
        initial=plan.initial[None],
        sources=plan.system.sources[None],
        scales=np.zeros((1, 3)),
        channels=np.arange(len(plan.channels))[None],
        profile=plan.profile[None],
    )
    own, ((length, force, _),) = started(plan, row, plan.idle[None], feet)
    # what the engine has made of the plan by now does not depend on these three, and stays
    plan.__dict__.update(initial=own.ravel(), length=float(length), force=float(force))
    return plan


SPRINGS = ("stiffness_v", "damping_v", "stiffness_l", "damping_l", "stiffness_t", "damping_t", "tilt")
"""Ends of paths of numbers that are in the matrices of stiffness and damping alone."""


def of_leg(scene: Scene, path: str) -> bool:
    """Whether the number at a path is a spring or a damper between hip and foot of a walker's leg, which a plan has in
    its arrays as it is; where the ground moves its forces have them too."""
    walker, keys = scene.robot.structure, path.split(".")
    if not isinstance(walker, Walker) or keys[:3] != ["robot", "structure", "legs"] or scene.ground.motion is not None:
        return False
    return keys[-1] in SPRINGS[:-1] and len(keys) == 5 and walker.legs[keys[3]].tip is None


def resprung(plan: Plan, scene: Scene, values: Mapping[str, float]) -> Plan:
    """The plan of a walker with other springs and dampers of its legs, by path (`of_leg`); no description is read."""
    assert plan.legs is not None
    assert isinstance(scene.robot.structure, Walker)
    body, names = plan.legs.body, list(scene.robot.structure.legs)
    own = {what: getattr(body, what).copy() for what in ("stiffness", "damping")}
    for path, value in values.items():
        *_, leg, field = path.split(".")
        what, _, way = field.partition("_")
        own[what][names.index(leg), "vlt".index(way)] = value
    body = body._replace(**own)
    damping, stiffness = _springs(body, len(plan.system.mass))
    out = replace(plan, system=replace(plan.system, damping=damping, stiffness=stiffness), legs=Legs.of(body))
    out.__dict__["signals"] = plan.signals  # of the same drives
    return out


def _springs(body: LeggedBody, size: int) -> tuple[Floats, Floats]:
    """Damping and stiffness (n, n) of a walker, to the last bit as `Walker.matrices`."""
    nb, nl = len(body.body_mass), len(body.mass)
    damping, stiffness = np.zeros((size, size)), np.zeros((size, size))
    damping[:nb, :nb], stiffness[:nb, :nb] = body.body_damping, body.body_stiffness
    springs = [
        (at, body.hip[k, w], body.stiffness[k, w], body.damping[k, w])
        for k in range(nl)
        for w, at in ((1, nb + 2 * k), (0, nb + 2 * k + 1), (2, nb + 2 * nl + k))[: body.directions]
    ]
    add_springs(stiffness, damping, springs)
    return damping, stiffness


def renumbered(plan: Plan, scene: Scene, paths: Sequence[str]) -> Plan | None:
    """The plan of a scene that differs from that of a plan in the numbers at some paths alone: what they move in its
    arrays is moved; None where one is neither a spring or damper of a leg nor a parameter of a law.

    Raises InputError as `lower_scene`.
    """
    springs = {path: float(get_value(scene, path)) for path in paths if of_leg(scene, path)}
    places = {path: slot(scene, path) for path in paths if path not in springs}
    parameters = plan.laws.parameters.copy()
    for path, place in places.items():
        if place is None or place.kind is not Kind.LAW:
            return None
        parameters[slice(None) if place.feet is None else list(place.feet), place.at] = get_value(scene, path)
    if springs and plan.system.directions is not None:  # these may depend on springs
        return None
    out = resprung(plan, scene, springs) if springs else replace(plan)
    laws = replace(plan.laws, parameters=parameters, acting=scene.ground.acting_laws)
    laws.__dict__["native"] = plan.laws.native  # parameters come with every batch
    stance, rate, initial = lower_stance(scene, out.system), _rate(out.system), _initial(scene, len(out.system.mass))
    out.__dict__.update(laws=laws, stance=stance, rate=rate, initial=initial, signals=plan.signals)
    return _at_start(out, list(scene.robot.feet))


def lower_stance(scene: Scene, system: LinearSystem) -> Stance | None:
    """How a walker stands that is to start so. Raises InputError where nothing holds it up."""
    standing = scene.initial.standing
    if standing is None:
        return None
    return stance_of(scene.robot, system.stiffness, system.weight, system.loads, standing.driven)


def lower_system(scene: Scene) -> LinearSystem:
    """The linear structure of a scene with its feet, drives and weight."""
    structure = scene.robot.structure
    matrices = structure.matrices()
    n = structure.size
    feet = scene.robot.feet.values()
    normals = np.zeros((n, len(feet)))
    for i, foot in enumerate(feet):
        normals[:, i] = foot.normal * structure.row(foot.point)
    onto = [drive.load.vector(structure) for drive in scene.robot.drives.values()]
    if scene.ground.motion is not None:
        onto += [one.load for one in ground_forces(scene, matrices)]
    loads = np.stack(onto, axis=1) if onto else np.zeros((n, 0))
    weight = np.zeros((n, 2))
    if scene.ground.gravity is not None:
        up, ahead = structure.vertical(), structure.horizontal()
        assert up is not None  # checked by Scene
        weight[:, 0] = -product(matrices.mass, up)
        if ahead is not None:
            weight[:, 1] = -product(matrices.mass, ahead)
    return LinearSystem(
        np.ascontiguousarray(matrices.mass, dtype=float),
        matrices.damping,
        matrices.stiffness,
        normals,
        np.array([foot.gap for foot in feet], dtype=float),
        loads,
        weight,
        gravity_on(*scene.ground.falling),
        _directions(scene, matrices, normals),
        _alone(scene),
        _tangents(scene),
    )


def gravity_on(acceleration: ArrayLike, incline: ArrayLike) -> Floats:
    """Gravity (2, ...) [m/s^2] on a ground that rises forward by an incline [rad]: into it, and back along the way."""
    return np.array([np.multiply(acceleration, np.cos(incline)), np.multiply(acceleration, np.sin(incline))])


def lower_profile(ground: Ground, feet: Mapping[str, float]) -> Floats:
    """Of each line of uneven ground below feet at places across the way by name points (2 np,) [m], and factors
    (3 (np - 1),) where its facets are not alike; none of level ground."""
    if ground.profile is None:
        return np.zeros(0)
    lines, _ = ground.profile.lines(feet)
    return np.concatenate([part.ravel() for line in lines for part in (line.points, line.patches)])


def lines_below(body: LeggedBody, profiles: Floats) -> Iterator[tuple[Floats, bool, NDArray[np.intp]]]:
    """Of each line of uneven ground of runs its points (nr, np, 2) [m], whether it repeats, and which feet go along it;
    profiles (nr, .): as `lower_profile`."""
    first = 0
    for number, (count, repeats, patched) in enumerate(zip(body.points, body.periodic, body.patched, strict=True)):
        points = profiles[:, first : first + 2 * count].reshape(len(profiles), -1, 2)
        yield points, bool(repeats), np.flatnonzero(body.line == number)
        first += 2 * count + 3 * (count - 1) * patched


def still_only(scene: Scene, what: str) -> None:
    """Raise InputError for ground that moves, and for feet with grounds of their own, where some part of the library,
    named, knows neither."""
    if scene.ground.motion is not None:
        raise InputError([f"ground.motion: {what} on ground that stays: leave it out"])
    if scene.grounds:
        raise InputError([f"grounds: {what} on one ground for all feet: leave them out"])


def level_only(plan: Plan, what: str) -> None:
    """Raise InputError for uneven ground and for legs that move across the way, where some part of the library, named,
    knows neither."""
    if plan.profile.size:
        raise InputError([f"ground.profile: {what} on level ground alone: leave it out"])
    ahead_only(plan, what)


def ahead_only(plan: Plan, what: str) -> None:
    """Raise InputError for legs that move across the way, where some part of the library, named, knows motion in one
    plane alone."""
    if plan.legs is not None and plan.legs.sways:
        text = f"{what} with legs that move upward and along the way alone: leave out stiffness_t and damping_t"
        raise InputError([f"robot.structure.legs: {text}"])


def lower_legs(scene: Scene, system: LinearSystem) -> Legs | None:
    """Body and legs of a scene with the linear structure ``system``; None where that does not walk."""
    robot, profile = scene.robot, scene.ground.profile
    lines, line = ([], [0] * len(robot.feet)) if profile is None else profile.lines(scene.across)
    walker = robot.structure
    if not isinstance(walker, Walker):
        return None
    names, nb = list(walker.legs), walker.body_size
    nl, nd = len(names), system.loads.shape[1]
    values = np.array(
        [
            [(one.mass, one.stiffness_v, one.damping_v), (one.mass, one.stiffness_l, one.damping_l)]
            + [(one.mass, leg.stiffness_t, leg.damping_t)] * walker.sways
            for leg, one in ((leg, leg.end) for leg in walker.legs.values())
        ]
    )
    ways = values.shape[1]
    hip = np.array([[*walker.above(leg)[::-1], walker.hip_row_y(leg)][:ways] for leg in names])
    damping, stiffness = walker.within()
    # what moves a hip or a foot, and a coordinate within the body by itself
    moves = np.abs([*hip.reshape(-1, nb), *map(walker.hip_row_z, names), *map(walker.hip_row_x, names)]).max(axis=0)
    lever = np.maximum(moves, np.where(np.arange(nb) < walker.rigid_size, 1e-300, 1.0))
    leg = np.array([names.index(one.point) for one in robot.feet.values()], dtype=np.int64)
    foot, gap = np.full(nl, -1, dtype=np.int64), np.zeros(nl)
    foot[leg], gap[leg] = np.arange(len(leg)), system.rest_gap
    plane, sideways = np.split(system.loads[nb:], [2 * nl])
    # upward, along the way, and across it
    onto = np.concatenate([plane.reshape(nl, 2, nd)[:, ::-1], sideways.reshape(nl, walker.directions - 2, nd)], axis=1)
    touched = np.any(onto != 0.0, axis=1)
    of_leg, driven_by = np.nonzero(touched)
    body = LeggedBody(
        body_mass=walker.body_mass(),
        body_weight=-system.weight[:nb],
        body_stiffness=stiffness,
        body_damping=damping,
        lever=lever,
        mass=values[:, 0, 0].copy(),
        stiffness=values[:, :, 1].copy(),
        damping=values[:, :, 2].copy(),
        hip=hip,
        gap=gap,
        foot=foot,
        leg=leg,
        kind=np.zeros((nl, ways), dtype=np.int64),
        weight=-system.weight[nb + 1 : nb + 2 * nl : 2, 0],
        first=np.concatenate([[0], np.cumsum(touched.sum(axis=1))]).astype(np.int64),
        drive=driven_by,
        gain=onto[of_leg, :, driven_by].reshape(-1, ways),
        body_load=np.ascontiguousarray(system.loads[:nb].T),
        place=np.array([one.x for one in walker.legs.values()]),
        points=np.array([len(one.points) for one in lines], dtype=np.int64),
        periodic=np.array([one.repeats for one in lines], dtype=np.int64),
        patched=np.array([len(one.patches) > 0 for one in lines], dtype=np.int64),
        line=np.array(line, dtype=np.int64),
        directions=ways,
    )
    return Legs.of(body)


def _tangents(scene: Scene) -> np.ndarray | None:
    """Rows (n, m) of the feet's places along the ground, zeros for those that slide freely; None where all do, and of a
    walker, whose legs say it."""
    if not scene.slides or isinstance(scene.robot.structure, Walker):
        return None
    row, feet = scene.robot.structure.row, scene.robot.feet.values()
    return np.stack([row(foot.along) if foot.along else np.zeros_like(row(foot.point)) for foot in feet], axis=1)


def _alone(scene: Scene) -> np.ndarray | None:
    """Coordinates (n, m) that move one foot alone; None unless feet land by the pull as printed."""
    if not isinstance(scene.ground.landing, PullAsPrinted) or not scene.robot.feet:
        return None
    structure = scene.robot.structure
    return np.stack([foot.normal * structure.alone(foot.point) for foot in scene.robot.feet.values()], axis=1)


def _directions(scene: Scene, matrices: Matrices, normals: np.ndarray) -> np.ndarray | None:
    """Impact direction of every foot (n, m); None for the mass-weighted map."""
    chosen = scene.ground.impact
    if chosen is None or isinstance(chosen, MassWeighted):
        return None
    body = Body(matrices.mass, matrices.stiffness, scene.robot.structure.row)
    columns = [chosen.direction(name, normals[:, i], body) for i, name in enumerate(scene.robot.feet)]
    return np.array(columns).reshape(len(columns), len(matrices.mass)).T


def lower_laws(scene: Scene) -> FootLaws:
    """The laws that act on the feet: each takes the next columns of the parameter rows, and its twin or its program.

    Raises InputError where a law of the user cannot be compiled.
    """
    acting, own = scene.ground.acting_laws, [ground.acting_laws for ground in scene.foot_grounds]
    switched = _switched(scene)
    columns = _columns(acting, switched)
    printed = _native.FLAGS["pull_as_printed"] if isinstance(scene.ground.landing, PullAsPrinted) else 0
    rows, flags = [], []
    for laws in own or [acting]:
        row: list[float] = []
        for name, law in acting.items():
            row += laws.get(name, law).parameters()
            row += [float(name in laws)] * (name in switched)
        rows.append(row)
        flags.append(printed)
        for law in laws.values():
            assert law.hook is not None  # or it would not act
            flags[-1] |= _native.FLAGS.get(law.hook, 0)
            if isinstance(law, SmoothLaw) and law.uses_rate:
                flags[-1] |= _native.FLAGS["uses_rate"]
    m = len(own)
    return FootLaws(
        np.array(flags[:m], dtype=np.int64),
        np.array(rows, dtype=float).reshape(len(rows), -1),
        np.full(m, -1, dtype=np.int64),
        acting,
        columns,
        *_terms(acting, columns, switched),
        switched,
    )


def _switched(scene: Scene) -> frozenset[str]:
    """Names of the laws that do not act on all feet."""
    grounds = scene.foot_grounds if scene.grounds else ()
    return frozenset(name for name in scene.ground.acting_laws if any(name not in one.acting_laws for one in grounds))


def _terms(
    acting: Mapping[str, Law], columns: Mapping[str, int], switched: frozenset[str]
) -> tuple[tuple[tuple[int, int, int, int], ...], tuple[Program, ...]]:
    """What the engine is to call, and the programs among it: every function of each law, by its twin where there is
    one and it acts on all feet."""
    terms: list[tuple[int, int, int, int]] = []
    programs: list[Program] = []
    for name, law in acting.items():
        for hook in type(law).functions() or {law.hook: None}:
            twin = _twin(type(law)) if hook == law.hook and name not in switched else -1
            terms.append((_native.HOOKS.index(hook), twin, -1 if twin >= 0 else len(programs), columns[name]))
            if twin < 0:
                programs.append(program_of(type(law), hook, switched=name in switched))
    return tuple(terms), tuple(programs)


def _columns(acting: Mapping[str, Law], switched: frozenset[str]) -> dict[str, int]:
    """First column of each law's parameters."""
    counts = [len(law.names()) + (name in switched) for name, law in acting.items()]
    return dict(zip(acting, accumulate([0, *counts[:-1]]), strict=True)) if acting else {}


def _twin(law: type[Law]) -> int:
    """Number of the law's function among those that the engine has written out; -1 where it carries out a program,
    as of a user's law, whatever its name."""
    comes_along = law.__module__.startswith(_LAWS)
    return _native.TWINS.get(f"{law.__name__}.{law.function_name}", -1) if comes_along else -1


_LAWS = Law.__module__.removesuffix("base")
"""Package of the laws that come with the library, a file each."""


def program_of(law: type[Law], hook: str | None = None, *, switched: bool = False) -> Program:
    """A law's function, or that of another hook, as the engine carries it out; switched: see `translate`.

    Raises InputError where it contains what a law may not.
    """
    functions = law.functions()
    if (hook or law.hook) not in functions:
        raise InputError(f"{law.name()}: defines no function {law.function_name}")
    return translate(*functions[hook or law.hook or ""], switched=switched)


class Kind(Enum):
    """What a slot is a number of."""

    LAW = "parameter of a ground law"
    INITIAL = "initial state"
    GAP = "rest gap of a foot"
    GRAVITY = "gravity, or the incline by which it is turned"
    PROFILE = "shape of uneven ground"
    MOTION = "how the ground moves"
    DRIVE = "what one drive does"
    GAIT = "what the drives of a gait do"


@dataclass(frozen=True)
class Place:
    """Where a slot is. at: column of the law parameters or of the initial state, or number of the foot or drive; feet:
    numbers of those that a parameter of a law is of, None for all."""

    kind: Kind
    at: int = 0
    feet: tuple[int, ...] | None = None

    @property
    def bounded(self) -> bool:
        """Whether its bounds are an interval of its own, whatever else varies; what drives do is checked as a whole."""
        return self.kind not in (Kind.DRIVE, Kind.GAIT, Kind.MOTION)


_TURNED = ("ground.gravity.acceleration", "ground.incline")
"""What gravity on the ground depends on, as `tarsus.model.ground.Ground.falling`."""


def slot(scene: Scene, path: str) -> Place | None:
    """The slot of the number at a path, or None where its value enters a plan's structure."""
    keys = path.split(".")
    if (column := _law_column(scene, path)) is not None:
        return Place(Kind.LAW, column, _feet_of(scene, keys))
    if (column := _initial_column(scene, path)) is not None:
        return Place(Kind.INITIAL, column)
    if path in _TURNED and scene.ground.gravity is not None:
        return Place(Kind.GRAVITY, _TURNED.index(path))
    if keys[:2] == ["ground", "profile"] and _is_float(scene, path):
        return Place(Kind.PROFILE)
    if keys[:2] == ["ground", "motion"] and _is_float(scene, path):
        return Place(Kind.MOTION)
    if keys[:2] == ["robot", "feet"] and len(keys) == 4 and keys[3] == "gap" and keys[2] in scene.robot.feet:
        return Place(Kind.GAP, list(scene.robot.feet).index(keys[2]))
    if keys[0] == "gait" and scene.gait is not None:
        return Place(Kind.GAIT)
    drives = list(scene.robot.drives)
    if keys[0] == "signals" and len(keys) > 2 and keys[1] in drives and keys[1] in scene.signals:
        return Place(Kind.DRIVE, drives.index(keys[1]))
    if keys[:2] == ["robot", "drives"] and len(keys) > 3 and keys[2] in drives and keys[3] != "load":
        return Place(Kind.DRIVE, drives.index(keys[2]))
    return None


def _is_float(scene: Scene, path: str) -> bool:
    try:
        return isinstance(get_value(scene, path), float)
    except InputError:
        return False


def _law_column(scene: Scene, path: str) -> int | None:
    """Column of a foot's parameter row that holds the value at ``path``; None if it is no parameter of a law.

    Such values vary from run to run without lowering the scene again.
    """
    head, _, rest = path.partition(".")
    ground: Ground | None = scene.ground
    if head == "grounds":
        name, _, rest = rest.partition(".")
        ground = scene.grounds.get(name)
    elif head != "ground":
        return None
    if ground is None:
        return None
    whole, _, field = rest.rpartition(".")
    name = whole.removeprefix("laws.")
    law = ground.acting_laws.get(name)
    if law is None or field not in law.names() or (name in ground.laws) != (name != whole):
        return None
    return _columns(scene.ground.acting_laws, _switched(scene))[name] + law.names().index(field)


def _feet_of(scene: Scene, keys: Sequence[str]) -> tuple[int, ...] | None:
    """Numbers of the feet on the ground that a path leads into; None where all are on one."""
    if not scene.grounds:
        return None
    own = keys[1] if keys[0] == "grounds" else None
    return tuple(i for i, foot in enumerate(scene.robot.feet.values()) if foot.ground == own)


def _initial_column(scene: Scene, path: str) -> int | None:
    """Place in the initial state (2n,) of the value at ``path``; None if it is none that the scene gives."""
    keys = path.split(".")
    if len(keys) != 3 or keys[0] != "initial" or keys[1] not in ("displacement", "velocity"):
        return None
    given = getattr(scene.initial, keys[1])
    if given is None or not keys[2].isdecimal() or int(keys[2]) >= len(given):
        return None
    return int(keys[2]) + (len(given) if keys[1] == "velocity" else 0)


def started(plan: Plan, rows: Rows, idle: Floats, feet: Sequence[str]) -> tuple[Floats, Floats]:
    """Initial states of runs, (nr, 2n), where a walker starts standing those in which each stands, and their scales
    (nr, 3), with lengths and forces of their own. idle (nr, nd) [N]: of drives without volts; feet: their names.

    Raises InputError for the first run that would start below the ground, or does not stand, and for an incline under
    a walker that sways.
    """
    if plan.legs is not None and plan.legs.sways and np.any(rows.sources[:, -1]):
        raise InputError([f"ground.incline: {STRAIGHT_AHEAD}"])
    initial, scales, refused = _native.start_rows(plan.rules, plan.laws.native, rows.signals, rows, idle)
    if plan.legs is not None and len(plan.legs.body.points):
        initial, scales, refused = _started_above(plan, rows, idle, initial)
    if len(refused):
        raise InputError([_refusal(int(run), int(fault), feet, int(foot), by) for run, fault, foot, by in refused])
    return initial, scales


def _started_above(plan: Plan, rows: Rows, idle: Floats, initial: Floats) -> tuple[Floats, Floats, Floats]:
    """The same above uneven ground, where the rest gap of a foot counts from the ground below it. A walker that stands
    is moved along by what bears on it, so that the ground below it is found in turn with where it stands.
    """
    assert plan.legs is not None
    body, m = plan.legs.body, plan.feet
    at = len(body.body_mass) + 2 * body.leg
    lines = list(lines_below(body, rows.profile))
    largest = np.zeros((len(rows.profile), m))
    for points, _, feet in lines:
        largest[:, feet] = np.abs(points).max(axis=(1, 2), initial=0.0)[:, None]
    for _ in range(_ROUNDS):
        below = body.place[body.leg] + initial[:, at]
        level = rows.sources.copy()
        ground = np.zeros_like(below)
        for points, repeats, feet in lines:
            ground[:, feet] = [heights_of(own, repeats, x) for own, x in zip(points, below[:, feet], strict=True)]
        level[:, :m] -= ground
        size = np.abs(ground) + largest + np.abs(below)
        level[:, :m][np.abs(level[:, :m]) < _SUM * size] = 0.0
        start = rows.initial
        if plan.lift.size:
            gaps = level[:, :m] + start[:, : plan.lift.size] @ plan.system.normals
            start = start.copy()
            start[:, : plan.lift.size] += np.maximum(-gaps.min(axis=1), 0.0)[:, None] * plan.lift
        own = SimpleNamespace(**vars(rows) | {"sources": level, "initial": start})
        found, scales, refused = _native.start_rows(plan.rules, plan.laws.native, rows.signals, own, idle)
        if len(refused) or np.array_equal(found, initial):
            break
        initial = found
    return found, scales, refused


_SUM = 1e-15
"""Part of the size of the ground of which a gap above it is rounding."""

_ROUNDS = 40
"""Each brings a foot nearer to its place by the slope of the ground times how soft the walker is along it."""

REFUSALS = {
    "below the ground": "foot '{foot}' would start {by} below the ground",
    "pulled down": "foot '{foot}' would have to be pulled down by {by}: it does not stand",
    "unbalanced": "the forces along the way do not balance: the robot would not stand still",
}
"""Why a run cannot start, by the engine's word for it."""


def _refusal(run: int, fault: int, feet: Sequence[str], foot: int, by: float) -> str:
    word = _native.FAULTS[fault]
    below = word == "below the ground"
    size = format_quantity(float(f"{by:.6g}"), "m") if below else format_quantity(float(f"{by:.4g}"), "N")
    sentence = REFUSALS[word].format(foot=feet[foot], by=size)
    return f"initial.displacement: in run {run} {sentence}" if below else sentence


def distinct(rows: Floats) -> tuple[Floats, np.ndarray]:
    """The different rows (nr, k), and the number of that which each one is."""
    if (rows == rows[0]).all():  # as a rule: sorting them takes longer
        return rows[:1], np.zeros(len(rows), dtype=np.intp)
    found, which = np.unique(rows, axis=0, return_inverse=True)
    return found, which.reshape(-1)


def _rate(system: LinearSystem) -> float:
    """Fastest rate [1/s] of a structure, undriven and free, to some per cent: a scale of steps and thresholds."""
    if not len(system.mass):
        return 1.0
    springs, dampers = (solve(system.mass, part) for part in (system.stiffness, system.damping))
    return max(math.sqrt(largest_of(springs)), largest_of(dampers), 1.0)
