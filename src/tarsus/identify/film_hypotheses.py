"""Hypotheses of the flights after detachments: another exponent of the film, and an attraction by the volts.

``F = -C g' / (g + g0)^n`` with n = 3 is assumed; 2 is the alternative: one more unknown of the flights, beside each
one's own, C / g0^n and g0. Both exponents are scored on every second record, fitted to the others; where neither has
nearly all of the weight, draws of the film come from both, so that an exponent that is undecided widens what hangs on
it. A foot that the volts attract, by ``C_e V^2 / (g + g_e)^2``, leaves the ground against a force that the film's would
have to make up for: one more unknown for each of some g_e. Where the flights show one, their film is another than that
of the fit, and its exponent is not asked for.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.fit.verdict import LEVEL
from tarsus.identify.checks import SURE, with_checks
from tarsus.identify.detachment import Detachments
from tarsus.identify.draws import by_group
from tarsus.identify.film import FilmFit
from tarsus.identify.flight import FILM, PULLS, equations_of
from tarsus.identify.foot import ATTRACTED_AT, BEYOND, FootModel
from tarsus.identify.one_more import FEWEST, OneMore, one_more
from tarsus.identify.step import PREFERRED, UNDECIDED, Alternative, Check
from tarsus.solve import Varied

_ASSUMED, _OTHER = 3.0, 2.0
_REACH = 2.0
"""How far from the assumed exponent one is still a film's: those of thin films lie from 1 to 3, and the flights' slopes
at 3, which the estimate goes along, say nothing of one much further off."""

_LEAST = 0.2
"""Hundredths of the force that bends the foot by its gap that an attraction must have: 0.04 are left of a sound device
at 80 dB, where noise hides nothing of what flights and drive are off."""
_NOTHING = 1e-12
"""Part of a first guess of an attraction about which its derivative is taken: a flight is linear in it."""


def figure_of(found: OneMore) -> str:
    """The exponent as one more unknown in words: its value where the flights tell one, else why there is none."""
    if found.error > _ASSUMED - _OTHER:
        return f"these flights tell none: its standard error is {found.error:.2g}"
    if abs(found.value - _ASSUMED) > _REACH:
        ends = f"{_ASSUMED - _REACH:g} to {_ASSUMED + _REACH:g}"
        return f"none from {ends} fits, with standard error {found.error:.2g}"
    return f"{found.value:.3g} with standard error {found.error:.2g}"


def with_exponent(film: FilmFit, found: OneMore, seed: int) -> FilmFit:
    """A film's fit with both exponents as alternatives, draws of both where they are undecided, and the check."""
    step, share = film.step, found.weight
    ratio, drawn, unit = step.combinations["C / g0^3"]
    said, fits = figure_of(found), abs(found.value - _ASSUMED) <= max(_REACH, found.error)
    notes = step.notes
    if not found.decided:
        picked = found.picked(len(step.samples), seed)
        thickness = step.samples[:, 1] * np.exp(np.where(picked, found.moves[1], 0.0))
        # of the other law C has another unit; it is drawn as what damps the same at contact
        drawn = drawn * np.exp(np.where(picked, found.moves[0], 0.0))
        step = replace(step, samples=np.column_stack([drawn * thickness**3, thickness]))
        notes = (
            *notes,
            f"The exponent of the film is undecided between 3 and 2 ({said}): its draws hold both.",
        )
    moved = np.log(step.values) + np.array([found.moves[0] + 3.0 * found.moves[1], found.moves[1]])
    changes: dict[str, float] = {path: float(np.exp(one)) for path, one in zip(FILM, moved, strict=True)}
    answers: list[Alternative] = []
    for value, weight, change in ((_ASSUMED, 1.0 - share, dict[str, float]()), (_OTHER, share, changes)):
        word = UNDECIDED if not found.decided else PREFERRED if weight > 0.5 and fits else "contradicted"
        answers.append(
            Alternative("exponent of the film", f"{value:g}", weight, said, value == _ASSUMED, word, change)
        )
    cause = f"the exponent of the film is {_OTHER:g} rather than {_ASSUMED:g} (as one more unknown {said})"
    if not fits:
        cause = f"the flights after detachments are not damped by a film alone: of its exponents {said}"
    # flights under another force than the film's, as on a ground that gives way, tell their first pulls wrong as well
    check = Check(
        "weight of the other exponent of the film",
        share,
        LEVEL,
        paths=(*FILM, *PULLS),
        cause=cause,
        hangs=True,
    )
    step = replace(
        step, combinations={**step.combinations, "C / g0^3": (ratio, drawn, unit)}, notes=notes,
        alternatives=(*step.alternatives, *answers), checks=(*step.checks, check),
    )  # fmt: skip
    return replace(film, step=step)


