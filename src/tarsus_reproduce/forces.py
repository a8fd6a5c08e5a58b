"""Forces from differences of measured velocities, (3.33) to (3.37), with the noise they carry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.impacts.free import point_rows
from tarsus.model.structure.base import Matrices, Structure
from tarsus.records.measurement import Measurement, Quantity
from tarsus.tables.table import Column, Table, Tabled

CLEAR = 5.0
"""How many of its standard deviations a foot's force must have for a ratio to it to mean anything."""


@dataclass(frozen=True)
class ForceEstimate:
    """External forces at the points of a record (3.35).

    names: of the n channels; values (n, ns - 1) [N]; noise (n, ns - 1) [N]: standard deviation that white noise of the
    velocities causes; it grows with time, since the displacement is a sum of all velocities before.
    """

    names: tuple[str, ...]
    values: Floats
    noise: Floats


@dataclass(frozen=True)
class ImpactForces(Tabled):
    """Forces of impacts (3.36).

    names: of the n channels; values (ni, n) [N] and noise (ni, n) [N], their standard deviation; ratio (ni, n): over
    the force at the contact foot (3.37), and ratio_noise (ni, n), its standard deviation; both NaN where the foot's
    force is not clear of its noise, since the ratio of two noises depends on the mass matrix and not on the impact.
    """

    names: tuple[str, ...]
    values: Floats
    noise: Floats
    ratio: Floats
    ratio_noise: Floats

    def table(self) -> Table:
        """Every impact's forces with their standard deviations."""
        columns = [Column(name, "N", over=over) for over in ("force", "noise") for name in self.names]
        rows = [(i + 1, *row) for i, row in enumerate(np.hstack([self.values, self.noise]).tolist())]
        return Table("Forces of impacts", ("impact", *columns), rows)


def integrate(velocity: Floats, step: float) -> Floats:
    """Displacements [m] from velocities (..., ns) [m/s] by the rule of (3.34), zero at the first sample.

    An offset of the velocity grows linearly in it, white noise as the square root of time.
    """
    total = np.cumsum(velocity[..., :-1], axis=-1) * step
    return np.concatenate([np.zeros_like(velocity[..., :1]), total], axis=-1)


def point_matrices(structure: Structure, points: Sequence[str]) -> Matrices:
    """Mass, damping and stiffness (n, n) in the displacements of n points: the matrices of (3.3).

    Raises
    ------
    InputError
        Unless the points are as many as the structure's coordinates and tell them apart.
    """
    rows = point_rows(structure, points)
    if rows.shape[0] != rows.shape[1]:
        raise InputError(
            f"matrices of points need as many of these as the structure has coordinates, {structure.size}, "
            f"got {len(points)}"
        )
    if np.linalg.cond(rows) > 1e10:
        raise InputError("the points do not determine the coordinates of the structure")
    inverse = np.linalg.inv(rows)
    m = structure.matrices()
    return Matrices(*(inverse.T @ matrix @ inverse for matrix in (m.mass, m.damping, m.stiffness)))


def estimate_forces(record: Measurement, structure: Structure, names: Sequence[str]) -> ForceEstimate:
    """External forces from velocities by differences (3.33), sums (3.34) and the equation of motion (3.35).

    Parameters
    ----------
    record
        Velocities, best of the difference (3.27): what remains are then the forces of the ground.
    structure
        With n coordinates.
    names
        Of n channels, each at a point of its own.

    Raises
    ------
    InputError
        If channels are missing or no velocities, or the points do not determine the structure's motion.
    """
    velocity, noise = _velocities(record, names)
    m = point_matrices(structure, [record.channel(name).at for name in names])
    ts = record.step
    acceleration = np.diff(velocity, axis=1) / ts
    values = m.mass @ acceleration + m.damping @ velocity[:, :-1] + m.stiffness @ integrate(velocity, ts)[:, :-1]
    newest, here = _variance(m.mass / ts, noise), _variance(m.damping - m.mass / ts, noise)
    summed = _variance(m.stiffness * ts, noise)
    variance = (newest + here)[:, None] + summed[:, None] * np.arange(record.count - 1)
    return ForceEstimate(tuple(names), values, np.sqrt(variance))


def impact_forces(
    record: Measurement, structure: Structure, names: Sequence[str], foot: str, after: NDArray[np.int64]
) -> ImpactForces:
    """Forces of impacts (3.36) and their ratios to the contact foot's (3.37).

    The force of (3.35) at sample i takes the difference of samples i and i + 1. Where sample ``after`` is the first
    after an impact, its force therefore appears at ``after - 1``, and the k of (3.36) is ``after - 2``.

    Parameters
    ----------
    record, structure, names
        As for `estimate_forces`.
    foot
        Name of the contact foot's channel among them.
    after
        Numbers (ni,) of the first samples after each impact, as `detect_impacts` gives them.

    Returns
    -------
    ImpactForces
        Forces [N] of each impact at each channel, and their ratios.

    Raises
    ------
    InputError
        If the foot is not among the channels, and as `estimate_forces`.
    """
    if foot not in names:
        raise InputError(f"the contact foot '{foot}' is not among the channels {', '.join(names)}")
    velocity, noise = _velocities(record, names)
    m = point_matrices(structure, [record.channel(name).at for name in names])
    ts = record.step
    chosen = np.asarray(after, dtype=np.int64)
    chosen = chosen[(chosen >= 2) & (chosen < record.count)]
    # F(k + 1) - F(k) written out in the three velocities it is made of; the displacement's sum cancels but for one
    shares = (m.mass / ts - m.damping + m.stiffness * ts, m.damping - 2.0 * m.mass / ts, m.mass / ts)
    values = np.zeros((len(chosen), len(velocity)))
    covariance = np.zeros((len(velocity), len(velocity)))
    for i, share in enumerate(shares):
        values += (share @ velocity[:, chosen - 2 + i]).T
        covariance += (share * noise**2) @ share.T
    c = tuple(names).index(foot)
    own = values[:, c : c + 1]
    clear = np.abs(own) > CLEAR * np.sqrt(covariance[c, c])
    ratio = np.divide(values, own, out=np.full_like(values, np.nan), where=clear)
    spread = np.diag(covariance) - 2.0 * ratio * covariance[c] + ratio**2 * covariance[c, c]
    return ImpactForces(
        tuple(names),
        values,
        np.broadcast_to(np.sqrt(np.diag(covariance)), values.shape),
        ratio,
        np.sqrt(spread.clip(0.0)) / np.abs(own),
    )


def _velocities(record: Measurement, names: Sequence[str]) -> tuple[Floats, Floats]:
    """Velocities (n, ns) and their noise (n,), zero where a channel does not state it."""
    problems = [
        f"channel '{name}' is in {record.channel(name).quantity.unit}: forces are estimated from velocities (m/s)"
        for name in names
        if record.channel(name).quantity is not Quantity.VELOCITY
    ]
    if problems:
        raise InputError(problems)
    noise = np.array([record.channel(name).noise or 0.0 for name in names])
    return np.array([record[name] for name in names]), noise


def _variance(matrix: Floats, noise: Floats) -> Floats:
    return np.sum((matrix * noise) ** 2, axis=1)
