"""Local maximum-likelihood finish: poles of one mode and its near neighbours from the lines around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from tarsus.base.arrays import Complexes, Floats
from tarsus.modes.lsfd import background_columns, modal_columns, pole_curves, stacked, synthesise

_LINES = 10
"""And lines at least, twice its unknowns."""
_ROUNDS = 3
"""Rounds of weights by the misfit."""
_STEPS = 25
"""Evaluations in each at most."""
_STEP = 1e-5
"""Part of a pole's damping by which its derivatives are taken."""
_NEIGHBOURS = 3
"""Neighbours that are fitted along; farther ones are held."""
_MARGIN = 0.25
"""Margin of the window on either side, as a part of it: residues of poles there are free."""
_ALIKE = 0.25
"""Part of a pole's damping that one in the margin must have: a sharper one is a line of noise."""


@dataclass(frozen=True)
class Surroundings:
    """Lines that a local fit uses, and what of the far modes it takes up.

    bandwidths: half-power bands to either side; degree: of the background in frequency; hann: whether the responses are
    seen through Hann windows.
    """

    bandwidths: float = 3.0
    degree: int = 2
    hann: bool = False

    def lines(self, frequency: Floats, pole: complex) -> slice:
        """Those around a pole [rad/s], ten to either side at least."""
        half = max(self.bandwidths * abs(pole.real) / np.pi, _LINES * (frequency[1] - frequency[0]))
        centre = pole.imag / (2.0 * np.pi)
        first = int(np.searchsorted(frequency, centre - half))
        return slice(first, max(int(np.searchsorted(frequency, centre + half, side="right")), first + 1))


USUAL = Surroundings()
"""Three half-power bands, where the response has fallen to a sixth, and a parabola for the far modes."""


@dataclass(frozen=True)
class LocalFit:
    """One mode fitted to the lines around it.

    pole [rad/s]; lines: those of the band that were used; noise (nc,): standard deviation of real and imaginary part of
    every channel's misfit; misfit (nc, 2 nl) and slopes (nc, 2 nl, 2): real over
    imaginary parts of what is left, and of the derivatives by real and imaginary part of the pole with all other
    unknowns adapted, over that deviation; residues (nc,): in the unit of the response times rad/s; deviation (nc,): of
    their real and imaginary parts, at the fitted pole.
    """

    pole: complex
    lines: slice
    noise: Floats
    misfit: Floats
    slopes: Floats
    residues: Complexes
    deviation: Floats

    @property
    def significance(self) -> float:
        """Root mean square over channels of residue over its deviation."""
        return float(np.sqrt(np.mean(np.abs(self.residues / self.deviation) ** 2 / 2.0)))


