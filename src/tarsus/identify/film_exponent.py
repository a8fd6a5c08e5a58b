"""What the form of the film's law leaves open: its exponent as one more unknown of all flights after detachments.

``F = -C g' / (g + g0)^n`` with n = 3 is that of an even film between flat faces. How far flights tell another n, and
how uncertain it is, moves the film along in its draws: flights over an uneven film are explained as well by an even one
of two thirds of its thickness.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.identify.checks import SURE, with_checks
from tarsus.identify.draws import DRAWS, by_group, newton_draws
from tarsus.identify.film import FilmFit
from tarsus.identify.flight import FILM, PULLS, equations_of
from tarsus.identify.step import Check

ASSUMED = 3.0
_FEWEST = 4
"""Records whose scatter tells how well one more unknown is known."""
_TOLD = 1e12
"""Condition of the scaled information beyond which it is rounding: flights that do not feel an unknown say nothing."""
_MOST = 1.0
"""By how much the exponent is taken to be another one at most: 2 to 4 are those of films, slip and roughness."""


@dataclass(frozen=True)
class Exponent:
    """The exponent that flights show: value and standard error, as records scatter; moves (2,): of the logarithms of
    C / g0^n and g0 for one unit of it."""

    value: float
    error: float
    moves: Floats

    @property
    def open(self) -> float:
        """By how much it may be another one than is assumed: its error, and what it comes out to be off."""
        return float(min(np.hypot(self.error, self.value - ASSUMED), _MOST))


def film_checked(film: FilmFit, seed: int) -> FilmFit:
    """A film's fit with draws over the exponents that its flights leave open, and the check whether they show another
    one; seed: of the draws."""
    exponent = exponent_of(film, seed)
    return film if exponent is None else with_exponent(film, exponent, seed)


def exponent_of(film: FilmFit, seed: int) -> Exponent | None:
    """The exponent that the flights show, with the level of the ground free beside it as far as it is not known; None
    of few records, or of no film or one that they do not feel."""
    offs = film.offs
    records = [one.trace for one in offs.items]
    if not film.step.paths or len(set(records)) < _FEWEST:
        return None
    law, unknowns = film.fitted.sought.law(offs.model, film.fitted.place), film.fitted.unknowns
    assert law.slopes is not None
    rates = [law.value[0] * np.log(law.value[1]), 0.0, 0.0, 0.0, 1.0]  # with C / g0^n as it is
    residuals, slopes, _ = offs.flown(unknowns, replace(law, slopes=np.column_stack([law.slopes, rates])))
    points = np.zeros(len(offs.model.points))
    shift = np.append(offs.model.rest(offs.level + film.unsure) - offs.model.rest(offs.level), points)
    rows = [
        np.insert(by, -1, np.repeat(-shift / noise, left.shape[1]), axis=0)
        for by, left, noise in zip(slopes, residuals, offs.noise, strict=True)
    ]
    information, score = by_group(records, *equations_of(residuals, rows, unknowns.shape[1]).reduced())
    information[:, -2, -2] += 1.0 / len(information)  # the level is known to a standard error, its unit
    total = information.sum(axis=0)
    size = np.sqrt(np.diag(total))
    if not size.all() or np.linalg.cond(total / np.outer(size, size)) > _TOLD:
        return None
    whole = np.linalg.solve(total, score.sum(axis=0))
    # about the fit with it: without, what it explains would count as scatter
    error = float(np.std(newton_draws([(information, score - information @ whole)], seed)[:, -1]))
    return Exponent(ASSUMED + float(whole[-1]), error, -np.linalg.solve(total[:-1, :-1], total[:-1, -1])[:2])


def with_exponent(film: FilmFit, found: Exponent, seed: int) -> FilmFit:
    """A film's fit with draws over the exponents that are left open, and the check of the one that is assumed."""
    step, said = film.step, f"{found.value:.3g} with standard error {found.error:.2g}"
    turned = np.outer(found.open * np.random.default_rng([seed, 23]).standard_normal(DRAWS), found.moves)
    ratio, drawn, unit = step.combinations["C / g0^3"]
    # of another law C has another unit; it is drawn as what damps the same at contact
    drawn, thickness = drawn * np.exp(turned[:, 0]), step.samples[:, 1] * np.exp(turned[:, 1])
    check = Check(
        "exponent of the film off 3, in standard errors",
        abs(found.value - ASSUMED) / found.error,
        float(np.sqrt(SURE)),
        paths=(*FILM, *PULLS),
        record="record ramps that lift the foot higher, and lower",
        cause=f"the flights after detachments are not damped as by a film of exponent 3: it comes out as {said}",
    )
    step = replace(
        step,
        samples=np.column_stack([drawn * thickness**3, thickness]),
        combinations={**step.combinations, "C / g0^3": (ratio, drawn, unit)},
        notes=(*step.notes, f"As one more unknown the exponent of the film is {said}; the film is drawn over it."),
    )
    return replace(film, step=with_checks(step, (check,)))
