"""Scene to arrays: the one place that knows both the descriptions and the kernels."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.core import _native, hooks
from tarsus.core.arrays import Laws
from tarsus.core.modes import Floats, LinearSystem
from tarsus.drive.lower import lower
from tarsus.drive.pieces import TERMS, Pieces
from tarsus.errors import InputError
from tarsus.laws.adhesion import Adhesion
from tarsus.laws.base import ImpactLaw, LatchLaw, Law, ResistiveLaw, SmoothLaw
from tarsus.laws.electrostatic import Electrostatic
from tarsus.laws.film import Film
from tarsus.laws.friction import AdhesiveFriction, Friction
from tarsus.laws.impact_map import Body, MassWeighted, passive_angle
from tarsus.laws.landing import PullAsPrinted, RestituteFirst
from tarsus.laws.leg_electrostatic import LegElectrostatic
from tarsus.laws.restitution import Restitution
from tarsus.laws.translate import translate
from tarsus.scene import Ground, Scene
from tarsus.spec import quantity_units
from tarsus.standing import equilibrium
from tarsus.structure.base import Matrices

# Columns of a foot's parameter row that hold the built-in laws; a user's parameters follow.
FILM, ELECTROSTATIC, ADHESION, RESTITUTION, LEG = 0, 2, 4, 6, 7
FRICTION, ADHESIVE, LANDING, USER = 10, 11, 12, 13

hooks.bind(
    {
        "momentum": [hooks.BoundLaw(Film.momentum, FILM, 2)],
        "force": [
            hooks.BoundLaw(Electrostatic.force, ELECTROSTATIC, 2),
            hooks.BoundLaw(LegElectrostatic.force, LEG, 3),
        ],
        "rebound": [hooks.BoundLaw(Restitution.rebound, RESTITUTION, 1)],
        "strength": [hooks.BoundLaw(Adhesion.strength, ADHESION, 2)],
        "friction": [
            hooks.BoundLaw(Friction.bound, FRICTION, 1),
            hooks.BoundLaw(AdhesiveFriction.bound, ADHESIVE, 1),
        ],
        "excess": [hooks.BoundLaw(RestituteFirst.excess, LANDING, 1)],
    }
)
hooks.bind_angle(passive_angle)


@lru_cache(maxsize=1)
def source_hash() -> str:
    """Hash of every source compiled into the engine: a changed law or kernel never meets stale machine code."""
    here = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted([*(here / "core").rglob("*.py"), *(here / "laws").glob("*.py"), Path(__file__)]):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def without_native(plan: Any) -> dict[str, Any]:
    """What is pickled of a plan: its fields; what the native engine holds of it is made again where it is needed."""
    return {name: plan.__dict__[name] for name in plan.__dataclass_fields__}


@dataclass(frozen=True)
class FootLaws:
    """Laws of every foot: flags (m,), parameters (m, np), volts channel (m,); addresses (8,) of users' functions and,
    by pointer column, where in the parameter row a user's parameters start."""

    flags: np.ndarray
    parameters: np.ndarray
    addresses: np.ndarray
    starts: dict[int, int]
    volts: np.ndarray
    terms: tuple[tuple[int, int, int, int], ...] = ()
    """What acts in the native engine: (hook, twin, number of a program, first column of its parameters)."""
    programs: tuple[Any, ...] = ()

    def __getstate__(self) -> dict[str, Any]:
        return without_native(self)

    @property
    def use_rates(self) -> bool:
        """Whether a law of a foot in the air asks for its gap rate."""
        return bool(np.any(self.flags & hooks.USES_RATE))

    @cached_property
    def native(self) -> _native.Laws:
        """The laws as the native engine holds them; their parameters come with every batch."""
        return _native.Laws(
            self.flags, self.volts, self.parameters.shape[1], list(self.terms), list(self.programs)
        )

    def own(self) -> OwnLaws:
        """A copy with parameter memory of its own, which the users' functions read."""
        parameters = self.parameters.copy()
        pointer = np.tile(self.addresses, (len(parameters), 1))
        base, width = parameters.ctypes.data, parameters.shape[1]
        for column, start in self.starts.items():
            pointer[:, column + 4] = base + 8 * (np.arange(len(parameters)) * width + USER + start)
        return OwnLaws(Laws(self.flags, parameters, pointer, self.volts))


@dataclass(frozen=True)
class OwnLaws:
    """Kernel arrays of the laws, with memory nobody else writes to."""

    arrays: Laws

    @property
    def parameters(self) -> np.ndarray:
        return self.arrays.parameters


