"""What a step of voltage does to a leg near rest, and the lengths of its links: the design problem (4.1)-(4.2), as
corrected in erratum E12."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import Amount, MaybeAmount, quantity, with_values
from tarsus.design.request import Given, Settings, settings_of
from tarsus.model.structure.base import Array
from tarsus.model.structure.leg import Leg
from tarsus.model.structure.leg_motion import GRAVITY, standing_load

LENGTHS = ("hip.length", "thigh.length", "shin.length")
"""Paths of the design parameters (4.2)."""

COARSE = 5
"""Lengths tried of each link before the optimiser starts from the best of them: the optimum is at the load's limit or
at a bound, and a fifth of the range from either is within reach of it."""
SAME = 1e-6
"""Share by which a length may miss its bound, or a load its limit, and still be at it: the differences' own."""
SWINGS = 1e-9
"""Share of a rate that has to be imaginary for a motion to swing: rounding of an eigenvalue is 1e-15 of the largest."""
ENOUGH, DIFFERENCE = 1e-10, 1e-6
"""The optimiser ends where the speed gains less than this share, and takes differences of lengths by parts of the
longest one: the time of a peak is known to 1e-14, so that slopes are good to 1e-8; with smaller ones the last line
search hangs on rounding."""


@dataclass(frozen=True)
class StepLift:
    """Answer of the linearised leg to a step to its rated voltage, from rest under its load.

    static: lift that remains [m]; peak: lift at the first peak [m]; peak_time: when [s], infinite for a leg
    that creeps up without a peak, which then has ``peak == static``; lifted: greatest load that the driven leg
    holds at or above its height without load [N]; standing: greatest load under which the nonlinear leg stands at
    0 V [N], see `standing_load`.
    """

    static: float
    peak: float
    peak_time: float
    lifted: float
    standing: float

    @property
    def capacity(self) -> float:
        """Load capacity [N]: what the leg both lifts and, undriven, stands under."""
        return min(self.lifted, self.standing)

    @property
    def mean_speed(self) -> float:
        """Lift at the first peak over the time to it [m/s]: (4.1) as corrected in E12; 0 without a peak."""
        return self.peak / self.peak_time


def step_lift(leg: Leg) -> StepLift:
    """Figures of a step to the rated voltage, exact for the linearised leg (`Leg.linearised`) but for `standing`."""
    linear = leg.linearised()
    matrices, body = linear.matrices(), linear.row("body")
    force = leg.torque_load() * leg.torque
    settled, give = np.linalg.solve(matrices.stiffness, np.column_stack([force, body])).T
    static = float(body @ settled)
    loads = (static / float(body @ give), standing_load(leg))
    rates, parts = _decays(matrices.mass, matrices.damping, matrices.stiffness, settled, body)
    swinging = np.imag(rates) > SWINGS * np.abs(rates)
    if static <= 0.0 or not swinging.any():
        return StepLift(static, static, math.inf, *loads)
    slow = np.flatnonzero(swinging)[np.argmin(np.abs(rates[swinging]))]

    def speed(time: float) -> float:
        return float(np.sum(parts * rates * np.exp(rates * time)).real)

    from scipy.optimize import brentq  # takes longer to load than all designs

    guess = math.pi / float(np.imag(rates[slow]))
    start, end = 0.5 * guess, 1.5 * guess
    if not speed(start) > 0.0 > speed(end):
        return StepLift(static, static, math.inf, *loads)
    when: Any = brentq(speed, start, end, xtol=1e-14 * guess)
    peak = static + float(np.sum(parts * np.exp(rates * when)).real)
    return StepLift(static, peak, when, *loads)


