"""Circle fit of a mode in the mobility plane, as the source identified its structure (section 2.3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from tarsus.base.arrays import Complexes, Floats
from tarsus.base.errors import InputError

_LEVEL = 0.2
"""Part of the peak down to which lines belong to the circle: below, neighbours and background bend it."""
_FEWEST = 5
"""Lines that a circle takes: three for it, and two to see whether it is one."""
_ARC = 180.0
"""Degrees that lines must span: of less the centre is not known along the arc."""


class CircleFit(NamedTuple):
    """One mode from the circle that its mobility runs through: frequency [Hz], undamped; damping_ratio [1]; centre and
    radius of the circle."""

    frequency: float
    damping_ratio: float
    centre: complex
    radius: float


def fit_circle(points: Complexes) -> tuple[complex, float]:
    """Centre and radius of the circle of least squared distance to at least three points (k,) that lie on no line."""
    middle, size = points.mean(), np.ptp(np.abs(points - points[0]))
    x, y = ((points - middle) / size).real, ((points - middle) / size).imag
    columns = np.column_stack([2.0 * x, 2.0 * y, np.ones_like(x)])
    a, b, rest = np.linalg.lstsq(columns, x**2 + y**2, rcond=None)[0]  # Kasa 1976: linear, and near the least distance
    start = np.array([a, b, np.sqrt(rest + a * a + b * b)])
    cx, cy, radius = least_squares(lambda p: np.hypot(x - p[0], y - p[1]) - p[2], start, method="lm").x
    return complex(middle + size * (cx + 1.0j * cy)), float(size * abs(radius))


def fit_mode_circle(frequency: Floats, mobility: Complexes, near: float) -> CircleFit:
    """Natural frequency and damping ratio from the resonance of a mobility next to a frequency.

    A mode of viscous damping runs through a circle exactly, clockwise, at the angle
    ``angle = angle0 - 2 atan((w^2 - w0^2) / (2 zeta w0 w))`` about its centre; the law is fitted by least squares to
    all points down to a fifth of the peak. A constant of the modes elsewhere moves the circle, and changes neither.

    Parameters
    ----------
    frequency
        Lines (nf,) [Hz].
    mobility
        Velocity per unit of drive (nf,).
    near
        Frequency [Hz] to look for the peak, within ten lines.

    Raises
    ------
    InputError
        If the resonance is under-resolved (fewer than 5 lines on the circle, or on less than half of it, or a
        half-power band below the line spacing), or turns the wrong way.
    """
    line = float(frequency[1] - frequency[0])
    around = np.flatnonzero(np.abs(frequency - near) <= 10.0 * line)
    if not len(around):
        raise InputError(f"no line lies near {near:g} Hz")
    size = np.abs(mobility)
    peak = first = last = int(around[np.argmax(size[around])])
    while first > 0 and _LEVEL * size[peak] < size[first - 1] < size[first]:
        first -= 1
    while last < len(size) - 1 and _LEVEL * size[peak] < size[last + 1] < size[last]:
        last += 1
    f, lines = frequency[first : last + 1], mobility[first : last + 1]
    if len(lines) < _FEWEST:
        raise InputError(_unresolved(frequency[peak], f"only {len(lines)} lines reach a fifth of its peak", line))
    centre, radius = fit_circle(lines)
    angles = np.unwrap(np.angle(lines - centre))
    arc = float(np.degrees(np.ptp(angles)))
    if arc < _ARC:
        raise InputError(_unresolved(frequency[peak], f"its lines cover {arc:.0f} degrees of a circle only", line))

    def off(p: Floats) -> Floats:
        return p[2] - 2.0 * np.arctan2((f**2 - p[0] ** 2) / (p[0] * f), 2.0 * p[1]) - angles

    half = max(float(f[-1] - f[0]) / 10.0, 0.5 * line)
    start = np.array([frequency[peak], half / frequency[peak], angles[peak - first]])
    natural, damping, _ = least_squares(off, start, x_scale=np.array([half, start[1], 1.0])).x.tolist()
    if angles[-1] > angles[0] or damping <= 0.0:
        raise InputError(
            f"the resonance at {frequency[peak]:g} Hz turns the wrong way: its circle is run through anticlockwise, as "
            "with negative damping; look at the sign of the phase and at what else drives the structure"
        )
    if 2.0 * damping * natural < line:
        raise InputError(_unresolved(natural, f"its half-power band is {2.0 * damping * natural:.3g} Hz", line))
    return CircleFit(natural, damping, centre, radius)


def _unresolved(frequency: float, why: str, line: float) -> str:
    return (
        f"the resonance at {frequency:g} Hz is under-resolved: {why}, at a line spacing of {line:g} Hz; measure longer"
    )
