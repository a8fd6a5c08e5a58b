r"""Impact laws: what an impact at one foot does to the velocity of the whole structure.

Newton's law says how fast the struck foot departs, :math:`n^T v^+ = -e\, n^T v^-`; an impact law says how the other
coordinates follow,

.. math:: v^+ = v^- - (1 + e)\, d\, n^T v^- , \qquad n^T d = 1 ,

so a law is a direction ``d`` for every foot: what changes by how much when the foot's rate changes by one. The matrix
``R = I - (1 + e) d n^T`` is the source's CoR matrix (3.22). Three laws are offered by name:

* `MassWeighted`: ``d = M^-1 n / (n^T M^-1 n)``, an impulse at the foot and nothing else (Newton, Moreau);
* `DominantMode`: ``d = phi_k / phi_k,c``, the structure moves in one mode only, (3.17)-(3.24);
* `MeasuredImpactMap`: ``d`` as measured or printed.

Only the first can never create kinetic energy: with ``R = M^{1/2} R M^{-1/2}`` (unit mass metric) every other direction
has ``max eig(R^T R) > 1``. Each law therefore acts through its *passive projection* unless ``passive`` is set false:
the nearest matrix in the mass metric (Frobenius norm) that creates no energy and keeps the struck foot's restitution.
See `Directed.passive_matrix` for its closed form.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tarsus.base.errors import InputError
from tarsus.base.linear import cholesky, inverse, modes_of, product, pseudoinverse, rank_of, solve, svd
from tarsus.base.messages import PathErrors
from tarsus.base.spec import Description, FrozenDict, Named, quantity

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Body:
    """The structure as an impact law sees it.

    mass, stiffness (n, n); row(point) (n,): weights that give a point's displacement.
    """

    mass: Array
    stiffness: Array
    row: Callable[[str], Array]

    def mobility(self, normal: Array) -> float:
        """``n^T M^-1 n`` [1/kg]: rate of a foot per unit impulse on it."""
        return float(product(normal, solve(self.mass, normal)))


class ImpactMap(Description):
    """Base of the impact laws."""

    title: ClassVar[str]
    """The map in words, for reports."""

    passive: bool = Field(
        default=True, description="act through the nearest map that creates no energy; false runs the map as it is"
    )

    def direction(self, foot: str, normal: Array, body: Body) -> Array:
        """Direction d (n,) with ``normal @ d == 1``: change of all velocities per unit change of the foot's rate.

        Parameters
        ----------
        foot
            Name of the struck foot.
        normal
            Weights (n,) of the foot's gap.
        body
            The structure.

        Raises
        ------
        InputError
            Where the map does not say how this foot's impact moves the structure.
        """
        raise NotImplementedError


class MassWeighted(ImpactMap):
    """Newton's and Moreau's map: the impact is an impulse at the foot, ``d = M^-1 n / (n^T M^-1 n)``."""

    title = "mass-weighted"
    kind: Literal["mass_weighted"] = "mass_weighted"

    def direction(self, foot: str, normal: Array, body: Body) -> Array:
        spread = solve(body.mass, normal)
        return np.asarray(spread / float(product(normal, spread)), dtype=np.float64)


class DominantMode(ImpactMap):
    """The source's assumption 2: after the impact the structure moves in one mode, (3.17)-(3.24).

    ``d = phi_k / (n^T phi_k)``.  Without a number the mode is the one that an impulse at the foot moves most,
    the largest ``(n^T phi_k)^2 / (phi_k^T M phi_k)``: its share of the foot's mobility.
    """

    title = "dominant mode"
    kind: Literal["dominant_mode"] = "dominant_mode"
    mode: int | None = Field(
        default=None, ge=1, description="number of the mode, from 1 in order of frequency; absent: by rule"
    )

    def direction(self, foot: str, normal: Array, body: Body) -> Array:
        _, shapes = modes_of(body.mass, body.stiffness)
        shares = product(normal, shapes) ** 2
        if self.mode is not None and self.mode > len(shares):
            raise PathErrors([("mode", f"the structure has {len(shares)} modes, got {self.mode}")])
        chosen = int(np.argmax(shares)) if self.mode is None else self.mode - 1
        at_foot = float(product(normal, shapes[:, chosen]))
        if at_foot**2 <= 1e-12 * shares.sum():
            raise PathErrors([("mode", f"mode {chosen + 1} does not move foot '{foot}'")])
        return np.asarray(shapes[:, chosen] / at_foot, dtype=np.float64)


class MeasuredImpactMap(ImpactMap):
    """A measured or printed map: the first column of the CoR matrix, foot by foot.

    ``columns`` holds, for every foot that can be struck, the change of velocity of named points per unit change of
    the foot's own (1 at the foot itself). The points must determine the motion of the whole structure. A foot without a
    column is struck mass-weighted.
    """

    title = "given"
    kind: Literal["given"] = "given"
    columns: Named[Named[float]] = quantity(
        "1", "by foot: change of velocity of each point per unit change of the foot's", default=FrozenDict()
    )

    @model_validator(mode="after")
    def _some(self) -> MeasuredImpactMap:
        if not self.columns:
            raise PathErrors([("columns", "expected the column of at least one foot, got none")])
        return self

    def direction(self, foot: str, normal: Array, body: Body) -> Array:
        column = self.columns.get(foot)
        if column is None:
            return MassWeighted().direction(foot, normal, body)
        where = f"columns.{foot}"
        rows, faults = [], []
        for point in column:
            try:
                rows.append(body.row(point))
            except KeyError:
                faults.append((f"{where}.{point}", f"the structure has no point '{point}'"))
        if faults:
            raise PathErrors(faults)
        n = len(normal)
        matrix = np.array(rows)
        found = rank_of(matrix)
        if found < n:
            text = f"its {len(column)} points determine {found} of the {n} coordinates of the structure"
            raise PathErrors([(where, text)])
        direction = product(pseudoinverse(matrix), np.array(list(column.values())))
        at_foot = float(product(normal, direction))
        if abs(abs(at_foot) - 1.0) > 1e-6:
            raise PathErrors([(where, f"expected 1 at the foot itself, got {abs(at_foot):g}")])
        return direction / at_foot

    @classmethod
    def from_matrix(
        cls, matrix: Array, points: list[str], foot_points: dict[str, str], *, passive: bool = True
    ) -> MeasuredImpactMap:
        """The map of a CoR matrix R (n, n) over ``points``, (3.22): the identity but for the struck feet's columns.

        Parameters
        ----------
        matrix
            R (n, n), as printed.
        points
            Names of its coordinates.
        foot_points
            Point of every foot that is struck, by name of the foot.
        passive
            As the field.

        Raises
        ------
        InputError
            Where another column is not that of the identity, or a foot's own entry is 1 (it would not bounce).
        """
        change = np.asarray(matrix, dtype=float) - np.eye(len(points))
        struck = {points.index(point): foot for foot, point in foot_points.items()}
        still = [points[c] for c in range(len(points)) if c not in struck and np.any(change[:, c] != 0.0)]
        if still:
            raise InputError(f"CoR matrix: column of '{still[0]}' is not the identity's, but it is no struck foot")
        columns = {}
        for c, foot in struck.items():
            if change[c, c] == 0.0:
                raise InputError(f"CoR matrix: the entry of '{points[c]}' itself is 1, so it does not bounce")
            columns[foot] = dict(zip(points, (change[:, c] / change[c, c]).tolist(), strict=True))
        return cls(columns=columns, passive=passive)


AnyImpactMap = Annotated[MassWeighted | DominantMode | MeasuredImpactMap, Field(discriminator="kind")]


@dataclass(frozen=True)
class Directed:
    """An impact at one foot: mass (n, n), normal (n,), direction d (n,) and restitution e.

    In the unit mass metric ``u = M^{1/2} v`` with the unit normal ``m`` the direction is ``m + skew * s``, with a
    unit vector ``s`` across the normal; ``skew`` is zero for the mass-weighted map only.
    """

    mass: Array
    normal: Array
    direction: Array
    restitution: float

    @property
    def mobility(self) -> float:
        """``n^T M^-1 n`` [1/kg]."""
        return float(product(self.normal, solve(self.mass, self.normal)))

    @property
    def across(self) -> Array:
        """``d - M^-1 n / (n^T M^-1 n)`` (n,): what the direction has beyond the mass-weighted one."""
        spread = solve(self.mass, self.normal)
        return self.direction - spread / float(product(self.normal, spread))

    @property
    def skew(self) -> float:
        """Size of the part across the normal, against that along it, in the mass metric [1]."""
        across = self.across
        return math.sqrt(max(float(product(across, self.mass, across)), 0.0) * self.mobility)

    def matrix(self) -> Array:
        """R (n, n) of the map as it is, (3.22)."""
        return np.eye(len(self.mass)) - (1.0 + self.restitution) * np.outer(self.direction, self.normal)

    def passive_matrix(self) -> Array:
        r"""R (n, n) nearest to `matrix` in the mass metric with ``R^T M R <= M`` and the foot's row kept.

        In the basis (m, s) of the unit mass metric the map is ``[[-e, 0], [-(1+e) skew, 1]]`` and the identity
        elsewhere.  A matrix ``[[-e, 0], [-beta, alpha]]`` creates no energy where
        ``alpha^2 + beta^2 / (1 - e^2) <= 1``; with ``beta = sqrt(1 - e^2) sin(theta)`` and ``alpha = cos(theta)`` the
        nearest one has ``sin(theta) (1 - e^2 cos(theta)) = (1 + e) skew sqrt(1 - e^2) cos(theta)``.
        """
        e, size = self.restitution, self.skew
        theta = passive_angle(e, size)
        beta = math.sqrt(max(1.0 - e * e, 0.0)) * math.sin(theta)
        root = math.sqrt(self.mobility)
        spread = solve(self.mass, self.normal)
        out = np.eye(len(self.mass)) - (1.0 + e) * np.outer(spread, self.normal) / self.mobility
        if size > 0.0:
            side = self.across * root / size
            out -= np.outer(side, beta * self.normal / root + (1.0 - math.cos(theta)) * product(self.mass, side))
        return out

    def gain(self, *, passive: bool = False) -> float:
        """Largest factor by which one impact can multiply kinetic energy: max eig of ``M^-1/2 R^T M R M^-1/2``."""
        factor = cholesky(self.mass)
        r = self.passive_matrix() if passive else self.matrix()
        scaled = product(factor.T, r, inverse(factor.T))
        return float(svd(scaled)[0][0] ** 2)

    def energy(self, velocity: Array, *, passive: bool = False) -> Array:
        """Kinetic energy [J] that the impact creates (positive) or destroys, for velocities (n,) or (n, k) before."""
        after = (self.passive_matrix() if passive else self.matrix()) @ velocity
        return 0.5 * (
            np.einsum("i...,ij,j...->...", after, self.mass, after)
            - np.einsum("i...,ij,j...->...", velocity, self.mass, velocity)
        )


def passive_angle(restitution: float, skew: float) -> float:
    """Angle theta in [0, pi/2] of the passive projection: see `Directed.passive_matrix`; Newton's method, bracketed."""
    e = restitution
    if e >= 1.0:
        return 0.0
    c = math.sqrt(1.0 - e * e)
    wanted = (1.0 + e) * skew * c
    low, high = 0.0, 0.5 * math.pi
    theta = math.atan2(wanted, 1.0 - e * e)
    for _ in range(60):
        sine, cosine = math.sin(theta), math.cos(theta)
        f = sine * (1.0 - e * e * cosine) - wanted * cosine
        if f > 0.0:
            high = theta
        else:
            low = theta
        slope = cosine * (1.0 - e * e * cosine) + e * e * sine * sine + wanted * sine
        after = theta - f / slope if slope > 0.0 else low
        if not low <= after <= high:
            after = 0.5 * (low + high)
        if abs(after - theta) <= 1e-16:
            return after
        theta = after
    return theta
