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


def series_of(run: WalkRun, raw: RawWalks, times: Floats) -> WalkSeries:
    """Unpack the samples of a run taken at ``times`` [s]."""
    plan, scene = run.walk.plan, run.scene
    body, m, nb = run.walk.body, plan.feet, len(run.walk.body.body_mass)
    rows = raw.samples.T
    nt, nl = len(times), len(body.mass)
    place, speed = rows[:nb], rows[nb : 2 * nb]
    feet = rows[2 * nb : 2 * nb + 4 * nl].reshape(nl, 2, 2, nt)  # leg; upward, along; displacement, rate
    x = np.concatenate([place, feet[:, ::-1, 0].reshape(2 * nl, nt)])
    v = np.concatenate([speed, feet[:, ::-1, 1].reshape(2 * nl, nt)])
    contact, sense = rows[2 * nb + 4 * nl : 2 * nb + 4 * nl + 2 * m].reshape(2, m, nt)
    energy = rows[2 * nb + 4 * nl + 2 * m :]
    held = np.isin(contact, (STUCK, SLIPPING))
    gap = body.gap[body.leg, None] + feet[body.leg, 0, 0]
    rate = feet[body.leg, 0, 1]
    force = np.array([evaluate(channel, times) for channel in plan.channels[: plan.drives]])
    force = force.reshape(plan.drives, nt)
    # the structure's force on every coordinate; on a held foot it is its pull, or its force along the way
    system = plan.system
    onto = system.loads @ force + system.constant[:, None] - system.stiffness @ x - system.damping @ v
    upward = onto[nb + 1 :: 2][body.leg]
    along = onto[nb::2][body.leg]
    pull = np.where(held, upward, 0.0)
    laws = acting.forces(run, gap, rate, held, times)
    smooth, resistive = (acting.total(laws, scene.ground, hook, gap) for hook in ("force", "momentum"))
    strength = of_any.strength_of(run, times, held)
    bounds = list(scene.ground.acting_on("friction").values())
    friction = np.where(contact == STUCK, -along, 0.0)
    sliding = contact == SLIPPING
    if bounds and sliding.any():
        margin = np.maximum(strength - pull - smooth, 0.0)  # below 0 by rounding where a foot has just let go
        friction[sliding] = -sense[sliding] * acting.value(bounds[0], margin[sliding], strength[sliding])
    state = Sampled(x, v, gap, rate, resistive, np.where(held, 0.0, smooth), pull, held)
    return WalkSeries(
        time=times, state=state, force=force, volts=of_any.drive_volts(run, times), laws=laws,
        contact=np.where(held, -(pull + smooth), 0.0),
        strength=strength, kinetic=of_any.quadratic(system.mass, v), elastic=of_any.quadratic(system.stiffness, x),
        cumulative=_terms(energy) | of_any.event_losses(run, times), works=_works(run, energy), ledger=run.ledger,
        body=place,
        foot_x=feet[body.leg, 1, 0], slipping=sliding, friction=friction,
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
