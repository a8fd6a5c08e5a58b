"""What single laws do in a run: their forces at sample times, and their names in the account of its energy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.core import _native
from tarsus.plan.lowering import Plan, program_of

if TYPE_CHECKING:
    from tarsus.model.laws.base import Law
    from tarsus.plan.slots import Rows

Floats = NDArray[np.float64]


def value(law: Law, *arguments: Floats | float, hook: str | None = None) -> Floats:
    """Value of a law's function, or of that of another hook, at arguments, of one shape together, by the program
    that the engine carries out."""
    return _evaluated(_native.evaluate, law, arguments, hook)


def strength(law: Law, ages: Floats | float, volts: Floats | float) -> Floats:
    """Strength [N] of contacts of some age [s] under the volts of their feet, by a law of adhesion."""
    return value(law, *(ages, volts)[: len(law.leading)])


def slope(law: Law, *arguments: Floats | float) -> Floats:
    """Its derivative by the first argument."""
    return _evaluated(lambda *of: _native.evaluate_slopes(*of)[0], law, arguments)


def _evaluated(
    by: object, law: Law, arguments: tuple[Floats | float, ...], hook: str | None = None
) -> Floats:
    program = program_of(type(law), hook)
    rows = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in arguments))
    table = np.ascontiguousarray(np.array([row.ravel() for row in rows]))
    found = by(program.code, program.constants, table, np.array(law.parameters(), dtype=float))  # type: ignore[operator]
    return np.asarray(found).reshape(rows[0].shape)


@dataclass(frozen=True)
class Acting:
    """The laws on the feet of one run, which has a row of a plan's data."""

    plan: Plan
    rows: Rows

    @cached_property
    def laws(self) -> dict[str, Law]:
        """By name, with the parameters of the run."""
        given, row = self.plan.laws, self.rows.parameters[0, 0].tolist()
        return {
            name: law.model_copy(update=dict(zip(law.names(), row[given.columns[name] :], strict=False)))
            for name, law in given.acting.items()
        }

    def on(self, hook: str) -> dict[str, Law]:
        """Those that the engine calls in one place; see `tarsus.model.laws.Law.hook`."""
        return {name: law for name, law in self.laws.items() if law.hook == hook}

    def works(self, resistive: Floats, smooth: Floats, shares: Floats) -> dict[str, Floats]:
        """Work of every law on the structure by name, from that of all resistive and of all smooth ones, and from the
        shares (np, ...) of those that act together, all but the last of a kind, resistive ones first."""
        out: dict[str, Floats] = {}
        first = 0
        for hook, whole in zip(_HOOKS, (resistive, smooth), strict=True):
            *names, last = [*self.on(hook)] or [""]
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
        return {
            name: np.where(held, 0.0, slope(law, above) * speed)
            if hook == "momentum"
            else value(law, above, speed, volts, np.broadcast_to(time, volts.shape))
            for hook in _HOOKS
            for name, law in self.on(hook).items()
        }

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
