"""Ring-down after detachment -> the film's C and g0.

Fitted to the flights of `tarsus.identify.detachment` with ``F = -C g' / (g + g0)^3`` (2.10 with the sign of E2). What
the decay near the ground tells best is ``C / g0^3`` [N s/m], the damping at contact; C and g0 alone hang together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.identify.detachment import (
    PRIOR,
    WORST,
    Detachments,
    FilmGuess,
    FittedDetachments,
    find_detachments,
    weak,
)
from tarsus.identify.draws import DRAWS, by_group, carried, newton_draws
from tarsus.identify.estimates import PLACEHOLDER, Estimates
from tarsus.identify.foot import FootModel
from tarsus.identify.step import Panel, Residual, StepResult, Used, measured_and_fitted, over_noise
from tarsus.identify.traces import Trace
from tarsus.records.excluded import Excluded, Exclusion, enough, evenly

PATHS = ("ground.film.coefficient", "ground.film.thickness")
MOST = 120
"""Flights that are fitted at most, evenly from all."""
_SHOWN = 4
"""Flights that the report shows, evenly from all."""
_ROUGH = 4.0
"""Times the worst or the usual misfit that a flight may have under the first guess of the film, which is off
itself."""


@dataclass(frozen=True)
class FilmFit:
    """The step's result; name of the foot's point; the detachments it used, as fitted; and draws of their pulls
    about the fitted ones: what the film and earlier steps do not know (draws, nr)."""

    step: StepResult
    foot: str
    offs: Detachments
    fitted: FittedDetachments
    pulls: Floats


def identify_film(
    model: FootModel,
    known: Estimates,
    traces: Sequence[Trace],
    level: float,
    seed: int,
    near: FilmFit | None = None,
) -> FilmFit:
    """Film coefficient and thickness, with C / g0^3.

    Parameters
    ----------
    model
        Structure and drive as identified.
    known
        What earlier steps found, with draws.
    traces
        Records of ramped squares.
    level
        Contact level from the rest [m].
    seed
        Of the draws.
    near
        A fit of the same records to a device not far from this one, to start from; what it left out stays out.

    Raises
    ------
    InputError
        If no detachment can be used.
    """
    if near is not None:
        fitted = near.offs.fit(model, near.fitted.film, start=near.fitted.unknowns, about=_first_guess(model))
        step, pulls = _result(model, known, near.offs, fitted, seed)
        return FilmFit(step, model.foot_point, near.offs, fitted, pulls)
    items, left = find_detachments(traces, model.foot_point, level)
    found = len(items) + len(left)
    if not items:
        files = ", ".join(sorted({trace.file for trace in traces}))
        raise InputError(
            f"{files}: channel '{model.foot_point}' shows no detachment with a free flight after it"
        )
    items, others = enough(items, MOST, "detachments", "all records of ramped squares", model.foot_point)
    left += others
    offs = Detachments(traces, items, level)
    rough = offs.fit(model, _first_guess(model), fixed=True)
    near_enough = rough.chi < max(_ROUGH * WORST, _ROUGH * float(np.median(rough.chi)))
    first = offs.chosen(near_enough).fit(model, rough.film, start=rough.unknowns[near_enough])
    whole = offs.fit(model, first.film, fixed=True)
    good = whole.chi < WORST
    if not good.any():
        raise InputError(
            "no flight after a detachment is a free motion of this structure: are sampling rate, channels and zero "
            "right?"
        )
    for r in np.flatnonzero(~good):
        trace = traces[items[int(r)].trace]
        at = trace.time[items[int(r)].hold.last]
        text = (
            f"the flight after the release at {at:.5g} s is no free motion of this structure (chi-squared "
            f"{whole.chi[r]:.3g})"
        )
        left.append(Excluded(trace.file, model.foot_point, text, kind=Exclusion.UNLIKE))
    offs = offs.chosen(good)
    fitted = offs.fit(model, whole.film, start=whole.unknowns[good], about=_first_guess(model))
    step, pulls = _result(model, known, offs, fitted, seed)
    used = Used("detachments", len(offs.items), found)
    step = replace(step, left_out=tuple(left), used=(used,))
    return FilmFit(step, model.foot_point, offs, fitted, pulls)


def wide_film(model: FootModel, seed: int) -> StepResult:
    """The film as an unknown that no record tells: draws as wide as what keeps fits of it from running away, about what
    the device file knows of it, or about a film that damps as much as the structure where that is a placeholder."""
    film, guess = model.scene.ground.acting.film, _first_guess(model)
    origin = model.scene.origin(PATHS[0])
    if film is not None and (origin is None or origin.note != PLACEHOLDER):
        guess = FilmGuess.of(film.coefficient, film.thickness)
    logs = np.random.default_rng([seed, 31]).standard_normal((DRAWS, 2)) * PRIOR
    thickness = np.exp(guess.thickness + logs[:, 1])
    samples = np.column_stack([np.exp(guess.stiffness + logs[:, 0]) * thickness**3, thickness])
    values = np.array([guess.film.coefficient, guess.film.thickness])
    stiffness = float(np.exp(guess.stiffness))
    return StepResult(
        "film", PATHS, values, samples, taken=PATHS,
        combinations={"C / g0^3": (stiffness, samples[:, 0] / thickness**3, "N s/m")},
    )  # fmt: skip


def _first_guess(model: FootModel) -> FilmGuess:
    """A film that damps the foot as much as the structure's first mode does, half a gap thick."""
    return FilmGuess(float(np.log(model.like_damping)), float(np.log(0.5 * model.gap)))


