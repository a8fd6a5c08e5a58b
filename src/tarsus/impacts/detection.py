"""Impacts in a record: where they are, by velocities alone or by the height over a ground that is known, and the
source's plain figures of them, (3.30) to (3.32)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.signal import find_peaks

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.impacts.estimates import Spread, spread
from tarsus.records.measurement import Measurement, Quantity, check_sampled_together

_SIDE = 6
"""Samples on either side of an instant that its jump is judged by."""

_ORDER = 2
"""Order of the polynomials that continue the samples of each side to the instant."""


STILL = 5.0
"""Standard deviations of a sample within which a foot counts as still: of a million samples at rest hardly one is
beyond."""

APPROACH = 8.0
"""Standard deviations of a velocity sample that an approach to the ground must reach: of a hundred thousand samples
none does by chance."""

BACK = 0.3
"""Part of the approach with which a foot may still go down in the sample after an impact: its mean over the sample in
which a slow rebound began."""


@dataclass(frozen=True)
class Impacts:
    """Impacts found in a channel: ni of them in time order.

    after (ni,): number of the first sample after each; jump (ni,) [m/s]: change of the velocity there; score (ni,):
    jump over its noise; deviation [m/s]: standard deviation of a jump where there is none.
    """

    after: NDArray[np.int64]
    jump: Floats
    score: Floats
    deviation: float

    def __len__(self) -> int:
        return len(self.after)


def detect_impacts(
    record: Measurement, foot: str, threshold: float = 6.0, separation: float = 0.0
) -> Impacts:
    """Jumps in the velocity of a foot.

    The samples on each side of an instant, continued to it by a parabola, give two velocities; their difference is
    compared with its noise. The noise is the channel's own or that of the differences themselves (from their median),
    whichever is larger, so that a motion too quick for the sampling is not taken for impacts.

    Parameters
    ----------
    record
        With a channel of velocities; best the difference of a close and an in-air record.
    foot
        Name of the channel.
    threshold
        Jump over noise from which on it is an impact.
    separation
        Least time between impacts [s]; never less than six samples. Of closer ones the strongest counts.

    Raises
    ------
    InputError
        If the channel is no velocity or shows no impact.
    """
    channel = record.channel(foot)
    if channel.quantity is not Quantity.VELOCITY:
        raise InputError(
            f"channel '{foot}' is in {channel.quantity.unit}: impacts are looked for in velocities (m/s)"
        )
    values = record[foot]
    if record.count < 4 * _SIDE:
        raise InputError(
            f"channel '{foot}' has {record.count} samples: an impact takes at least {4 * _SIDE} to see"
        )
    at = (np.arange(_SIDE) + 0.5) / _SIDE
    ahead = np.linalg.pinv(np.vander(at, _ORDER + 1, increasing=True))[0]
    weights = np.concatenate([-ahead[::-1], ahead])
    jumps = sliding_window_view(values, 2 * _SIDE) @ weights
    own = (channel.noise or 0.0) * float(np.linalg.norm(weights))
    deviation = max(own, 1.4826 * float(np.median(np.abs(jumps))), 1e-12 * float(np.ptp(values)))
    if deviation == 0.0:
        raise InputError(f"no impacts found: channel '{foot}' is constant")
    score = np.abs(jumps) / deviation
    apart = max(_SIDE, int(np.ceil(separation / record.step)))
    chosen, _ = find_peaks(score, height=threshold, distance=apart + 1)
    if not len(chosen):
        raise InputError(
            f"no impacts found in channel '{foot}': its largest jump is {np.max(score):.1f} times the noise of one, "
            f"below the threshold of {threshold:g}"
        )
    return Impacts(chosen + _SIDE, jumps[chosen], score[chosen], deviation)


def impacts_at_ground(
    height: Floats, speed: Floats, noise_x: float, noise_v: float, step: float
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Last samples before rebounds of a foot, and the samples (ns,) at which it stands on the ground.

    Parameters
    ----------
    height, speed
        Of the foot over the ground (ns,) [m], [m/s].
    noise_x, noise_v
        Standard deviations of their samples.
    step
        Sampling step [s].
    """
    near = height < STILL * noise_x + np.abs(speed) * step
    jump = speed[1:] - speed[:-1]
    met = (speed[:-1] < -APPROACH * noise_v) & near[:-1] & near[1:] & (jump > APPROACH * noise_v)
    met &= speed[1:] > -BACK * np.abs(speed[:-1])
    impacts = np.array(
        [first + np.argmax(jump[first : last + 1]) for first, last in runs_of(met)], dtype=np.intp
    )
    slow = near & (np.abs(speed) < STILL * noise_v) & (np.abs(height) < STILL * noise_x)
    return impacts, slow


def runs_of(chosen: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of every run of a mask."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(int), [0]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2] - 1, strict=True)]


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
    close: Measurement,
    subtracted: Measurement,
    foot: str,
    impacts: Impacts,
    names: Sequence[str] | None = None,
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
