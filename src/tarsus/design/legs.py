"""The lengths of a leg's links: the design problem (4.1)-(4.2), as corrected in erratum E12."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import Amount, MaybeAmount, quantity, with_values
from tarsus.design.request import Given, Settings, settings_of
from tarsus.model.structure.base import Array
from tarsus.model.structure.leg import Leg
from tarsus.model.structure.leg_motion import GRAVITY
from tarsus.model.structure.leg_step import StepLift, step_lift

LENGTHS = ("hip.length", "thigh.length", "shin.length")
"""Paths of the design parameters (4.2)."""

COARSE = 5
"""Lengths tried of each link before the optimiser starts from the best of them: the optimum is at the load's limit or
at a bound, and a fifth of the range from either is within reach of it."""
SAME = 1e-6
"""Share by which a length may miss its bound, or a load its limit, and still be at it: the differences' own."""
ENOUGH, DIFFERENCE = 1e-10, 1e-6
"""The optimiser ends where the speed gains less than this share, and takes differences of lengths by parts of the
longest one: the time of a peak is known to 1e-14, so that slopes are good to 1e-8; with smaller ones the last line
search depends on rounding."""


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
        return np.array([self.leg.hip.length, self.leg.thigh.length, self.leg.shin.length])


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

    Maximises the mean speed from the step to the first peak, ``y_b(t_f)/t_f``, of legs that carry the load, lifted when
    driven and without folding at 0 V, by scipy's SLSQP from the best of a coarse grid. The source's objective, the
    speed *at* the peak, is zero for every leg (E12).

    structure has everything but the lengths, and its links keep their mass per length; shortest, longest [m] bound
    every length; load [N] is the weight of the body under ``gravity`` unless given; request as for `tarsus.design`.
    Raises InputError for bounds that are not in order, and where no leg carries the load and answers with a peak.
    """
    options = settings_of(LegSettings, request, shortest=shortest, longest=longest, load=load, **settings)
    low, high = options.shortest, options.longest
    if not low < high:
        raise InputError(f"lengths must have shortest < longest, got {low:g} m and {high:g} m")
    return _fastest(structure, low, high, options.load or structure.body_mass * options.gravity)


def _fastest(leg: Leg, shortest: float, longest: float, needed: float) -> LinkDesign:
    least = shortest / longest

    def made(parts: Array) -> Leg:
        lengths = np.clip(parts, least, 1.0) * longest
        return with_values(leg, dict(zip(LENGTHS, lengths.tolist(), strict=True)))

    def spare(parts: Array) -> Array:
        one = step_lift(made(parts))
        return np.array([one.lifted, one.standing]) / needed - 1.0

    grid = [np.array(parts) for parts in product(np.linspace(least, 1.0, COARSE), repeat=3)]
    tried = [(parts, step_lift(made(parts))) for parts in grid]
    able = [(one.mean_speed, parts) for parts, one in tried if one.capacity >= needed and one.mean_speed > 0.0]
    if not able:
        raise InputError(
            f"no leg with links of {shortest:g} to {longest:g} m carries {needed:.3g} N and peaks after a step"
        )
    from scipy.optimize import minimize

    speed, start = max(able, key=lambda pair: pair[0])
    found = minimize(
        lambda parts: -step_lift(made(parts)).mean_speed / speed,
        start,
        method="SLSQP",
        bounds=[(least, 1.0)] * 3,
        constraints={"type": "ineq", "fun": spare},
        options={"ftol": ENOUGH, "eps": DIFFERENCE, "maxiter": 200},
    )
    best = made(found.x)
    lift = step_lift(best)
    if not found.success or lift.capacity < needed * (1.0 - SAME):
        raise InputError(f"the optimiser found no design: {found.message}")
    ends = (found.x < least + SAME) | (found.x > 1.0 - SAME)
    return LinkDesign(best, lift, needed, tuple(np.array(LENGTHS)[ends].tolist()), int(found.nfev))
