"""Frequency responses in the air -> natural frequencies, damping ratios, and how the drive is shared out over the
modes.

The response of the displacement of point o to the volts is ``sum_k phi_ko p_k gamma / (m_k (s^2 + 2 zeta_k w_k s +
w_k^2))``: the residue at the upper pole is ``phi_ko p_k gamma / (2 i w_dk m_k)``. With shapes and masses from the
device's geometry the residues tell ``p_k gamma``, and so the participations p_k up to their common factor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.special import ndtri

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.fit.ranges import Range
from tarsus.identify.draws import DRAWS, student
from tarsus.identify.foot import FootModel
from tarsus.identify.hysteresis import Shares
from tarsus.identify.influence import FILE, ORDER, VOLTS, Influence
from tarsus.identify.step import Residual, StepResult, Used
from tarsus.measure.mac import mac
from tarsus.model.scene import ModalLoad
from tarsus.model.structure import Beam, Modal
from tarsus.modes.agreement import Agreed, agreeing
from tarsus.modes.frf import estimate_frf
from tarsus.modes.known_shapes import fit_known_shapes
from tarsus.modes.lsfd import residues_of
from tarsus.modes.modal import ModalFit, identify_modes
from tarsus.modes.mode import ModeVerdict
from tarsus.records.measurement import Measurement

_ORDERS_PER_MODE = 6
"""Order of the models per fitted mode: two describe one, the others take up noise and background."""
_FEWEST_ORDERS = 12
"""Order at least: fewer hold no pole in common."""
_EDGE = 0.01
"""Part of the band at either end that is left out: the sweep begins and ends there."""
_KNOWN_TO = 3e-4
"""Relative error that a participation has at least: the drive is not quite linear, and all sweeps share that."""
_SWAPPED = 0.5
"""Part of the mismatch of shapes that another order, or sign, of channels must leave to be named."""
_ALIKE = 1e-3
"""Difference of the MAC below which two shapes are alike: gains of channels that are wrong by 3 % turn a shape by as
much."""
_UNEXPLAINED = 0.3
"""Part of the responses unexplained from which on a fit is remarked: as in `tarsus.modes`."""
_WORST_SHAPE = 0.5
"""Mismatch of shapes (0 alike, 1 orthogonal) beyond which the modes are not those of the geometry."""


@dataclass(frozen=True)
class Resonances:
    """The step's result, the modal fit behind it, that of all modes found, the device with it, the participations, and
    the sources of the sweeps."""

    step: StepResult
    fit: ModalFit
    seen: ModalFit
    model: FootModel
    shares: Shares
    sources: tuple[str, ...]


def identify_resonances(
    model: FootModel, records: Sequence[Measurement], band: tuple[float, float], seed: int, near: ModalFit | None = None
) -> Resonances:
    """Frequencies and damping ratios of a beam or a modal structure, from sweeps in the air.

    Parameters
    ----------
    model
        The device as known beforehand: kind and geometry of the structure; its frequencies and damping are not used.
    records
        Repeats, each with a velocity or displacement of every point and the drive.
    band
        Lowest and highest frequency swept in all of them [Hz].
    seed
        Of the draws.
    near
        The modes found in nearly these records, to start from.

    Raises
    ------
    InputError
        For a structure of another kind, sweeps of which no majority agrees, modes that are not there or not
        determined, channels that look swapped.
    """
    structure = model.scene.robot.structure
    if not isinstance(structure, Beam | Modal):
        raise InputError("the structure to identify must be a beam or modal, for its frequencies to be its parameters")
    margin = _EDGE * (band[1] - band[0])
    inside = band[0] + min(margin, 0.5 * band[0]), band[1] - margin
    agreed = agreeing(records, model.points, inside)
    fit, seen = _fitted(model, agreed, inside, structure.size, near)
    if isinstance(structure, Modal):
        fit = replace(fit, modes=tuple(fit.modes[k] for k in _order(model, fit)))
    frequencies = tuple(float(mode.frequency.value) for mode in fit.modes)
    ratios = tuple(float(mode.damping.value) for mode in fit.modes)
    known = len(structure.frequencies)
    changes = {f"robot.structure.frequencies.{k}": f for k, f in enumerate(frequencies[:known])}
    changes |= {f"robot.structure.damping_ratios.{k}": r for k, r in enumerate(ratios)}
    model = model.changed(changes)
    _check_shapes(model, fit, agreed.records)
    random = np.random.default_rng([seed, 3])
    numbers = [mode.frequency for mode in fit.modes][:known] + [mode.damping for mode in fit.modes]
    samples = np.column_stack([_drawn(number, random) for number in numbers])
    step = StepResult(
        "resonances",
        tuple(changes),
        np.array(list(changes.values())),
        samples,
        residuals=(Residual("responses of all records", "1", fit.misfit, np.nan, fit.frf.values.size),),
        used=(Used("sweeps", len(agreed.records), len(records)), Used("modes", len(fit.modes), len(fit.modes))),
        left_out=agreed.left_out,
        notes=(*fit.remarks, *fit.refused),
    )
    sources = tuple(one.source for one in agreed.records)
    return Resonances(step, fit, seen, model, _shares(model, fit, seed), sources)


def _fitted(
    model: FootModel, agreed: Agreed, inside: tuple[float, float], count: int, near: ModalFit | None
) -> tuple[ModalFit, ModalFit]:
    """The modes of the structure, and all that were found."""
    first = agreed.records[0]
    frf = estimate_frf(agreed.records, [agreed.drive], agreed.channels, inside)
    orders = max(_FEWEST_ORDERS, _ORDERS_PER_MODE * count)
    fit = identify_modes(frf, inside, orders, between_fits=False, near=near)
    if isinstance(model.scene.robot.structure, Modal) and len(fit.modes) < count:
        return _by_shapes(model, fit, agreed), fit
    if len(fit.modes) < count:
        raise InputError(
            f"{first.source} and its repeats show {len(fit.modes)} of the {count} modes of the structure from "
            f"{inside[0]:.4g} to {inside[1]:.4g} Hz: they may lie outside, or the drive hardly moves them; sweep "
            "where they are, and about a voltage at which the drive follows it"
        )
    chosen = fit.only([fit.modes[int(k)].frequency.value for k in _picked(model, fit, count)])
    # of modes of a structure that is known, a tilt is the instrument's: its delay
    unusable = [one.reason for one in chosen.modes if one.verdict not in (ModeVerdict.DETERMINED, ModeVerdict.TURNED)]
    if unusable:
        raise InputError([f"{first.source} and its repeats: {said}" for said in unusable])
    return chosen, fit


def _by_shapes(model: FootModel, seen: ModalFit, agreed: Agreed) -> ModalFit:
    """Modes too wide and close to be seen one by one: those of the known shapes, together."""
    fit = replace(fit_known_shapes(seen.frf, model.rows.T), poles=seen.poles)
    name = f"{agreed.records[0].source} and its repeats"
    if fit.misfit > _UNEXPLAINED:
        raise InputError(
            f"{name}: modes of the shapes of the structure leave {100 * fit.misfit:.0f} % of the responses "
            "unexplained: are the points, the order and signs of the channels and the shapes right?"
        )
    if fit.refused:
        raise InputError([f"{name}: {said}" for said in fit.refused])
    return fit


def _picked(model: FootModel, fit: ModalFit, count: int) -> list[int]:
    """Numbers of the modes of the structure among those found: the strongest, by frequency, or those of its
    shapes."""
    if isinstance(model.scene.robot.structure, Modal):
        return sorted(_order(model, fit))
    return sorted(int(k) for k in np.argsort(_strength(fit))[::-1][:count])


def _strength(fit: ModalFit) -> Floats:
    """Largest response (nm,) that each mode found has at its resonance, of the displacement by the drive."""
    return np.array([np.max(np.abs(mode.residues)) / abs(mode.pole.real) for mode in fit.modes])


def _order(model: FootModel, fit: ModalFit) -> list[int]:
    """Number of the mode found for each mode of a structure whose shapes are known (MAC, one to one).

    Shapes that are alike at the points measured do not tell which mode is which: of modes found that fit as well the
    strongest are taken, and they have the order of frequencies that the device file states.
    """
    structure = model.scene.robot.structure
    assert isinstance(structure, Modal)
    shapes, strength = _shapes(model).T, _strength(fit)
    likeness = np.atleast_2d(mac(shapes, _parts(model, fit).T))
    _, found = linear_sum_assignment(-likeness - _ALIKE * strength / strength.max())
    alike = np.atleast_2d(mac(shapes, shapes)) > 1.0 - _ALIKE
    stated = np.argsort(structure.frequencies, kind="stable").tolist()
    for one, other in combinations(stated, 2):
        if alike[one, other] and fit.frequencies[found[one]] > fit.frequencies[found[other]]:
            found[[one, other]] = found[[other, one]]
    return [int(k) for k in found]


def of_sweeps(found: Resonances, order: Mapping[str, int], volts: Mapping[str, float]) -> Influence | None:
    """What each sweep says of frequencies and damping ratios, by the poles that it has alone; None of modes without.

    Parameters
    ----------
    found
        The step.
    order
        Place of every source of records among all files.
    volts
        Highest of each of them [V].
    """
    shifts = [mode.shifts for mode in found.fit.modes]
    if any(one is None or len(one) != len(found.sources) for one in shifts) or len(found.sources) < 2:
        return None
    poles = np.array([mode.pole + np.asarray(one) for mode, one in zip(found.fit.modes, shifts, strict=True)])
    size = np.abs(poles)
    paths = found.step.paths
    known = len(paths) - len(poles)
    each = np.concatenate([size[:known] / (2.0 * np.pi), -poles.real / size]).T
    count, std = len(each), found.step.std
    information = np.repeat(np.diag(1.0 / (count * std**2))[None], count, axis=0)
    number = np.arange(count)
    along = {ORDER: [order[one] for one in found.sources], VOLTS: [volts[one] for one in found.sources]}
    covariates = {name: np.array(one, dtype=np.float64) for name, one in along.items()}
    score = np.einsum("nab,nb->na", information, each - each.mean(axis=0))
    return Influence(paths, information, score, np.ones(len(paths)), {FILE: number}, covariates)


def _drawn(number: Range, random: np.random.Generator) -> Floats:
    """Draws of a number with its interval: normal, of the same 95 %."""
    deviation = number.half_width(1.0) / ndtri(0.5 + 0.5 * number.level)
    return number.value + deviation * random.standard_normal(DRAWS)


def _parts(model: FootModel, fit: ModalFit) -> Floats:
    """Shape value times participation times gain over mass (nm, no), displacement per volt, for the fitted
    residues."""
    return np.array([_part(mode.pole, mode.residues[:, 0]) for mode in fit.modes])


def _part(pole: complex, residues: NDArray[np.complex128]) -> Floats:
    return np.real(2.0j * pole.imag * residues)


def _shapes(model: FootModel) -> Floats:
    """Shapes of the structure at the points (nm, np), over the modal masses."""
    return model.rows.T / np.diag(model.mass)[:, None]


def _check_shapes(model: FootModel, fit: ModalFit, records: Sequence[Measurement]) -> None:
    """Raise InputError where the responses do not look like the structure's modes; swapped channels are named."""
    seen, known = _parts(model, fit), _shapes(model)
    plain = _mismatch(seen, known)
    if plain < _WORST_SHAPE * _SWAPPED:
        return
    names = fit.frf.outputs
    files = ", ".join(sorted({record.source for record in records}))
    for a, b in combinations(range(len(names)), 2):
        order = list(range(len(names)))
        order[a], order[b] = order[b], order[a]
        if _mismatch(seen[:, order], known) < _SWAPPED * plain:
            raise InputError(
                f"{files}: channels '{names[a]}' and '{names[b]}' look swapped: the modes have the shapes "
                "of the structure "
                "only the other way round"
            )
    for k, name in enumerate(names):
        turned = np.where(np.arange(len(names)) == k, -1.0, 1.0)
        if _mismatch(seen * turned, known) < _SWAPPED * plain:
            raise InputError(
                f"{files}: the sign of channel '{name}' looks flipped: the modes have the shapes of the structure only "
                "with the other one"
            )
    if plain > _WORST_SHAPE:
        raise InputError(
            f"{files}: the modes do not have the shapes of the structure at {', '.join(names)} "
            f"(an error of {100 * plain:.0f} %): are "
            "the points, the signs of the channels and the geometry right?"
        )


