"""Impacts -> the column of the impact map: how all points follow the foot at an impact.

The flights on both sides of every impact are fitted again, with the velocities of all coordinates free to jump. The
change of each point's velocity per unit change of the foot's, one number for all impacts, is a column of (3.22); the
mass-weighted law has ``rows M^-1 n / (n M^-1 n)``. For records in the air beside those near the ground
`tarsus.impacts.estimate_impact_map` does without the drive's law.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.identify.detachment import WORST
from tarsus.identify.draws import DRAWS
from tarsus.identify.foot import FootModel
from tarsus.identify.restitution import FEWEST, BounceStudy, film_of
from tarsus.identify.step import Curve, Panel, Residual, StepResult, Used
from tarsus.impacts.estimates import common_ratio

Floats = NDArray[np.float64]


def identify_impact_column(model: FootModel, study: BounceStudy, seed: int) -> StepResult:
    """Column of the impact map at every point but the foot, beside that of the mass-weighted law.

    It has no parameter of the device: a device without a map of its own follows the mass-weighted law.

    Raises
    ------
    InputError
        If too few impacts are fitted well with free velocities.
    """
    fitted = study.bounces.fit(model, film_of(model), free=True)
    good = fitted.chi < WORST
    if np.count_nonzero(good) < FEWEST:
        raise InputError(
            f"{np.count_nonzero(good)} impacts tell how all points jump; at least {FEWEST} are needed"
        )
    changes = fitted.unknowns[good] @ fitted.changes.T
    covariance = np.einsum("aq,iqr,br->iab", fitted.changes, fitted.inverse[good], fitted.changes)
    k = model.points.index(model.foot_point)
    known = model.rows @ model.jump / float(model.rows[k] @ model.jump)
    random = np.random.default_rng([seed, 13])
    combinations, residuals, notes, curves = {}, [], [], []
    for i, name in enumerate(model.points):
        if i == k:
            continue
        pair = covariance[:, [i, k]][:, :, [i, k]]
        ratio = common_ratio(changes[:, i], changes[:, k], pair)
        draws = ratio.value + ratio.std * random.standard_normal(DRAWS)
        combinations[f"jump of {name} over the foot's"] = (ratio.value, draws, "1")
        rest = changes[:, i] - ratio.value * changes[:, k]
        turn = np.array([1.0, -ratio.value])
        unsure = np.einsum("a,nab,b->n", turn, pair, turn)
        residuals.append(
            Residual(
                f"jumps of {name}",
                "m/s",
                float(np.sqrt(np.mean(rest**2))),
                float(np.sqrt(np.mean(unsure))),
                len(rest),
            )
        )
        agrees = ratio.low <= known[i] <= ratio.high
        notes.append(
            f"{name}: {ratio.value:.4g} [{ratio.low:.4g}, {ratio.high:.4g}]; the mass-weighted law has "
            f"{known[i]:.4g}, " + ("which agrees." if agrees else "which does not agree.")
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
        files=frozenset(
            study.bounces.traces[study.bounces.items[int(r)].trace].file for r in np.flatnonzero(good)
        ),
        panels=(panel,) if curves else (),
        notes=tuple(notes),
    )
