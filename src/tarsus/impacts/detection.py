"""Impacts in a record: where they are, by velocities alone or by the height over a ground that is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.signal import find_peaks

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.records.measurement import Measurement, Quantity

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


def detect_impacts(record: Measurement, foot: str, threshold: float = 6.0, separation: float = 0.0) -> Impacts:
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
        raise InputError(f"channel '{foot}' is in {channel.quantity.unit}: impacts are looked for in velocities (m/s)")
    values = record[foot]
    if record.count < 4 * _SIDE:
        raise InputError(f"channel '{foot}' has {record.count} samples: an impact takes at least {4 * _SIDE} to see")
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
    impacts = np.array([first + np.argmax(jump[first : last + 1]) for first, last in runs_of(met)], dtype=np.intp)
    slow = near & (np.abs(speed) < STILL * noise_v) & (np.abs(height) < STILL * noise_x)
    return impacts, slow


def runs_of(chosen: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of every run of a mask."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(int), [0]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2] - 1, strict=True)]
