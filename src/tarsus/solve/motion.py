"""How one run moved between its events, what its laws did, and where its energy went."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import NDArray

from tarsus.base.events import FootState
from tarsus.core import _native
from tarsus.core import arrays as a
from tarsus.core.states import SampledStates, states_of
from tarsus.files.ledger import Ledger
from tarsus.plan.lowering import Plan, program_of, without_native
from tarsus.plan.rows import Rows
from tarsus.solve.codes import CLOSED
from tarsus.solve.engine import Accuracy, Engine, RawRuns
from tarsus.solve.ground_work import ground_work

if TYPE_CHECKING:
    from tarsus.core.modes import LinearSystem
    from tarsus.model.laws.base import Law
    from tarsus.solve.run import Run

Floats = NDArray[np.float64]


def law_value(law: Law, *arguments: Floats | float, hook: str | None = None) -> Floats:
    """Value of a law's function, or of that of another hook, at arguments, of one shape together, by the program
    that the engine carries out."""
    return _evaluated(_native.evaluate, law, arguments, hook)


def contact_strength(law: Law, ages: Floats | float, volts: Floats | float) -> Floats:
    """Strength [N] of contacts of some age [s] under the volts of their feet, by a law of adhesion."""
    return law_value(law, *(ages, volts)[: len(law.leading)])


def law_slope(law: Law, *arguments: Floats | float) -> Floats:
    """Its derivative by the first argument."""
    return _evaluated(lambda *of: _native.evaluate_slopes(*of)[0], law, arguments)


def _evaluated(by: object, law: Law, arguments: tuple[Floats | float, ...], hook: str | None = None) -> Floats:
    program = program_of(type(law), hook)
    rows = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in arguments))
    table = np.ascontiguousarray(np.array([row.ravel() for row in rows]))
    found = by(program.code, program.constants, table, np.array(law.parameters(), dtype=float))  # type: ignore[operator]
    return np.asarray(found).reshape(rows[0].shape)


@dataclass(frozen=True)
class RunLaws:
    """The laws on the feet of one run, which has a row of a plan's data."""

    plan: Plan
    rows: Rows

    @cached_property
    def by_ground(self) -> list[tuple[list[int], dict[str, Law]]]:
        """Numbers of feet that are on one ground, and the laws on them by name, with the parameters of the run."""
        rows = self.rows.parameters[0, : self.plan.feet]
        if not len(rows):
            return []
        _, first, which = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        groups = [np.flatnonzero(which.ravel() == k).tolist() for k in range(len(first))]
        return [(feet, self.plan.laws.of_row(rows[feet[0]].tolist())) for feet in groups]

    def on(self, hook: str) -> list[str]:
        """Names of the laws that the engine calls in one place; see `tarsus.model.laws.Law.hook`."""
        return [name for name, law in self.plan.laws.acting.items() if law.hook == hook]

    def on_feet(self, hook: str) -> Iterator[tuple[list[int], str, Law]]:
        """The same with the feet that each one acts on."""
        for feet, laws in self.by_ground:
            yield from ((feet, name, law) for name, law in laws.items() if law.hook == hook)

    def works(self, resistive: Floats, smooth: Floats, shares: Floats) -> dict[str, Floats]:
        """Work of every law on the structure by name, from that of all resistive and of all smooth ones, and from the
        shares (np, ...) of those that act together, all but the last of a kind, resistive ones first."""
        out: dict[str, Floats] = {}
        first = 0
        for hook, whole in zip(_HOOKS, (resistive, smooth), strict=True):
            *names, last = self.on(hook) or [""]
            own = shares[first : first + len(names)]
            out |= dict(zip(names, own, strict=True)) | ({last: whole - own.sum(axis=0)} if last else {})
            first += len(names)
        return out

    def forces(self, gap: Floats, rate: Floats, held: NDArray[np.bool_], time: Floats) -> dict[str, Floats]:
        """Force [N] (m, nt) of every law on the feet along the normal, by name: of resistive laws on free feet, of the
        other smooth ones on held feet as well, which they press to the ground or lift."""
        volts = self.volts(time)
        # a foot on the ground may be below it by rounding, where a law need not be defined
        above = np.where(held, 0.0, np.maximum(gap, 0.0))
        speed = np.where(held, 0.0, rate)
        when = np.broadcast_to(time, volts.shape)
        out = {name: np.zeros_like(above) for hook in _HOOKS for name in self.on(hook)}
        for feet, name, law in self.on_feet("momentum"):
            out[name][feet] = np.where(held[feet], 0.0, law_slope(law, above[feet]) * speed[feet])
        for feet, name, law in self.on_feet("force"):
            out[name][feet] = law_value(law, above[feet], speed[feet], volts[feet], when[feet])
        return out

    def total(self, forces: Mapping[str, Floats], hook: str, like: Floats) -> Floats:
        """Forces of all laws of one kind together, of the shape of ``like``."""
        return sum((forces[name] for name in self.on(hook)), np.zeros_like(like))

    def volts(self, time: Floats) -> Floats:
        """Volts (m, nt) that the laws of each foot see."""
        out = np.zeros((self.plan.feet, *np.shape(time)))
        for i, channel in enumerate(self.plan.laws.volts):
            if channel >= 0:
                out[i] = self.rows.drive(channel, time)
        return out

    def drives(self, time: Floats) -> Floats:
        """Forces (nd, nt) [N] of the drives."""
        forces = [self.rows.drive(d, time) for d in range(self.plan.drives)]
        return np.array(forces).reshape(self.plan.drives, len(time))


