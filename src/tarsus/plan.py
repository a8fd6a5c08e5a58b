"""Scene to arrays: the one place that knows both the descriptions and the kernels."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.core import _native
from tarsus.core.modes import LinearSystem
from tarsus.core.signals import Signals
from tarsus.drive.lower import lower
from tarsus.drive.pieces import Pieces
from tarsus.errors import InputError
from tarsus.laws.base import Law, SmoothLaw
from tarsus.laws.impact_map import Body, MassWeighted
from tarsus.laws.landing import PullAsPrinted
from tarsus.laws.program import Program
from tarsus.laws.registry import is_built_in
from tarsus.laws.translate import translate
from tarsus.scene import Ground, Scene
from tarsus.standing import equilibrium
from tarsus.structure.base import Matrices


@lru_cache(maxsize=1)
def source_hash() -> str:
    """Hash of the engine and of every source that it is told by: changed ones never meet what others have made."""
    here = Path(__file__).parent
    digest = hashlib.sha256()
    engine = Path(_native.__file__)
    for path in sorted([*(here / "core").rglob("*.py"), *(here / "laws").glob("*.py"), Path(__file__), engine]):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def without_native(plan: Any) -> dict[str, Any]:
    """What is pickled of a plan: its fields; what the native engine holds of it is made again where it is needed."""
    return {name: plan.__dict__[name] for name in plan.__dataclass_fields__}


@dataclass(frozen=True)
class FootLaws:
    """Laws of every foot: flags (m,), parameters (m, np), volts channel (m,).

    acting: the laws by name; columns: where in the parameter row each one's parameters start; terms: the same for the
    engine, (hook, twin, number of a program, first column) each.
    """

    flags: np.ndarray
    parameters: np.ndarray
    volts: np.ndarray
    acting: Mapping[str, Law]
    columns: Mapping[str, int]
    terms: tuple[tuple[int, int, int, int], ...]
    programs: tuple[Program, ...]

    def __getstate__(self) -> dict[str, Any]:
        return without_native(self)

    @property
    def use_rates(self) -> bool:
        """Whether a law of a foot in the air asks for its gap rate."""
        return bool(np.any(self.flags & _native.FLAGS["uses_rate"]))

    @cached_property
    def native(self) -> _native.Laws:
        """The laws as the engine holds them; their parameters come with every batch."""
        return _native.Laws(
            self.flags, self.volts, self.parameters.shape[1], list(self.terms), list(self.programs)
        )


@dataclass(frozen=True)
class Plan:
    """A scene as arrays, ready for the engine.

    system: the linear structure; laws: flags, parameters and volts channel per foot;
    signals: drive channels then volts channels, made of ``channels``; initial (2n,): displacements and velocities
    at t = 0. length [m], force [N], rate [1/s]: scales that turn relative tolerances into absolute ones.
    """

    system: LinearSystem
    laws: FootLaws
    signals: Signals
    channels: tuple[Pieces, ...]
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
    def native_signals(self) -> _native.Signals:
        """The drive channels as the native engine holds them."""
        return _native.Signals(self.signals)


def lower_scene(scene: Scene) -> Plan:
    """Lower a scene to arrays.

    Raises InputError where a law of the user cannot be compiled, and where a walker that is to start standing cannot.
    """
    system = lower_system(scene)
    names = list(scene.robot.drives)
    forces, volts, signals = [], [], scene.actuator_volts
    for name, drive in scene.robot.drives.items():
        force, volt = lower(signals[name], drive.law, drive.history)
        forces.append(force)
        volts.append(volt)
    feet = list(scene.robot.feet.values())
    laws = lower_laws(scene.ground, len(feet))
    if scene.ground.makes_energy:
        laws.flags[:] |= _native.FLAGS["map_as_is"]
    acts = (laws.flags & _native.FLAGS["force"]) != 0
    # where no foot has an electrode, users' laws see the volts of the first drive
    rest = names[0] if names and not any(f.electrode for f in feet) else None
    wired = [f.electrode if f.electrode is not None else rest for f in feet]
    used = sorted({names.index(w) for w, a in zip(wired, acts, strict=True) if a and w is not None})
    for i, w in enumerate(wired):
        if acts[i] and w is not None:
            laws.volts[i] = len(names) + used.index(names.index(w))
    channels = (*forces, *(volts[d] for d in used))
    signals = pack_signals(channels)
    n = system.mass.shape[0]
    initial = np.zeros(2 * n)
    if scene.initial.standing is not None:
        initial[:n] = equilibrium(scene, driven=scene.initial.standing.driven)
    if scene.initial.displacement is not None:
        initial[:n] = scene.initial.displacement
    if scene.initial.velocity is not None:
        initial[n:] = scene.initial.velocity
    length, force, rate = _scales(scene, system, signals, initial)
    return Plan(system, laws, signals, channels, initial, length, force, rate)


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
    constant = np.zeros(n)
    if scene.ground.gravity is not None:
        up = structure.vertical()
        assert up is not None  # checked by Scene
        constant -= scene.ground.gravity.acceleration * (matrices.mass @ up)
    return LinearSystem(
        np.ascontiguousarray(matrices.mass, dtype=float), matrices.damping, matrices.stiffness, normals,
        np.array([foot.gap for foot in feet], dtype=float), loads, constant, _directions(scene, matrices, normals),
        _alone(scene),
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


def lower_laws(ground: Ground, m: int) -> FootLaws:
    """The laws that act on m feet: each takes the next columns of the parameter row, and its twin or its program.

    Raises InputError where a law of the user cannot be compiled.
    """
    acting = ground.acting_laws
    columns = _columns(acting)
    flags = _native.FLAGS["pull_as_printed"] if isinstance(ground.landing, PullAsPrinted) else 0
    terms: list[tuple[int, int, int, int]] = []
    programs: list[Program] = []
    row: list[float] = []
    for name, law in acting.items():
        row += law.parameters()
        assert law.hook is not None  # or it would not act
        flags |= _native.FLAGS.get(law.hook, 0)
        if isinstance(law, SmoothLaw) and law.uses_rate:
            flags |= _native.FLAGS["uses_rate"]
        twin = _twin(type(law))
        terms.append((_native.HOOKS.index(law.hook), twin, -1 if twin >= 0 else len(programs), columns[name]))
        if twin < 0:
            programs.append(program_of(type(law)))
    return FootLaws(
        np.full(m, flags, dtype=np.int64), np.tile(np.array(row, dtype=float), (max(m, 1), 1)),
        np.full(m, -1, dtype=np.int64), acting, columns, tuple(terms), tuple(programs),
    )  # fmt: skip


def _columns(acting: Mapping[str, Law]) -> dict[str, int]:
    """First column of each law's parameters."""
    counts = [len(law.names()) for law in acting.values()]
    return dict(zip(acting, accumulate([0, *counts[:-1]]), strict=True)) if acting else {}


