"""What the form of the film's law leaves open: its exponent as one more unknown of all flights after detachments.

``F = -C g' / (g + g0)^n`` with n = 3 is that of an even film between flat faces. The film's interval is that of this
law, whose draws fly as the records do. How far flights leave another n open says how far C and g0 may be off: flights
over an uneven film are explained as well by an even one of two thirds of its thickness.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.identify.checks import SHIFTED, SURE, with_checks
from tarsus.identify.draws import by_group, sandwich_draws
from tarsus.identify.film import FilmFit
from tarsus.identify.flight import FILM, PULLS, equations_of
from tarsus.identify.step import Check, StepResult

ASSUMED = 3.0
_FEWEST = 4
"""Records whose scatter shows how well one more unknown is known."""
_TOLD = 1e12
"""Condition of the scaled information beyond which it is rounding: flights that do not feel an unknown say nothing."""
_MOST = 1.0
"""By how much the exponent is taken to be another one at most: 2 to 4 are those of films, slip and roughness."""
_LOW = (
    "record as many ramps that lift the foot no farther than half its gap; where its faces are known to be flat, state "
    "even_film = true in the campaign"
)
"""Of a sound campaign of the foreign laboratory the exponent is then known to 0.12 where it was to 0.32."""


@dataclass(frozen=True)
class Exponent:
    """The exponent that flights show: value and standard error, as records scatter; moves (2,): of the logarithms of C
    and g0 for one unit of it, C being that which damps the same at contact under the assumed law."""

    value: float
    error: float
    moves: Floats

    @property
    def open(self) -> float:
        """By how much it may be another one than is assumed: its error, and what it comes out to be off."""
        return float(min(np.hypot(self.error, self.value - ASSUMED), _MOST))

    def checks(self, step: StepResult) -> tuple[Check, Check]:
        """Whether flights show another exponent, which makes their pulls wrong as well; and whether those that they
        leave open move the film's numbers no farther than their intervals reach."""
        said = f"{self.value:.3g} with standard error {self.error:.2g}"
        far = np.abs(self.moves) * self.open * step.values
        return (
            Check(
                "exponent of the film off 3, in standard errors",
                abs(self.value - ASSUMED) / self.error,
                float(np.sqrt(SURE)),
                paths=(*FILM, *PULLS),
                record=_LOW,
                cause=f"the flights after detachments are not damped as by a film of exponent 3: it is {said}",
            ),
            Check(
                "shift of the film by other exponents, in standard deviations",
                float(np.max(far / step.std)),
                SHIFTED,
                paths=FILM,
                record=_LOW,
                cause=f"the film is taken for an even one, of exponent 3, and flights leave the exponent open: {said}",
                far=dict(zip(FILM, far.tolist(), strict=True)),
            ),
        )


def film_checked(film: FilmFit, seed: int) -> FilmFit:
    """A film's fit with the checks of the exponent that it assumes; seed: of the draws."""
    exponent = exponent_of(film, seed)
    return film if exponent is None else replace(film, step=with_checks(film.step, exponent.checks(film.step)))


def exponent_of(film: FilmFit, seed: int) -> Exponent | None:
    """The exponent that the flights show, with the level of the ground free, too, as far as it is not known; None of
    few records, or of no film or one that they do not feel."""
    offs = film.offs
    records = [one.trace for one in offs.items]
    if not film.step.paths or len(set(records)) < _FEWEST:
        return None
    law, unknowns = film.fitted.parameters.law(offs.model, film.fitted.place), film.fitted.unknowns
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
    error = float(np.std(sandwich_draws([(information, score - information @ whole)], seed)[:, -1]))
    ratio, thickness = -np.linalg.solve(total[:-1, :-1], total[:-1, -1])[:2]
    return Exponent(ASSUMED + float(whole[-1]), error, np.array([ratio + ASSUMED * thickness, thickness]))
