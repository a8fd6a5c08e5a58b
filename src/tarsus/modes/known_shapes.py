"""Modes of a structure whose shapes are known, however wide and close they are.

Poles of strongly damped modes that overlap are not seen in responses one by one. With known shapes the responses of
all points hold three unknowns a mode: ``y_o = sum_k phi_ko g_k s^d / (s^2 + 2 zeta_k w_k s + w_k^2)``. Modes are added
one by one, each where it explains most of what the others leave, and all are fitted together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from tarsus.base.arrays import Complexes, Floats
from tarsus.base.errors import InputError
from tarsus.modes.frf import Frf
from tarsus.modes.intervals import Basis, Scatter, moved_by, scatter_between
from tarsus.modes.lsfd import stacked
from tarsus.modes.modal import ModalFit
from tarsus.modes.mode import IdentifiedMode, ModeVerdict

_RATIOS = (0.003, 0.01, 0.03, 0.1, 0.3, 0.7)
"""Damping ratios that are tried first, at frequencies as close as their bandwidth."""
_LINES = 3000
"""Lines of which the first search takes no more."""
_ROUNDS = 60
"""Evaluations of the fit at most, so that one that runs away ends."""
_BLOCKS = 50
"""Blocks of neighbouring lines between which the scatter is taken without repeats: Student's quantile is then the
normal one to 3 %."""


@dataclass(frozen=True)
class _Responses:
    """Responses (no, nf) over their noise (no,), with the shapes (nm, no) over it, at s (nf,) [rad/s]."""

    s: Complexes
    values: Complexes
    shapes: Floats
    derivatives: int

    def thinned(self, most: int) -> _Responses:
        """No more than so many of the lines, evenly from all."""
        every = slice(None, None, -(-len(self.s) // most))
        return _Responses(self.s[every], self.values[:, every], self.shapes, self.derivatives)

    def curves(self, omega: Floats, zeta: Floats) -> tuple[Complexes, Complexes]:
        """Responses (nm, nf) of single modes of gain 1, and their denominators."""
        below = self.s**2 + 2.0 * (zeta * omega)[:, None] * self.s + omega[:, None] ** 2
        return self.s**self.derivatives / below, below

    def model(self, x: Floats, which: list[int]) -> Complexes:
        """Responses (no, nf) of some modes; x (3 n,): logarithms of frequencies [rad/s] and ratios, gains."""
        omega, zeta, gain = _unpacked(x)
        return np.einsum("ko,kf->of", gain[:, None] * self.shapes[which], self.curves(omega, zeta)[0])

    def slopes(self, x: Floats, which: list[int]) -> Floats:
        """Derivatives (2 no nf, 3 n) of the model, real over imaginary parts."""
        omega, zeta, gain = _unpacked(x)
        curves, below = self.curves(omega, zeta)
        by_ratio = -curves * 2.0 * (zeta * omega)[:, None] * self.s / below
        by_frequency = by_ratio - curves * 2.0 * omega[:, None] ** 2 / below
        parts = np.concatenate([by_frequency * gain[:, None], by_ratio * gain[:, None], curves])
        shapes = np.tile(self.shapes[which], (3, 1))
        full = np.einsum("po,pf->ofp", shapes, parts).reshape(-1, len(parts))
        return stacked(full, 0)

    def fitted(self, x: Floats, which: list[int], tolerance: float) -> Floats:
        """Unknowns of some modes fitted together, from a start, until the sum of squares falls no more."""

        low, high = np.log(0.1 * abs(self.s[0])), np.log(10.0 * abs(self.s[-1]))
        ends = np.array([[low, -12.0, -np.inf], [high, 3.0, np.inf]])
        found = least_squares(
            lambda at: stacked((self.model(at, which) - self.values).ravel(), 0),
            x,
            jac=lambda at: self.slopes(at, which),  # pyright: ignore[reportArgumentType]
            bounds=np.repeat(ends, len(which), axis=1),
            x_scale="jac",
            ftol=tolerance,
            xtol=1e-10,
            max_nfev=_ROUNDS,
        )
        return np.asarray(found.x, dtype=np.float64)

    def next_mode(self, left: Complexes, others: list[int]) -> tuple[int, float, float, float]:
        """The mode that explains most of what is left: its number, frequency [rad/s], ratio and gain."""
        size = np.sum(self.shapes**2, axis=1)
        seen = self.shapes @ left
        low, high = float(abs(self.s[0])), float(abs(self.s[-1]))
        best = (-1.0, -1, low, 0.1, 0.0)
        for ratio in _RATIOS:
            count = int(np.ceil(np.log(high / low) / ratio)) + 1
            for omega in np.array_split(np.geomspace(low, high, count), -(-count // 64)):
                curves, _ = self.curves(omega, np.full(len(omega), ratio))
                along = np.real(seen @ np.conj(curves).T)
                power = np.sum(np.abs(curves) ** 2, axis=1)
                drop = along**2 / (size[:, None] * power)
                drop[others] = -1.0
                k, j = np.unravel_index(int(np.argmax(drop)), drop.shape)
                if drop[k, j] > best[0]:
                    gain = along[k, j] / (size[k] * power[j])
                    best = (float(drop[k, j]), int(k), float(omega[j]), ratio, float(gain))
        return best[1:]


def _unpacked(x: Floats) -> tuple[Floats, Floats, Floats]:
    omega, zeta, gain = x.reshape(3, -1)
    return np.exp(omega), np.exp(zeta), gain


def fit_known_shapes(frf: Frf, shapes: Floats) -> ModalFit:
    """Modes of given real shapes in responses to one drive.

    Parameters
    ----------
    frf
        Responses; repeats of them tell the noise and the intervals.
    shapes
        (nm, no), of any scale: as many modes as are sought.

    Returns
    -------
    ModalFit
        With the modes in the order of the shapes, and a verdict on each.

    Raises
    ------
    InputError
        For several drives.
    """
    if len(frf.inputs) != 1:
        raise InputError(f"modes of known shapes need one drive, got {len(frf.inputs)}")
    noise = _noise(frf)
    whole = _Responses(
        np.asarray(2.0j * np.pi * frf.frequency, dtype=np.complex128),
        frf.values[:, 0] / noise[:, None],
        shapes / noise,
        frf.derivatives,
    )
    x, which = _searched(whole.thinned(_LINES))
    x = whole.fitted(x, which, 1e-10)
    scatter, basis, moved = _scatter(frf, whole, noise, x, which)
    place = np.argsort(which)
    omega, zeta, gain = (part[place] for part in _unpacked(x))
    modes = []
    for k, at in enumerate(place):
        turning = omega[k] * np.sqrt(max(1.0 - zeta[k] ** 2, 1e-12))
        residues = (gain[k] * shapes[k] / (2.0j * turning))[:, None]
        unit = np.eye(len(x))
        frequency = omega[k] / (2.0 * np.pi)
        mode = IdentifiedMode(
            scatter.range_of(float(frequency), unit[at] * frequency, "Hz"),
            scatter.range_of(float(zeta[k]), unit[len(which) + at] * zeta[k], "1"),
            basis,
            residues,
            0.0,
            1.0,
            0,
            ModeVerdict.DETERMINED,
            "",
        )
        shifts = None if moved is None else _shifts(mode, moved[:, at], moved[:, len(which) + at])
        modes.append(replace(mode, shifts=shifts).with_verdict(frf))
    synthesis = (whole.model(x, which) * noise[:, None])[:, None]
    return ModalFit(frf, tuple(modes), {}, synthesis)


def _noise(frf: Frf) -> Floats:
    """Standard deviation (no,) of the real and imaginary parts of each response; without repeats, its size."""
    if frf.repeats is None or len(frf.repeats) < 2:
        return np.sqrt(np.mean(np.abs(frf.values[:, 0]) ** 2, axis=-1))
    off = frf.repeats[:, :, 0] - frf.repeats[:, :, 0].mean(axis=0)
    return np.sqrt(np.sum(np.abs(off) ** 2, axis=(0, 2)) / (2.0 * (len(off) - 1) * len(off) * off.shape[-1]))


def _searched(responses: _Responses) -> tuple[Floats, list[int]]:
    """First unknowns of all modes, and the numbers of the modes in their order."""
    x, which = np.zeros(0), []
    for _ in range(len(responses.shapes)):
        left = responses.values - responses.model(x, which) if which else responses.values
        k, omega, zeta, gain = responses.next_mode(left, which)
        which.append(k)
        x = np.column_stack([x.reshape(3, -1), [np.log(omega), np.log(zeta), gain]]).ravel()
        x = responses.fitted(x, which, 1e-4)
    return x, which


def _scatter(
    frf: Frf, whole: _Responses, noise: Floats, x: Floats, which: list[int]
) -> tuple[Scatter, Basis, Floats | None]:
    """Scatter of the unknowns, between what, and how far single repeats move the unknowns (nr, 3 n)."""
    count, size = len(noise), len(x)
    slopes = np.moveaxis(whole.slopes(x, which).reshape(2, count, -1, size), 0, 1).reshape(count, -1, size)
    left, off, moved = stacked(whole.values - whole.model(x, which), 1), None, None
    if frf.repeats is not None:
        off = stacked((frf.repeats - frf.values)[:, :, 0], 2) / noise[:, None]
        moved = moved_by(slopes, off)
    width = round(left.shape[1] / 2 / _BLOCKS)
    return *scatter_between(slopes, left, off, width, channels=False), moved


def _shifts(mode: IdentifiedMode, by_frequency: Floats, by_ratio: Floats) -> Complexes:
    """Shifts (nr,) of a pole [rad/s] for those of the logarithms of its frequency and ratio."""
    pole, ratio = mode.pole, mode.damping.value
    turned = -ratio * abs(pole) * (1.0 + 1.0j * ratio / np.sqrt(max(1.0 - ratio**2, 1e-12)))
    return pole * by_frequency + turned * by_ratio
