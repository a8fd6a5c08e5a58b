"""Ring-down after detachment -> the film's C and g0.

Fitted to the flights of `tarsus.identify.detachment` with ``F = -C g' / (g + g0)^3`` (2.10 with the sign of E2). The
decay near the ground determines ``C / g0^3`` [N s/m], the damping at contact, best; C and g0 alone are correlated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.identify.detachment import JOINT, Detachments, Pulls, find_detachments
from tarsus.identify.draws import drawn_level
from tarsus.identify.estimates import PLACEHOLDER, Estimates
from tarsus.identify.flight import FILM, WORST, FlightFit, FlightParameters, FlightProblem
from tarsus.identify.foot import FootModel
from tarsus.identify.step import StepResult, Used
from tarsus.identify.traces import Trace
from tarsus.records.excluded import Excluded, enough, evenly

MOST = 120
"""Flights that are fitted at most, evenly from all."""
_SHOWN = 4
"""Flights that the report shows, evenly from all."""
_ROUGH = 4.0
"""Times the worst or the usual misfit that a flight may have under the first guess of the film, which is off
itself."""
PRIOR = (3.0, 2.0)
"""Standard deviations of log C/g0^3 and log g0 about the first guess, which only keep a fit from running away."""
ASIDE = 4.0
"""Standard errors along the direction in which C and g0 are correlated, to both sides, from which a fit starts again:
flights whose moments are unknowns themselves leave valleys next to the lowest (of 150 devices two ended in one, 3.5 and
6.3 standard errors away)."""
AGAIN = 6
"""Times that such neighbours are looked for at most."""
_LIMITS = (1e-8, 1e-2)
"""Film thicknesses [m] that flights feel."""


@dataclass(frozen=True)
class FilmFit:
    """The step's result; the detachments it used, as fitted, with their pulls; draws of these about the fitted ones:
    what the film and earlier steps do not know (draws, nr); and the standard error of the level [m]."""

    step: StepResult
    offs: Detachments
    fitted: FlightFit
    pulls: Pulls
    drawn: Floats
    unsure: float


def identify_film(
    model: FootModel,
    known: Estimates,
    traces: Sequence[Trace],
    level: tuple[float, float],
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
        Contact level from the rest [m], with its standard error.
    seed
        Of the draws; those of the level are of the one before, which are those that the drive's law is drawn over.
    near
        A fit of nearly these records to a device not far from this one, to start from; what it left out stays out.

    Raises
    ------
    InputError
        If no detachment can be used.
    """
    parameters = film_parameters(model)
    if near is not None:
        offs, kept = near.offs.among(traces, level[0], model)
        begun = near.fitted.unknowns[kept]
        return _found(offs, offs.together(begun, parameters, near.fitted.place, JOINT), known, level[1], seed)
    items, left = find_detachments(traces, model.foot_point, level[0])
    found = len(items) + len(left)
    if not items:
        files = ", ".join(sorted({trace.file for trace in traces}))
        raise InputError(f"{files}: channel '{model.foot_point}' shows no detachment with a free flight after it")
    items, others = enough(items, MOST, "detachments", "all records of ramped squares", model.foot_point)
    left += others
    offs = Detachments(traces, items, level[0], model)
    rough = offs.under(parameters, parameters.centre)
    near_enough = rough.chi < max(_ROUGH * WORST, _ROUGH * float(np.median(rough.chi)))
    first = offs.chosen(near_enough).together(rough.unknowns[near_enough], parameters, parameters.centre, JOINT)
    whole = offs.under(parameters, first.place)
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
        left.append(Excluded(trace.file, model.foot_point, text))
    offs = offs.chosen(good)
    fitted = _lowest(offs.together(whole.unknowns[good], parameters, whole.place, JOINT))
    film = _found(offs, fitted, known, level[1], seed)
    used = Used("detachments", len(offs.items), found)
    return replace(film, step=replace(film.step, left_out=tuple(left), used=(used,)))


def film_parameters(model: FootModel) -> FlightParameters:
    """The film by the logarithms of C / g0^3 and g0, about one that damps the foot as much as the structure's first
    mode does, half a gap thick; on a ground without a film nothing is fitted."""
    if model.scene.ground.acting.film is None:
        return FlightParameters((), np.zeros((0, 0)), np.zeros(0), np.zeros((0, 0)))
    low, high = np.log(_LIMITS)
    return FlightParameters(
        FILM,
        np.array([[1.0, 3.0], [0.0, 1.0]]),
        np.log([model.like_damping, 0.5 * model.gap]),
        np.diag(np.array(PRIOR) ** -2.0),
        np.array([-np.inf, low]),
        np.array([np.inf, high]),
    )


def wide_film(model: FootModel, seed: int) -> StepResult:
    """The film as an unknown that no record shows, about what the device file knows of it, or about the first guess
    where that is a placeholder."""
    film, parameters = model.scene.ground.acting.film, film_parameters(model)
    origin = model.scene.origin(FILM[0])
    if film is not None and (origin is None or origin.note != PLACEHOLDER):
        about = np.log([film.coefficient / film.thickness**3, film.thickness])
        parameters = replace(parameters, centre=about)
    return parameters.wide("film", seed)


def _lowest(fitted: FlightFit) -> FlightFit:
    """The fit, or a lower one that is reached by way of the lower of its two neighbours."""
    for _ in range(AGAIN if fitted.parameters.names else 0):
        size, axes = np.linalg.eigh(fitted.system.reduced()[0].sum(axis=0) + fitted.parameters.information)
        aside = ASIDE * axes[:, 0] / np.sqrt(size[0])
        neighbours = (
            fitted.problem.together(fitted.unknowns, fitted.parameters, fitted.place + by * aside, JOINT)
            for by in (1.0, -1.0)
        )
        other = min(neighbours, key=lambda one: float(one.system.cost.sum()))
        gain = float(fitted.system.cost.sum() - other.system.cost.sum())
        if gain > 0.0:
            fitted = other
        if gain < 1.0:  # of one standard error, which moves nothing that anybody reads
            break
    return fitted


def _found(offs: Detachments, fitted: FlightFit, known: Estimates, unsure: float, seed: int) -> FilmFit:
    def pulls_at(there: FlightProblem, unknowns: Floats) -> Floats:
        assert isinstance(there, Detachments)
        return there.pulls(unknowns)[0]

    pulls = offs.pulls_of(fitted)
    level = drawn_level((offs.level, unsure), seed - 1)
    own, before = fitted.drawn(known, level, seed, pulls_at)
    panels = tuple(
        fitted.panel(
            r,
            f"{trace.file}, release at {trace.time[one.hold.last]:.4g} s",
            "time after detachment",
            trace.time[one.first] - fitted.unknowns[r, 0],
        )
        for r in evenly(range(len(offs.items)), _SHOWN)
        for one in (offs.items[r],)
        for trace in (offs.traces[one.trace],)
    )
    count = len(fitted.place)
    step = fitted.step("film", fitted.place + own + before[:, :count], 0.0, panels)
    return FilmFit(step, offs, fitted, pulls, before[:, count:] + own @ pulls.by_film.T, unsure)