def _decays(
    mass: Array, damping: Array, stiffness: Array, settled: Array, body: Array
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Rates (2n,) [1/s] and parts (2n,) [m] with body height = static + sum(parts exp(rates t)), from rest at 0."""
    n = len(mass)
    scale = math.sqrt(float(np.trace(stiffness) / np.trace(mass)))  # brings positions and rates to one size
    flow = np.block(
        [
            [np.zeros((n, n)), np.eye(n) * scale],
            [-np.linalg.solve(mass, stiffness) / scale, -np.linalg.solve(mass, damping)],
        ]
    )
    rates, vectors = (np.asarray(one, dtype=np.complex128) for one in np.linalg.eig(flow))
    amounts = np.linalg.solve(vectors, np.concatenate([-settled, np.zeros(n)]))
    parts = (body @ vectors[:n]) * amounts
    return rates, np.asarray(parts, dtype=np.complex128)


@dataclass(frozen=True)
class LinkDesign:
    """The best leg within its bounds.

    leg: with the lengths found, widths and thicknesses kept (`Link.density`); lift: its figures; load [N] that it
    had to carry; at_bound: paths of lengths that ended at a bound; evaluations: of the optimiser.
    """

    leg: Leg
    lift: StepLift
    load: float
    at_bound: tuple[str, ...]
    evaluations: int

    @property
    def lengths(self) -> Array:
        """Lengths (3,) of hip link, thigh and shin [m]."""
        return _lengths(self.leg)


@dataclass(frozen=True)
class Landscape:
    """Mean speed and load capacity over two floats of a leg, the others as given.

    across, up: paths of the two floats; x (m,), y (n,) their values [SI]; speed (n, m) [m/s], 0 where no
    peak follows the step; capacity (n, m) [N].
    """

    across: str
    up: str
    x: Array
    y: Array
    speed: Array
    capacity: Array

    def best(self, load: float) -> tuple[float, float, float]:
        """The two floats and the speed at the fastest point that carries a load [N].

        Raises
        ------
        InputError
            If no point carries it.
        """
        speed = np.where(self.capacity >= load, self.speed, -1.0)
        row, column = np.unravel_index(int(np.argmax(speed)), speed.shape)
        if speed[row, column] < 0.0:
            raise InputError(f"no leg of the landscape carries {load:.3g} N")
        return float(self.x[column]), float(self.y[row]), float(speed[row, column])


def landscape(leg: Leg, across: str, x: ArrayLike, up: str, y: ArrayLike) -> Landscape:
    """Mean speed to the first peak and load capacity over a grid of two floats of a leg.

    Parameters
    ----------
    leg
        What the other numbers are of.
    across, x
        Path of the float along the grid's rows and its values (nx,) [SI].
    up, y
        Path of the float along its columns and its values (ny,) [SI].

    Returns
    -------
    Landscape
        Mean speed (ny, nx) [m/s] and capacity (ny, nx) [N].

    Raises
    ------
    InputError
        For an unknown path or a value that the leg refuses.
    """
    xs, ys = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    lifts = [[step_lift(with_values(leg, {across: a, up: b})) for a in xs] for b in ys]
    speed = np.array([[one.mean_speed for one in row] for row in lifts])
    return Landscape(across, up, xs, ys, speed, np.array([[one.capacity for one in row] for row in lifts]))


class LegSettings(Settings):
    """What a leg is designed for, see `tarsus.design.leg`."""

    shortest: Amount = quantity("m", "least length of every link", gt=0)
    longest: Amount = quantity("m", "greatest length of every link", gt=0)
    load: MaybeAmount = quantity("N", "force to be carried; the leg's own body unless given", default=None, gt=0)
    gravity: Amount = quantity("m/s^2", "acceleration of gravity, for that weight", default=GRAVITY, ge=0)


def leg(
    structure: Leg,
    shortest: float | str | None = None,
    longest: float | str | None = None,
    load: float | str | None = None,
    *,
    request: Given = None,
    **settings: Any,
) -> LinkDesign:
    """Lengths of hip link, thigh and shin that raise the body fastest and still carry the load.

    Maximises the mean speed from the step to the first peak, ``y_b(t_f)/t_f``, subject to a load capacity of at
    least the load (lifted when driven, and carried without folding at 0 V), by sequential quadratic programming
    (scipy's SLSQP) from the best of a coarse grid.
    The source's objective, the speed *at* the peak, is zero for every leg (E12).

    Parameters
    ----------
    structure
        Everything but the lengths; its links keep their mass per length.
    shortest, longest
        Bounds of every length [m].
    load
        Force to be carried [N]; the weight of the leg's body mass unless given.
    request
        Settings as a mapping or a TOML file, see `tarsus.design.settings_text`; what is given as an argument prevails.
    settings
        gravity: acceleration of gravity [m/s^2], for that weight.

    Raises
    ------
    InputError
        If the bounds are not in order, or no leg within them carries the load and answers with a peak.
    """
    options = settings_of(LegSettings, request, shortest=shortest, longest=longest, load=load, **settings)
    low, high = options.shortest, options.longest
    if not low < high:
        raise InputError(f"lengths must have shortest < longest, got {low:g} m and {high:g} m")
    return _fastest(
        structure, low, high, structure.body_mass * options.gravity if options.load is None else options.load
    )


def _fastest(leg: Leg, shortest: float, longest: float, needed: float) -> LinkDesign:
    def lift(parts: Array) -> StepLift:
        values = np.clip(parts, shortest / longest, 1.0) * longest
        return step_lift(with_values(leg, dict(zip(LENGTHS, values.tolist(), strict=True))))

    tried = [
        (parts, lift(np.array(parts))) for parts in product(np.linspace(shortest / longest, 1.0, COARSE), repeat=3)
    ]
    able = [(parts, one) for parts, one in tried if one.capacity >= needed and one.mean_speed > 0.0]
    if not able:
        raise InputError(
            f"no leg with links of {shortest:g} to {longest:g} m carries {needed:.3g} N and peaks after a step"
        )

    def spare(parts: Array) -> Array:
        one = lift(parts)
        return np.array([one.lifted, one.standing]) / needed - 1.0

    from scipy.optimize import minimize

    start, first = max(able, key=lambda pair: pair[1].mean_speed)
    found = minimize(
        lambda parts: -lift(parts).mean_speed / first.mean_speed,
        np.array(start),
        method="SLSQP",
        bounds=[(shortest / longest, 1.0)] * 3,
        constraints={"type": "ineq", "fun": spare},
        options={"ftol": ENOUGH, "eps": DIFFERENCE, "maxiter": 200},
    )
    best = lift(found.x)
    if not found.success or best.capacity < needed * (1.0 - SAME):
        raise InputError(f"the optimiser found no design: {found.message}")
    lengths = np.clip(found.x, shortest / longest, 1.0) * longest
    chosen = with_values(leg, dict(zip(LENGTHS, lengths.tolist(), strict=True)))
    near = SAME * longest
    at_bound = tuple(
        path
        for path, length in zip(LENGTHS, lengths, strict=True)
        if length < shortest + near or length > longest - near
    )
    return LinkDesign(chosen, best, needed, at_bound, int(found.nfev))


def _lengths(leg: Leg) -> Array:
    return np.array([leg.hip.length, leg.thigh.length, leg.shin.length])