@dataclass(frozen=True)
class Plan:
    """A scene as arrays, ready for the engine.

    system: the linear structure; laws: flags, parameters, users' pointers and volts channel per foot;
    channels: forces of the drives, then volts of those of ``charged``; initial (2n,): displacements and velocities at
    t = 0. length [m], force [N], rate [1/s]: scales that turn relative tolerances into absolute ones.
    """

    system: LinearSystem
    laws: FootLaws
    channels: tuple[Pieces, ...]
    charged: tuple[int, ...]
    initial: np.ndarray
    length: float
    force: float
    rate: float

    def __getstate__(self) -> dict[str, Any]:
        return without_native(self)

    @property
    def feet(self) -> int:
        return self.system.normals.shape[1]

    @property
    def drives(self) -> int:
        return self.system.loads.shape[1]

    @cached_property
    def signals(self) -> _native.Signals:
        """The drive channels as the engine holds them."""
        return pack(self.channels)


def lower_scene(scene: Scene, drive: Callable[..., tuple[Pieces, Pieces]] = lower) -> Plan:
    """Lower a scene to arrays; ``drive`` lowers its drives.

    Raises InputError where a law of the user cannot be compiled, and where a walker that is to start standing cannot.
    """
    system = lower_system(scene)
    names = list(scene.robot.drives)
    forces, volts, signals = [], [], scene.actuator_volts
    for name, one in scene.robot.drives.items():
        force, volt = drive(signals[name], one.law, one.history)
        forces.append(force)
        volts.append(volt)
    feet = list(scene.robot.feet.values())
    laws = _lower_laws(scene.ground.acting, len(feet))
    if scene.ground.makes_energy:
        laws.flags[:] |= hooks.MAP_AS_IS
    acts = (laws.flags & hooks.HAS_FORCE) != 0
    # where no foot has an electrode, users' laws see the volts of the first drive
    rest = names[0] if names and not any(f.electrode for f in feet) else None
    wired = [f.electrode if f.electrode is not None else rest for f in feet]
    used = sorted({names.index(w) for w, a in zip(wired, acts, strict=True) if a and w is not None})
    for i, w in enumerate(wired):
        if acts[i] and w is not None:
            laws.volts[i] = len(names) + used.index(names.index(w))
    channels = (*forces, *(volts[d] for d in used))
    n = system.mass.shape[0]
    initial = np.zeros(2 * n)
    if scene.initial.standing is not None:
        initial[:n] = equilibrium(scene, driven=scene.initial.standing.driven)
    if scene.initial.displacement is not None:
        initial[:n] = scene.initial.displacement
    if scene.initial.velocity is not None:
        initial[n:] = scene.initial.velocity
    length, force = scales(
        scene, system, np.array([[pieces.span for pieces in forces]]).reshape(1, -1), laws.parameters[None],
        initial[None], system.sources[None],
    )  # fmt: skip
    return Plan(
        system, laws, channels, tuple(used), initial, float(length[0]), float(force[0]), _rate(system)
    )


def lower_system(scene: Scene) -> LinearSystem:
    """The linear structure of a scene with its feet, drives and weight."""
    structure = scene.robot.structure
    matrices = structure.matrices()
    n = structure.size
    feet = scene.robot.feet.values()
    normals = np.zeros((n, len(feet)))
    for i, foot in enumerate(feet):
        normals[:, i] = foot.normal * structure.row(foot.point)
    loads = np.zeros((n, len(scene.robot.drives)))
    for d, drive in enumerate(scene.robot.drives.values()):
        loads[:, d] = drive.load.vector(structure)
    weight, gravity = np.zeros(n), 0.0
    if scene.ground.gravity is not None:
        up = structure.vertical()
        assert up is not None  # checked by Scene
        weight, gravity = -(matrices.mass @ up), scene.ground.gravity.acceleration
    return LinearSystem(
        np.ascontiguousarray(matrices.mass, dtype=float), matrices.damping, matrices.stiffness, normals,
        np.array([foot.gap for foot in feet], dtype=float), loads, weight, gravity,
        _directions(scene, matrices, normals), _alone(scene),
    )  # fmt: skip


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


