"""Modes of a walker's body from a structure: from matrices M, C and K, from a table of modes, from measured modes."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.linear import modes_of
from tarsus.model.structure.base import Structure
from tarsus.model.structure.walker import WalkerMode

COUPLED = 1e-3
"""Damping between two modes, over what damps them, above which modes of their own would not be those of the body: it
moves a pole by less than a thousandth of its half-power band."""


def body_modes(
    structure: Structure, above: float, upward: Mapping[str, str], along: Mapping[str, str] | None = None
) -> dict[str, WalkerMode]:
    """The modes of a free body for `tarsus.model.structure.WalkerBody.modes`, ``mode1`` and so on by frequency.

    Parameters
    ----------
    structure
        The body without legs, from matrices (`Lumped`), modes (`Modal`, or a universal file of them,
        ``tarsus.modes.read_mode_table``), or what was measured of it
        (``tarsus.modes.identify_modes(...).structure()``).
    above
        Frequency [Hz] above which its modes are its own: below lie the rigid motions, on whatever it was hung.
    upward
        Points of the structure at hips and payloads, by the names of these.
    along
        The same for motion along the way; shapes are 0 there without.

    Raises InputError for points that the structure does not have, for no mode above that frequency, and where
    damping couples the modes.
    """
    found = structure.matrices()
    squared, shapes = modes_of(found.mass, found.stiffness)
    kept = [k for k, one in enumerate(squared) if one > (2.0 * math.pi * above) ** 2]
    if not kept:
        raise InputError(f"the structure has no mode above {above:g} Hz")
    unknown = sorted({*upward.values(), *(along or {}).values()} - {*structure.points})
    if unknown:
        raise InputError(f"the structure has no point {', '.join(map(repr, unknown))}")
    damping = shapes.T @ found.damping @ shapes
    own = np.sqrt(np.abs(np.outer(np.diag(damping), np.diag(damping))))
    between = np.abs(damping - np.diag(np.diag(damping)))[np.ix_(kept, kept)]
    if np.any(between > COUPLED * own[np.ix_(kept, kept)] + 1e-12 * np.abs(damping).max(initial=0.0)):
        raise InputError("damping couples the modes of the structure: modes of a walker's body are damped one by one")
    out: dict[str, WalkerMode] = {}
    for number, k in enumerate(kept, 1):
        up, on = (
            {name: float(structure.row(point) @ shapes[:, k]) for name, point in way.items()}
            for way in (upward, along or {})
        )
        size = max(map(abs, [*up.values(), *on.values()]), default=0.0)
        if size == 0.0:
            continue  # a mode that moves no hip and no payload has no effect
        rate = math.sqrt(squared[k])
        out[f"mode{number}"] = WalkerMode(
            frequency=rate / (2.0 * math.pi),
            damping_ratio=damping[k, k] / (2.0 * rate),
            mass=size**-2,
            upward={name: one / size for name, one in up.items()},
            along={name: one / size for name, one in on.items()},
        )
    return out
