"""How late, and behind which low-pass, the responses of sweeps are: ``H = G(s) sum_k a_k / (s^2 + 2 zeta_k w_k s +
w_k^2)`` with real a_k.

Modes of a structure are real: what turns all residues along the frequency is the instruments'. A drive with memory
turns them as well, by one angle at all frequencies; it is fitted along.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.optimize import least_squares
from scipy.signal import bessel, butter

from tarsus.base.arrays import Complexes, Floats
from tarsus.identify.draws import student
from tarsus.identify.with_error import WithError
from tarsus.modes.lsfd import stacked
from tarsus.modes.modal import ModalFit

SAMPLES = 0.004
"""Samples of a delay that is looked for at least: behind 0.2 us at 20 kHz a film is found wrong by 0.7 %, a twentieth
of its usual standard error."""
_LINES = 4000
"""Lines that are fitted at most, evenly from all: a delay is known to a hundredth of the above from these."""
_BETTER = 0.1
"""Part of the squares that a low-pass must take away from those behind a pure delay, to be taken instead."""
_TURNS = (-2.0, 6.0, 0.1)
"""Turns of the highest line that delays are searched over: from, to, step."""
_SCALE = 1e-3
"""Size of a change of an unknown."""
_ROUGH = 1.3
"""Squares over those of a free fit from which on a pure delay does not explain the responses."""
_BLEND = 256
"""Samples over which the end of a record is led back to its beginning for a transform."""
_ORDERS = ((butter, (1, 2, 3, 4, 6, 8)), (bessel, (2, 4, 8)))
"""Low-passes that instruments have."""


@dataclass(frozen=True)
class LowPass:
    """A low-pass of a corner [Hz]; poles (n,) [1] for a corner at 1 rad/s; name."""

    name: str
    poles: Complexes
    corner: float

    @property
    def delay(self) -> float:
        """Delay [s] of what is slow."""
        return float(-np.sum(1.0 / self.poles).real / (2.0 * np.pi * self.corner))

    def response(self, s: NDArray[np.complexfloating[Any, Any]]) -> Complexes:
        """At s (nf,) [rad/s]."""
        scaled = s / (2.0 * np.pi * self.corner)
        return np.prod(1.0 / (1.0 - scaled[:, None] / self.poles), axis=1)


def passed(values: Floats, step: float, factor: Callable[[Complexes], Complexes]) -> Floats:
    """Values (ns,) with their transform multiplied by a factor of s [rad/s]; the end is led back to the beginning."""
    count = len(values)
    whole = int(next_fast_len(count + _BLEND, real=True) or count + _BLEND)
    ends = np.linspace(0.0, np.pi, whole - count + 2)[1:-1]
    led = values[0] + (values[-1] - values[0]) * 0.5 * (1.0 + np.cos(ends))
    s = np.asarray(2.0j * np.pi * np.fft.rfftfreq(whole, step), dtype=np.complex128)
    return np.fft.irfft(np.fft.rfft(np.concatenate([values, led])) * factor(s), whole)[:count]


@dataclass(frozen=True)
class Delay:
    """Of responses behind the drive: time [s] by which what is slow comes later, all together; low: the low-pass in it,
    None for a pure delay."""

    time: WithError
    low: LowPass | None

    def off(self, step: float) -> bool:
        """Whether it is more than what does no harm to records of a sampling step [s]."""
        return self.low is not None or self.time.off(0.0, SAMPLES * step)


def delay_of(fit: ModalFit) -> Delay | None:
    """Delay of the responses of modes; None where the lines are too few to tell."""
    lines = _Lines(fit)
    if len(lines.s) < 4 * (len(fit.modes) + 2):
        return None
    best = lines.fitted(None, lines.start)
    if best.cost > _ROUGH * lines.noise:
        best = min(best, lines.fitted(None, lines.searched(None)), key=lambda one: one.cost)
    if best.cost > _ROUGH * lines.noise:
        for low in _low_passes(lines.highest):
            tried = lines.fitted(low, lines.searched(low))
            if tried.cost < (1.0 - _BETTER) * best.cost:
                best = tried
    return lines.judged(best)


def _low_passes(corner: float) -> Iterator[LowPass]:
    for family, orders in _ORDERS:
        for order in orders:
            poles = np.asarray(family(order, 1.0, analog=True, output="zpk")[1])  # pyright: ignore[reportOptionalSubscript]
            yield LowPass(f"{family.__name__} low-pass of order {order}", poles, corner)


@dataclass(frozen=True)
class _Explained:
    """Unknowns x (p,) of a fit, the low-pass at them, what is left (n,) and its derivatives (n, p) by them."""

    x: Floats
    low: LowPass | None
    left: Floats
    slopes: Floats

    @property
    def cost(self) -> float:
        """Squares that are left."""
        return float(self.left @ self.left)


class _Lines:
    """Lines of the mean responses, each response over its size.

    Unknowns: logarithms of frequencies [rad/s] and of damping ratios, delay and angle, the latter over turns of the
    highest line, and the logarithm of a low-pass's corner. Amplitudes, and those of stiffness and mass for modes
    beyond the band, are real and linear: they are eliminated at every step, which no fit of `tarsus.fit` does.
    """

    def __init__(self, fit: ModalFit) -> None:
        frf = fit.frf
        stride = -(-len(frf.frequency) // _LINES)
        self.s = 2.0j * np.pi * frf.frequency[::stride]
        self.highest = float(frf.frequency[-1])
        values = frf.values[:, 0, ::stride]
        self.size = np.sqrt(np.sum(np.abs(values) ** 2, axis=1))[:, None]
        self.target = stacked(values / self.size, -1)
        self.repeats = None if frf.repeats is None else frf.repeats[:, :, 0, ::stride] / self.size
        left = (frf.values - fit.synthesis)[:, 0, ::stride] / self.size
        self.noise = float(np.sum(np.abs(left) ** 2))
        self.derivatives = frf.derivatives
        self.modes = len(fit.modes)
        omega = np.array([abs(mode.pole) for mode in fit.modes])
        ratio = np.array([mode.damping.value for mode in fit.modes])
        tilts = np.array([mode.tilt for mode in fit.modes])
        late = float(-np.sum(tilts * omega) / np.sum(omega**2))
        self.start = np.concatenate([np.log(omega), np.log(ratio), [late * 2.0 * np.pi * self.highest, 0.0]])

    def columns(self, x: Floats, low: LowPass | None) -> Complexes:
        """What each amplitude gives (nf, nm + 2)."""
        m, s = self.modes, self.s
        omega, zeta = np.exp(x[:m]), np.exp(x[m : 2 * m])
        late, turned = x[2 * m] / (2.0 * np.pi * self.highest), x[2 * m + 1]
        modes = 1.0 / (s[:, None] ** 2 + 2.0 * zeta * omega * s[:, None] + omega**2)
        beyond = np.column_stack([np.ones_like(s), s**2])
        through: Complexes = s**self.derivatives * np.exp(-1.0j * turned)
        if low is not None:
            low = replace(low, corner=float(np.exp(x[-1])))
            late -= low.delay
            through = through * low.response(s)
        return (through * np.exp(-s * late))[:, None] * np.concatenate([modes, beyond], axis=1)

    def left(self, x: Floats, low: LowPass | None) -> Floats:
        """What the best amplitudes leave (no 2 nf,)."""
        columns = self.columns(x, low)
        basis = np.linalg.qr(stacked(columns / np.linalg.norm(columns, axis=0), 0)).Q
        return (self.target - (self.target @ basis) @ basis.T).ravel()

    def searched(self, low: LowPass | None) -> Floats:
        """The best of many starts, by delay."""
        tried = []
        for late in np.arange(*_TURNS):
            x = np.concatenate([self.start[:-2], [2.0 * np.pi * late, 0.0]])
            x = x if low is None else np.append(x, np.log(low.corner))
            tried.append((float(np.sum(self.left(x, low) ** 2)), x))
        return min(tried, key=lambda one: one[0])[1]

    def fitted(self, low: LowPass | None, start: Floats) -> _Explained:
        """The best fit behind a low-pass, or a pure delay, from a start."""
        found = least_squares(lambda x: self.left(x, low), start, method="lm", x_scale=_SCALE)
        if low is not None:
            low = replace(low, corner=float(np.exp(found.x[-1])))
        return _Explained(found.x, low, found.fun, found.jac)

    def judged(self, found: _Explained) -> Delay:
        """Delay and angle with their errors: what single repeats differ by, or else what the fit leaves."""
        inverse = np.linalg.pinv(found.slopes.T @ found.slopes)
        if self.repeats is None or len(self.repeats) < 2:
            error = np.sqrt(np.diag(inverse) * np.mean(found.left**2))
        else:
            off = stacked(self.repeats - self.repeats.mean(axis=0), -1).reshape(len(self.repeats), -1)
            count = len(off)
            error = np.sqrt(np.mean((off @ found.slopes @ inverse) ** 2, axis=0) / count) * student(float(count))
        m, turn = 2 * self.modes, 2.0 * np.pi * self.highest
        return Delay(WithError(float(found.x[m]) / turn, float(error[m]) / turn), found.low)