def _lower_laws(ground: Ground, m: int) -> FootLaws:
    row = np.zeros(USER)
    flags = 0
    for column, law, flag in (
        (FILM, ground.film, hooks.HAS_MOMENTUM),
        (ELECTROSTATIC, ground.electrostatic, hooks.HAS_FORCE),
        (LEG, ground.leg_electrostatic, hooks.HAS_FORCE),
        (ADHESION, ground.adhesion, hooks.HAS_LATCH),
        (RESTITUTION, ground.restitution, 0),
        (_slot("friction", ground.friction), ground.friction, 0),
    ):
        if law is not None:
            values = law.parameters()
            row[column : column + len(values)] = values
            flags |= flag
    if isinstance(ground.landing, RestituteFirst):
        row[LANDING] = ground.landing.speed
        flags |= hooks.RESTITUTES_FIRST
    elif isinstance(ground.landing, PullAsPrinted):
        flags |= hooks.PULL_AS_PRINTED
    if ground.film is None:
        row[FILM + 1] = 1.0  # an absent film has a thickness, so that it is zero and not 0/0
    if ground.electrostatic is None:
        row[ELECTROSTATIC + 1] = 1.0
    terms = [
        (_native.HOOKS.index(hook), _native.TWINS[twin], -1, column)
        for law, hook, twin, column in (
            (ground.film, "momentum", "Film.momentum", FILM),
            (ground.electrostatic, "force", "Electrostatic.force", ELECTROSTATIC),
            (ground.leg_electrostatic, "force", "LegElectrostatic.force", LEG),
            (ground.restitution, "rebound", "Restitution.rebound", RESTITUTION),
            (ground.adhesion, "strength", "Adhesion.strength", ADHESION),
            (
                ground.friction,
                "friction",
                f"{type(ground.friction).__name__}.bound",
                _slot("friction", ground.friction),
            ),
        )
        if law is not None
    ]
    if isinstance(ground.landing, RestituteFirst):
        terms.append((_native.HOOKS.index("excess"), _native.TWINS["RestituteFirst.excess"], -1, LANDING))
    programs: list[Any] = []
    own = np.zeros(8, dtype=np.int64)
    extra: list[float] = []
    starts: dict[int, int] = {}
    for kind, column, flag in _PROTOCOLS:
        laws = [law for law in ground.laws.values() if isinstance(law, kind)]
        if not laws:
            continue
        if len(laws) > 1 and column in (hooks.REBOUND, hooks.STRENGTH):
            names = ", ".join(law.name() for law in laws)
            raise InputError(f"ground.laws: only one {kind.__name__} can act at a time, got {names}")
        own[column] = _compiled(
            tuple((type(law).function(), len(law.parameters())) for law in laws), len(kind.leading)
        )
        starts[column] = len(extra)
        if column in (hooks.REBOUND, hooks.STRENGTH):  # takes the place of the built-in one
            terms = [term for term in terms if term[0] != column]
        for law in laws:
            terms.append((column, -1, len(programs), USER + len(extra)))
            function = type(law).function()
            assert function is not None  # checked where laws are read
            programs.append(translate(function, len(law.leading)))
            extra += law.parameters()
            if isinstance(law, SmoothLaw) and law.uses_rate:
                flags |= hooks.USES_RATE
        flags |= flag
    return FootLaws(
        np.full(m, flags, dtype=np.int64), np.tile(np.concatenate([row, extra]), (max(m, 1), 1)), own, starts,
        np.full(m, -1, dtype=np.int64), tuple(terms), tuple(programs),
    )  # fmt: skip


_SLOTS = {
    "film": FILM,
    "electrostatic": ELECTROSTATIC,
    "leg_electrostatic": LEG,
    "adhesion": ADHESION,
    "restitution": RESTITUTION,
    "friction": FRICTION,
    "landing": LANDING,
}


def _slot(name: str, law: Law | None) -> int:
    """First column of the ground's law of that name."""
    return ADHESIVE if isinstance(law, AdhesiveFriction) else _SLOTS[name]


def law_column(scene: Scene, path: str) -> int | None:
    """Column of a foot's parameter row that holds the value at ``path``; None if it is no parameter of a law.

    Such values vary from run to run without lowering the scene again.
    """
    keys = path.split(".")
    if keys[0] != "ground" or len(keys) < 3 or getattr(scene.ground.acting, keys[1], None) is None:
        return None
    if len(keys) == 3 and keys[1] in _SLOTS:
        law = getattr(scene.ground, keys[1])
        fields = list(quantity_units(type(law))) if law is not None else []
        return _slot(keys[1], law) + fields.index(keys[2]) if keys[2] in fields else None
    if len(keys) == 4 and keys[1] == "laws" and keys[2] in scene.ground.laws:
        column = USER
        for kind, _, _ in _PROTOCOLS:
            for name, law in scene.ground.laws.items():
                if isinstance(law, kind):
                    fields = list(quantity_units(type(law)))
                    if name == keys[2]:
                        return column + fields.index(keys[3]) if keys[3] in fields else None
                    column += len(fields)
    return None


