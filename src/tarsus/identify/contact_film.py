"""The film at contact, determined by impacts where the records above the ground leave it open.

Records without contact determine ``C / (g + g0)^3`` at their gaps. At the ground a thin film is stronger by orders, and
the velocities there, and thus the restitution, depend on it. The flights before and after an impact show it: all
impacts together inform about the logarithms of C and g0, with the zeros of the displacements, which bend the flights
near the ground alike, as further unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Floats
from tarsus.fit.normal_equations import Descent, NormalEquations, descend
from tarsus.identify.bounce import BounceFit, Bounces, find_bounces, known_offsets
from tarsus.identify.estimates import Estimates
from tarsus.identify.flight import FILM, WORST, FlightParameters
from tarsus.identify.restitution import FEWEST, MOST, sound
from tarsus.identify.step import StepResult, Used
from tarsus.identify.traces import Trace
from tarsus.records.excluded import evenly

_SHARES = (0.0, -1.0, 1.0, -2.0, 2.0)
"""Places tried first, in standard deviations: 95 % of what was known."""
_DESCENT = Descent(rounds=12, settled=0.1, far=1.0)
"""Beyond a factor of e of the film's numbers the impacts are not linear in them; a tenth of a standard error no longer
matters, for the interval is that wide."""


def film_by_impacts(
    known: Estimates, step: StepResult, traces: Sequence[Trace], close: Sequence[Trace], level: tuple[float, float]
) -> tuple[Estimates, StepResult]:
    """The film of a step that saw it from above, with what impacts say; all that depends on it moves with it.

    Parameters
    ----------
    known
        What was found so far, the step's numbers among it.
    step
        Of records close to the ground. Where it did not look for the film, or there are too few impacts, nothing
        changes.
    traces
        Records of bounces.
    close
        The step's own records.
    level
        Contact level from the rest, and its standard error [m].
    """
    if FILM[0] not in step.paths:
        return known, step
    found = find_bounces(traces, known.base.foot_point, level[0])[0]
    if len(found) < FEWEST:
        return known, _unchanged(step, f"{len(found)} can be used, {FEWEST} are needed")
    bounces = Bounces(traces, evenly(found, MOST), level[0], known.model())
    seen = np.log(np.column_stack([step.draws(path) for path in FILM]))
    covariance = np.cov(seen.T)
    information = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
    parameters = FlightParameters(FILM, np.eye(2), np.log([step.value(path) for path in FILM]), information)
    begun, passed = _begun(bounces, parameters, covariance)
    if begun is None:
        return known, _unchanged(step, f"under none of {len(_SHARES)} films could the flights be followed ({passed})")
    place, fitted = begun
    bounces = bounces.by(bounces.model.changed(dict(zip(FILM, np.exp(place).tolist(), strict=True))))
    good = sound(bounces, fitted).like
    if np.count_nonzero(good) < FEWEST:
        text = f"{np.count_nonzero(good)} of {len(good)} are single ones between free motions, {FEWEST} are needed"
        return known, _unchanged(step, text)
    bounces = bounces.chosen(good)
    place, more = _determined(bounces, parameters, place, fitted.unknowns[good], level[1])
    spread = np.linalg.inv(more + information)
    narrower = np.linalg.cholesky(spread) @ np.linalg.inv(np.linalg.cholesky(covariance))
    new = place + (seen - parameters.centre) @ narrower.T
    moved = _moved(known, seen, covariance, new, place - parameters.centre)
    if passed:
        text = f"Of {len(_SHARES)} films tried first, some let no flight be followed to the ground: {passed}."
        step = replace(step, notes=(*step.notes, text))
    used = Used("impacts, for the film", int(good.sum()), len(found))
    return moved, _with(step, moved, close, used, bounces.files())


def _unchanged(step: StepResult, why: str) -> StepResult:
    """The step as it was, and why impacts show nothing of its film."""
    return replace(step, notes=(*step.notes, f"The impacts do not determine the film: {why}."))


def _begun(
    bounces: Bounces, parameters: FlightParameters, covariance: Floats
) -> tuple[tuple[Floats, BounceFit] | None, str]:
    """Of the earlier logarithms (2,) of the film and places up to two deviations to either side of them, the way they
    are known worst, the one that leaves least of the impacts, and these as fitted there; None where no fit ends. And
    which places were passed over, in words.

    Under a film that is far too strong flights cannot be followed back to the ground at all: they overflow there, and
    that is counted by what is left of them."""
    strength, ways = np.linalg.eigh(covariance)
    best: tuple[float, Floats, BounceFit] | None = None
    passed: list[str] = []
    for share in _SHARES:
        place = parameters.centre + share * float(np.sqrt(strength[-1])) * ways[:, -1]
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                fitted = bounces.fit(parameters.law(bounces.model, place).value)
        except np.linalg.LinAlgError as error:
            passed.append(f"C = {np.exp(place[0]):.3g} N m^2 s, g0 = {np.exp(place[1]):.3g} m: {error}")
            continue
        left = float(np.minimum(np.nan_to_num(fitted.chi, nan=WORST), WORST).mean())
        if best is None or left < best[0]:
            best = left, place, fitted
    return None if best is None else best[1:], "; ".join(passed)


def _moved(known: Estimates, seen: Floats, covariance: Floats, new: Floats, by: Floats) -> Estimates:
    """What was found before with the film's logarithms moved from draws (draws, 2) to new ones, the values ``by`` (2,):
    all that goes with them by their draws follows; constants of the ground as logarithms, which their draws are even
    in."""
    factors = np.array([path.startswith("ground.") for path in known.paths])

    def even(numbers: Floats) -> Floats:
        return np.where(factors, np.log(np.where(factors, numbers, 1.0)), numbers)

    def back(numbers: Floats) -> Floats:
        return np.where(factors, np.exp(np.where(factors, numbers, 0.0)), numbers)

    drawn, value = even(known.samples), even(known.values)
    columns = [known.paths.index(path) for path in FILM]
    off = drawn - drawn.mean(axis=0)
    along = (off.T @ (seen - seen.mean(axis=0)) / (len(seen) - 1)) @ np.linalg.inv(covariance)
    along[columns] = np.eye(len(columns))
    samples = drawn + (new - seen) @ along.T
    samples[:, columns] = new
    return replace(known, values=back(value + along @ by), samples=back(samples))


def _determined(
    bounces: Bounces, parameters: FlightParameters, place: Floats, unknowns: Floats, level_error: float
) -> tuple[Floats, Floats]:
    """The film's logarithms (2,) that impacts and what was known before give, and the information (2, 2) of the impacts
    about them; from a place (2,) with the unknowns of the impacts there.

    Under every film the impacts are fitted again: their unknowns follow it along curved valleys, in which all taken
    together creep."""
    offsets = known_offsets(bounces, level_error)

    def equations(_: Floats, shared: Floats, __: NDArray[np.intp]) -> NormalEquations:
        nonlocal unknowns
        law = parameters.law(bounces.model, shared)
        unknowns = bounces.fit(law.value, unknowns).unknowns
        return bounces.about(law, unknowns).gathered(len(shared), offsets).eliminated()

    prior = parameters.centre, parameters.information
    found = descend(equations, np.zeros((1, 0)), place, prior=prior, how=_DESCENT)
    return found.shared, found.equations.shared[0]


def _with(step: StepResult, moved: Estimates, close: Sequence[Trace], used: Used, files: frozenset[str]) -> StepResult:
    """The step with the numbers that it and the impacts determine together."""
    own = [moved.paths.index(path) for path in step.paths]
    values, samples = moved.values[own], moved.samples[:, own]
    parameters = FlightParameters(step.paths, np.eye(len(values)), np.log(values), np.eye(len(values)))
    gap = min((t.gap for t in close if t.gap is not None and t.file in step.files), default=0.0)
    return replace(
        step,
        values=values,
        samples=samples,
        combinations=parameters.combinations(gap, parameters.centre, np.log(samples)),
        used=(*step.used, used),
        files=step.files | files,
    )
