"""The exponent of the film as a hypothesis of the flights after detachments.

``F = -C g' / (g + g0)^n`` with n = 3 is assumed; 2 is the alternative. About the fitted flights the trace of the
exponent is that of a force ``C g' log((g + g0) / g0) / (g + g0)^3`` on the foot, under the fitted film: one more column
beside each flight's own unknowns, C / g0^n and g0. Both exponents are scored on every second record, fitted to the
others; where neither has nearly all of the weight, draws of the film come from both, so that an exponent that is
undecided widens what hangs on it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tarsus.fit.verdict import LEVEL
from tarsus.identify.detachment import Released
from tarsus.identify.draws import newton_draws
from tarsus.identify.film import FilmFit
from tarsus.identify.flight import SUBSTEPS, equations_of
from tarsus.identify.foot import FootModel
from tarsus.identify.step import PREFERRED, UNDECIDED, Alternative, Check

Floats = NDArray[np.float64]

_ASSUMED, _OTHER = 3.0, 2.0
_TOLD = 1e12
"""Condition of the scaled information about film and exponent beyond which it is rounding: a film too weak to be felt
tells no exponent."""
PATHS = ("ground.film.coefficient", "ground.film.thickness")
_PULLS = ("ground.adhesion.initial", "ground.adhesion.rate")
"""What comes of the pulls at which the same flights begin: flights under another force than the film's tell them wrong
as well, as on a ground that gives way."""


@dataclass(frozen=True)
class Exponent:
    """value and error of the exponent as one more unknown; gain: of the other exponent, in chi-squared of records left
    out; moves (2,): of the logarithms of C / g0^n and g0 with that exponent."""

    value: float
    error: float
    gain: float
    moves: Floats

    @property
    def weight(self) -> float:
        """Share of the other exponent."""
        return float(1.0 / (1.0 + np.exp(-0.5 * np.clip(self.gain, -700.0, 700.0))))


def with_exponent(film: FilmFit, found: Exponent, seed: int) -> FilmFit:
    """A film's fit with both exponents as alternatives, draws of both where they are undecided, and the check."""
    step, share = film.step, found.weight
    decided = max(share, 1.0 - share) >= LEVEL
    ratio, drawn, unit = step.combinations["C / g0^3"]
    said = f"{found.value:.3g} with standard error {found.error:.2g}"
    notes = step.notes
    if not decided:
        picked = np.random.default_rng([seed, 23]).random(len(step.samples)) < share
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
        word = UNDECIDED if not decided else PREFERRED if weight > 0.5 else "contradicted"
        answers.append(
            Alternative("exponent of the film", f"{value:g}", weight, said, value == _ASSUMED, word, change)
        )
    cause = f"the exponent of the film is {_OTHER:g} rather than {_ASSUMED:g} (as one more unknown {said})"
    check = Check(
        "weight of the other exponent of the film", share, LEVEL, paths=(*PATHS, *_PULLS), cause=cause
    )
    step = replace(
        step, combinations={**step.combinations, "C / g0^3": (ratio, drawn, unit)}, notes=notes,
        alternatives=(*step.alternatives, *answers), checks=(*step.checks, check),
    )  # fmt: skip
    return replace(film, step=step)


def film_exponent(model: FootModel, film: FilmFit, seed: int) -> Exponent | None:
    """The exponent that the flights of a film's fit prefer, and how 2 does; None of fewer than four
    records, or of a film that the flights do not feel.

    Parameters
    ----------
    model
        Structure and drive as identified.
    film
        The fit with the exponent three.
    seed
        Of the draws.
    """
    records = np.array([one.trace for one in film.offs.items])
    numbers = np.unique(records)
    if len(numbers) < 4:
        return None
    released, guess = Released(film.offs, model), film.fitted.film
    residuals, slopes, _ = released.flown(film.fitted.unknowns, guess.law)
    whole = [np.vstack([one, trace]) for one, trace in zip(slopes, _traces(released, film), strict=True)]
    system = equations_of(residuals, whole, film.fitted.unknowns.shape[1])
    each, right = system.reduced()
    information = np.array([each[records == k].sum(axis=0) for k in numbers])
    score = np.array([right[records == k].sum(axis=0) for k in numbers])
    total = information.sum(axis=0)
    size = np.sqrt(np.diag(total))
    if not size.all() or np.linalg.cond(total / np.outer(size, size)) > _TOLD:
        return None
    step = np.linalg.solve(total, score.sum(axis=0))
    error = float(np.std(newton_draws(information, score, seed)[:, 2]))
    move = _OTHER - _ASSUMED
    moves = -np.linalg.solve(total[:2, :2], total[:2, 2]) * move
    gain = 0.0
    for h in (0, 1):
        seen, unseen = (np.arange(len(numbers)) % 2 == k for k in (h, 1 - h))
        for sign, by in ((1.0, move), (-1.0, 0.0)):
            a, s = information[seen].sum(axis=0), score[seen].sum(axis=0)
            own = np.append(np.linalg.solve(a[:2, :2], s[:2] - a[:2, 2] * by), by)
            gain += sign * float(
                2.0 * own @ score[unseen].sum(axis=0) - own @ information[unseen].sum(axis=0) @ own
            )
    # records whose residuals hang together count for less, as the scatter of their scores says
    scale = max(error**2 / float(np.linalg.inv(total)[2, 2]), 1.0)
    return Exponent(_ASSUMED + float(step[2]), error, gain / scale, moves)


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