class _Problem:
    """Separable least squares: poles nonlinear; residues and background, of each channel, linear."""

    def __init__(
        self,
        frequency: Floats,
        values: Complexes,
        weights: Floats,
        start: Complexes,
        fixed: Complexes,
        window: Surroundings,
    ) -> None:
        self.frequency, self.hann = frequency, window.hann
        background = [background_columns(frequency, window.degree), modal_columns(frequency, fixed, self.hann)]
        self.background = np.linalg.qr(stacked(np.concatenate(background, axis=1), 0)).Q
        self.start = start
        line = 2.0 * np.pi * (frequency[1] - frequency[0])
        self.unit = np.maximum(np.abs(start.real), 0.1 * line)
        self.values = self.beyond(stacked(values, 1).T)
        self.weights = weights
        self._kept: tuple[bytes, Floats, Floats] = b"", np.zeros((0, 0)), np.zeros((0, 0))

    def poles(self, theta: Floats) -> Complexes:
        half = len(self.start)
        return self.start + self.unit * (theta[:half] + 1.0j * theta[half:])

    def beyond(self, columns: Floats) -> Floats:
        """Columns (2 nf, n) without what the background gives."""
        return columns - self.background @ (self.background.T @ columns)

    def columns(self, theta: Floats) -> tuple[Floats, Floats]:
        """Orthonormal basis (2 nf, k) of what poles give beyond the background, and its triangle (k, k); kept for the
        last place, where residuals and derivatives are asked for, and residuals again under other weights."""
        if self._kept[0] != theta.tobytes():
            own = modal_columns(self.frequency, self.poles(theta), self.hann)
            found = np.linalg.qr(self.beyond(stacked(own, 0)))
            self._kept = theta.tobytes(), found.Q, found.R
        return self._kept[1:]

    def solve(self, theta: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Weighted residuals (2 nf, nc), weighted linear parameters (k, nc), orthonormal basis (2 nf, k), triangle."""
        basis, triangle = self.columns(theta)
        target = self.values * self.weights
        inner = basis.T @ target
        linear = np.asarray(np.linalg.solve(triangle, inner), dtype=float)
        return target - basis @ inner, linear, basis, triangle

    def slope(self, poles: Complexes) -> Complexes:
        """Derivatives (nf, np) of the poles' curves by the poles; those of smeared ones, which are analytic, by central
        differences, right to the square of the step."""
        if not self.hann:
            return pole_curves(self.frequency, poles) ** 2
        step = _STEP * self.unit
        above, below = (pole_curves(self.frequency, poles + way * step, True) for way in (1.0, -1.0))
        return (above - below) / (2.0 * step)

    def residual(self, theta: Floats) -> Floats:
        return self.solve(theta)[0].ravel()

    def sensitivity(self, theta: Floats) -> Floats:
        """Derivatives of the weighted model (2 nf, nc, 2 np), the linear parameters' part taken out (Kaufman 1975)."""
        _, linear, basis, _ = self.solve(theta)
        poles, count = self.poles(theta), len(self.start)
        near, far = (self.slope(one)[:, None] for one in (poles, poles.conj()))
        both, apart = near + far, 1.0j * (near - far)
        real, imag = linear[:count].T, linear[count : 2 * count].T
        by_parts = [both * real + apart * imag, apart * real - both * imag]
        out = stacked(np.concatenate(by_parts, axis=2) * np.tile(self.unit, 2), 0)
        flat = self.beyond(out.reshape(len(out), -1))
        return (flat - basis @ (basis.T @ flat)).reshape(out.shape)

    def jacobian(self, theta: Floats) -> Floats:
        return -self.sensitivity(theta).reshape(-1, 2 * len(self.start))


def refine_pole(
    frequency: Floats,
    values: Complexes,
    start: complex,
    others: Complexes,
    residues: Complexes | None = None,
    window: Surroundings = USUAL,
    most: float = np.inf,
) -> LocalFit | None:
    """Maximum-likelihood fit of one pole in its own window.

    The model is the pole and the three nearest others in the window, with their conjugates and free complex residues;
    those in the window's margin that are not much sharper, with free residues, which stay where they are; and a
    background in frequency, of the window's degree, in every channel for all that lies elsewhere. Noise is normal,
    independent between channels and lines; its level in each channel is estimated with the poles.

    Parameters
    ----------
    frequency
        Lines of the band (nf,) [Hz].
    values
        Responses (nc, nf) of all pairs of output and input.
    start
        The pole, nearly [rad/s].
    others
        Other poles (np,) [rad/s].
    residues
        Of these (nc, np), as far as known: what those that are not fitted give is subtracted first.
    window
        Lines to use, the degree of the background, and whether a window smears both.
    most
        Level of noise, the geometric mean over channels, above which a round is the last: weights do not mend that.

    Returns
    -------
    LocalFit or None
        None where the lines do not determine it: too few, a start that leads out of the window, or too much is left.
    """
    lines = window.lines(frequency, start)
    f, h = frequency[lines], values[:, lines]
    centre = others.imag / (2.0 * np.pi)
    inside = np.flatnonzero((centre > f[0]) & (centre < f[-1]))
    away = np.maximum(f[0] - centre, centre - f[-1])
    alike = np.abs(others.real) > _ALIKE * abs(start.real)
    margin = others[(away >= 0.0) & (away < _MARGIN * (f[-1] - f[0])) & alike]
    fitted = inside[np.argsort(np.abs(others[inside] - start))][:_NEIGHBOURS]
    if residues is not None:
        free = np.concatenate([fitted, np.flatnonzero(np.isin(others, margin))])
        rest = np.setdiff1d(np.arange(len(others)), free)
        h = h - synthesise(f, others[rest], residues[:, rest], window.hann)
    near = np.append(start, others[fitted])
    columns = 2 * len(near) + 2 * (window.degree + 1) + 2 * len(margin)
    freedom = 2 * len(f) - columns - 2.0 * len(near) / len(values)
    if freedom < 1.0:
        return None
    power = np.sqrt(np.mean(np.abs(h) ** 2, axis=1))
    level = power = np.where(power > 0.0, power, 1.0)
    theta = np.zeros(2 * len(near))
    problem = _Problem(f, h, 1.0 / level, near, margin, window)
    for _ in range(_ROUNDS):
        found = least_squares(problem.residual, theta, problem.jacobian, max_nfev=_STEPS)  # pyright: ignore[reportArgumentType]
        theta = found.x
        misfit = found.fun.reshape(-1, len(level))
        level = np.maximum(level * np.sqrt(np.sum(misfit**2, axis=0) / freedom), 1e-9 * power)
        if np.exp(np.mean(np.log(level))) > most:
            return None
        problem.weights = 1.0 / level
    pole = complex(problem.poles(theta)[0])
    if not f[0] <= pole.imag / (2.0 * np.pi) <= f[-1]:
        return None
    return _local_fit(problem, theta, pole, lines)


def _local_fit(problem: _Problem, theta: Floats, pole: complex, lines: slice) -> LocalFit:
    residual, linear, _, triangle = problem.solve(theta)
    slopes, count = problem.sensitivity(theta), len(problem.start)
    flat = slopes.reshape(-1, 2 * count)
    full = flat.T @ flat
    own = np.array([0, count])
    others = np.delete(np.arange(2 * count), own)
    mixed = np.linalg.pinv(full[np.ix_(others, others)]) @ full[np.ix_(others, own)]
    slopes = slopes[..., own] - slopes[..., others] @ mixed
    noise, rows = 1.0 / problem.weights, np.linalg.inv(triangle)[[0, count]]
    return LocalFit(
        pole,
        lines,
        noise,
        residual.T,
        slopes.transpose(1, 0, 2) / problem.unit[0],
        noise * (linear[0] + 1.0j * linear[count]),
        noise * np.sqrt(np.sum(rows**2) / 2.0),
    )
