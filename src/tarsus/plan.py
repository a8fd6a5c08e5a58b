"""Scene to arrays: the one place that knows both the descriptions and the kernels."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from tarsus.core import hooks
from tarsus.core.arrays import Laws
from tarsus.core.modes import LinearSystem
from tarsus.core.signals import Signals
from tarsus.laws.adhesion import Adhesion
from tarsus.laws.electrostatic import Electrostatic
from tarsus.laws.film import Film
from tarsus.laws.restitution import Restitution

# Columns of a foot's parameter row that hold the built-in laws; a user's parameters follow.
FILM, ELECTROSTATIC, ADHESION, RESTITUTION, USER = 0, 2, 4, 6, 7

hooks.bind(
    {
        "momentum": [hooks.BoundLaw(Film.momentum, FILM, 2)],
        "force": [hooks.BoundLaw(Electrostatic.force, ELECTROSTATIC, 2)],
        "rebound": [hooks.BoundLaw(Restitution.rebound, RESTITUTION, 1)],
        "strength": [hooks.BoundLaw(Adhesion.strength, ADHESION, 2)],
    }
)


@lru_cache(maxsize=1)
def source_hash() -> str:
    """Hash of every source compiled into the engine: a changed law or kernel never meets stale machine code."""
    here = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted([*(here / "core").glob("*.py"), *(here / "laws").glob("*.py"), Path(__file__)]):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@dataclass(frozen=True)
class Plan:
    """A scene as arrays, ready for the engine.

    system: the linear structure; laws: flags, parameters, users' pointers and volts channel per foot;
    signals: drive channels then volts channels; initial (2n,): displacements and velocities at t = 0.
    length [m], force [N], rate [1/s]: scales that turn relative tolerances into absolute ones.
    first_step, horizon [s]: first and longest step tried.
    """

    system: LinearSystem
    laws: Laws
    signals: Signals
    initial: np.ndarray
    length: float
    force: float
    rate: float
    first_step: float
    horizon: float

    @property
    def feet(self) -> int:
        return self.system.normals.shape[1]

    @property
    def drives(self) -> int:
        return self.system.loads.shape[1]