def initial_column(scene: Scene, path: str) -> int | None:
    """Place in the initial state (2n,) of the value at ``path``; None if it is none that the scene gives."""
    keys = path.split(".")
    if len(keys) != 3 or keys[0] != "initial" or keys[1] not in ("displacement", "velocity"):
        return None
    given = getattr(scene.initial, keys[1])
    if given is None or not keys[2].isdecimal() or int(keys[2]) >= len(given):
        return None
    return int(keys[2]) + (len(given) if keys[1] == "velocity" else 0)


_PROTOCOLS = (
    (ResistiveLaw, hooks.MOMENTUM, hooks.HAS_MOMENTUM),
    (SmoothLaw, hooks.FORCE, hooks.HAS_FORCE),
    (ImpactLaw, hooks.REBOUND, 0),
    (LatchLaw, hooks.STRENGTH, hooks.HAS_LATCH),
)


@lru_cache(maxsize=64)
def _compiled(laws: tuple[tuple[Callable[..., float], int], ...], arguments: int) -> int:
    try:
        return hooks.compile_laws(laws, arguments)
    except Exception as error:  # numba raises many kinds; all mean the same to the user
        names = ", ".join(function.__qualname__ for function, _ in laws)
        reason = next(
            (line.strip() for line in str(error).splitlines() if line.strip()), type(error).__name__
        )
        raise InputError(
            f"{names}: a law must be arithmetic, 'if' and math functions of floats: {reason}"
        ) from error


def pack(channels: Sequence[Pieces]) -> _native.Signals:
    """Channels laid end to end as the engine takes them; one that holds its last value gets a piece for that."""
    loops = np.array([pieces.loop for pieces in channels], dtype=np.int64)
    counts = np.array([pieces.count for pieces in channels], dtype=np.int64)
    starts = np.concatenate([np.zeros(0), *(pieces.start for pieces in channels)])
    coefs = np.concatenate([np.zeros((0, TERMS)), *(pieces.coef for pieces in channels)])
    kinks = np.concatenate([np.zeros(0, dtype=bool), *(pieces.kink for pieces in channels)])
    return _native.Signals(counts, loops, starts, coefs, kinks)


SMALLEST = 1e-12
"""[m] Below the size of an atom a clearance is zero and no scale."""


def scales(
    scene: Scene,
    system: LinearSystem,
    spans: Floats,
    parameters: Floats,
    initial: Floats,
    sources: Floats,
) -> tuple[Floats, Floats]:
    """Length [m] and force [N] of nr runs (nr,) that tolerances refer to.

    spans (nr, nd) [N] of the drives' forces; parameters (nr, m, np), initial (nr, 2n), sources (nr, m + 1) as in
    `tarsus.slots.Rows`.
    """
    n, m = system.normals.shape
    lengths = [np.abs(sources[:, :m] + initial[:, :n] @ system.normals), sources[:, :m]]
    if scene.ground.acting.film is not None:
        lengths.append(parameters[:, :1, FILM + 1])
    length = np.concatenate(lengths, axis=1)
    length = np.where(length > SMALLEST, length, 0.0).max(axis=1, initial=0.0)
    length = np.where(length > 0.0, length, 1e-6)
    forces = [np.abs(spans), np.abs(sources[:, m:]) * np.abs(system.weight).max(initial=0.0)]
    if scene.ground.adhesion is not None:
        forces.append(parameters[:, :1, ADHESION])
    if n:
        forces.append(length[:, None] * float(np.abs(np.diag(system.stiffness)).min()))
    force = np.concatenate(forces, axis=1).max(axis=1, initial=0.0)
    return length, np.where(force > 0.0, force, 1e-9)


def _rate(system: LinearSystem) -> float:
    """Fastest rate [1/s] of a structure."""
    if not len(system.mass):
        return 1.0
    per_mass = np.linalg.solve(system.mass, np.concatenate([system.stiffness, system.damping], axis=1))
    squares, rub = np.split(per_mass, 2, axis=1)
    fastest = np.sqrt(np.abs(np.linalg.eigvals(squares)).max())
    return max(float(fastest), float(np.abs(np.linalg.eigvals(rub)).max()) if rub.any() else 0.0, 1.0)
