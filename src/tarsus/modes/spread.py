"""How far a mode's numbers depend on the choices of a fit: order of the models, band and background, method.

A measured structure is not quite the sum of modes that is fitted to it, so that another order, band or method gives
other numbers. What noise alone does to each of these is known, and subtracted: responses that are a sum of modes with
noise have no spread.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from tarsus.base.arrays import Complexes, Floats
from tarsus.modes.frf import Frf
from tarsus.modes.intervals import numbers_of, variances_of
from tarsus.modes.lscf import fit_poles
from tarsus.modes.refine import LocalFit, Surroundings, refine_pole

_WINDOWS = (Surroundings(1.5, 1), Surroundings(6.0, 3))
"""Half of the usual window with a simpler background, and twice the usual one with a richer one."""
_ORDERS = 8
"""Orders of the upper half, in which weak modes have appeared, that are compared: neighbours are nearly alike."""
_DRAWS = 4
"""Draws of noise that the models are fitted to as well: their mean square is good to a factor of two."""
_SEED = 20130
"""Of the draws: the same responses always have the same intervals."""
_SMOOTHED = 41
"""Lines over which noise is averaged: forty differences know it to a sixth."""


def spreads(frf: Frf, poles: Mapping[int, Complexes], synthesis: Complexes, fits: Sequence[LocalFit]) -> Floats:
    """Standard deviations (nm, 2) of natural frequency [Hz] and damping ratio [1] of modes between ways to fit them.

    Three spreads add up in their squares: that of the models of high order of the whole band about the local fit, that
    of local fits in half and twice the band with other backgrounds, and that of the files, between which a structure
    changes with its instruments and its temperature.

    Parameters
    ----------
    frf
        Responses of the band.
    poles
        Of the models by order [rad/s].
    synthesis
        Responses of all modes and background (no, ni, nf).
    fits
        Of the modes.
    """
    square = _between_orders(frf, poles, synthesis, fits) + _between_windows(frf, fits)
    return np.sqrt(square + _between_files(frf, fits))


def _between_orders(frf: Frf, poles: Mapping[int, Complexes], synthesis: Complexes, fits: Sequence[LocalFit]) -> Floats:
    """Variance (nm, 2) between poles of models and local fits, less that of noisy responses of exactly these modes."""
    top = max(poles)
    orders = np.unique(np.linspace(top // 2, top, _ORDERS).astype(int)).tolist()
    orders = [order for order in orders if order in poles]
    noise = noise_of(frf, frf.values - synthesis)
    random = np.random.default_rng(_SEED)
    seen = _squares(poles, orders, fits)
    by_noise = np.zeros_like(seen)
    for _ in range(_DRAWS):
        drawn = random.standard_normal((2, *noise.shape)) * noise
        simulated = fit_poles(frf.frequency, synthesis + drawn[0] + 1.0j * drawn[1], orders)
        by_noise += _squares(simulated, orders, fits) / _DRAWS
    return np.maximum(seen - by_noise, 0.0)


def _squares(poles: Mapping[int, Complexes], orders: Sequence[int], fits: Sequence[LocalFit]) -> Floats:
    """Median squares (nm, 2) over orders of what the nearest pole within a half-power band is off; 0 without one."""
    out = np.zeros((len(fits), 2))
    for k, fit in enumerate(fits):
        nearest = [poles[order][np.argmin(np.abs(poles[order] - fit.pole))] for order in orders]
        near = [pole for pole in nearest if abs(pole - fit.pole) < 2.0 * abs(fit.pole.real)]
        if near:
            off = np.array([numbers_of(pole) for pole in near]) - numbers_of(fit.pole)
            out[k] = np.median(off**2, axis=0)
    return out


def _between_windows(frf: Frf, fits: Sequence[LocalFit]) -> Floats:
    """Variance (nm, 2) between local fits in other windows and the usual ones, less that by noise.

    Of two fits, one of which is efficient, the variance of the difference is the difference of the variances
    (Hausman 1978).
    """
    channels = frf.values.reshape(-1, len(frf.frequency))
    ends = np.array([fit.pole for fit in fits])
    out = np.zeros((len(fits), 2))
    for k, fit in enumerate(fits):
        own, squares = variances_of(fit), []
        for window in _WINDOWS:
            window = replace(window, hann=frf.hann)
            other = refine_pole(frf.frequency, channels, fit.pole, np.delete(ends, k), window=window)
            if other is not None:
                off = np.array(numbers_of(other.pole)) - numbers_of(fit.pole)
                squares.append(np.maximum(off**2 - np.abs(variances_of(other) - own), 0.0))
        if squares:
            out[k] = np.mean(squares, axis=0)
    return out


def _between_files(frf: Frf, fits: Sequence[LocalFit]) -> Floats:
    """Variance (nm, 2) of the files' mean, weighted as the fit does, from the steps to the poles of single files less
    what noise makes of these."""
    out = np.zeros((len(fits), 2))
    names = sorted(set(frf.files))
    for k, fit in enumerate(fits if len(names) > 1 else ()):
        own, weights, squares = numbers_of(fit.pole), [], []
        for name in names:
            rows = np.repeat([one == name for one in frf.files], len(frf.inputs))
            slopes = fit.slopes[rows].reshape(-1, 2)
            information = slopes.T @ slopes
            step = np.linalg.pinv(information) @ slopes.T @ fit.misfit[rows].ravel()
            off = np.array(numbers_of(fit.pole + complex(*step))) - own
            squares.append(off**2 - variances_of(fit, rows))
            weights.append(np.trace(information))
        share = np.array(weights) / np.sum(weights)
        out[k] = np.maximum(share @ np.array(squares), 0.0) * np.sum(share**2)
    return out


def noise_of(frf: Frf, misfit: Complexes) -> Floats:
    """Standard deviation (no, ni, nf) of real and imaginary part of the noise: from repeats, else from second
    differences of the misfit over the lines, in which what a model lacks, being smooth, is not."""
    if frf.repeats is not None and len(frf.repeats) > 1:
        count = len(frf.repeats)
        power = np.sum(np.abs(frf.repeats - frf.values) ** 2, axis=0) / (2.0 * count * (count - 1))
    else:
        bent = misfit[..., 2:] - 2.0 * misfit[..., 1:-1] + misfit[..., :-2]
        power = np.pad(np.abs(bent) ** 2 / 12.0, ((0, 0), (0, 0), (1, 1)), "edge")
    return np.sqrt(uniform_filter1d(power, min(_SMOOTHED, power.shape[-1]), axis=-1))
