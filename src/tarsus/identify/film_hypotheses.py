"""What else may act on a foot that flies after a detachment: a film of another exponent, an attraction by the volts.

``F = -C g' / (g + g0)^n`` with n = 3 is assumed. About the fit one more unknown of all flights tells which exponent
they show, and how the film moves with it: 2 is the alternative, and where neither has nearly all of the weight draws of
the film hold both. A foot that the volts attract, by ``C_e V^2 / (g + g_e)^2``, leaves the ground against a force that
the film's would have to make up for: one more unknown for each of some g_e.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.fit.verdict import LEVEL
from tarsus.identify.checks import SHIFTED, SURE, with_checks
from tarsus.identify.detachment import Detachments
from tarsus.identify.draws import by_group, newton_draws
from tarsus.identify.film import FilmFit
from tarsus.identify.flight import FILM, PULLS, equations_of
from tarsus.identify.foot import ATTRACTED_AT, BEYOND, FootModel
from tarsus.identify.step import PREFERRED, UNDECIDED, Alternative, Check
from tarsus.solve import Varied

ASSUMED, OTHER = 3.0, 2.0
_NOTHING = 1e-12
"""Part of a first guess of an attraction about which its derivative is taken: a flight is linear in it."""
_HIGHER = "record ramps that lift the foot higher, and lower"
_MOST = 0.8
"""Share of draws with the other exponent at most: the value, which has the assumed one, stays well inside of them."""
_FEWEST = 4
"""Records whose scatter tells how well one more unknown is known."""
_TOLD = 1e12
"""Condition of the scaled information beyond which it is rounding: flights that do not feel an unknown say nothing."""


@dataclass(frozen=True)
class Beside:
    """One more unknown of the flights: value and standard error, as records scatter; moves (2,): of the logarithms of
    C / g0^n and g0 for one unit of it."""

    value: float
    error: float
    moves: Floats

    @property
    def strength(self) -> float:
        """Chi-squared that it takes away."""
        return (self.value / self.error) ** 2

    def shift(self, film: FilmFit) -> float:
        """Standard deviations by which it moves a number of the film at most."""
        drawn = np.log(film.step.samples)
        std = np.array([np.std(drawn[:, 0] - 3.0 * drawn[:, 1]), np.std(drawn[:, 1])])
        return float(np.max(np.abs(self.value * self.moves) / std))


def film_checked(model: FootModel, film: FilmFit, seed: int) -> FilmFit:
    """A film's fit with the checks whether its flights show an attraction by the volts or another exponent, and with
    draws of both exponents where the flights leave them open.

    Parameters
    ----------
    model
        Structure and drive as identified.
    film
        The fit with the exponent three.
    seed
        Of the draws.
    """
    pull = attraction_of(model, film, seed)
    if pull is not None and pull.strength > SURE and pull.shift(film) > SHIFTED:
        return with_attraction(film, pull)  # their film is another than that of the fit
    exponent = exponent_of(model, film, seed)
    return film if exponent is None else with_exponent(film, exponent, seed)


def exponent_of(model: FootModel, film: FilmFit, seed: int) -> Beside | None:
    """The exponent that the flights show; None of few records, or of a film that they do not feel."""
    law = film.fitted.sought.law(model, film.fitted.place)
    with_n = np.array([law.value[0] * np.log(law.value[1]), 0.0, 0.0, 0.0, 1.0])  # with C / g0^n as it is
    found = _beside(film.offs, film, law, with_n, seed)
    return None if found is None else replace(found, value=ASSUMED + found.value)


def attraction_of(model: FootModel, film: FilmFit, seed: int) -> Beside | None:
    """The attraction by the volts that the flights show most of, in hundredths of the force that bends the foot by its
    gap, in contact at `ATTRACTED_AT`; None as above, and of a ground whose law has one."""
    if model.scene.ground.acting.electrostatic is not None:
        return None
    law, offs, found = film.fitted.sought.law(model, film.fitted.place), copy(film.offs), list[Beside]()
    offs.squares = offs.squared()
    for part in BEYOND:
        beyond = part * model.gap
        pull = model.like_attraction(beyond)
        there = replace(law, value=np.array([*law.value[:2], _NOTHING * pull, beyond, law.value[4]]))
        one = _beside(offs, film, there, np.array([0.0, 0.0, pull, 0.0, 0.0]), seed)
        if one is not None and one.value > 0.0:  # none pushes the foot away
            found.append(one)
    return max(found, key=lambda one: one.strength, default=None)


def _beside(offs: Detachments, film: FilmFit, law: Varied, rates: Floats, seed: int) -> Beside | None:
    """One more unknown of the flights of a fit, by which the constants of the forces at the foot (5,) go at these
    rates, with the level of the ground free beside it as far as it is not known."""
    records = [one.trace for one in offs.items]
    if len(set(records)) < _FEWEST:
        return None
    assert law.slopes is not None
    more, unknowns = replace(law, slopes=np.column_stack([law.slopes, rates])), film.fitted.unknowns
    residuals, slopes, _ = offs.flown(unknowns, more)
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
    return Beside(float(whole[-1]), error, -np.linalg.solve(total[:-1, :-1], total[:-1, -1])[:2])


def with_attraction(film: FilmFit, found: Beside) -> FilmFit:
    """A film's fit with the check whether the volts attract the foot."""
    cause = (
        f"the volts attract the foot, by their square, as flights after detachments show: in contact at "
        f"{ATTRACTED_AT:g} V with {found.value:.3g} +- {2.0 * found.error:.1g} % of the force that bends it by its gap"
    )
    check = Check(
        "attraction by the volts, in chi-squared of the flights", found.strength, SURE,
        paths=(*FILM, *PULLS, "ground.restitution.coefficient"), cause=cause,
        record="repeat the ramps at half the volts: an attraction falls to a quarter",
    )  # fmt: skip
    return replace(film, step=with_checks(film.step, (check,)))


def with_exponent(film: FilmFit, found: Beside, seed: int) -> FilmFit:
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


def _of_exponent(found: Beside, apart: float, said: str) -> tuple[Check, Check]:
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
