"""Derivatives of the terms of a run's energy ledger: what the engine has summed up, impacts, and what is stored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.core.arrays import E_ADHESION, E_ENERGY

if TYPE_CHECKING:
    from tarsus.solve.gradients import GradientRun
    from tarsus.solve.lanes import Tangents
    from tarsus.solve.tangents import Entering

Floats = NDArray[np.float64]


def energy_slopes(run: GradientRun, given: Entering, found: Tangents) -> Mapping[str, Floats]:
    """Derivatives (P,) of the ledger's terms by name, and of the work of laws that act alone of their kind.

    found: with a sample at the run's end, and with energies.
    """
    work, damping, resistive, smooth, friction = found.energies
    if run.plan.legs is not None:
        resistive = -resistive
    losses = found.events[:, E_ENERGY], found.events[:, E_ADHESION]
    impacts, adhesion = (one.sum(axis=0) if len(one) else np.zeros(len(work)) for one in losses)
    kinetic, elastic = _stored(run, given, found)
    out = {
        "work_in": work, "damping": damping, "friction": friction, "kinetic": kinetic,
        "elastic": elastic, "impacts": impacts - adhesion, "adhesion": adhesion,
    }  # fmt: skip
    for hook, total in (("momentum", resistive), ("force", smooth)):
        names = list(run.scene.ground.acting_on(hook))
        if len(names) == 1:
            out[names[0]] = total
    return out


def _stored(run: GradientRun, given: Entering, found: Tangents) -> tuple[Floats, Floats]:
    """Derivatives (P,) of the changes of kinetic and elastic energy."""

    system, n = run.plan.system, len(run.plan.system.mass)
    first, last = run.plan.initial, run.motion.last
    starts, ends = given.data.initial, found.samples[0, : 2 * n]
    kinetic = last[n:] @ system.mass @ ends[n:] - first[n:] @ system.mass @ starts[n:]
    elastic = last[:n] @ system.stiffness @ ends[:n] - first[:n] @ system.stiffness @ starts[:n]
    for p, change in given.structure.items():
        for sign, z in ((0.5, last), (-0.5, first)):
            kinetic[p] += sign * z[n:] @ change.mass @ z[n:]
            elastic[p] += sign * z[:n] @ change.stiffness @ z[:n]
    return kinetic, elastic
