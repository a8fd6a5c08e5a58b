"""How far each group of data pulls each number: its information and its score about the estimate.

About the minimum the data of a group have an information ``A_g`` and a score ``s_g``, whose sums are the whole
information ``A`` and nothing. With ``B = A^-1`` the group has the share ``h_g = (B A_g B)_jj / B_jj`` of what is known
of number j, and pulls it by ``m_g = (B s_g)_j``: alone it would have it ``m_g / h_g`` off. Whether that is chance, and
along what it goes, is asked of all numbers alike (`tarsus.identify.covariance`, `tarsus.identify.surprises`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.arrays import Floats
from tarsus.identify.draws import by_group
from tarsus.identify.traces import LEVEL, Stands, Trace

BLOCK, EVENT, FILE, SET = "block", "event", "file", "set"
"""Levels of groups, finest first: a straight run of the volts is a block; what repeats of a set show of one and the
same moment is one event, and of walks a window of a record with its tie to the one before."""
ORDER, REPEAT, VOLTS, WITHIN, SPEED, CONTACT, TIME = (
    "the order of recording",
    "repeats of a record",
    "the volts",
    "the volts in a record",
    "the logarithm of speed",
    "contact time",
    "time since the drives began",
)
"""What groups of data may differ by."""


@dataclass(frozen=True)
class Influence:
    """Parts of the data about an estimate of p numbers.

    paths (p,); information (n, p, p) and score (n, p) of each part; units (p,): size of one unit of the numbers here
    [SI], for those that are estimated by their logarithm the value itself; levels: number (n,) of the group that each
    part is of, by level; covariates: by what they are, (n,), NaN for a part that has none; shared (draws, n, p): what
    all that earlier steps do not know does to the scores, where that is known.
    """

    paths: tuple[str, ...]
    information: Floats
    score: Floats
    units: Floats
    levels: Mapping[str, NDArray[np.intp]]
    covariates: Mapping[str, Floats]
    shared: Floats | None = None

    def at(self, level: str) -> tuple[Floats, Floats]:
        """Information (g, p, p) and score (g, p) of the groups of a level."""
        information, score = by_group(self.levels[level], self.information, self.score)
        return information, score

    def pulls(self, level: str, prior: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """Of the groups of a level: shares (g, p) of what is known of each number, pulls (g, p); variances (p,), in
        units of the numbers; prior (p, p): information that was known beforehand."""
        information, score = self.at(level)
        inverse = np.linalg.inv(information.sum(axis=0) + (0.0 if prior is None else prior))
        variance = np.diag(inverse).copy()
        share = np.einsum("ja,nab,bj->nj", inverse, information, inverse) / variance
        return share, score @ inverse, variance

    def of(self, paths: tuple[str, ...], ways: Floats, units: Floats) -> Influence:
        """On other numbers (k = p), which these move by ``ways`` (k, p), in units of theirs."""
        back = np.linalg.inv(ways)
        information = np.einsum("ap,nab,bq->npq", back, self.information, back)
        return replace(self, paths=paths, information=information, score=self.score @ back, units=units)


def numbered(names: Sequence[object]) -> NDArray[np.intp]:
    """Number (n,) of the group that each of some names stands for."""
    return np.unique([str(one) for one in names], return_inverse=True)[1]


def events_of(sets: Sequence[str], when: Sequence[float], apart: float) -> NDArray[np.intp]:
    """Number (n,) of the event that each of some moments [s] shows: repeats of a set show one and the same event, less
    than so far apart [s]."""
    names, at = numbered(sets), np.asarray(when)
    order = np.lexsort((at, names))
    new = (np.diff(names[order]) > 0) | (np.diff(at[order]) > apart)
    number = np.empty(len(order), dtype=np.intp)
    number[order] = np.concatenate([[0], np.cumsum(new)])
    return number


def of_records(traces: Sequence[Trace], which: ArrayLike) -> tuple[dict[str, NDArray[np.intp]], dict[str, Floats]]:
    """Files and sets of parts of the data, by the number (n,) of the record that each is from, and what records differ
    by: their order, which repeat they are, the highest volts."""
    at = np.asarray(which, dtype=np.intp)
    files, sets = [one.file for one in traces], [one.set for one in traces]
    repeat = [sets[:k].count(name) for k, name in enumerate(sets)]
    levels = {FILE: numbered([files[k] for k in at]), SET: numbered([sets[k] for k in at])}
    by_record = {
        ORDER: [one.order for one in traces],
        REPEAT: repeat,
        VOLTS: [float(np.abs(one.volts).max()) for one in traces],
    }
    return levels, {name: np.array(one, dtype=np.float64)[at] for name, one in by_record.items()}


def of_levels(stands: Stands) -> Influence:
    """On the place of the ground; a record that is far off pulls as three errors do."""
    weight = stands.errors**-2.0
    off = stands.levels - float(weight @ stands.levels / weight.sum())
    off = off.clip(-3.0 * stands.errors, 3.0 * stands.errors)[stands.of] + stands.off
    groups, covariates = of_records(stands.traces, stands.of)
    information = (weight[stands.of] * stands.share)[:, None, None]
    covariates[WITHIN] = stands.volts
    return Influence((LEVEL,), information, information[:, :, 0] * off[:, None], np.ones(1), groups, covariates)
