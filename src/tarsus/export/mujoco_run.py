"""MuJoCo runs the model that was written, and says what is lost: restitution, pull-off force, touchdowns, stride."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.export.mjcf import Mjcf
from tarsus.export.subject import LOW, Floats, Subject
from tarsus.files.settled import drive_period, settled
from tarsus.solve import Run, simulate
from tarsus.tables.table import ROW, Column, Table

TOUCHDOWNS = 10
"""So many are compared."""

PERIODS = 6
"""Drive periods of steady motion that a walker walks at least, for its stride."""

MOST_STEPS = 4_000_000
"""Of the comparison, some tens of seconds; what is left out is said."""

CHUNK = 50_000
"""Steps in one call: their states are in memory together."""

PHASES = 16
"""Falls whose moments of touch are spread over a step: restitution is the worst of them."""


@dataclass(frozen=True)
class SpringMotion:
    """MuJoCo's motion in SI: touchdowns as rows (nc, 4) of time, foot, approach and departure speed (0: held); state at
    the marks asked for (nk, n)."""

    touchdowns: Floats
    marks: Floats
    duration: float


class Loaded:
    """The model of a scene in MuJoCo. Raises InputError where MuJoCo is not installed, or refuses it."""

    def __init__(self, mjcf: Mjcf) -> None:
        try:
            mujoco: Any = import_module("mujoco")  # which has no types
        except ImportError:
            raise InputError("MuJoCo is not installed: pip install mujoco") from None
        self.mjcf, self.mujoco = mjcf, mujoco
        try:
            self.model = mujoco.MjModel.from_xml_string(mjcf.text())
        except ValueError as error:
            raise InputError(f"mjcf: MuJoCo refuses the model: {' '.join(str(error).split())}") from None
        described, units = mjcf.subject, mjcf.units
        self.n, self.m = len(mjcf.tree.joints), len(described.feet)
        self.normal = np.array([foot.normal for foot in described.scene.robot.feet.values()], dtype=float)
        for (
            name
        ) in described.feet:  # the ground may be moved: where it is at its body's place MuJoCo asks the body alone
            self.model.geom_sameframe[self.model.geom(f"ground:{name}").id] = 0
        ground = np.array([self.model.geom(f"ground:{name}").pos[2] for name in described.feet])
        radius = np.array([self.model.geom(f"foot:{name}").size[0] for name in described.feet])
        self.ground, self.own = (ground + self.normal * radius, mjcf.tree.own_units(units))  # of centres of feet
        self.heights = self._sensors("framepos")
        self.rates = self._sensors("framelinvel")
        self.drives = [self.model.actuator(f"drive:{name}").id for name in described.drives]
        held = described.scene.ground.holds
        self.pads = [self.model.actuator(f"adhesion:{name}").id for name in described.feet] if held else []

    def _sensors(self, kind: str) -> list[int]:
        """Places of the upward component of a sensor of every foot."""
        return [int(self.model.sensor(f"{kind}:{name}").adr[0]) + 2 for name in self.mjcf.subject.feet]

    def controls(self, times: Floats) -> Floats:
        """Controls (nt, nu) at times [s], drives at the middle of the step."""
        out = np.zeros((len(times), self.model.nu))
        force = self.mjcf.subject.forces(times + 0.5 * self.mjcf.step)
        out[:, self.drives] = force.T / self.mjcf.units.force
        out[:, self.pads] = self.mjcf.subject.held_strength / self.mjcf.units.force
        return out

    def state_of(self, position: Floats, velocity: Floats) -> Floats:
        """The state of the engine with joints at a position and velocity (n,) in its units."""
        data = self.mujoco.MjData(self.model)
        data.qpos[:], data.qvel[:] = position, velocity
        kind = self.mujoco.mjtState.mjSTATE_FULLPHYSICS
        state = np.zeros(self.mujoco.mj_stateSize(self.model, kind))
        self.mujoco.mj_getState(self.model, data, state, kind)
        return state

    def advanced(self, state: Floats, controls: Floats) -> tuple[Floats, Floats, Floats]:
        """States (nt, ns) after every step, gaps and rates (nt, m) before it, in MuJoCo's units."""
        data = self.mujoco.MjData(self.model)
        states, seen = import_module("mujoco.rollout").rollout(self.model, data, state[None], controls[None])
        gap = self.normal * (seen[0][:, self.heights] - self.ground)
        return states[0], gap, self.normal * seen[0][:, self.rates]

    def run(self, duration: float, marks: Floats) -> SpringMotion:
        """From the start over a duration [s]; marks (nk,) [s]: when the state is wanted."""
        step, units = self.mjcf.step, self.mjcf.units
        count = math.ceil(duration / step)
        state = self.state_of(*self.mjcf.start)
        wanted = np.minimum(np.rint(marks / step).astype(int), count) - 1
        found, kept = (_Feet(self.m, LOW * self.mjcf.subject.height / units.length), np.zeros((len(marks), self.n)))
        for first in range(0, count, CHUNK):
            times: Any = step * np.arange(first, min(first + CHUNK, count))
            states, gap, rate = self.advanced(state, self.controls(times))
            found.see(times, step, gap, rate * step / units.time)
            for k in np.flatnonzero((wanted >= first) & (wanted < first + len(times))):
                kept[k] = self.mjcf.tree.moves @ (states[wanted[k] - first, 1 : 1 + self.n] * self.own)
            state = states[-1]
            if not np.isfinite(state).all():
                raise InputError(f"mjcf: MuJoCo's motion is not finite after {times[-1]:.4g} s; give a shorter --step")
        rows = np.array(found.rows).reshape(-1, 4)
        rows[:, 2:] *= units.length / step
        return SpringMotion(rows[np.argsort(rows[:, 0], kind="stable")], kept, count * step)


