"""The chain while its tip is held at the ground: a linear system in complex modal amplitudes.

With the tip at the ground and at rest the other coordinates z = (x, v) obey z' = A z + b(F), so the held
force is F_s(t) = level(F) + sum_k Re c_k(t) with c_k' = lambda_k c_k. The amplitudes bound it,
|F_s - level| <= sum |c_k|, so a peer can stop integrating once that bound is under the adhesion and jump to
the next switch of the voltage.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems import FloatArray, Problem

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Held:
    """Held chain of m = n - 1 free coordinates ``free`` (m,), rates ``rate`` (m,) [1/ms].

    ``to_amplitude`` (m, 2m): c = to_amplitude @ z - ``offset``[h]; ``from_amplitude`` (2m, m):
    z = Re(from_amplitude @ c) + ``rest``[h]; ``level``[h] [uN] is the held force of the static solution, for
    half period parity h = 0, 1.
    """

    free: NDArray[np.int64]
    system: FloatArray
    load: tuple[FloatArray, FloatArray]
    rate: ComplexArray
    to_amplitude: ComplexArray
    from_amplitude: ComplexArray
    offset: tuple[ComplexArray, ComplexArray]
    rest: tuple[FloatArray, FloatArray]
    level: tuple[float, float]

    @property
    def slowest(self) -> float:
        """Smallest decay rate [1/ms]."""
        return float(-self.rate.real.max())


def held_chain(problem: Problem) -> Held:
    """The held system of ``problem``; all its modes must be oscillatory (they are for P1)."""
    n, tip = problem.n, problem.tip
    free = np.array([i for i in range(n) if i != tip])
    m = n - 1
    inverse_mass = 1.0 / problem.mass[free]
    system = np.zeros((2 * m, 2 * m))
    system[:m, m:] = np.eye(m)
    system[m:, :m] = -inverse_mass[:, None] * problem.stiffness[np.ix_(free, free)]
    system[m:, m:] = -inverse_mass[:, None] * problem.damping[np.ix_(free, free)]
    loads = []
    for half in (0, 1):
        load = np.zeros(2 * m)
        load[m:] = -inverse_mass * problem.stiffness[free, tip] * problem.ground
        load[m:] += inverse_mass * np.where(free == problem.drive, problem.drive_force(half), 0.0)
        loads.append(load)
    rate, vectors = np.linalg.eig(system)
    upper = rate.imag > 0.0
    if int(upper.sum()) != m:
        raise ValueError("a held mode is overdamped; amplitudes in conjugate pairs do not apply")
    row = problem.held_force_row()
    level0 = row[tip] * problem.ground
    row = row[np.concatenate([free, n + free])]
    vectors_up = 2.0 * vectors[:, upper]
    gains = row @ vectors_up
    to_amplitude = gains[:, None] * np.linalg.inv(vectors)[upper]
    rest = [-np.linalg.solve(system, load) for load in loads]
    return Held(
        free=free,
        system=system,
        load=(loads[0], loads[1]),
        rate=rate[upper],
        to_amplitude=to_amplitude,
        from_amplitude=vectors_up / gains,
        offset=(to_amplitude @ rest[0], to_amplitude @ rest[1]),
        rest=(rest[0], rest[1]),
        level=(float(level0 + row @ rest[0]), float(level0 + row @ rest[1])),
    )