def _result(
    model: FootModel, known: Estimates, offs: Detachments, fitted: FittedDetachments, seed: int
) -> tuple[StepResult, Floats]:
    information, score = by_group([one.trace for one in offs.items], fitted.information, fitted.score)
    own = newton_draws(information, score, seed, weak())
    centre, about = np.array([fitted.film.stiffness, fitted.film.thickness]), _first_guess(model)

    def again(values: Floats) -> Floats:
        film, pulls = offs.moved(known.model(values), fitted, about)
        return np.concatenate([film, pulls])

    from_before = carried(again, known.values, known.samples)
    logs = centre + own + from_before[:, :2]
    pulls = from_before[:, 2:] + own @ fitted.by_film.T
    film = fitted.film.film
    thickness = np.exp(logs[:, 1])
    stiffness = np.exp(logs[:, 0])
    samples = np.column_stack([stiffness * thickness**3, thickness])
    values = np.array([float(np.asarray(film.coefficient)), float(np.asarray(film.thickness))])
    ratio = float(np.exp(fitted.film.stiffness))

    step = StepResult(
        "film",
        PATHS,
        values,
        samples,
        combinations={"C / g0^3": (ratio, stiffness, "N s/m")},
        residuals=_residuals(offs, fitted),
        panels=_panels(model, offs, fitted),
        files=offs.files,
    )
    return step, pulls


def _residuals(offs: Detachments, fitted: FittedDetachments) -> tuple[Residual, ...]:
    by_record: dict[int, list[Floats]] = {}
    for one, left in zip(offs.items, fitted.residuals, strict=True):
        by_record.setdefault(one.trace, []).append(left.ravel())
    return tuple(
        over_noise(offs.traces[number].file, np.concatenate(left))
        for number, left in sorted(by_record.items())
    )


def _panels(model: FootModel, offs: Detachments, fitted: FittedDetachments) -> tuple[Panel, ...]:
    k = model.points.index(model.foot_point)
    panels = []
    for r in evenly(range(len(offs.items)), _SHOWN):
        one = offs.items[r]
        trace = offs.traces[one.trace]
        part = slice(one.first, one.first + one.after)
        time = trace.time[part] - trace.time[one.first] + fitted.unknowns[r, 0]
        gap = model.normal * fitted.flights[r][k] + model.gap
        left = model.normal * fitted.residuals[r][k] * trace.noise_x[k]
        title = f"{trace.file}, release at {trace.time[one.hold.last]:.4g} s"
        panels.append(measured_and_fitted(title, ("time after detachment", "s", "gap", "m"), time, gap, left))
    return tuple(panels)
