"""The impact law of a foot from records near the ground and in the air, with its uncertainty.

The difference of the two records obeys the linear structure without drive between impacts. Its free motion, fitted on
both sides of each impact, gives the velocity of the foot just before and the change of every point's velocity, with the
noise of both known; impacts and repeats are then combined by errors-in-variables regression.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.impacts.alignment import RESIDUAL_LIMIT, Alignment, align, residual_gate, subtract
from tarsus.impacts.detection import Impacts, detect_impacts
from tarsus.impacts.estimates import Spread, common_ratio
from tarsus.impacts.fitted import FittedImpacts, FitWindow, fit_impacts, joined, usable
from tarsus.impacts.free import FreeResponse
from tarsus.model.structure.base import Structure
from tarsus.records.measurement import Measurement, Quantity
from tarsus.tables.table import Column, Table, Tabled


@dataclass(frozen=True)
class Repeat:
    """One pair of records as it was used: the alignments with each in-air record, why the gate refuses
    it, the impacts found (None where the gate refused) and those fitted (None where there are none)."""

    alignments: tuple[Alignment, ...]
    refused: tuple[str, ...]
    impacts: Impacts | None = None
    fitted: FittedImpacts | None = None


@dataclass(frozen=True, repr=False)
class ImpactMapEstimate(Tabled):
    """An impact law as measured.

    foot: the contact foot; names: of the np points; restitution: with 95 % interval and scatter; column (np of them):
    change of each point's velocity per unit change of the foot's, one at the foot; repeats: all pairs, refused ones
    too; fitted: the impacts used, of all repeats.
    """

    foot: str
    names: tuple[str, ...]
    restitution: Spread
    column: tuple[Spread, ...]
    repeats: tuple[Repeat, ...]
    fitted: FittedImpacts

    def table(self) -> Table:
        """Restitution, and the change of every point per unit change of the foot's; repeats that were refused."""
        rows = [
            (name, one.value, (one.low, one.high), one.scatter, one.n)
            for name, one in (("restitution", self.restitution), *zip(self.names, self.column, strict=True))
        ]
        columns = ("number", "value", "95 % interval", Column("scatter from impact to impact", digits=2), "impacts")
        refused = [" ".join(one.refused) for one in self.repeats if one.refused]
        return Table(f"Impact law of '{self.foot}'", columns, rows, refused)

    @property
    def values(self) -> Floats:
        """The column (np,) [1]."""
        return np.array([one.value for one in self.column])

    @property
    def matrix_column(self) -> Floats:
        """Column (np,) of the CoR matrix (3.22) for the foot: velocities after an impact per approach velocity."""
        unit = np.array([float(name == self.foot) for name in self.names])
        return unit - (1.0 + self.restitution.value) * self.values


def estimate_impact_map(
    close: Measurement | Sequence[Measurement],
    in_air: Measurement | Sequence[Measurement],
    structure: Structure,
    foot: str,
    before: float | None = None,
    window: FitWindow | None = None,
    residual_limit: float = RESIDUAL_LIMIT,
) -> ImpactMapEstimate:
    """Restitution and impact column of a foot, from records near the ground and in the air.

    Parameters
    ----------
    close, in_air
        Repeats of velocities with the same drive, near the ground and without contact; every in-air record is aligned
        with every close one, and their mean subtracted. Velocity channels at points of the structure are used.
    structure
        Linear structure, as identified in the air.
    foot
        Channel of the contact foot.
    before
        End of the part without contact [s]; by default, just before the first impact seen in each record.
    window
        How impacts are fitted; the default `FitWindow` if None.
    residual_limit
        Of the gate; noise counts as residual, so that records noisier than 20 dB need a wider one.

    Raises
    ------
    InputError
        If a channel is clipped, no repeat passes the gate (with every reason), or no impact can be used.
    """
    closes = (close,) if isinstance(close, Measurement) else tuple(close)
    airs = (in_air,) if isinstance(in_air, Measurement) else tuple(in_air)
    if not closes or not airs:
        raise InputError("expected at least one record near the ground and one in the air")
    names = _used_channels(closes[0], structure, foot)
    chosen = FitWindow() if window is None else window
    repeats = tuple(
        _repeat(one, i, airs, names, structure, foot, before, chosen, residual_limit) for i, one in enumerate(closes)
    )
    c, seen = names.index(foot), [r.impacts for r in repeats if r.impacts is not None]
    if not seen:
        raise InputError([reason for r in repeats for reason in r.refused])
    used = [r.fitted for r in repeats if r.fitted is not None]
    fitted = usable(joined(used), c, chosen) if used else None
    if fitted is None or not len(fitted):
        found = sum(map(len, seen))
        raise InputError(
            f"none of the {found} impacts found in channel '{foot}' can be used: too weak, too close together, or not "
            "between free motions of this structure"
        )
    return ImpactMapEstimate(
        foot, names, _restitution(fitted, c), tuple(_column(fitted, c, i) for i in range(len(names))), repeats, fitted
    )