_HOOKS = ("momentum", "force")
"""Of laws that do work on a free foot: the resistive ones, and the other smooth ones."""


class Account(NamedTuple):
    """Energies of the ledger and works of the laws by name, up to given times (nt,) or of a whole run [J]."""

    terms: dict[str, Floats]
    works: dict[str, Floats]


def account_of(acting: RunLaws, energy: Floats) -> Account:
    """Of energies that the engine has summed up (ENERGIES + np, ...), see `tarsus.core.arrays`."""
    terms = {"work_in": energy[a.WORK], "damping": energy[a.DAMPING], "friction": energy[a.FRICTION]}
    return Account(terms, acting.works(-energy[a.FILM], energy[a.SMOOTH], energy[a.ENERGIES :]))


class Sliding(NamedTuple):
    """What feet (m, nt) do in one direction along the ground: places [m] and speeds [m/s], not negative, whether they
    are held there or slide, the sense of that, and the structure's force [N]."""

    place: Floats
    speed: Floats
    held: NDArray[np.bool_]
    slides: NDArray[np.bool_]
    sense: Floats
    force: Floats


class MotionAlongGround(NamedTuple):
    """What a robot does along the ground: coordinates of a walker's body (nb, nt) [m, rad], and its feet along the way,
    and across it where they move so."""

    body: Floats
    along: Sliding
    across: Sliding | None = None


class MotionSamples(NamedTuple):
    """A run at given times: its states, its energies up to then, and what feet that know it do along the way."""

    state: SampledStates
    account: Account
    way: MotionAlongGround | None


def _ground_motion(tangents: Floats | None, state: SampledStates) -> MotionAlongGround | None:
    """What feet that know their way do along the ground, places (n, m); None where none does."""
    if tangents is None or state.contact is None or state.friction is None:
        return None
    along = np.where(state.contact == FootState.STUCK, -state.friction, 0.0)
    none = np.zeros((0, state.x.shape[1]))
    speed, stuck, slips = (
        np.abs(tangents.T @ state.v),
        state.contact == FootState.STUCK,
        state.contact == FootState.SLIPPING,
    )
    return MotionAlongGround(none, Sliding(tangents.T @ state.x, speed, stuck, slips, -np.sign(state.friction), along))