class _Feet:
    """What is seen of feet step by step: touchdowns (time, foot, approach and departure in gap a step)."""

    def __init__(self, feet: int, low: float) -> None:
        self.rows: list[list[float]] = []
        self._low = low
        self._apex, self._open = np.zeros(feet), [-1] * feet
        self._before: tuple[Floats, Floats] | None = None

    def see(self, times: Floats, step: float, gap: Floats, rate: Floats) -> None:
        """Steps (nt,) with gaps and rates (nt, m), the rates in gap a step."""
        if self._before is not None:
            gap = np.vstack([self._before[0], gap])
            rate = np.vstack([self._before[1], rate])
            times = np.append(times[0] - step, times)
        for i in range(gap.shape[1]):
            self._foot(i, times, step, gap[:, i], rate[:, i])
        self._before = gap[-1].copy(), rate[-1].copy()

    def _foot(self, i: int, times: Floats, step: float, gap: Floats, rate: Floats) -> None:
        above = gap > 0.0
        crossings = np.flatnonzero(above[1:] != above[:-1])
        since = 0
        for k in crossings:
            if above[k]:
                apex = max(self._apex[i], float(gap[since : k + 1].max()))
                if apex > self._low:
                    share = gap[k] / (gap[k] - gap[k + 1])
                    self.rows.append([times[k] + share * step, i, -rate[k], 0.0])
                    self._open[i] = len(self.rows) - 1
                self._apex[i] = 0.0
            else:
                if self._open[i] >= 0:
                    self.rows[self._open[i]][3] = max(rate[k + 1], 0.0)
                    self._open[i] = -1
            since = k + 1
        if above[-1]:
            self._apex[i] = max(self._apex[i], float(gap[since:].max()))


def restitution(loaded: Loaded) -> tuple[float, float]:
    """Restitution of the first foot in MuJoCo, the mean and the one that is farthest off, at the speed of the run's
    hardest impact: the robot undeformed, the
    ground below its foot, no drives and no adhesion, moved as an impulse at the foot would."""
    mjcf, units = loaded.mjcf, loaded.mjcf.units
    system, speed = mjcf.subject.plan.system, mjcf.subject.impact_speed
    normal = system.normals[:, 0]
    response = system.per_impulse[:, 0] / (normal @ system.per_impulse[:, 0])
    depth, found = speed / mjcf.contact_rate, []
    saved = loaded.model.geom_pos.copy()
    _others_away(loaded, 0)
    name = mjcf.subject.feet[0]
    plane, at = loaded.model.geom(f"ground:{name}").id, mjcf.tree.places[name][2]
    count = math.ceil((12.0 / mjcf.contact_rate + 2.0 * depth / speed) / mjcf.step)
    for phase in range(PHASES):
        above = 0.5 * depth + phase / PHASES * speed * mjcf.step
        loaded.model.geom_pos[plane, 2] = at - loaded.normal[0] * above / units.length
        v = np.linalg.solve(mjcf.tree.moves, -speed * response) / loaded.own
        state = loaded.state_of(np.zeros(loaded.n), v * units.time)
        _, gap, rate = loaded.advanced(state, np.zeros((count, loaded.model.nu)))
        gap[:, 0] += loaded.normal[0] * (saved[plane, 2] - loaded.model.geom_pos[plane, 2])
        inside = np.flatnonzero(gap[:, 0] <= 0.0)
        out = inside[-1] + 1 if len(inside) and inside[-1] + 1 < count else None
        found.append(0.0 if out is None else rate[out, 0] / -rate[inside[0] - 1, 0])
    loaded.model.geom_pos[:] = saved
    values = np.array(found)
    return float(values.mean()), float(values[np.argmax(np.abs(values - mjcf.restitution))])


