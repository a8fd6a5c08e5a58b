"""Series of a run: states, forces and energies at sample times."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import CONTACT_BEGINS
from tarsus.core.modes import ContactMode, contact_mode
from tarsus.core.replay import Integrals, Sampled, integrate
from tarsus.core.replay import sample as sample_states
from tarsus.model.drive.pieces import evaluate
from tarsus.solve import acting
from tarsus.solve.run import Ledger

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.solve.run import Run

Floats = NDArray[np.float64]

NOTHING = 1e-24
"""Part of the plan's force times length below which energies are rounding: motion of 1e-12 of the length."""
SETTLED = 2e-3
"""Way of a foot in a resistive law, as part of the plan's length, below which its account closes less exactly. Gaps at the
nodes of a single run's steps settle to 0.05 * 1e-10 of the length (modal_newton.hpp), and its momentum, and so its work, is
as uncertain as that is to the way: 1e-8, what counts as closed, at 5e-4. Steps add to four times that at most
(1.6e-3 is the worst of 46 random films)."""
LEAST = 1e-12
"""Way of a foot, as part of the plan's length, below which it is rounding."""
FEWEST, MOST, PER_PERIOD, PER_CYCLE = 2001, 20001, 400, 6
VALUES = 4_000_000
"""Numbers that the series of a run have together, about, where that leaves them enough samples."""


@dataclass(frozen=True)
class Series:
    """A run at nt times [s]: state of the structure and, per foot, its forces [N].

    force (nd, nt): drive forces; laws: force (m, nt) of every smooth law on the foot by name, positive along the
    normal; contact (m, nt): the ground's reaction on a held foot, positive pushing; strength (m, nt): f_a of a held
    foot.
    cumulative, works: energies of the ledger and works of the laws by name, from the start (nt,) [J].
    """

    time: Floats
    state: Sampled
    force: Floats
    volts: Floats
    laws: Mapping[str, Floats]
    contact: Floats
    strength: Floats
    kinetic: Floats
    elastic: Floats
    cumulative: Mapping[str, Floats]
    works: Mapping[str, Floats]
    ledger: Ledger


def grid(run: Run) -> Floats:
    """Even sample times: enough for the drive period and the fastest mode, within bounds."""
    cycles = run.duration * run.plan.rate / (2.0 * np.pi)
    wanted = max(PER_PERIOD * run.duration / run.period, PER_CYCLE * cycles)
    kept = VALUES // (2 * len(run.scene.robot.structure.points) + 12 * len(run.foot_names) + 12)
    most = max(min(MOST, kept), FEWEST)
    return np.linspace(0.0, run.end_time, int(np.clip(np.ceil(wanted), FEWEST - 1, most - 1)) + 1)


def sample(run: Run, times: Floats | None = None) -> Series:
    """Replay the recorded steps of a run at ``times`` [s], increasing (an even grid by default)."""
    time = grid(run) if times is None else times
    plan, scene = run.plan, run.scene
    state = sample_states(plan.system, run.raw.book.book, run.raw.trace, time)
    force = np.array([evaluate(channel, time) for channel in plan.channels[: plan.drives]])
    force = force.reshape(plan.drives, len(time))
    laws = acting.forces(run, state.gap, state.rate, state.held, time)
    smooth = acting.total(laws, scene.ground, "force", state.gap)
    knots = np.concatenate([[0.0], run.energies.time])
    cumulative, works = (
        {name: np.interp(time, knots, np.concatenate([[0.0], values])) for name, values in terms.items()}
        for terms in _terms(run)
    )
    return Series(
        time=time, state=state, force=force, volts=drive_volts(run, time), laws=laws,
        contact=np.where(state.held, -(state.pull + smooth), 0.0), strength=strength_of(run, time, state.held),
        kinetic=quadratic(plan.system.mass, state.v), elastic=quadratic(plan.system.stiffness, state.x),
        cumulative=cumulative | event_losses(run, time), works=works, ledger=run.ledger,
    )  # fmt: skip


def quadratic(matrix: Floats, z: Floats) -> Floats:
    """Energy (nt,) of states z (n, nt): z M z / 2."""
    return 0.5 * np.einsum("it,ij,jt->t", z, matrix, z)


def drive_volts(run: Run, time: Floats) -> Floats:
    """Volts (nd, nt) at every drive's actuator."""
    signals = run.scene.actuator_volts.values()
    return np.array([signal.volts(time) for signal in signals]).reshape(len(signals), len(time))


def command_volts(scene: Scene, time: Floats) -> Floats | None:
    """Volts (nd, nt) that every drive's amplifier is told to give; None where all are ideal."""
    drives, commands = scene.robot.drives, scene.waveforms
    if all(drive.amplifier.ideal for drive in drives.values()):
        return None
    return np.array([commands[d].volts(time) if d in commands else np.zeros(len(time)) for d in drives])


def energies(run: Run) -> Integrals:
    """Energy integrals of every recorded step; the work of laws that act together told apart."""
    return integrate(run.plan.system, run.raw.book.book, run.raw.trace, acting.parts(run))


