"""Residues of known poles by linear least squares over a band: what each mode contributes to every response."""

from __future__ import annotations

import numpy as np

from tarsus.base.arrays import Complexes, Floats


def stacked(values: Complexes, axis: int) -> Floats:
    """Real parts, then imaginary parts, along an axis."""
    return np.concatenate([values.real, values.imag], axis=axis)


def pole_curves(frequency: Floats, poles: Complexes, hann: bool = False) -> Complexes:
    """Responses (nf, np) of single poles [rad/s]: ``1 / (s - pole)``; through Hann windows of segments of a stationary
    drive the same smeared.

    The mean cross spectrum of segments of length T is the transform of the correlation times the autocorrelation of
    the window, ``(1 - u) (2 + cos(2 pi u)) / 3 + sin(2 pi u) / (2 pi)`` at the lag ``u T`` (Bendat and Piersol, 11.5),
    and where the drive's power changes little over a few lines, so is the response. T is one over the line spacing.
    """
    apart = 2.0j * np.pi * frequency[:, None] - poles
    if not hann:
        return 1.0 / apart
    length = 1.0 / (frequency[1] - frequency[0])
    way = np.where(apart.real < 0.0, -1.0, 1.0)  # what grows goes on backwards in time, and the window is even
    q = way * apart * length - np.array([0.0, 2.0j * np.pi, -2.0j * np.pi])[:, None, None]
    held = (1.0 - np.exp(-q)) / q
    falling = (1.0 - held) / q
    smeared = (4.0 * falling[0] + falling[1] + falling[2]) / 6.0 + (held[1] - held[2]) / (4.0j * np.pi)
    return way * length * smeared


def modal_columns(frequency: Floats, poles: Complexes, hann: bool = False) -> Complexes:
    """Responses (nf, 2 np) to unit real parts, then unit imaginary parts, of the residues of poles and conjugates."""
    near, far = pole_curves(frequency, poles, hann), pole_curves(frequency, poles.conj(), hann)
    return np.concatenate([near + far, 1.0j * (near - far)], axis=1)


def background_columns(frequency: Floats, degree: int) -> Complexes:
    """Legendre polynomials over the band (nf, 2 (degree + 1)), with real, then imaginary coefficients."""
    powers = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, len(frequency)), degree)
    return np.concatenate([powers, 1.0j * powers], axis=1).astype(np.complex128)


def residues_of(
    frequency: Floats, values: Complexes, poles: Complexes, hann: bool = False
) -> tuple[Complexes, Complexes]:
    """Residues of poles in responses (least-squares frequency domain), and what is left for the modes outside: a
    background of second degree in frequency, free in every response.

    Parameters
    ----------
    frequency
        Lines (nf,) [Hz].
    values
        Responses (nc, nf) in any unit.
    poles
        Poles (np,) [rad/s], above 0 Hz.
    hann
        Whether the responses are seen through Hann windows (`pole_curves`).

    Returns
    -------
    residues : (nc, np)
        In the unit of the response times rad/s; each belongs to ``1 / (j w - pole)``, its conjugate to the conjugate.
    background : (nc, nf)
    """
    own, rest = modal_columns(frequency, poles, hann), background_columns(frequency, 2)
    columns = np.concatenate([own, rest], axis=1)
    scale = np.linalg.norm(columns, axis=0)
    design = stacked(columns, 0) / scale
    target = stacked(values, 1).T
    found = np.linalg.lstsq(design, target, rcond=None)[0] / scale[:, None]
    count = len(poles)
    return (found[:count] + 1.0j * found[count : 2 * count]).T, (rest @ found[2 * count :]).T


def synthesise(frequency: Floats, poles: Complexes, residues: Complexes, hann: bool = False) -> Complexes:
    """Responses (..., nf) of poles (np,) with residues (..., np), conjugates included."""
    columns = modal_columns(frequency, poles, hann)
    return stacked(residues, -1) @ columns.T