def _others_away(loaded: Loaded, but: int) -> None:
    """Put the ground out of reach of all feet but one."""
    for i, name in enumerate(loaded.mjcf.subject.feet):
        if i != but:
            loaded.model.geom_pos[loaded.model.geom(f"ground:{name}").id, 2] -= loaded.normal[i] * 1e6


def pull_off(loaded: Loaded) -> float:
    """Pull [N] of the structure on the first foot, held by adhesion alone and without weight, when it leaves the
    reach of adhesion under a force that grows slowly: (n' M^-1 n)^-1 n' M^-1 (F - K x - C v)."""
    mjcf, units, mujoco = loaded.mjcf, loaded.mjcf.units, loaded.mujoco
    system, held = mjcf.subject.plan.system, mjcf.subject.held_strength
    normal = system.normals[:, 0]
    share = system.per_impulse[:, 0] / (normal @ system.per_impulse[:, 0])
    saved = loaded.model.geom_pos.copy()
    _others_away(loaded, 0)
    opt = loaded.model.opt
    gravity, bias = opt.gravity.copy(), loaded.model.actuator_biasprm.copy()
    opt.gravity[:], loaded.model.actuator_biasprm[:] = 0.0, 0.0
    x = _lifted(system, normal, -system.rest_gap[0] - 1e-3 * mjcf.reach)
    data = mujoco.MjData(loaded.model)
    data.qpos[:] = np.linalg.solve(mjcf.tree.moves, x) / loaded.own
    data.ctrl[loaded.pads[0]] = held / units.force
    onto, steps = mjcf.tree.moves.T @ normal, 40_000
    first = float(share @ (-system.stiffness @ x))  # what the structure pulls there by itself
    pull = math.nan
    for k in range(steps):
        force = held * (0.95 + 0.1 * k / steps) - first
        data.qfrc_applied[:] = onto * force * loaded.own / units.length / units.force
        mujoco.mj_step(loaded.model, data)
        if not data.ncon:
            break
        x = mjcf.tree.moves @ (data.qpos * loaded.own)
        v = mjcf.tree.moves @ (data.qvel * loaded.own) / units.time
        pull = float(share @ (normal * force - system.stiffness @ x - system.damping @ v))
    opt.gravity[:], loaded.model.actuator_biasprm[:] = gravity, bias
    loaded.model.geom_pos[:] = saved
    return pull


def _lifted(system: Any, normal: Floats, way: float) -> Floats:
    """Displacements (n,) of least elastic energy, of these the least, that move a foot by a way [m]."""
    whole = np.block([[system.stiffness, normal[:, None]], [normal[None], np.zeros((1, 1))]])
    scale = np.append(1.0 / np.sqrt(np.diag(system.mass)), 1.0)
    load = np.append(np.zeros(len(normal)), way)
    return (scale * np.linalg.lstsq(whole * scale * scale[:, None], load * scale, rcond=1e-12)[0])[:-1]


def loss(mjcf: Mjcf) -> Table:
    """What MuJoCo makes of the model, compared with the library's own run, as a table with its parts.

    Raises InputError where MuJoCo is not installed, or refuses the model.
    """
    loaded, described = Loaded(mjcf), mjcf.subject
    run = described.run
    rows: list[tuple[object, ...]] = []
    mean, worst = restitution(loaded)
    at = f"restitution at {described.impact_speed:.4g} m/s"
    rows.append((at, mjcf.restitution, mean, _off(mean, mjcf.restitution), "1"))
    rows.append((f"{at}, worst moment of touch", mjcf.restitution, worst, _off(worst, mjcf.restitution), "1"))
    if described.scene.ground.holds and described.held_strength > 0.0:
        pull = pull_off(loaded)
        rows.append(("pull-off force", described.held_strength, pull, _off(pull, described.held_strength), "N"))
    window = _window(described)
    window = min(window, MOST_STEPS * mjcf.step)
    bare = simulate(_bare(described), run.duration)
    steady = None if run.marks is None else steady_periods((run, bare), window)
    marks = np.zeros(0) if steady is None else np.array(steady[:2])
    motion, notes = loaded.run(window, marks), list[str]()
    if steady is not None:
        own, turns = run.states(marks).x[0], steady[2]
        fair = bare.states(marks).x[0]
        mine, same, other = ((one[1] - one[0]) / turns for one in (own, fair, motion.marks[:, 0]))
        rows.append((f"stride, mean of {turns} periods", mine, other, _off(other, mine), "m"))
        rows.append((f"stride by the laws of the model, mean of {turns} periods", same, other, _off(other, same), "m"))
    elif run.marks is not None:
        notes.append(f"No stride is compared: within {window:.3g} s the walk is no steady motion.")
    columns = ("quantity", Column("Tarsus", ROW), Column("MuJoCo", ROW), Column("difference", "%", digits=3))
    note = (
        f"MuJoCo {loaded.mujoco.__version__}, step {mjcf.step:.3g} s, contacts of {mjcf.contact_rate:.3g} rad/s; "
        f"{motion.duration:.4g} s were run."
    )
    return Table(
        f"{described.scene.name} in MuJoCo",
        columns,
        [row[:4] for row in rows],
        [note, *notes],
        [_touchdowns(described, bare, motion)],
        units=[str(row[4]) for row in rows],
    )