def _twin(law: type[Law]) -> int:
    """Number of the law's function among those that the engine has written out; -1 where it carries out a program."""
    return _native.TWINS.get(f"{law.__name__}.{law.function_name}", -1) if is_built_in(law) else -1


def program_of(law: type[Law]) -> Program:
    """A law's function as the engine carries it out.

    Raises InputError where it contains what a law may not.
    """
    function = law.function()
    if function is None:
        raise InputError(f"{law.name()}: defines no function {law.function_name}")
    return translate(function, len(law.leading))


def law_column(scene: Scene, path: str) -> int | None:
    """Column of a foot's parameter row that holds the value at ``path``; None if it is no parameter of a law.

    Such values vary from run to run without lowering the scene again.
    """
    acting = scene.ground.acting_laws
    paths = {
        f"ground.{'laws.' if name in scene.ground.laws else ''}{name}.{field}": columns + place
        for (name, law), columns in zip(acting.items(), _columns(acting).values(), strict=True)
        for place, field in enumerate(law.names())
    }
    return paths.get(path)


def initial_column(scene: Scene, path: str) -> int | None:
    """Place in the initial state (2n,) of the value at ``path``; None if it is none that the scene gives."""
    keys = path.split(".")
    if len(keys) != 3 or keys[0] != "initial" or keys[1] not in ("displacement", "velocity"):
        return None
    given = getattr(scene.initial, keys[1])
    if given is None or not keys[2].isdecimal() or int(keys[2]) >= len(given):
        return None
    return int(keys[2]) + (len(given) if keys[1] == "velocity" else 0)


