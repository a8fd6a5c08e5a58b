"""How well frequencies and damping ratios are recovered from noisy frequency responses, and whether intervals hold.

Run ``python benchmarks/modal_recovery.py [trials] [decibels]``. Every trial draws four modes of a structure
(frequencies 200 Hz to 6 kHz, damping ratios 0.5 % to 4 %, shapes at eight points), writes down the displacements of
these points per force at the first, adds noise to every line, 40 dB below the root mean square of its response, and
identifies the modes: once from one measurement, with intervals from the scatter between channels, once from six repeats
of it with that noise each, with intervals from the scatter between repeats. Printed are the errors and how often the
95 % intervals cover the truth.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass

import numpy as np

from tarsus.base.errors import InputError
from tarsus.modes import Frf, ModalFit, identify_modes
from tarsus.records.measurement import Quantity

POINTS = 8
BAND = (100.0, 6800.0)
LINE = 1.0


@dataclass(frozen=True)
class Truth:
    """Frequencies (nm,) [Hz], damping ratios (nm,), shapes (nm, points) for modal masses of 1 kg."""

    frequencies: np.ndarray
    damping: np.ndarray
    shapes: np.ndarray

    @staticmethod
    def draw(random: np.random.Generator) -> Truth:
        """Four modes, each at least a third above the one before."""
        frequencies = 200.0 * np.cumprod(
            np.append(random.uniform(1.0, 1.8), random.uniform(1.35, 2.3, size=3))
        )
        shapes = random.uniform(0.3, 1.0, size=(4, POINTS)) * random.choice([-1.0, 1.0], size=(4, POINTS))
        return Truth(frequencies, random.uniform(0.005, 0.04, size=4), shapes * frequencies[:, None])

    def responses(self, frequency: np.ndarray) -> np.ndarray:
        """Displacement per force at the first point (points, 1, nf) [m/N]."""
        w, own = 2.0 * np.pi * frequency, 2.0 * np.pi * self.frequencies[:, None]
        modes = 1.0 / (own**2 - w**2 + 2.0j * self.damping[:, None] * own * w)
        return np.einsum("mp,m,mf->pf", self.shapes, self.shapes[:, 0], modes)[:, None, :]


def measured(truth: Truth, random: np.random.Generator, repeats: int, decibels: float = 40.0) -> Frf:
    """Responses with noise of equal variance on all lines of a channel; several repeats are averaged."""
    frequency = np.arange(BAND[0], BAND[1], LINE)
    exact = truth.responses(frequency)
    level = 10.0 ** (-decibels / 20.0) * np.sqrt(np.mean(np.abs(exact) ** 2, axis=-1, keepdims=True) / 2.0)
    shape = (repeats, *exact.shape)
    noisy = exact + level * (random.standard_normal(shape) + 1.0j * random.standard_normal(shape))
    names = tuple(f"p{k}" for k in range(1, POINTS + 1))
    single = noisy if repeats > 1 else None
    return Frf(frequency, noisy.mean(axis=0), names, ("p1",), Quantity.DISPLACEMENT, single)


@dataclass(frozen=True)
class Recovery:
    """Over all modes of all trials, nan where a mode was not found: relative errors of frequency and damping ratio, and
    whether their intervals cover the truth; extra: modes found that are none."""

    frequency: np.ndarray
    damping: np.ndarray
    frequency_covered: np.ndarray
    damping_covered: np.ndarray
    extra: int


def score(truths: list[Truth], fits: list[ModalFit | None]) -> Recovery:
    """Every true mode against the identified one within half its bandwidth."""
    rows, found = [], 0
    for truth, fit in zip(truths, fits, strict=True):
        modes = fit.modes if fit is not None else ()
        found += len(modes)
        for f, ratio in zip(truth.frequencies, truth.damping, strict=True):
            near = [m for m in modes if abs(m.frequency.value - f) < ratio * f]
            if not near:
                rows.append((np.nan,) * 4)
                continue
            a, b = near[0].frequency, near[0].damping
            covered = float(a.low <= f <= a.high), float(b.low <= ratio <= b.high)
            rows.append((a.value / f - 1.0, b.value / ratio - 1.0, *covered))
    table = np.array(rows)
    hits = int(np.count_nonzero(np.isfinite(table[:, 0])))
    return Recovery(*table.T, found - hits)


def recover(trials: int, repeats: int, decibels: float = 40.0, first: int = 0) -> Recovery:
    """Draw, measure, identify and score."""
    truths, fits = [], []
    for seed in range(first, first + trials):
        random = np.random.default_rng(seed)
        truth = Truth.draw(random)
        truths.append(truth)
        try:
            fits.append(identify_modes(measured(truth, random, repeats, decibels), BAND))
        except InputError as error:
            print(f"trial {seed}: {error}")
            fits.append(None)
    return score(truths, fits)


def report(result: Recovery) -> str:
    """The figures as text."""
    known = np.isfinite(result.frequency)
    lines = [f"{known.sum()} of {known.size} modes found, {result.extra} found that are none"]
    for name, error, covered in (
        ("frequency", result.frequency, result.frequency_covered),
        ("damping", result.damping, result.damping_covered),
    ):
        size = np.abs(error[known])
        lines.append(
            f"{name}: mean absolute error {size.mean():.4%}, 95 % below {np.quantile(size, 0.95):.4%}, worst "
            f"{size.max():.4%}; interval covers in {covered[known].mean():.1%}"
        )
    return "\n".join(lines)


def main(arguments: list[str]) -> None:
    count = int(arguments[0]) if arguments else 200
    decibels = float(arguments[1]) if len(arguments) > 1 else 40.0
    for repeats in (1, 6):
        start = time.perf_counter()
        print(f"{count} trials, {repeats} repeat{'s' if repeats > 1 else ''}, {decibels:g} dB")
        print(report(recover(count, repeats, decibels)))
        print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main(sys.argv[1:])
