"""Modal models printed as rounded matrices: their modes, what the rounding leaves open, and the way back.

The matrices of appendix B of the source are known to half a unit of their last printed digit and up to a
common unit that is not printed.  Everything here is in that unit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.model.structure.base import Array, Matrices
from tarsus.model.structure.modal import Modal
from tarsus_reproduce.packaged import data_table


@dataclass(frozen=True)
class PrintedModel:
    """One robot of appendix B, as printed.

    ``matrices`` are mass, damping and stiffness (n, n) of the heights of n points, the contact foot first, in
    a common unit that is not printed; ``half_widths`` is the rounding of their entries, (n, n) each.  A pair
    of entries printed with two values is its mean, and its half width covers both.  ``restitution_column`` is
    the first column (n,) of R_CoR and ``table_frequencies`` the row (n,) of Table 3.3 [Hz].
    """

    name: str
    matrices: Matrices
    half_widths: Matrices
    restitution_column: Array
    table_frequencies: Array


def printed_model(name: str) -> PrintedModel:
    """The printed matrices of ``"hexapod"`` or ``"quadruped"`` (appendix B, Table 3.3); InputError for another name."""
    tables = data_table("appendix_b.toml", Decimal)
    if name not in tables:
        raise InputError(f"no printed model is called '{name}'{nearest(name, tables)}")
    table = tables[name]
    pairs = [_symmetric(table[key]) for key in ("M", "C", "K")]
    return PrintedModel(
        name,
        Matrices(*(value for value, _ in pairs)),
        Matrices(*(half for _, half in pairs)),
        np.array(table["R_first_column"], dtype=float),
        np.array(table["table_3_3_hz"], dtype=float),
    )


def _symmetric(rows: Sequence[Sequence[Decimal]]) -> tuple[Array, Array]:
    """Symmetric values and half widths (n, n) of printed entries; the digits tell the rounding."""
    value = np.array(rows, dtype=float)
    half = np.array([[0.5 * 10.0 ** int(entry.as_tuple().exponent) for entry in row] for row in rows])
    return (value + value.T) / 2.0, np.abs(value - value.T) / 2.0 + np.maximum(half, half.T)


@dataclass(frozen=True)
class ModalForm:
    """Undamped modes of a model, or of several, in order of frequency.

    ``frequencies`` [Hz] is (..., n); ``shapes`` (..., n, n) has the modes as columns, mass-normalised, each positive at
    the first point; ``damping`` (..., n, n) is ``P^T C P`` [1/s], diagonal if damping is modal.
    """

    frequencies: Array
    shapes: Array
    damping: Array

    @property
    def damping_ratios(self) -> Array:
        """Damping ratios (..., n) of the diagonal of ``damping``, its other entries left out."""
        return np.diagonal(self.damping, axis1=-2, axis2=-1) / (4.0 * math.pi * self.frequencies)

    @property
    def coupling(self) -> float:
        """Largest entry of ``damping`` of one model outside its diagonal, relative to those of its two modes [1]."""
        root = np.sqrt(np.abs(np.diagonal(self.damping)))
        return float(np.max(np.abs(self.damping / np.outer(root, root) - np.eye(len(root)))))


def modal_form(matrices: Matrices) -> ModalForm:
    """Modes of ``M x'' + C x' + K x = 0``: equation (3.3) taken back to (3.1); matrices (..., n, n).

    Raises InputError if mass or stiffness is not positive definite.
    """
    for what, matrix in (("mass", matrices.mass), ("stiffness", matrices.stiffness)):
        lowest = float(np.linalg.eigvalsh(matrix)[..., 0].min())
        if lowest <= 0.0:
            raise InputError(
                f"the {what} matrix is not positive definite, so it has no modes: lowest eigenvalue {lowest:.3g}"
            )
    inverse = np.linalg.inv(np.linalg.cholesky(matrices.mass))
    squared, vectors = np.linalg.eigh(inverse @ matrices.stiffness @ inverse.swapaxes(-1, -2))
    shapes = inverse.swapaxes(-1, -2) @ vectors
    shapes = np.where(shapes[..., :1, :] < 0.0, -shapes, shapes)
    return ModalForm(np.sqrt(squared) / (2.0 * math.pi), shapes, shapes.swapaxes(-1, -2) @ matrices.damping @ shapes)


def rounding(model: PrintedModel, draws: int = 10_000, seed: int = 0) -> tuple[float, ModalForm]:
    """What the printed digits leave open: modes of models whose entries are uniform within the rounding of the printed
    ones (Monte Carlo).

    Gives the share of the draws that were positive definite, and the modes of those.

    Raises InputError if none was.
    """
    rng = np.random.default_rng(seed)
    size = len(model.matrices.mass)
    upper = np.triu_indices(size)

    def draw(value: Array, half: Array) -> Array:
        drawn = np.zeros((draws, size, size))
        drawn[:, *upper] = value[upper] + half[upper] * rng.uniform(-1.0, 1.0, (draws, len(upper[0])))
        return drawn + np.triu(drawn, 1).swapaxes(1, 2)

    mass, damping, stiffness = (
        draw(getattr(model.matrices, what), getattr(model.half_widths, what))
        for what in ("mass", "damping", "stiffness")
    )
    good = (np.linalg.eigvalsh(mass)[:, 0] > 0.0) & (np.linalg.eigvalsh(stiffness)[:, 0] > 0.0)
    if not good.any():
        raise InputError(
            f"none of {draws} draws within the rounding of the printed {model.name} is positive definite; "
            "its digits do not hold a model"
        )
    return float(good.mean()), modal_form(Matrices(mass[good], damping[good], stiffness[good]))


def interval(samples: Array, level: float = 0.95) -> tuple[Array, Array]:
    """Lower and upper end of the central interval that holds ``level`` of the samples, along the first axis."""
    low, high = np.quantile(samples, [(1.0 - level) / 2.0, (1.0 + level) / 2.0], axis=0)
    return low, high


def modal_structure(form: ModalForm, points: Sequence[str], modal_mass: float, digits: int = 7) -> Modal:
    """The description of a modal form with so many significant digits: points are the names of its n points,
    ``modal_mass`` [kg] is what one unit of printed mass weighs, the same for all mass-normalised modes."""

    def rounded(values: Array) -> tuple[float, ...]:
        return tuple(float(f"{value:.{digits}g}") for value in values)

    return Modal(
        frequencies=rounded(form.frequencies),
        damping_ratios=rounded(form.damping_ratios),
        modal_masses=rounded(np.full(len(form.frequencies), modal_mass)),
        shapes={point: rounded(row) for point, row in zip(points, form.shapes, strict=True)},  # pyright: ignore[reportArgumentType]
    )
