"""Laws as the compiled engines take them: fixed columns for the built-in ones, addresses for users'."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tarsus.core import hooks
from tarsus.core.arrays import Laws
from tarsus.laws import (
    Adhesion,
    AdhesiveFriction,
    Electrostatic,
    Film,
    Friction,
    LegElectrostatic,
    RestituteFirst,
    Restitution,
)
from tarsus.laws.impact_map import passive_angle
from tarsus.plan import FootLaws

BUILT_IN = {
    Film: 0, Electrostatic: 2, Adhesion: 4, Restitution: 6, LegElectrostatic: 7, Friction: 10, AdhesiveFriction: 11,
    RestituteFirst: 12,
}  # fmt: skip
USER = 13
COLUMNS = {
    "momentum": hooks.MOMENTUM, "force": hooks.FORCE, "rebound": hooks.REBOUND, "strength": hooks.STRENGTH,
}  # fmt: skip

hooks.bind(
    {
        hook: [
            hooks.BoundLaw(law.function(), column, len(law.names()))  # type: ignore[arg-type]
            for law, column in BUILT_IN.items()
            if law.hook == hook
        ]
        for hook in ("momentum", "force", "rebound", "strength", "friction", "excess")
    }
)
hooks.bind_angle(passive_angle)


@dataclass(frozen=True)
class OwnLaws:
    """Kernel arrays of the laws, with memory nobody else writes to."""

    arrays: Laws

    @property
    def parameters(self) -> np.ndarray:
        return self.arrays.parameters


def _users(laws: FootLaws) -> list[str]:
    """Names of users' laws, hook by hook: so their parameters stand."""
    own = [name for name, law in laws.acting.items() if type(law) not in BUILT_IN]
    return sorted(own, key=lambda name: list(COLUMNS).index(laws.acting[name].hook))  # type: ignore[arg-type]


def rows(laws: FootLaws, parameters: np.ndarray) -> np.ndarray:
    """Parameters (..., np) of the native engine as the compiled ones take them."""
    users = _users(laws)
    extra = sum(len(laws.acting[name].names()) for name in users)
    out = np.zeros((*parameters.shape[:-1], USER + extra))
    out[..., [BUILT_IN[Film] + 1, BUILT_IN[Electrostatic] + 1]] = 1.0  # an absent law is zero and not 0/0
    at = USER
    for name in [*(set(laws.acting) - set(users)), *users]:
        law = laws.acting[name]
        count, first = len(law.names()), laws.columns[name]
        to = BUILT_IN.get(type(law), at)
        at += count if type(law) not in BUILT_IN else 0
        out[..., to : to + count] = parameters[..., first : first + count]
    return out


def own(laws: FootLaws) -> OwnLaws:
    """The laws with parameter memory of their own, which the users' functions read."""
    parameters = rows(laws, laws.parameters)
    pointer = np.zeros((len(parameters), 8), dtype=np.int64)
    base, width, start = parameters.ctypes.data, parameters.shape[1], USER
    for hook, column in COLUMNS.items():
        several = [laws.acting[name] for name in _users(laws) if laws.acting[name].hook == hook]
        if several:
            functions = tuple((type(law).function(), len(law.names())) for law in several)
            pointer[:, column] = hooks.compile_laws(functions, len(several[0].leading))  # type: ignore[arg-type]
            pointer[:, column + 4] = base + 8 * (np.arange(len(parameters)) * width + start)
            start += sum(len(law.names()) for law in several)
    return OwnLaws(Laws(laws.flags, parameters, pointer, laws.volts))