def pack_signals(channels: Sequence[Pieces]) -> Signals:
    """Channels laid end to end for the kernels; a channel that holds its last value gets a piece for that."""
    starts, ends, coefs, sharps, untils, overs = [], [], [], [], [], []
    first, loops, periods, spans = [0], [], [], []
    for pieces in channels:
        start, end = pieces.start[:-1], pieces.start[1:]
        coef, kink = pieces.coef, pieces.kink
        if pieces.loop < 0:
            hold = np.zeros((1, coef.shape[1]))
            hold[0, 0] = coef[-1].sum()
            start, end = np.append(start, end[-1]), np.append(end, _FOREVER)
            coef, kink = np.vstack([coef, hold]), np.append(kink, True)
        sharp = np.append(kink[1:], kink[pieces.loop] if pieces.loop >= 0 else False)
        # every piece is bounded by the sum of its coefficients' sizes
        middle = coef[:, 0]
        swing = np.abs(coef[:, 1:]).sum(axis=1)
        span = float((middle + swing).max() - (middle - swing).min())
        until, over = _kink_distances(end - start, _continued(end - start, coef, span), sharp, pieces.loop)
        starts.append(start)
        ends.append(end)
        coefs.append(coef)
        sharps.append(sharp)
        untils.append(until)
        overs.append(over)
        first.append(first[-1] + len(start))
        loops.append(pieces.loop)
        periods.append(float(pieces.start[-1] - pieces.start[pieces.loop]) if pieces.loop >= 0 else 0.0)
        spans.append(span)

    def join(parts: list[np.ndarray], empty: tuple[int, ...] = (0,)) -> np.ndarray:
        return np.ascontiguousarray(np.concatenate(parts)) if parts else np.zeros(empty)

    coef = join(coefs, (0, 12))
    return Signals(
        first=np.array(first, dtype=np.int64), start=join(starts), end=join(ends), coef=coef,
        flat=np.all(coef[:, 1:] == 0.0, axis=1), sharp=join(sharps).astype(np.bool_), until=join(untils),
        over=join(overs),
        loop=np.array(loops, dtype=np.int64), period=np.array(periods, dtype=float), span=np.array(spans, dtype=float),
    )  # fmt: skip


_FOREVER = 1e30


_SLIVER = 1e-5
"""A piece this much shorter than the longest may be shorter than any step."""
_FAR = 1e4
"""Spans of the channel that a sliver may be continued to: what it rounds then is below the tolerance of a drive."""


def _continued(length: np.ndarray, coef: np.ndarray, span: float) -> np.ndarray:
    """How far [s] each piece (P,) may be continued beyond its end: a quarter of its length, slivers much further."""
    over = 0.25 * length
    short = np.flatnonzero(length < _SLIVER * length[length < _FOREVER].max(initial=0.0))
    size = np.abs(coef[short])
    for lengths in 2.0 ** np.arange(50.0):
        within = size[:, 1:] @ (1.0 + 2.0 * lengths) ** np.arange(1.0, coef.shape[1]) <= _FAR * span
        over[short[within]] = lengths * length[short[within]]
    return over


def _kink_distances(
    length: np.ndarray, continued: np.ndarray, sharp: np.ndarray, loop: int
) -> tuple[np.ndarray, np.ndarray]:
    """Time from the start of each piece to the next kink (inf: none), and how far one may look beyond that."""
    count = len(length)
    until, over = np.full(count, np.inf), np.full(count, np.inf)
    for _ in range(2):  # twice round the loop
        following, following_over = (until[loop], over[loop]) if loop >= 0 else (np.inf, np.inf)
        for p in range(count - 1, -1, -1):
            if sharp[p]:
                following, following_over = 0.0, continued[p]
            following = following + length[p]
            until[p], over[p] = following, following_over
    return until, over


def _scales(
    scene: Scene, system: LinearSystem, signals: Signals, initial: np.ndarray
) -> tuple[float, float, float]:
    n = len(system.mass)
    start = np.abs(system.rest_gap + system.normals.T @ initial[:n])
    lengths = [*start, *system.rest_gap]
    acting = scene.ground.acting_laws.values()
    lengths += [law.length_scale() for law in acting]
    # below the size of an atom a clearance is zero and no scale
    length = max((x for x in lengths if x > 1e-12), default=1e-6)
    forces = [abs(s) for s in signals.span[: system.loads.shape[1]]]
    forces += [law.force_scale() for law in acting]
    forces.append(float(np.abs(system.constant).max(initial=0.0)))
    forces.append(length * float(np.abs(np.diag(system.stiffness)).min(initial=np.inf)) if n else 0.0)
    force = max((x for x in forces if x > 0.0), default=1e-9)
    scale = np.sqrt(
        np.abs(np.linalg.eigvals(np.linalg.solve(system.mass, system.stiffness))).max(initial=0.0)
    )
    rub = np.abs(np.linalg.eigvals(np.linalg.solve(system.mass, system.damping))).max(initial=0.0)
    rate = max(float(scale), float(rub), 1.0)
    return length, force, rate
