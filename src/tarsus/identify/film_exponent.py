"""The exponent of the film as a hypothesis of the flights after detachments.

``F = -C g' / (g + g0)^n`` with n = 3 is assumed; 2 is the alternative. About the fitted flights the trace of the
exponent is that of a force ``C g' log((g + g0) / g0) / (g + g0)^3`` on the foot, under the fitted film: one more column
beside each flight's own unknowns, C / g0^n and g0. Both exponents are scored on every second record, fitted to the
others; where neither has nearly all of the weight, draws of the film come from both, so that an exponent that is
undecided widens what hangs on it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.fit.verdict import LEVEL
from tarsus.identify.adhesion import PATHS as PULLS
from tarsus.identify.detachment import Released
from tarsus.identify.draws import by_group
from tarsus.identify.film import PATHS, FilmFit
from tarsus.identify.flight import SUBSTEPS, equations_of
from tarsus.identify.foot import FootModel
from tarsus.identify.one_more import FEWEST, OneMore, one_more
from tarsus.identify.step import PREFERRED, UNDECIDED, Alternative, Check

_ASSUMED, _OTHER = 3.0, 2.0


def with_exponent(film: FilmFit, found: OneMore, seed: int) -> FilmFit:
    """A film's fit with both exponents as alternatives, draws of both where they are undecided, and the check."""
    step, share = film.step, found.weight
    ratio, drawn, unit = step.combinations["C / g0^3"]
    said = f"{found.value:.3g} with standard error {found.error:.2g}"
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
    changes: dict[str, float] = {path: float(np.exp(one)) for path, one in zip(PATHS, moved, strict=True)}
    answers: list[Alternative] = []
    for value, weight, change in ((_ASSUMED, 1.0 - share, dict[str, float]()), (_OTHER, share, changes)):
        word = UNDECIDED if not found.decided else PREFERRED if weight > 0.5 else "contradicted"
        answers.append(
            Alternative("exponent of the film", f"{value:g}", weight, said, value == _ASSUMED, word, change)
        )
    cause = f"the exponent of the film is {_OTHER:g} rather than {_ASSUMED:g} (as one more unknown {said})"
    # flights under another force than the film's, as on a ground that gives way, tell their first pulls wrong as well
    check = Check(
        "weight of the other exponent of the film", share, LEVEL, paths=(*PATHS, *PULLS), cause=cause
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
    records = [one.trace for one in film.offs.items]
    if len(set(records)) < FEWEST:
        return None
    released, guess = Released(film.offs, model), film.fitted.film
    residuals, slopes, _ = released.flown(film.fitted.unknowns, guess.law)
    whole = [np.vstack([one, trace]) for one, trace in zip(slopes, _traces(released, film), strict=True)]
    system = equations_of(residuals, whole, film.fitted.unknowns.shape[1])
    information, score = by_group(records, *system.reduced())
    found = one_more(information, score, seed, _OTHER - _ASSUMED)
    return None if found is None else replace(found, value=_ASSUMED + found.value)


def _traces(released: Released, film: FilmFit) -> list[Floats]:
    """What a larger exponent, with C / g0^n as it is, changes of every flight's samples (channels times samples), over
    the noise."""
    (flow,), model, (counts,) = released.flows, released.model, released.counts
    n, many, substeps, constants = len(model.mass), len(counts), SUBSTEPS, film.fitted.film.film
    launches = released.launches(film.fitted.unknowns, constants.law(), np.arange(many))
    steps = substeps * (counts - 1) + 1
    every, _ = flow.fly(launches, released.drive[0], steps, np.eye(2 * n), every=1)
    ends, longest = np.cumsum(steps), int(steps.max())
    state = np.zeros((longest, many, 2 * n))
    for r, (end, count) in enumerate(zip(ends, steps, strict=True)):
        state[:count, r] = every[end - count : end]
    gap, rate = model.gap + state[..., :n] @ model.row, state[..., n:] @ model.row
    g0 = constants.thickness
    close = constants.coefficient / g0**3 * (g0 / np.maximum(gap + g0, 0.1 * g0)) ** 3
    push = close * rate * np.log(np.maximum(1.0 + gap / g0, 0.1))
    by_gap, by_rate = 3.0 * close * rate / np.maximum(gap + g0, 0.1 * g0), -close
    z, out, before = np.zeros((many, 2 * n)), np.zeros((longest, many, 2 * n)), push[0]
    for k in range(1, longest):
        free, after = z @ flow.free.T + np.outer(before, flow.first[:, 1]), before
        for _ in range(2):
            new = free + np.outer(after, flow.last[:, 1])
            after = push[k] + by_gap[k] * (new[:, :n] @ model.row) + by_rate[k] * (new[:, n:] @ model.row)
        z, before = free + np.outer(after, flow.last[:, 1]), after
        out[k] = z
    seen = out[::substeps] @ released.output.T
    return [
        (seen[:count, r] / white).T.ravel()
        for r, (count, white) in enumerate(zip(counts.tolist(), released.noise, strict=True))
    ]
