"""How far every window of a walk pulls the numbers that all share: its `Influence`, windows within records within sets.

A part is a window, with what is known of its start, or a tie of two windows; starts, zeros of channels and what single
feet have of their own are eliminated, so that parts add up to what the records say of the numbers and to nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.fit.record_problem import RecordFit
from tarsus.fit.record_ties import WindowPulls
from tarsus.identify.influence import EVENT, FILE, ORDER, SET, TIME, VOLTS, Influence, numbered

if TYPE_CHECKING:
    from tarsus.identify.walking import WalkRecord


def influence_of(
    records: Sequence[WalkRecord], fit: RecordFit, pulls: WindowPulls, paths: Sequence[str], spread: Floats
) -> tuple[Influence, Floats]:
    """Influence on the logarithms of the first numbers of a fit, and information (np, np) that was known beforehand.

    paths (np,): of the numbers; spread (np,): standard deviations of their logarithms beforehand. Raises nothing: where
    nothing determines a number, what was known beforehand remains.
    """
    count, whole = len(paths), pulls.information.sum(axis=0)
    others = slice(count, len(whole))
    eliminated = np.linalg.solve(whole[others, others] + np.eye(len(whole) - count), whole[others, :count])
    ways = np.vstack([np.eye(count), -eliminated]) / spread
    information = np.einsum("ap,nab,bq->npq", ways, pulls.information, ways)
    segments = [fit.segments[k] for k in pulls.window]
    of = np.array([one.record for one in segments])
    levels = {
        EVENT: numbered(pulls.window.tolist()),
        FILE: numbered([records[r].name for r in of]),
        SET: numbered([records[r].set or records[r].name for r in of]),
    }
    ends = {r: max(one.span[1] for one in segments if one.record == r) for r in np.unique(of).tolist()}
    volts = {r: records[r].volts(np.linspace(0.0, end, 1000)) for r, end in ends.items()}
    covariates = {
        ORDER: of.astype(float),
        VOLTS: np.array([volts[r] for r in of.tolist()]),
        TIME: np.array([0.5 * sum(one.span) for one in segments]),
    }
    values = np.array([fit.values[path] for path in paths])
    one = Influence(tuple(paths), information, pulls.score @ ways, values, levels, covariates)
    return one, ways.T @ ways