def shape_mismatch(found: Resonances) -> float:
    """Largest part of a mode's shape that is not along that of the structure."""
    return _mismatch(_parts(found.model, found.fit), _shapes(found.model))


def _mismatch(seen: Floats, known: Floats) -> float:
    """Largest part of a mode's shape (nm, np) that is not along the known one."""
    along = np.sum(seen * known, axis=1) ** 2 / (np.sum(seen**2, axis=1) * np.sum(known**2, axis=1))
    return float(np.sqrt(np.max(1.0 - along)))


def _shares(model: FootModel, fit: ModalFit, seed: int) -> Shares:
    """Participations (n - 1,) of a modal load, and draws (draws, n - 1) over the repeats.

    Each repeat has its residues at its own poles: a damping ratio that is too small makes the residue too small too.
    """
    load = model.scene.robot.drives[model.drive].load
    if not isinstance(load, ModalLoad) or len(fit.modes) < 2:
        return Shares.none()
    known = _shapes(model)
    frf = fit.frf
    repeats = frf.values[None] if frf.repeats is None else frf.repeats
    gains = []
    for r, one in enumerate(repeats):
        poles = np.array([mode.pole + (0.0 if mode.shifts is None else mode.shifts[r]) for mode in fit.modes])
        residues, _ = residues_of(frf.frequency, one[:, 0], poles)
        parts = np.array([_part(pole, residues[:, k] / pole**frf.derivatives) for k, pole in enumerate(poles)])
        gains.append(np.sum(parts * known, axis=1) / np.sum(known**2, axis=1))
    table = np.array(gains)
    mean = table.mean(axis=0)
    values = load.participation[0] * mean[1:] / mean[0]
    if len(table) < 2:
        return Shares(values, np.diag((0.1 * values) ** 2), np.repeat(values[None], DRAWS, axis=0))
    # means of as many repeats, as far from theirs as these are
    moved = np.random.default_rng([seed, 11]).standard_normal((DRAWS, len(table))) @ (table - mean) / len(table)
    drawn = mean + moved * student(float(len(table)))
    off = load.participation[0] * drawn[:, 1:] / drawn[:, :1] - values
    covariance = np.atleast_2d(np.cov(off.T)) + np.diag((_KNOWN_TO * values) ** 2)
    return Shares(values, covariance, values + off)
