"""Residues of known poles by linear least squares over a band: what each mode contributes to every response."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def modal_columns(frequency: Floats, poles: Complexes) -> Complexes:
    """Responses (nf, 2 np) to unit real parts, then unit imaginary parts, of the residues of poles and conjugates."""
    s = 2.0j * np.pi * frequency[:, None]
    near, far = 1.0 / (s - poles), 1.0 / (s - poles.conj())
    return np.concatenate([near + far, 1.0j * (near - far)], axis=1)


def background_columns(frequency: Floats, degree: int) -> Complexes:
    """Legendre polynomials over the band (nf, 2 (degree + 1)), with real, then imaginary coefficients."""
    powers = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, len(frequency)), degree)
    return np.concatenate([powers, 1.0j * powers], axis=1).astype(np.complex128)


def residues_of(
    frequency: Floats, values: Complexes, poles: Complexes, degree: int = 2
) -> tuple[Complexes, Complexes]:
    """Residues of poles in responses (least-squares frequency domain), and what is left for the modes outside.

    Parameters
    ----------
    frequency
        Lines (nf,) [Hz].
    values
        Responses (nc, nf) in any unit.
    poles
        Poles (np,) [rad/s], above 0 Hz.
    degree
        Of the polynomial background in frequency, free in every response.

    Returns
    -------
    residues : (nc, np)
        In the unit of the response times rad/s; each belongs to ``1 / (j w - pole)``, its conjugate to the conjugate.
    background : (nc, nf)
    """
    own, rest = modal_columns(frequency, poles), background_columns(frequency, degree)
    columns = np.concatenate([own, rest], axis=1)
    scale = np.linalg.norm(columns, axis=0)
    design = np.concatenate([columns.real, columns.imag]) / scale
    target = np.concatenate([values.real, values.imag], axis=1).T
    found = np.linalg.lstsq(design, target, rcond=None)[0] / scale[:, None]
    count = len(poles)
    return (found[:count] + 1.0j * found[count : 2 * count]).T, (rest @ found[2 * count :]).T


def synthesise(frequency: Floats, poles: Complexes, residues: Complexes) -> Complexes:
    """Responses (..., nf) of poles (np,) with residues (..., np), conjugates included."""
    columns = modal_columns(frequency, poles)
    return np.concatenate([residues.real, residues.imag], axis=-1) @ columns.T