class _Walked(NamedTuple):
    """Samples of a walker: displacements and velocities (n, nt); of its legs (nl, 2, 2, nt) upward and along the way,
    and across it (nl, 2, nt), displacements and rates; what feet do (kinds, m, nt), which of them are held (m, nt),
    what they do across the way, and energies."""

    x: Floats
    v: Floats
    legs: Floats
    across: Floats
    footing: Floats
    held: NDArray[np.bool_]
    across_feet: Floats
    energy: Floats

    @classmethod
    def of(cls, plan: Plan, samples: Floats) -> _Walked:
        assert plan.legs is not None
        body, m = plan.legs.body, plan.feet
        nt, nl, nb, kinds = len(samples), len(body.mass), len(body.body_mass), 5 if len(body.points) else 2
        sideways = 2 * nl + m if plan.legs.sways else 0
        place, speed, *parts = np.split(samples.T, np.cumsum([nb, nb, 4 * nl, kinds * m, sideways]))
        legs, footing, across_feet = parts[0].reshape(nl, 2, 2, nt), parts[1].reshape(kinds, m, nt), parts[2]
        across = across_feet[: sideways and 2 * nl].reshape(-1, 2, nt)
        x = np.concatenate([place, legs[:, ::-1, 0].reshape(2 * nl, nt), across[:, 0]])
        v = np.concatenate([speed, legs[:, ::-1, 1].reshape(2 * nl, nt), across[:, 1]])
        held = np.isin(footing[0], (FootState.STUCK, FootState.SLIPPING))
        return cls(x, v, legs, across, footing, held, across_feet[2 * nl :], parts[3])


def walked(plan: Plan, samples: Floats) -> SampledStates:
    """States of a walker by its samples, with neither gaps nor forces of its feet."""
    at, none = _Walked.of(plan, samples), np.zeros((0, len(samples)))
    return SampledStates(at.x, at.v, none, none, none, none, none, at.held)


def unpacked(acting: RunLaws, samples: Floats, times: Floats) -> tuple[SampledStates, MotionAlongGround, Floats]:
    """States of a walker, what it does along the way, and its energies as the engine sums them up, of its samples."""
    plan, sources = acting.plan, acting.rows.sources[0]
    assert plan.legs is not None
    x, v, feet, across, footing, held, side, energy = _Walked.of(plan, samples)
    body, m, nb, nl = plan.legs.body, plan.feet, len(plan.legs.body.body_mass), len(feet)
    place = x[:nb]
    contact, sense, *below = footing
    up, ahead = feet[body.leg, 0], feet[body.leg, 1]
    gap, rate = sources[:m, None] + up[:, 0], up[:, 1]
    if below:  # the facets' directions: their tangents have these components along the way and upward
        gap, cos, sin = below
        rate = np.where(held, 0.0, cos * up[:, 1] - sin * ahead[:, 1])
    # the structure's force on every coordinate; on a held foot it is its pull, or its force along the way
    system = plan.system.at(sources)
    onto = system.loads @ acting.drives(times) + system.constant[:, None]
    onto -= system.stiffness @ x + system.damping @ v
    forces = acting.forces(gap, rate, held, times)
    smooth, resistive = (acting.total(forces, hook, gap) for hook in ("force", "momentum"))
    lift, along = onto[nb + 1 :: 2][body.leg], onto[nb::2][body.leg]
    slip = ahead[:, 1]
    if below:
        lift, along = cos * lift - sin * along, cos * along + sin * lift
        slip = cos * ahead[:, 1] + sin * up[:, 1]
    pull = np.where(held, lift, 0.0)
    state = SampledStates(x, v, gap, rate, resistive, np.where(held, 0.0, smooth), pull, held)
    stuck = contact == FootState.STUCK
    if not plan.legs.sways:
        way = MotionAlongGround(place, Sliding(ahead[:, 0], np.abs(slip), stuck, held & ~stuck, sense, along))
        return state, way, energy
    sway, push = across[body.leg], onto[nb + 2 * nl :][body.leg]
    speed = np.hypot(slip, sway[:, 1])
    ways = (
        Sliding(to, speed, stuck, held & ~stuck, turned, force)
        for to, turned, force in ((ahead[:, 0], sense, along), (sway[:, 0], side, push))
    )
    return state, MotionAlongGround(place, *ways), energy


