"""Legs that records of a walk do not tell apart: what it adds to intervals that two answers are as likely."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.spec import with_values
from tarsus.model.structure import Walker
from tarsus.solve import ResultCode, simulate

if TYPE_CHECKING:
    from tarsus.identify.walking import WalkRecord

ALIKE = 9.0
"""Sum of squares over the noise below which records do not show that legs are exchanged: three standard deviations."""


def arms_of(walker: Walker) -> dict[str, float]:
    """Distances [m] of the farthest hip from the axes that the body turns about: an angle times it is its motion."""
    legs = walker.legs.values()
    found = {"roll": max(abs(one.y) for one in legs), "pitch": max(abs(one.x) for one in legs)}
    return {name: one or walker.length or 1.0 for name, one in found.items()}


def mirrored(walker: Walker, records: Sequence[WalkRecord], values: Mapping[str, float]) -> Floats:
    """What it adds to the covariance (np, np) of logarithms that records show no difference when legs are exchanged, as
    surge and heave do not where legs that face each other across the middle go together: of two answers that are as
    likely the second moment about one is half the square of the distance."""
    paths, logs = list(values), np.log(list(values.values()))
    out = np.zeros((len(paths), len(paths)))

    own = list[Floats]()
    for to in _exchanges(walker):
        other = [_of_other(path, to) for path in paths]
        if set(other) != set(paths):
            continue
        own = own or _shown(records, values)
        exchanged = {path: values[at] for path, at in zip(paths, other, strict=True)}
        two = _shown(records, exchanged)
        off = np.log(list(exchanged.values())) - logs
        if own and two and sum(float(np.sum((a - b) ** 2)) for a, b in zip(own, two, strict=True)) < ALIKE:
            out += 0.5 * np.outer(off, off)
    return out


def _shown(records: Sequence[WalkRecord], numbers: Mapping[str, float]) -> list[Floats]:
    """What channels of records (nc, nt) show over their noise at numbers; nothing where a walk does not reach its
    end."""
    out = list[Floats]()
    for one in records:
        run = simulate(with_values(one.scene, numbers), float(one.times[-1]))
        if run.ended is not ResultCode.DONE:
            return []
        out.append(run.outputs(list(one.outputs), one.times) / one.noise[:, None])
    return out


def _exchanges(walker: Walker) -> list[dict[str, str]]:
    """In whose place each leg stands when the robot is turned half round, or mirrored in its middle or its axis."""
    legs, out = walker.legs, list[dict[str, str]]()
    near = 1e-3 * max(arms_of(walker).values())
    for x, y in ((-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0)):
        to = {
            name: next((k for k, at in legs.items() if np.hypot(at.x - x * one.x, at.y - y * one.y) < near), "")
            for name, one in legs.items()
        }
        if set(to.values()) == set(legs) and any(name != at for name, at in to.items()):
            out.append(to)
    return out


def _of_other(path: str, to: Mapping[str, str]) -> str:
    """The path of the same number of the leg in whose place one stands; other paths as they are."""
    begin, _, rest = path.partition("robot.structure.legs.")
    leg, dot, name = rest.partition(".")
    return path if begin or leg not in to else f"robot.structure.legs.{to[leg]}{dot}{name}"