def _used_channels(record: Measurement, structure: Structure, foot: str) -> tuple[str, ...]:
    names = tuple(c.name for c in record.channels if c.quantity is Quantity.VELOCITY and c.at in structure.points)
    channel = record.channel(foot)
    if foot not in names:
        why = (
            f"is in {channel.quantity.unit}, not m/s"
            if channel.quantity is not Quantity.VELOCITY
            else f"looks at no point of the structure, which has {', '.join(structure.points)}"
        )
        raise InputError(f"the contact foot's channel '{foot}' {why}")
    return names


def _repeat(
    close: Measurement,
    number: int,
    airs: Sequence[Measurement],
    names: tuple[str, ...],
    structure: Structure,
    foot: str,
    before: float | None,
    window: FitWindow,
    residual_limit: float,
) -> Repeat:
    close = close.select(names)
    quiet_end = _first_contact(close, foot, window) if before is None else before
    clipped = [said for one in (close, *(air.select(names) for air in airs)) for said in one.clipped()]
    if clipped:
        raise InputError(clipped)
    alignments = tuple(align(close, air, names, quiet_end) for air in airs)
    refused = next(filter(None, (residual_gate(one, residual_limit) for one in alignments)), ())
    if refused:
        return Repeat(alignments, refused)
    parts = [subtract(close, *one) for one in zip(airs, alignments, strict=True)]
    count, c = min(one.count for one in parts), names.index(foot)
    values = np.mean([one.values[:, :count] for one in parts], axis=0)
    still = close[foot][:count] - values[c] - np.mean([one.offset[c] for one in alignments])
    quiet = replace(parts[0], values=values).between(close.start, quiet_end).values
    noise = quiet.std(axis=1)
    channels = zip(parts[0].channels, noise.tolist(), strict=True)
    subtracted = replace(
        parts[0],
        values=values - quiet.mean(axis=1, keepdims=True),
        channels=tuple(replace(one, noise=size or None) for one, size in channels),
    )
    impacts = detect_impacts(subtracted, foot)
    points = [channel.at for channel in close.channels]
    free = FreeResponse(structure, points, np.maximum(noise, 1e-9 * np.abs(subtracted.values).max()), close.step)
    zero, share = noise / np.sqrt(quiet.shape[1]), 1.0 / len(airs)
    fitted = fit_impacts(subtracted, still, free, impacts, c, share, zero, number, window)
    return Repeat(alignments, (), impacts, fitted)


def _first_contact(close: Measurement, foot: str, window: FitWindow) -> float:
    """A time [s] safely before the first impact seen in a record."""
    first = int(detect_impacts(close, foot).after[0])
    return close.start + close.step * (first - 2 * window.fewest)


def _restitution(fitted: FittedImpacts, foot: int) -> Spread:
    """Departure over approach velocity, the first with its sign turned."""
    turn = np.zeros((2, fitted.covariance.shape[1]))
    turn[0, [0, 1 + foot]] = -1.0
    turn[1, 0] = 1.0
    after = fitted.before + fitted.change[:, foot]
    return common_ratio(-after, fitted.before, *_noise(fitted, turn))


def _column(fitted: FittedImpacts, foot: int, point: int) -> Spread:
    if point == foot:
        return Spread(1.0, 0.0, 1.0, 1.0, 0.0, len(fitted))
    pick = np.eye(fitted.covariance.shape[1])[[1 + point, 1 + foot]]
    return common_ratio(fitted.change[:, point], fitted.change[:, foot], *_noise(fitted, pick))


def _noise(fitted: FittedImpacts, pick: Floats) -> tuple[Floats, Floats, Floats]:
    """Errors of the pairs that ``pick`` (2, 1 + np) takes: of each, shared through the zeros, with the one after."""
    shifts = np.moveaxis(pick @ fitted.zero, 2, 0)
    shared = np.concatenate([shifts * (fitted.repeat == i)[:, None] for i in np.unique(fitted.repeat)])
    return pick @ fitted.covariance @ pick.T, shared, pick @ fitted.following[:-1] @ pick.T