def steady_periods(runs: Sequence[Run], window: float) -> tuple[float, float, int] | None:
    """Begin and end [s] of whole drive periods, and their number, in which the contacts of all runs of a walker repeat;
    None where they do not within a window [s]: a stride of the first steps is one of a transient."""
    every, period = [settled(one) for one in runs], drive_period(runs[0].scene)
    if period is None or not all(one is not None and one.multiple for one in every):
        return None
    found = [one for one in every if one is not None]
    since, turn = max(one.since for one in found), math.lcm(*(one.multiple or 1 for one in found))
    turns = int((window / period * (1.0 + 1e-9) - since) / turn) * turn
    return (since * period, (since + turns) * period, turns) if turns > 0 else None


def _off(found: float, wanted: float) -> float | None:
    return (found - wanted) / wanted if wanted else None


def _window(described: Subject) -> float:
    """Time [s] that is compared: to a little behind the tenth touchdown, of a walker some periods at least."""
    run, found = described.run, described.touchdowns
    own = found[found["apex"] > LOW * described.height]
    end = 1.05 * float(own["time"][TOUCHDOWNS - 1]) if len(own) >= TOUCHDOWNS else run.end_time
    if run.marks is not None and run.period == run.period:
        own_motion = settled(run)
        since = own_motion.since if own_motion is not None and own_motion.multiple else 0
        end = max(end, (since + PERIODS) * run.period)
    return min(end, run.end_time)


def _touchdowns(described: Subject, bare: Run, motion: SpringMotion) -> Table:
    """The first touchdowns of both, and of the library with the laws that MuJoCo's model has."""
    own = _first(described.touchdowns, described.height)
    fair = _first(Subject(described.scene, bare).touchdowns, described.height)
    names, other = described.feet, motion.touchdowns[:TOUCHDOWNS]
    rows = []
    for k in range(max(len(own), len(fair), len(other))):
        row: list[object] = [k + 1]
        for found in (own, fair):
            row += (
                [names[found[k]["foot"]], *(float(found[k][f]) for f in ("time", "speed_before"))]
                if k < len(found)
                else [None] * 3
            )
        row += [names[int(other[k, 1])], float(other[k, 0]), float(other[k, 2])] if k < len(other) else [None] * 3
        rows.append(row)
    parts = []
    for over in ("Tarsus", "Tarsus, laws of the model", "MuJoCo"):
        parts += [Column("foot", over=over), Column("time", "s", over=over), Column("speed", "m/s", over=over)]
    note = (
        f"Flights lower than {LOW:g} of the height of flights ({described.height:.3g} m) are left out. The second "
        "columns are the library's without the laws that the model lacks: what differs from the first is lost with "
        "these laws, what differs from the third by contacts that last."
    )
    return Table("first touchdowns", (Column("number"), *parts), rows, [note])


def _first(found: np.ndarray, height: float) -> np.ndarray:
    return found[found["apex"] > LOW * height][:TOUCHDOWNS]


def _bare(described: Subject) -> Any:
    """The scene with the laws that MuJoCo's model has: restitution, friction, adhesion that does not grow."""
    from tarsus.base.spec import with_values
    from tarsus.model.laws import Adhesion, RestituteFirst

    ground = described.scene.ground
    slots: dict[str, Any] = {
        f"ground.{name}": None
        for name, law in ground.acting_laws.items()
        if law.hook in ("momentum", "force") and hasattr(ground, name)
    }
    if ground.holds:
        slots["ground.adhesion"] = Adhesion(initial=described.held_strength, rate=0.0)
    slots["ground.landing"] = RestituteFirst(speed=0.0)
    slots["ground.impact"] = None
    return with_values(described.scene, slots)
