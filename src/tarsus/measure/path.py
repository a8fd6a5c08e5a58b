"""Where a body that turns gets to: its own surge and sway, laid along its heading."""

from __future__ import annotations

import numpy as np

from tarsus.base.arrays import Floats


def path_of(surge: Floats, sway: Floats, yaw: Floats) -> Floats:
    """Places (2, nt) [m] in the world, forward and to the left of how the body began, of surge and sway [m] and yaw
    [rad] (nt,): the integral of ``R(yaw) (surge', sway')``, each stretch along its mean heading.

    A stretch that turns by ``d`` errs by ``d^2 / 24`` of its length.
    """
    heading = 0.5 * (yaw[1:] + yaw[:-1])
    ahead, aside = np.diff(surge), np.diff(sway)
    steps = np.array(
        [np.cos(heading) * ahead - np.sin(heading) * aside, np.sin(heading) * ahead + np.cos(heading) * aside]
    )
    return np.concatenate([np.zeros((2, 1)), np.cumsum(steps, axis=1)], axis=1) + np.array([surge[:1], sway[:1]])
