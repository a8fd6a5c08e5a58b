"""What single laws do in a run: their forces at sample times, and their names in the account of its energy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.core import _native
from tarsus.core.replay import Part
from tarsus.model.drive.pieces import evaluate
from tarsus.model.laws.base import Law
from tarsus.plan.lowering import program_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tarsus.model.scene import Ground
    from tarsus.plan.lowering import Plan
    from tarsus.solve.run import Run

Floats = NDArray[np.float64]

__all__ = ["foot_volts", "forces", "momentum", "parts", "slope", "total", "value", "working", "works"]


def value(law: Law, *arguments: Floats | float) -> Floats:
    """Value of a law's function at arguments, of one shape together, by the program that the engine carries out."""
    return _evaluated(_native.evaluate, law, arguments)


def slope(law: Law, *arguments: Floats | float) -> Floats:
    """Its derivative by the first argument."""
    return _evaluated(lambda *of: _native.evaluate_slopes(*of)[0], law, arguments)


def _evaluated(by: object, law: Law, arguments: tuple[Floats | float, ...]) -> Floats:
    program = program_of(type(law))
    rows = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in arguments))
    table = np.ascontiguousarray(np.array([row.ravel() for row in rows]))
    found = by(program.code, program.constants, table, np.array(law.parameters(), dtype=float))  # type: ignore[operator]
    return np.asarray(found).reshape(rows[0].shape)


def working(ground: Ground) -> dict[str, Law]:
    """Laws whose forces do work on a free foot, by name: the resistive ones, then the other smooth ones."""
    return ground.acting_on("momentum") | ground.acting_on("force")


def parts(run: Run) -> list[Part]:
    """The laws whose work is told apart: of those that act together all but the last, whose work is the rest."""
    out = []
    for law in [*_shared(run.scene.ground, "momentum"), *_shared(run.scene.ground, "force")]:
        if law.hook == "momentum":
            out.append(Part(True, lambda gap, rate, time, law=law: value(law, gap)))
        else:
            out.append(
                Part(
                    False,
                    lambda gap, rate, time, law=law: value(
                        law, gap, rate, foot_volts(run.plan, time).T, time[:, None]
                    ),
                )
            )
    return out


def works(ground: Ground, resistive: Floats, smooth: Floats, shares: Floats) -> dict[str, Floats]:
    """Work of every law on the structure by name, from that of all resistive and of all smooth ones, and from the
    shares (np, ...) in the order of `parts`."""
    out: dict[str, Floats] = {}
    first = 0
    for hook, total in (("momentum", resistive), ("force", smooth)):
        names = list(ground.acting_on(hook))
        for place, name in enumerate(names):
            last = place == len(names) - 1
            out[name] = total - shares[first : first + place].sum(axis=0) if last else shares[first + place]
        first += max(len(names) - 1, 0)
    return out


def _shared(ground: Ground, hook: str) -> list[Law]:
    return list(ground.acting_on(hook).values())[:-1]


def forces(run: Run, gap: Floats, rate: Floats, held: NDArray[np.bool_], time: Floats) -> dict[str, Floats]:
    """Force [N] (m, nt) of every law on the feet along the normal, by name: of resistive laws on free feet, of the
    other smooth ones on held feet as well, which they press to the ground or lift."""
    volts = foot_volts(run.plan, time)
    # a foot on the ground may be below it by rounding, where a law need not be defined
    above = np.where(held, 0.0, np.maximum(gap, 0.0))
    speed = np.where(held, 0.0, rate)
    return {
        name: np.where(held, 0.0, slope(law, above) * speed)
        if law.hook == "momentum"
        else value(law, above, speed, volts, np.broadcast_to(time, volts.shape))
        for name, law in working(run.scene.ground).items()
    }


def total(forces: Mapping[str, Floats], ground: Ground, hook: str, like: Floats) -> Floats:
    """Forces of all laws of one kind together, of the shape of ``like``."""
    return sum((forces[name] for name in ground.acting_on(hook)), np.zeros_like(like))


def foot_volts(plan: Plan, time: Floats) -> Floats:
    """Volts (m, nt) that the laws of each foot see."""
    volts = np.zeros((plan.feet, *np.shape(time)))
    for i, channel in enumerate(plan.laws.volts):
        if channel >= 0:
            volts[i] = evaluate(plan.channels[channel], time)
    return volts


def momentum(ground: Ground, gap: float) -> float:
    """Momentum [N s] of the resistive laws at a gap [m]."""
    return sum(law.evaluate(max(gap, 0.0)) for law in ground.acting_on("momentum").values())
