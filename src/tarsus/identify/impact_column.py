"""Impacts -> the column of the impact law: how all points follow the foot at an impact.

The flights on both sides of every impact are fitted again, with the velocities of all coordinates free to jump. The
change of each point's velocity per unit change of the foot's, one number for all impacts, is a column of (3.22); the
mass-weighted law has ``rows M^-1 n / (n M^-1 n)``. Records near the ground less those of the same drive in the air
give it without the drive's law (`tarsus.impacts.estimate_impact_map`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.identify.bounce import Bounces
from tarsus.identify.draws import DRAWS, carried
from tarsus.identify.estimates import Estimates
from tarsus.identify.flight import WORST
from tarsus.identify.foot import FootModel
from tarsus.identify.restitution import FEWEST, variance_of
from tarsus.identify.step import Curve, Panel, Residual, StepResult, Used
from tarsus.impacts.estimates import Spread, common_ratio
from tarsus.impacts.impact_map import estimate_impact_map
from tarsus.records.excluded import Excluded
from tarsus.records.measurement import Measurement, Quantity


def identify_impact_column(model: FootModel, known: Estimates, near: Bounces, seed: int) -> StepResult:
    """Column of the impact law at every point but the foot, compared with the mass-weighted law's.

    It has no parameter of the device: a device without a map of its own follows the mass-weighted law. ``known``: what
    earlier steps found, whose draws widen the intervals.

    Raises
    ------
    InputError
        If too few impacts are fitted well with free velocities.
    """
    bounces = Bounces(near.traces, near.items, near.level, model, free=True)
    fitted = bounces.fit()
    good = fitted.chi < WORST
    if np.count_nonzero(good) < FEWEST:
        raise InputError(f"{np.count_nonzero(good)} impacts show how all points jump; at least {FEWEST} are needed")
    changes = fitted.unknowns[good] @ bounces.changes.T
    covariance = np.einsum("aq,iqr,br->iab", bounces.changes, fitted.inverse[good], bounces.changes)
    k = model.points.index(model.foot_point)
    weighted = model.rows @ model.jump / float(model.rows[k] @ model.jump)
    random = np.random.default_rng([seed, 13])
    combinations, residuals, notes, curves = {}, [], [], []
    others = [i for i in range(len(model.points)) if i != k]
    pairs = [covariance[:, [i, k]][:, :, [i, k]] for i in others]

    def ratios(values: Floats) -> Floats:
        moved = bounces.jumps(known.model(values), fitted)[good]
        return np.array(
            [common_ratio(moved[:, i], moved[:, k], own).value for i, own in zip(others, pairs, strict=True)]
        )

    shared = carried(ratios, known.values, known.samples)
    for i, pair, off in zip(others, pairs, shared.T, strict=True):
        name, ratio = model.points[i], common_ratio(changes[:, i], changes[:, k], pair)
        draws = ratio.value + ratio.std * random.standard_normal(DRAWS) + off
        low, high = np.quantile(draws, [0.025, 0.975])
        combinations[f"jump of {name} over the foot's"] = (ratio.value, draws, "1")
        rest = changes[:, i] - ratio.value * changes[:, k]
        unsure = variance_of(pair, ratio.value)
        residuals.append(Residual.of(f"jumps of {name}", "m/s", rest, np.sqrt(unsure)))
        agrees = low <= weighted[i] <= high
        notes.append(
            f"{name}: {ratio.value:.6g} [{low:.6g}, {high:.6g}]; the mass-weighted law has "
            f"{weighted[i]:.6g}, " + ("which agrees." if agrees else "which does not agree.")
        )
        error = np.sqrt(pair[:, 0, 0])
        curves.append(Curve(name, changes[:, k], changes[:, i], joined=False, error=error))
        ends = np.array([0.0, float(changes[:, k].max())])
        curves.append(Curve("common ratio", ends, ratio.value * ends))
    panel = Panel("jumps of the points over the foot's", "foot", "m/s", "point", "m/s", tuple(curves))
    return StepResult(
        "impact map",
        (),
        np.zeros(0),
        np.zeros((DRAWS, 0)),
        combinations=combinations,
        residuals=tuple(residuals),
        used=(Used("impacts", int(good.sum()), len(good)),),
        files=bounces.files(good),
        panels=(panel,) if curves else (),
        notes=tuple(notes),
    )


@dataclass(frozen=True)
class Pair:
    """Repeats of a set near the ground and of the one with the same drive in the air, by the sets' names."""

    near: str
    air: str
    close: tuple[Measurement, ...]
    in_air: tuple[Measurement, ...]


Combinations = dict[str, tuple[float, Floats, str]]
"""Numbers by name, as (value, draws (nd,), unit)."""


def map_from_pairs(
    known: Estimates, foot: str, pairs: Sequence[Pair], seed: int
) -> tuple[Combinations, list[Excluded]]:
    """Restitution and impact column by the sets near the ground, after section 3.4.2 of the source, and the pairs that
    cannot give them, with the reason: where the ground acts before it is touched, through a film, the record in the air
    does not explain the one near the ground. ``known``: what earlier steps found, whose draws widen the intervals."""
    random = np.random.default_rng([seed, 17])
    found: Combinations = {}
    left: list[Excluded] = []
    for pair in pairs:
        name = _velocity(pair.close[0], foot)
        try:
            if name is None:
                raise InputError(f"no channel is the velocity of point '{foot}'")
            found |= _of_pair(known, pair, name, random)
        except InputError as error:
            reason = error.problems[0][:1].lower() + error.problems[0][1:]
            left.append(Excluded(f"{pair.near} less {pair.air}", name or "", f"as a pair: {reason.rstrip('.')}"))
    return found, left


def _of_pair(known: Estimates, pair: Pair, foot: str, random: np.random.Generator) -> Combinations:
    def estimated(values: Floats) -> dict[str, Spread]:
        structure = known.model(values).scene.robot.structure
        estimate = estimate_impact_map(pair.close, pair.in_air, structure, foot)
        jumps = zip(estimate.names, estimate.column, strict=True)
        return {"restitution": estimate.restitution} | {
            f"jump of {name} over the foot's": one for name, one in jumps if name != foot
        }

    def moved(values: Floats) -> Floats:
        return np.array([one.value for one in estimated(values).values()])

    found, shared = estimated(known.values), carried(moved, known.values, known.samples)
    return {
        f"{name}, from {pair.near} less the air": (
            one.value,
            one.value + one.std * random.standard_normal(DRAWS) + off,
            "1",
        )
        for (name, one), off in zip(found.items(), shared.T, strict=True)
    }


def _velocity(record: Measurement, point: str) -> str | None:
    return next((c.name for c in record.channels if c.at == point and c.quantity is Quantity.VELOCITY), None)