@dataclass(frozen=True)
class RunMotion:
    """How one run moved, and where its energy went. Nothing of its steps is kept: states at given times are those of
    one more run.

    acting: the run's laws and its row of data; engine, accuracy, track: what it is run by.
    """

    acting: RunLaws
    engine: Engine
    accuracy: Accuracy
    track: bool

    def __getstate__(self) -> dict[str, object]:
        made = {"log": self.__dict__["log"]} if "log" in self.__dict__ else {}
        return without_native(self) | made

    @cached_property
    def log(self) -> RawRuns:
        """What the engine noted, with an account."""
        return self._run(None, account=True)

    def _run(self, times: Floats | None, *, account: bool) -> RawRuns:
        return self.engine.run(self.acting.rows, self.accuracy, self.track, times, account=account)

    def _sampled(self, times: Floats, *, account: bool) -> tuple[SampledStates, MotionAlongGround | None, Floats]:
        """States, what feet do along the way and energies up to then, at times [s] in order."""
        return self._unpacked(self._run(times, account=account).samples, times)

    def watched(self, times: Floats) -> tuple[RawRuns, SampledStates]:
        """What the engine notes without an account, and the states at times [s] in order, of one run."""
        found = self._run(times, account=False)
        return found, self._unpacked(found.samples, times)[0]

    def _unpacked(self, samples: Floats, times: Floats) -> tuple[SampledStates, MotionAlongGround | None, Floats]:
        plan = self.acting.plan
        if plan.legs is not None:
            return unpacked(self.acting, samples, times)
        tangents = plan.system.tangents
        state, energy = states_of(samples, len(plan.system.mass), plan.feet, tangents is not None)
        return state, _ground_motion(tangents, state), energy

    def states(self, times: Floats) -> SampledStates:
        """States and contact forces at times [s], increasing."""
        return self._sampled(times, account=False)[0]

    def seen(self, times: Floats) -> MotionSamples:
        """The same with energies."""
        state, way, energy = self._sampled(times, account=True)
        return MotionSamples(state, account_of(self.acting, energy), way)

    @property
    def last(self) -> Floats:
        """Displacements and velocities (2n,) at the end, events at its last moment included."""
        return self.log.last

    @property
    def account(self) -> Account:
        """Energies of the whole run."""
        assert self.log.energies is not None
        return account_of(self.acting, self.log.energies)


NOTHING = 1e-20
"""Part of the plan's force times length below which energies are rounding, and an account of nothing else is closed:
motion of 1e-10 of the length, which is what a step may err by."""
RESOLVED = 1.5e-5
"""Way of a foot in a resistive law, as part of the plan's length, below which its account closes less exactly. Where a
foot lands the powers of time of its momentum P leave 3e-13 P of rounding (as measured), and a way x through a film as
thick as the length changes P by 2 x of itself: 1.5e-13 / x is 1e-8, what counts as closed, at 1.5e-5."""
MOMENTS = 98
"""Moments of a run at which an account that is open is compared with what the robot stored: 97 parts, a prime number,
fall together with no whole periods of a drive."""
LEAST = 1e-12
"""Way of a foot, as part of the plan's length, below which it is rounding."""


def ledger_of_run(run: Run) -> Ledger:
    """Where the energy of a whole run went."""
    row, first, last = run.motion.acting.rows, run.motion.acting.rows.initial[0], run.motion.last
    lost = (float(run.events["energy"].sum()), float(run.events["adhesion_energy"].sum()))
    resolved = _unresolved(run, first, last)
    whole = ledger_of(run.plan.system, row.scales[0], first, last, run.motion.account, lost, resolved)
    if whole.closure > CLOSED:
        stored = max(_most_stored(run), abs(whole.residual) / (resolved * whole.closure))
        whole = replace(whole, closure=abs(whole.residual) / (resolved * stored))
    if run.scene.ground.motion is None:
        return whole
    end, n = np.array([run.end_time]), len(run.plan.system.mass)
    ground = float(ground_work(run, end, last[:n, None], np.array([whole.work_in]))[0])
    return replace(whole, work_in=whole.work_in - ground, ground=ground)


