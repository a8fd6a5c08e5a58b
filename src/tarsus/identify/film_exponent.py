"""Whether a film of another exponent acts on a foot that flies after a detachment.

``F = -C g' / (g + g0)^n`` with n = 3 is assumed. About the fit one more unknown of all flights tells which exponent
they show, and how the film moves with it: 2 is the alternative, and where neither has nearly all of the weight draws of
the film hold both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.fit.verdict import LEVEL
from tarsus.identify.checks import SURE, with_checks
from tarsus.identify.draws import by_group, newton_draws
from tarsus.identify.film import FilmFit
from tarsus.identify.flight import FILM, PULLS, equations_of
from tarsus.identify.step import PREFERRED, UNDECIDED, Alternative, Check

ASSUMED, OTHER = 3.0, 2.0
_HIGHER = "record ramps that lift the foot higher, and lower"
_MOST = 0.8
"""Share of draws with the other exponent at most: the value, which has the assumed one, stays well inside of them."""
_FEWEST = 4
"""Records whose scatter tells how well one more unknown is known."""
_TOLD = 1e12
"""Condition of the scaled information beyond which it is rounding: flights that do not feel an unknown say nothing."""


@dataclass(frozen=True)
class Exponent:
    """The exponent that flights show: value and standard error, as records scatter; moves (2,): of the logarithms of
    C / g0^n and g0 for one unit of it."""

    value: float
    error: float
    moves: Floats


def film_checked(film: FilmFit, seed: int) -> FilmFit:
    """A film's fit with the exponent three, with the check whether its flights show another one, and with draws of both
    exponents where the flights leave them open; seed: of the draws."""
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
    """A film's fit with both exponents as alternatives, draws of both where they are undecided, and the checks."""
    apart = ((found.value - ASSUMED) ** 2 - (found.value - OTHER) ** 2) / found.error**2
    weight = float(1.0 / (1.0 + np.exp(-0.5 * np.clip(apart, -700.0, 700.0))))
    # the law of the device file is given up as surely as any other, and else drawn along
    decided, step = weight <= 1.0 - LEVEL or apart > SURE, film.step
    ratio, drawn, unit = step.combinations["C / g0^3"]
    said = f"{found.value:.3g} with standard error {found.error:.2g}"
    moves = (OTHER - ASSUMED) * found.moves
    if not decided:
        picked = np.random.default_rng([seed, 23]).random(len(step.samples)) < min(weight, _MOST)
        thickness = step.samples[:, 1] * np.exp(np.where(picked, moves[1], 0.0))
        # of the other law C has another unit; it is drawn as what damps the same at contact
        drawn = drawn * np.exp(np.where(picked, moves[0], 0.0))
        note = f"The exponent of the film is undecided between 3 and 2 ({said}): its draws hold both."
        step = replace(
            step, samples=np.column_stack([drawn * thickness**3, thickness]), notes=(*step.notes, note)
        )
    moved = np.log(step.values) + np.array([moves[0] + 3.0 * moves[1], moves[1]])
    changes: dict[str, float] = {path: float(np.exp(one)) for path, one in zip(FILM, moved, strict=True)}
    answers: list[Alternative] = []
    for value, share, change in ((ASSUMED, 1.0 - weight, dict[str, float]()), (OTHER, weight, changes)):
        word = UNDECIDED if not decided else PREFERRED if share > 0.5 else "contradicted"
        answers.append(
            Alternative(
                "exponent of the film", f"{value:g}", share, said, value == ASSUMED, word, change, _HIGHER
            )
        )
    step = replace(step, combinations={**step.combinations, "C / g0^3": (ratio, drawn, unit)})
    return replace(film, step=with_checks(step, _of_exponent(found, apart, said), answers))


def _of_exponent(found: Exponent, apart: float, said: str) -> tuple[Check, Check]:
    """Whether the exponent is the assumed one, and any of the two. Flights under another force than the film's, as on a
    ground that gives way, tell their first pulls wrong as well."""
    name, record = (
        "weight of the other exponent of the film",
        "record ramps that lift the foot higher, and lower",
    )
    cause = f"the exponent of the film is {OTHER:g} rather than {ASSUMED:g} (as one more unknown {said})"
    neither = (
        f"the flights after detachments are not damped by a film alone: its exponent comes out as {said}"
    )
    off = max(abs(found.value - 0.5 * (ASSUMED + OTHER)) - 0.5 * (ASSUMED - OTHER), 0.0) / found.error
    return (
        Check(name, apart, SURE, paths=(*FILM, *PULLS), cause=cause, record=record),
        Check(
            "exponent of the film beyond both, in standard errors", off, float(np.sqrt(SURE)),
            paths=(*FILM, *PULLS), cause=neither, record=record,
        ),
    )  # fmt: skip
