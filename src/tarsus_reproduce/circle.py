"""Circle fit of a mode in the mobility plane, as the source identified its structure (section 2.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tarsus.base.arrays import Complexes, Floats
from tarsus.base.errors import InputError

_LEVEL = 0.2
"""Part of the peak down to which lines belong to the circle: below, neighbours and background bend it."""
_FEWEST = 5
"""Lines that a circle takes: three for it, and two to see whether it is one."""
_STRAIGHT = 1e-9
"""Width over length of points that lie on a line: radius and centre would have no digit left."""
_ARC = 180.0
"""Degrees that lines must span: of less the centre is not known along the arc."""


@dataclass(frozen=True)
class Circle:
    """A circle in the complex plane; misfit: root mean square distance of its points, in units of the radius."""

    centre: complex
    radius: float
    misfit: float


@dataclass(frozen=True)
class CircleFit:
    """One mode from the circle that its mobility runs through.

    frequency [Hz], undamped; damping_ratio [1]; circle; lines (k,): indices of the lines used; angles (k,) [rad]: of
    the points about the centre; misfit [rad]: root mean square of what the angle law leaves.
    """

    frequency: float
    damping_ratio: float
    circle: Circle
    lines: NDArray[np.intp]
    angles: Floats
    misfit: float


def fit_circle(points: Complexes) -> Circle:
    """Circle of least squared distance to points (k,), from the linear fit of its equation (Kasa 1976).

    Raises
    ------
    InputError
        If there are fewer than 3 points, or they lie on a line.
    """
    if len(points) < 3:
        raise InputError(f"a circle needs at least 3 points, got {len(points)}")
    middle = points.mean()
    size = np.sqrt(np.mean(np.abs(points - middle) ** 2))
    if size == 0.0:
        raise InputError("a circle needs points that differ")
    x, y = ((points - middle) / size).real, ((points - middle) / size).imag
    columns = np.column_stack([2.0 * x, 2.0 * y, np.ones_like(x)])
    (a, b, rest), _, rank, _ = np.linalg.lstsq(columns, x**2 + y**2, rcond=_STRAIGHT)
    if rank < 3:
        raise InputError("the points lie on a straight line: there is no circle through them")
    start = np.array([a, b, np.sqrt(rest + a * a + b * b)])

    def distance(p: Floats) -> Floats:
        return np.hypot(x - p[0], y - p[1]) - p[2]

    found = least_squares(distance, start, method="lm")
    cx, cy, radius = found.x
    misfit = float(np.sqrt(np.mean(found.fun**2)) / abs(radius))
    return Circle(complex(middle + size * (cx + 1.0j * cy)), float(size * abs(radius)), misfit)


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
    peak = int(around[np.argmax(size[around])])
    first, last = peak, peak
    while first > 0 and _LEVEL * size[peak] < size[first - 1] < size[first]:
        first -= 1
    while last < len(size) - 1 and _LEVEL * size[peak] < size[last + 1] < size[last]:
        last += 1
    lines = np.arange(first, last + 1)
    if len(lines) < _FEWEST:
        raise InputError(_unresolved(frequency[peak], f"only {len(lines)} lines reach a fifth of its peak", line))
    circle = fit_circle(mobility[lines])
    angles = np.unwrap(np.angle(mobility[lines] - circle.centre))
    arc = float(np.degrees(np.ptp(angles)))
    if arc < _ARC:
        raise InputError(_unresolved(frequency[peak], f"its lines cover {arc:.0f} degrees of a circle only", line))
    if angles[-1] > angles[0]:
        raise InputError(
            f"the resonance at {frequency[peak]:g} Hz turns the wrong way: its circle is run through anticlockwise, as "
            "with negative damping; look at the sign of the phase and at what else drives the structure"
        )
    f = frequency[lines]

    def law(p: Floats) -> Floats:
        ratio = (f**2 - p[0] ** 2) / (p[0] * f)
        return p[2] - 2.0 * np.arctan2(ratio, 2.0 * p[1])

    half = max(float(f[-1] - f[0]) / 10.0, 0.5 * line)
    start = np.array([frequency[peak], half / frequency[peak], angles[peak - first]])
    found = least_squares(lambda p: law(p) - angles, start, x_scale=np.array([half, start[1], 1.0]))
    natural, damping = float(found.x[0]), float(found.x[1])
    if damping <= 0.0:
        raise InputError(
            f"the resonance at {natural:g} Hz turns the wrong way: its damping ratio would be {damping:.3g}"
        )
    if 2.0 * damping * natural < line:
        raise InputError(_unresolved(natural, f"its half-power band is {2.0 * damping * natural:.3g} Hz", line))
    return CircleFit(natural, damping, circle, lines, angles, float(np.sqrt(np.mean(found.fun**2))))


def _unresolved(frequency: float, why: str, line: float) -> str:
    return (
        f"the resonance at {frequency:g} Hz is under-resolved: {why}, at a line spacing of {line:g} Hz; measure longer"
    )
