"""Series and energy ledger of a walker's run, sampled by the engine itself as it marches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import AIR, SLIPPING, STUCK
from tarsus.core import arrays as a
from tarsus.core.replay import Sampled
from tarsus.model.drive.pieces import evaluate
from tarsus.solve import acting
from tarsus.solve import series as of_any
from tarsus.solve.run import Ledger
from tarsus.solve.series import Series

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tarsus.plan.walker import WalkPlan
    from tarsus.solve.march import RawWalks
    from tarsus.solve.walkrun import WalkRun

Floats = NDArray[np.float64]

__all__ = ["WalkSeries", "ledger_of", "series_of"]


@dataclass(frozen=True)
class WalkSeries(Series):
    """A walker's run at nt times: beside every structure's series, the body's coordinates (nb, nt) [m, rad], the
    feet's places along the way foot_x (m, nt) [m], where they slide (m, nt), and friction on them (m, nt) [N],
    positive forward."""

    body: Floats
    foot_x: Floats
    slipping: NDArray[np.bool_]
    friction: Floats


@dataclass(frozen=True)
class WalkMotion:
    """Samples of a walker unpacked: state; laws: force (m, nt) [N] of every one on the feet; forward (m, nt) [N]: the
    structure's force on each foot along the way; contact, sense (m, nt): what each does, and which way it slides; body
    (nb, nt); foot_x (m, nt) [m]; energy: as the engine sums it up."""

    state: Sampled
    laws: Mapping[str, Floats]
    smooth: Floats
    force: Floats
    forward: Floats
    contact: Floats
    sense: Floats
    body: Floats
    foot_x: Floats
    energy: Floats


def motion_of(walk: WalkPlan, samples: Floats, times: Floats, sources: Floats) -> WalkMotion:
    """Unpack samples taken at ``times`` [s] of a run with these rest gaps and gravity (m + 1,)."""
    plan, body = walk.plan, walk.body
    m, nb, nt, nl = plan.feet, len(body.body_mass), len(times), len(body.mass)
    rows = samples.T
    place, speed = rows[:nb], rows[nb : 2 * nb]
    feet = rows[2 * nb : 2 * nb + 4 * nl].reshape(nl, 2, 2, nt)  # leg; upward, along; displacement, rate
    x = np.concatenate([place, feet[:, ::-1, 0].reshape(2 * nl, nt)])
    v = np.concatenate([speed, feet[:, ::-1, 1].reshape(2 * nl, nt)])
    contact, sense = rows[2 * nb + 4 * nl : 2 * nb + 4 * nl + 2 * m].reshape(2, m, nt)
    held = np.isin(contact, (STUCK, SLIPPING))
    gap = sources[:m, None] + feet[body.leg, 0, 0]
    rate = feet[body.leg, 0, 1]
    force = np.array([evaluate(channel, times) for channel in plan.channels[: plan.drives]])
    force = force.reshape(plan.drives, nt)
    # the structure's force on every coordinate; on a held foot it is its pull, or its force along the way
    system = plan.system
    onto = (
        system.loads @ force + sources[m] * system.weight[:, None] - system.stiffness @ x - system.damping @ v
    )
    pull = np.where(held, onto[nb + 1 :: 2][body.leg], 0.0)
    laws = acting.forces(plan, gap, rate, held, times)
    smooth, resistive = (
        sum((laws[name] for name, law in plan.laws.acting.items() if law.hook == hook), np.zeros_like(gap))
        for hook in ("force", "momentum")
    )
    state = Sampled(x, v, gap, rate, resistive, np.where(held, 0.0, smooth), pull, held)
    return WalkMotion(
        state, laws, smooth, force, onto[nb::2][body.leg], contact, sense, place, feet[body.leg, 1, 0],
        rows[2 * nb + 4 * nl + 2 * m :],
    )  # fmt: skip


def series_of(run: WalkRun, raw: RawWalks, times: Floats) -> WalkSeries:
    """Unpack the samples of a run taken at ``times`` [s]."""
    plan, scene = run.walk.plan, run.scene
    found = motion_of(run.walk, raw.samples, times, plan.system.sources)
    state, pull, held = found.state, found.state.pull, found.state.held
    strength = of_any.strength_of(run, times, held)
    bounds = list(scene.ground.acting_on("friction").values())
    friction = np.where(found.contact == STUCK, -found.forward, 0.0)
    sliding = found.contact == SLIPPING
    if bounds and sliding.any():
        # below 0 by rounding where a foot has just let go
        margin = np.maximum(strength - pull - found.smooth, 0.0)
        friction[sliding] = -found.sense[sliding] * acting.value(
            bounds[0], margin[sliding], strength[sliding]
        )
    return WalkSeries(
        time=times, state=state, force=found.force, volts=of_any.drive_volts(run, times), laws=found.laws,
        contact=np.where(held, -(pull + found.smooth), 0.0), strength=strength,
        kinetic=of_any.quadratic(plan.system.mass, state.v), elastic=of_any.quadratic(plan.system.stiffness, state.x),
        cumulative=_terms(found.energy) | of_any.event_losses(run, times), works=_works(run, found.energy),
        ledger=run.ledger, body=found.body, foot_x=found.foot_x, slipping=sliding, friction=friction,
    )  # fmt: skip


def _terms(energy: Floats) -> dict[str, Floats]:
    """Energies by name, of those that the engine has summed up (5 and as many as laws have shares, ...)."""
    return {"work_in": energy[a.WORK], "damping": energy[a.DAMPING], "friction": energy[a.FRICTION]}


def _works(run: WalkRun, energy: Floats) -> dict[str, Floats]:
    return acting.works(run.scene.ground, -energy[a.FILM], energy[a.SMOOTH], energy[a.ENERGIES :])


def ledger_of(run: WalkRun) -> Ledger:
    """Where the energy of a whole run went."""
    system, body = run.walk.plan.system, run.walk.body
    n = len(system.mass)
    place, feet, contact, energy = run.raw.end
    last = np.concatenate([place[0], feet[:, ::-1, 0].ravel(), place[1], feet[:, ::-1, 1].ravel()])
    for i in body.leg[contact == AIR]:
        at = n + len(body.body_mass) + 2 * i + 1
        last[at] += acting.momentum(run.scene.ground, feet[i, 0, 0] + body.gap[i]) / body.mass[i]
    terms, works = (
        {name: float(value) for name, value in some.items()} for some in (_terms(energy), _works(run, energy))
    )
    return of_any.balance(run, terms, works, last)
