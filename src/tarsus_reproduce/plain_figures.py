"""The source's plain figures of impacts, (3.30) to (3.32): from single samples before and after each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.impacts.detection import Impacts
from tarsus.impacts.estimates import Spread, spread
from tarsus.records.measurement import Measurement, check_sampled_together


@dataclass(frozen=True)
class PlainFigures:
    """Figures of impacts from single samples before and after each, as the source takes them.

    restitution (ni,): -(3.30), the sign turned as everywhere here; ratio (ni, np): velocity change over the foot's
    approach velocity (3.31); column (ni, np): the same over that of the foot (3.32). ``restitution_spread`` and
    ``column_spread`` (np of them) are their means with interval and scatter. names: of the np channels.
    """

    names: tuple[str, ...]
    restitution: Floats
    ratio: Floats
    column: Floats

    @property
    def restitution_spread(self) -> Spread:
        """Mean restitution."""
        return spread(self.restitution)

    @property
    def column_spread(self) -> tuple[Spread, ...]:
        """Mean of each channel's change per unit change of the foot's velocity."""
        return tuple(spread(values) for values in self.column.T)


def plain_figures(
    close: Measurement, subtracted: Measurement, foot: str, impacts: Impacts, names: Sequence[str] | None = None
) -> PlainFigures:
    """Restitution and velocity-change ratios by differences of neighbouring samples, (3.30) to (3.32).

    No smoothing, no allowance for noise or for the motion between two samples: the reference to compare better
    estimates with. Impacts at which the samples show the foot leaving before and after, or standing still, are left
    out.

    Parameters
    ----------
    close
        Record near the ground.
    subtracted
        The same less the in-air record (3.27).
    foot
        Channel of the contact foot.
    impacts
        From `detect_impacts`.
    names
        Channels; all of ``subtracted`` by default.

    Raises
    ------
    InputError
        If no impact is left.
    """
    chosen = tuple(subtracted.names if names is None else names)
    check_sampled_together(close, subtracted, chosen)
    k = impacts.after[(impacts.after >= 1) & (impacts.after < min(close.count, subtracted.count))]
    before, after = close[foot][k - 1], close[foot][k]
    change = np.array([subtracted[name][k] - subtracted[name][k - 1] for name in chosen]).T
    foot_change = subtracted[foot][k] - subtracted[foot][k - 1]
    usable = (before * foot_change < 0.0) & (before != 0.0)
    if not usable.any():
        raise InputError(f"no impact of channel '{foot}' turns an approach: is the record upside down?")
    before, after, change, foot_change = before[usable], after[usable], change[usable], foot_change[usable]
    return PlainFigures(chosen, -after / before, change / before[:, None], change / foot_change[:, None])