def strength_of(run: Run, time: Floats, held: NDArray[np.bool_]) -> Floats:
    """f_a [N] of every held foot: from the contact's age."""
    strength = np.zeros(held.shape)
    laws = list(run.scene.ground.acting_on("strength").values())
    if not laws:
        return strength
    for i in range(len(held)):
        begun = run.events[(run.events["foot"] == i) & np.isin(run.events["kind"], CONTACT_BEGINS)]["time"]
        if not len(begun):
            continue
        since = begun[np.clip(np.searchsorted(begun, time, side="right") - 1, 0, None)]
        ages = np.maximum(time - since, 0.0)
        strength[i, held[i]] = acting.value(laws[0], ages[held[i]])
    return strength


def _terms(run: Run) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Energies up to the end of every step (nr,) by name, and works of the laws."""
    found = run.energies
    works = acting.works(run.scene.ground, found.resistive, found.smooth, found.parts)
    return {"work_in": found.work, "damping": found.damping, "friction": np.zeros_like(found.work)}, works


def event_losses(run: Run, time: Floats) -> dict[str, Floats]:
    """Energies that blows and captures have taken by the sample times [J]."""
    events = run.events
    passed = np.searchsorted(np.maximum.accumulate(events["time"]), time, side="right")
    adhesion = np.concatenate([[0.0], np.cumsum(events["adhesion_energy"])])
    lost = np.concatenate([[0.0], np.cumsum(events["energy"])])
    return {"adhesion": adhesion[passed], "impacts": lost[passed] - adhesion[passed]}


def last_state(run: Run) -> Floats:
    """Displacements and velocities (2n,) at the end of a run, events at its last moment included."""
    system, raw = run.plan.system, run.raw
    if raw.pending >= 0:  # a contact was made or broken and not yet moved on from
        mode = contact_mode(system, raw.pending)
        return mode.to_physical @ (mode.from_physical @ (raw.physical - mode.offset)) + mode.offset
    mode = raw.book.book.modes[raw.mode]
    w = raw.state[: 2 * len(mode.blocks)]
    return mode.to_physical @ (w + _momenta(run, mode, w) @ mode.beta) + mode.offset


def _momenta(run: Run, mode: ContactMode, w: Floats) -> Floats:
    """Momentum potentials [N s] (m,) of the resistive laws at the free feet."""
    out = np.zeros(run.plan.feet)
    for i in range(len(out)):
        if not mode.mask >> i & 1:
            out[i] = acting.momentum(run.scene.ground, float(mode.outputs[i] @ w + mode.feed[i, -1]))
    return out


def ledger(run: Run) -> Ledger:
    """Where the energy of a whole run went."""
    terms, works = (
        {name: float(values[-1]) if len(values) else 0.0 for name, values in some.items()}
        for some in _terms(run)
    )
    last = last_state(run)
    return balance(run, terms, works, last, _unresolved(run, last))


def _unresolved(run: Run, last: Floats) -> float:
    """How many times less exactly than others the account closes where feet hardly move in a resistive law."""
    if not run.scene.ground.acting_on("momentum"):
        return 1.0
    system, n = run.plan.system, len(run.plan.system.mass)
    ends = np.ptp([z[:n] @ system.normals for z in (run.plan.initial, last)], axis=0)
    way = float(max(run.energies.swing.max(), ends.max()))
    return max(1.0, SETTLED / max(way / run.plan.length, LEAST))


def balance(
    run: Run, terms: Mapping[str, float], works: Mapping[str, float], last: Floats, unresolved: float = 1.0
) -> Ledger:
    """The ledger of energies and of the laws' works by name and of the state (2n,) at the end; unresolved: how
    many times less exactly than others it can close."""
    system = run.plan.system
    n = len(system.mass)
    first = run.plan.initial
    kinetic = [float(0.5 * z[n:] @ system.mass @ z[n:]) for z in (first, last)]
    elastic = [float(0.5 * z[:n] @ system.stiffness @ z[:n]) for z in (first, last)]
    adhesion = float(run.events["adhesion_energy"].sum())
    impacts = float(run.events["energy"].sum()) - adhesion
    change_k, change_e = kinetic[1] - kinetic[0], elastic[1] - elastic[0]
    gained = terms["work_in"] + sum(works.values())
    spent = terms["damping"] + terms["friction"] + impacts + adhesion
    residual = gained - spent - change_k - change_e
    sizes = [
        abs(x)
        for x in (*terms.values(), *works.values(), impacts, adhesion, change_k, change_e, *kinetic, *elastic)
    ]
    largest = max(unresolved * max(abs(x) for x in sizes), NOTHING * run.plan.force * run.plan.length)
    return Ledger(
        **terms, kinetic=change_k, elastic=change_e, impacts=impacts, adhesion=adhesion, laws=works, residual=residual,
        closure=abs(residual) / largest,
    )  # fmt: skip
