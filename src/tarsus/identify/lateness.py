"""How late the responses of sweeps are: ``H = exp(-s late) sum_k a_k / (s^2 + 2 zeta_k w_k s + w_k^2)`` with real a_k.

Modes of a structure are real: what turns all residues along the frequency is the instruments'. A drive with memory
turns them as well, by one angle at all frequencies; it is fitted along.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from tarsus.base.arrays import Complexes, Floats
from tarsus.identify.draws import student
from tarsus.identify.with_error import WithError
from tarsus.modes.lsfd import stacked
from tarsus.modes.modal import ModalFit

SAMPLES = 0.004
"""Samples of a delay that is looked for at least: a film is found 0.7 % off behind 0.2 us at 20 kHz, a twentieth of
its usual standard error."""
_LINES = 4000
"""Lines that are fitted at most, evenly from all: a delay is known to a hundredth of the above from these."""
_TURNS = (-2.0, 6.0, 0.1)
"""Turns of the highest line that delays are searched over: from, to, step."""
_SCALE = 1e-3
"""Size of a change of an unknown."""
_STEP = 1e-6
"""Change of an unknown by which slopes are taken."""
_ROUGH = 1.3
"""Squares over those of a free fit from which on a delay near the first guess does not explain the responses."""


def lateness_of(fit: ModalFit) -> WithError | None:
    """By how much [s] the responses of modes come behind the drive; None where the lines are too few to tell."""
    lines = _Lines(fit)
    if len(lines.s) < 4 * (len(fit.modes) + 2):
        return None
    best = lines.fitted(lines.start)
    if best[1] > _ROUGH * lines.noise:
        best = min(best, lines.fitted(lines.searched()), key=lambda one: one[1])
    return lines.judged(best[0])


class _Lines:
    """Lines of the mean responses, each response over its size.

    Unknowns: logarithms of frequencies [rad/s] and of damping ratios, delay and angle, the latter over turns of the
    highest line. Amplitudes, and those of stiffness and mass for modes beyond the band, are real and linear: they are
    eliminated at every step, which no fit of `tarsus.fit` does.
    """

    def __init__(self, fit: ModalFit) -> None:
        frf = fit.frf
        stride = -(-len(frf.frequency) // _LINES)
        self.s = 2.0j * np.pi * frf.frequency[::stride]
        self.highest = float(frf.frequency[-1])
        values = frf.values[:, 0, ::stride]
        self.size = np.sqrt(np.sum(np.abs(values) ** 2, axis=1))[:, None]
        self.values = values / self.size
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

    def columns(self, x: Floats) -> Complexes:
        """What each amplitude gives (nf, nm + 2)."""
        m, s = self.modes, self.s
        omega, zeta = np.exp(x[:m]), np.exp(x[m : 2 * m])
        late, turned = x[2 * m] / (2.0 * np.pi * self.highest), x[2 * m + 1]
        modes = 1.0 / (s[:, None] ** 2 + 2.0 * zeta * omega * s[:, None] + omega**2)
        beyond = np.column_stack([np.ones_like(s), s**2])
        through = s**self.derivatives * np.exp(-1.0j * turned - s * late)
        return through[:, None] * np.concatenate([modes, beyond], axis=1)

    def left(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """What the best amplitudes leave (no, 2 nf), these amplitudes (nm + 2, no) and their columns (2 nf, nm + 2)."""
        columns = self.columns(x)
        scale = np.linalg.norm(columns, axis=0)
        design = stacked(columns.T / scale[:, None], -1).T
        target = stacked(self.values, -1)
        amplitudes = np.linalg.lstsq(design, target.T, rcond=None)[0]
        return target - (design @ amplitudes).T, amplitudes / scale[:, None], design

    def searched(self) -> Floats:
        """The best of many starts, by delay."""
        starts = [
            np.concatenate([self.start[:-2], [2.0 * np.pi * late, 0.0]]) for late in np.arange(*_TURNS)
        ]
        return min(starts, key=lambda x: float(np.sum(self.left(x)[0] ** 2)))

    def fitted(self, start: Floats) -> tuple[Floats, float]:
        """The best fit from a start, and the squares that it leaves."""
        found = least_squares(lambda x: self.left(x)[0].ravel(), start, method="lm", x_scale=_SCALE)
        return found.x, 2.0 * float(found.cost)

    def judged(self, x: Floats) -> WithError:
        """The delay with its error: what single repeats differ by, or else what the fit leaves."""
        left, amplitudes, design = self.left(x)
        slopes = []
        for k in range(len(x)):
            moved = x.copy()
            moved[k] += _STEP
            change = stacked((self.columns(moved) - self.columns(x)).T, -1) / _STEP
            change = amplitudes.T @ change
            change -= (design @ np.linalg.lstsq(design, change.T, rcond=None)[0]).T
            slopes.append(change.ravel())
        inverse = np.linalg.pinv(np.array(slopes) @ np.array(slopes).T)
        if self.repeats is None or len(self.repeats) < 2:
            error = np.sqrt(np.diag(inverse) * np.mean(left**2))
        else:
            off = stacked(self.repeats - self.repeats.mean(axis=0), -1).reshape(len(self.repeats), -1)
            moves = off @ np.array(slopes).T @ inverse
            count = len(moves)
            error = np.sqrt(np.mean(moves**2, axis=0) / count) * student(float(count))
        m, turn = 2 * self.modes, 2.0 * np.pi * self.highest
        return WithError(float(x[m]) / turn, float(error[m]) / turn)
