"""Free flights of a linear structure near the ground, many at once, with exact derivatives.

State z = (x, v). ``z' = flow z + inputs (F_drive(t), F_foot)``, with film and attraction at the foot along its normal,
``F_foot = -C g' / (g + g0)^n - C_e V^2 / (g + g_e)^2``. A step is exact for forces that run straight between its ends;
the force at the foot at its end is found by two corrections. Derivatives are those of just this arithmetic.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from tarsus.core import _native
from tarsus.core.arrays import LANES

Floats = NDArray[np.float64]

SUBSTEPS = 3
"""Steps of the flow per sample."""


@dataclass(frozen=True)
class Varied:
    """Numbers (N, ...) of N flights and their derivatives by q unknowns (N, ..., q), or (..., q) where those of all
    flights are the same; none unless given."""

    value: Floats
    slopes: Floats | None = None

    def lanes(self, first: int) -> Floats:
        """Eight of the derivatives (N, ..., 8) from number ``first`` on; what is missing is zero."""
        out = np.zeros((*self.value.shape, LANES))
        if self.slopes is not None:
            part = self.slopes[..., first : first + LANES]
            out[..., : part.shape[-1]] = part
        return out


@dataclass(frozen=True)
class Launches:
    """How N flights begin, and what they feel at the foot.

    state (N, 2n): at the launch; begin (N,) [s]: when that is, from the first sample; offset (N, 2): force of the drive
    at the first sample [N] and its drift [N/s], on top of the drive's own; film (N, 5): C [N m^(n-1) s], g0 [m], C_e
    [N m^2/V^2], g_e [m], n; neutral (N,) [m]: gap where x = 0; near (N, nk), near_step [s]: the drive's own force up to
    the first sample, the last one there.
    """

    state: Varied
    begin: Varied
    offset: Varied
    film: Varied
    neutral: Floats
    near: Floats
    near_step: float

    @property
    def unknowns(self) -> int:
        """Number q of unknowns."""
        every = (self.state, self.begin, self.offset, self.film)
        return max((one.slopes.shape[-1] for one in every if one.slopes is not None), default=0)

    def part(self, first: int) -> SimpleNamespace:
        """As the engine takes them, with eight derivatives from number ``first`` on."""
        out = {"neutral": np.ascontiguousarray(self.neutral, dtype=float)}
        for name in ("state", "begin", "offset", "film"):
            one: Varied = getattr(self, name)
            out |= {name: np.ascontiguousarray(one.value, dtype=float), f"{name}_slopes": one.lanes(first)}
        return SimpleNamespace(**out)


class Flow:
    """Steps of free flights of one structure.

    Parameters
    ----------
    flow, inputs
        ``z' = flow @ z + inputs @ (F_drive, F_foot)``: (2n, 2n), (2n, 2).
    row
        Displacement of the foot along its normal from the coordinates (n,).
    step
        Length of a step [s]; below zero flights go back in time.
    """

    def __init__(self, flow: Floats, inputs: Floats, row: Floats, step: float) -> None:
        self.flow, self.inputs, self.row = (np.ascontiguousarray(one) for one in (flow, inputs, row))
        self.step = step
        self.free, self.first, self.last = _maps(self.flow.tobytes(), self.inputs.tobytes(), len(flow), step)

    def fly(
        self,
        launches: Launches,
        drive: Floats,
        counts: NDArray[np.integer],
        output: Floats,
        squares: Floats | None = None,
    ) -> tuple[Floats, Floats]:
        """Samples of flights, one flight after the other, and their derivatives.

        Parameters
        ----------
        launches
            Their beginnings.
        drive
            The drive's force [N] at the ends of the steps (N, steps + 1), from the first sample on.
        counts
            Samples of each flight (N,), `SUBSTEPS` steps apart.
        output
            What is seen of a state (nc, 2n).
        squares
            Squared volts [V^2] at the ends of the steps (N, steps + 1), where the foot is attracted.

        Returns
        -------
        tuple
            (samples, nc) and (samples, nc, q).
        """
        q, channels = launches.unknowns, len(output)
        parts = []
        values = np.zeros((0, channels))
        volts = np.zeros(0) if squares is None else squares
        fixed = [np.ascontiguousarray(one, dtype=float) for one in (launches.near, drive, volts)]
        numbers = np.ascontiguousarray(counts, dtype=np.int64)
        for first in range(0, max(q, 1), LANES):
            values, slopes = _native.fly(
                self,
                self.step,
                np.ascontiguousarray(output),
                launches.part(first),
                fixed[0],
                launches.near_step,
                fixed[1],
                fixed[2],
                numbers,
                SUBSTEPS,
            )
            parts.append(slopes.reshape(len(values), channels, LANES))
        return values, (parts[0] if len(parts) == 1 else np.concatenate(parts, axis=2))[..., :q]


@lru_cache(maxsize=32)
def _maps(flow: bytes, inputs: bytes, size: int, step: float) -> tuple[Floats, Floats, Floats]:
    """Maps of a step: of the state (2n, 2n), of the forces at its beginning and of those at its end (2n, 2)."""
    # exponential of the flow with inputs that run straight: z' = A z + B (w0 + w1 t)
    block = np.zeros((size + 4, size + 4))
    block[:size, :size] = np.frombuffer(flow).reshape(size, size) * step
    block[:size, size : size + 2] = np.frombuffer(inputs).reshape(size, 2) * step
    block[size : size + 2, size + 2 :] = np.eye(2)
    whole = np.asarray(expm(block), dtype=np.float64)
    held, slope = whole[:size, size : size + 2], whole[:size, size + 2 :]
    free = np.ascontiguousarray(whole[:size, :size])
    return free, np.asarray(held - slope, dtype=np.float64), np.ascontiguousarray(slope)