def _most_stored(run: Run) -> float:
    """The largest kinetic or elastic energy [J] of the robot at moments of its run."""
    state, system = run.motion.states(np.linspace(0.0, run.end_time, MOMENTS)), run.plan.system
    kinetic = np.einsum("in,ij,jn->n", state.v, system.mass, state.v)
    elastic = np.einsum("in,ij,jn->n", state.x, system.stiffness, state.x)
    return 0.5 * float(max(kinetic.max(), elastic.max()))


def ledger_of(
    system: LinearSystem,
    scales: Floats,
    first: Floats,
    last: Floats,
    account: Account,
    lost: Sequence[float] | Floats,
    resolved: float = 1.0,
) -> Ledger:
    """That of a motion from a state to another (2n,), with its account; scales: length [m] and force [N]; lost [J]: in
    impacts, and of that to adhesion; resolved: how exactly the account can close."""
    terms, works = ({name: float(one) for name, one in some.items()} for some in account)
    n = len(system.mass)
    kinetic = [float(0.5 * z[n:] @ system.mass @ z[n:]) for z in (first, last)]
    elastic = [float(0.5 * z[:n] @ system.stiffness @ z[:n]) for z in (first, last)]
    adhesion = float(lost[1])
    impacts = float(lost[0]) - adhesion
    change_k, change_e = kinetic[1] - kinetic[0], elastic[1] - elastic[0]
    gained = terms["work_in"] + sum(works.values())
    spent = terms["damping"] + terms["friction"] + impacts + adhesion
    residual = gained - spent - change_k - change_e
    sizes = (*terms.values(), *works.values(), impacts, adhesion, change_k, change_e, *kinetic, *elastic)
    length, force = scales[:2]
    largest = max(map(abs, sizes))
    moved = largest > NOTHING * force * length
    return Ledger(
        **terms,
        kinetic=change_k,
        elastic=change_e,
        impacts=impacts,
        adhesion=adhesion,
        laws=works,
        residual=residual,
        closure=abs(residual) / (resolved * largest) if moved else 0.0,
    )


def electrical_energy(run: Run) -> float:
    """Energy [J] that the electrodes of all drives take in a run, the integral of V dq from just after its start; NaN
    where a law has a memory.

    What capacitances store and gains that go with the volts hold of the motion, and the work of the drives, which is
    all of the ledger's but that of the weight (docs/drive.md, Charge and current).
    """
    drives = run.scene.robot.drives
    if any(drive.law.has_memory for drive in drives.values()):
        return np.nan
    row, system = run.motion.acting.rows, run.plan.system
    n = len(system.mass)
    ends = np.array([row.initial[0], run.motion.last])[:, :n]
    weight = float((ends[1] - ends[0]) @ system.weight @ row.sources[0, -2:])
    taken, times = run.ledger.work_in - weight, np.array([0.0, run.end_time])
    for drive, signal, load in zip(
        drives.values(), run.scene.actuator_volts.values(), system.loads.T[: len(drives)], strict=True
    ):
        volts = signal.volts(times)
        gain = polyval(volts, drive.law.small_signal_gain())
        held = 0.5 * (drive.capacitance or 0.0) * volts**2 + (volts * gain - drive.law.force(volts)) * (ends @ load)
        taken += float(held[1] - held[0])
    return taken


def _unresolved(run: Run, first: Floats, last: Floats) -> float:
    """How many times less exactly than others the account closes where feet hardly move in a resistive law."""
    gap_range, row = run.motion.log.gap_range, run.motion.acting.rows
    if gap_range is None or not gap_range.size or not run.motion.acting.on("momentum"):
        return 1.0
    normals = run.plan.system.normals
    ends = np.ptp([z[: len(normals)] @ normals for z in (first, last)], axis=0)
    way = float(max(gap_range.max(), ends.max()))
    return max(1.0, RESOLVED / max(way / row.scales[0, 0], LEAST))