def film_exponent(model: FootModel, film: FilmFit, seed: int) -> OneMore | None:
    """The exponent that the flights of a film's fit prefer, and how 2 does, moving the logarithms of C / g0^n and g0;
    None of fewer than four records, or of a film that the flights do not feel.

    Parameters
    ----------
    model
        Structure and drive as identified.
    film
        The fit with the exponent three.
    seed
        Of the draws.
    """
    law = film.fitted.sought.law(model, film.fitted.place)
    with_n = np.array([law.value[0] * np.log(law.value[1]), 0.0, 0.0, 0.0, 1.0])  # with C / g0^n as it is
    found = _one_more(film.offs, film, law, with_n, seed, _OTHER - _ASSUMED)
    return None if found is None else replace(found, value=_ASSUMED + found.value)


def film_attraction(model: FootModel, film: FilmFit, seed: int) -> OneMore | None:
    """An attraction by the volts that the flights of a film's fit show most of, in hundredths of the force that bends
    the foot by its gap, in contact at `ATTRACTED_AT`; None as above, and of a ground whose law has one."""
    if model.scene.ground.acting.electrostatic is not None:
        return None
    law, offs = film.fitted.sought.law(model, film.fitted.place), copy(film.offs)
    offs.squares, found = offs.squared(), list[OneMore]()
    for part in BEYOND:
        beyond = part * model.gap
        pull = model.like_attraction(beyond)
        there = replace(law, value=np.array([*law.value[:2], _NOTHING * pull, beyond, law.value[4]]))
        one = _one_more(offs, film, there, np.array([0.0, 0.0, pull, 0.0, 0.0]), seed)
        if one is not None:  # none pushes the foot away
            found.append(one if one.value > _LEAST else replace(one, gain=min(one.gain, 0.0)))
    return max(found, key=lambda one: one.gain, default=None)


def with_attraction(film: FilmFit, found: OneMore) -> FilmFit:
    """A film's fit with the check whether the volts attract the foot, and both answers."""
    size = f"in contact at {ATTRACTED_AT:g} V with {found.value:.3g} +- {2.0 * found.error:.1g} %"
    cause = (
        f"the volts attract the foot, by their square, as flights after detachments show: {size} of the force that "
        "bends it by its gap"
    )
    check = Check(
        "gain of an attraction by the volts, in chi-squared of flights left out", found.gain, SURE,
        paths=(*FILM, *PULLS, "ground.restitution.coefficient"), cause=cause,
    )  # fmt: skip
    told = _both_answers(found) if found.value > _LEAST else ()
    return replace(film, step=with_checks(film.step, (check,), told))


def _both_answers(found: OneMore) -> tuple[Alternative, ...]:
    """The film's force alone and an attraction beside it, where they are weighed against each other at all: each with
    its own weight, and what data left out say of it."""
    if found.decided and found.weight < 0.5:
        return ()
    words = ("", PREFERRED) if found.decided else (UNDECIDED, UNDECIDED)
    names = "the film's alone", "an attraction by the volts as well"
    return tuple(
        Alternative(
            "forces at the flying foot", name, weight, f"chi-squared of records left out "
            f"{'higher' if gain < 0.0 else 'lower'} by {abs(gain):.3g} than with the other", used, word,
        )
        for name, weight, gain, used, word in zip(
            names, (1.0 - found.weight, found.weight), (-found.gain, found.gain), (True, False), words, strict=True
        )
    )  # fmt: skip


def _one_more(
    offs: Detachments, film: FilmFit, law: Varied, rates: Floats, seed: int, value: float | None = None
) -> OneMore | None:
    """One more unknown of the flights of a fit, by which the constants of the forces at the foot (5,) go at these
    rates, with the level of the ground free beside it as far as it is not known."""
    records = [one.trace for one in offs.items]
    if len(set(records)) < FEWEST:
        return None
    assert law.slopes is not None
    more, unknowns = replace(law, slopes=np.column_stack([law.slopes, rates])), film.fitted.unknowns
    residuals, slopes, _ = offs.flown(unknowns, more)
    shift = np.append(
        offs.model.rest(offs.level + film.unsure) - offs.model.rest(offs.level),
        np.zeros(len(offs.model.points)),
    )
    rows = [
        np.insert(by, -1, np.repeat(-shift / noise, left.shape[1]), axis=0)
        for by, left, noise in zip(slopes, residuals, offs.noise, strict=True)
    ]
    information, score = by_group(records, *equations_of(residuals, rows, unknowns.shape[1]).reduced())
    information[:, -2, -2] += 1.0 / len(information)  # the level is known to a standard error, its unit
    return one_more(information, score, seed, value)
