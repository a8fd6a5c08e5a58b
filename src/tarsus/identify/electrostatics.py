"""Records close to the ground, without contact -> electrostatics and film.

From rest on, the structure moves under the drive's force, the film's ``-C g' / (g + g0)^3`` (3.26) and, where the
foot has an electrode, the attraction ``-C_e V^2 / (g + g_e)^2`` (3.25). Whole records at several gaps and voltages
are fitted together by the logarithms of the constants. Near one gap only ``C / (g + g0)^3`` and ``C_e / (g +
g_e)^2`` are seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.fit.normal_equations import Descent, NormalEquations, descend
from tarsus.identify.draws import DRAWS, carried, newton_draws
from tarsus.identify.estimates import Estimates
from tarsus.identify.flight import (
    SUBSTEPS,
    FlightSide,
    FlownStretches,
    Moment,
    Stretches,
    Varied,
    equations_of,
)
from tarsus.identify.foot import FootModel
from tarsus.identify.step import Panel, StepResult, Used, measured_and_fitted, over_noise
from tarsus.identify.traces import Trace
from tarsus.identify.volts import Volts
from tarsus.records.excluded import Excluded, evenly

FILM = ("ground.film.coefficient", "ground.film.thickness")
ATTRACTION = ("ground.electrostatic.coefficient", "ground.electrostatic.offset")

LONGEST = 0.1
"""Time [s] of a record that is fitted, from the beginning of the drive."""

_CLOSEST = 0.05
"""Part of the gap below which a foot counts as having touched."""
_SPREAD = 2.3
"""Standard deviation of the logarithms about the first guess, a factor of ten, which keeps a fit from running
away."""
_DESCENT = Descent(rounds=25, far=1.0)
"""Beyond a factor of e the motion is not linear in the constants."""
_SHOWN = 4
"""Records that the report shows, evenly from all."""


@dataclass(frozen=True)
class _Close:
    """Records close to the ground, ready to be fitted with any model.

    names (p,) of the constants; centre (p,): logarithms of the first guess.
    """

    traces: tuple[Trace, ...]
    volts: tuple[Volts, ...]
    first: tuple[int, ...]
    counts: tuple[int, ...]
    names: tuple[str, ...]
    centre: Floats

    def film(self, theta: Floats, model: FootModel) -> Varied:
        """Constants (4,) for logarithms (p,), with derivatives by those; what is not fitted is the model's."""
        own = dict(zip(self.names, np.exp(np.clip(theta, *_LIMITS)).tolist(), strict=True))
        ground = model.scene.ground.acting
        known = {FILM[0]: 0.0, FILM[1]: 1.0, ATTRACTION[0]: 0.0, ATTRACTION[1]: 1.0}
        if ground.film is not None:
            known |= {FILM[0]: ground.film.coefficient, FILM[1]: ground.film.thickness}
        if ground.electrostatic is not None:
            known |= {
                ATTRACTION[0]: ground.electrostatic.coefficient,
                ATTRACTION[1]: ground.electrostatic.offset,
            }
        every = (*FILM, *ATTRACTION)
        value = np.array([own.get(name, known[name]) for name in every])
        slopes = [[float(one == name) for name in self.names] for one in every]
        return Varied(value, value[:, None] * np.array(slopes))

    def flown(self, model: FootModel, theta: Floats) -> tuple[list[Floats], list[Floats], list[Floats]]:
        """By record: what the motion leaves over the noise (channels, samples), slopes (p, n), and the motion."""
        pairs = zip(self.first, self.counts, strict=True)
        items = [Moment(k, first - 1, 0, count) for k, (first, count) in enumerate(pairs)]
        whole = _FromRest(Stretches(self.traces, items, 0.0, dict(enumerate(self.volts))), model)
        return whole.flown(np.zeros((len(items), 0)), self.film(theta, model))

    def equations(self, model: FootModel, theta: Floats) -> NormalEquations:
        """Normal equations of the records about the constants; none has unknowns of its own."""
        residuals, slopes, _ = self.flown(model, theta)
        return equations_of(residuals, slopes, 0)


class _FromRest(FlownStretches[Moment]):
    """Flights of whole records from rest by a model, whose foot the squared volts attract."""

    def __init__(self, stretches: Stretches[Moment], model: FootModel) -> None:
        super().__init__(stretches, model)
        self.squares = np.zeros_like(self.drive[0])
        for r, one in enumerate(stretches.items):
            level = stretches.volts[one.trace].fine[SUBSTEPS * (one.last + 1) :][: self.drive[0].shape[1]]
            self.squares[r, : len(level)] = level**2

    def of_sides(self) -> tuple[FlightSide, ...]:
        """Onward, with a start that is known."""
        return (FlightSide(np.zeros((2 * len(self.model.row), 0)), (0.0, 0.0)),)

    def still(self, trace: Trace) -> Floats:
        """Coordinates (n,) at rest before the drive of a record."""
        force = float(self.model.law.force(trace.volts[:1], self.model.history)[0])
        return np.asarray(np.linalg.solve(self.model.stiffness, self.model.load) * force, dtype=np.float64)

    def states(self, unknowns: Floats, side: int = -1) -> Floats:
        """At rest."""
        x = np.array([self.still(self.stretches.traces[one.trace]) for one in self.stretches.items])
        return np.hstack([x, np.zeros_like(x)])

    def rest(self, trace: Trace) -> Floats:
        """Of the points at rest, from the neutral position."""
        return self.model.rows @ self.still(trace)

    def gap(self, trace: Trace) -> float:
        """The record's own, where it is known."""
        return self.model.gap if trace.gap is None else trace.gap


_LIMITS = (np.log(1e-30), np.log(1.0))
"""Logarithms of the constants [SI] within which exponentials neither overflow nor underflow; no film or attraction of
the field comes near."""


def identify_close(model: FootModel, known: Estimates, traces: Sequence[Trace], seed: int) -> StepResult:
    """Constants of the attraction, and of the film where no earlier step has found them.

    Parameters
    ----------
    model
        Structure and drive as identified; the laws that its ground has are the ones that are looked for.
    known
        What earlier steps found, with draws.
    traces
        Records close to the ground that never touch it, each with its gap at the neutral position.
    seed
        Of the draws.

    Raises
    ------
    InputError
        If the device's ground has neither law, or every record touches the ground.
    """
    ground = model.scene.ground.acting
    names: list[str] = []
    if ground.film is not None and FILM[0] not in known.paths:
        names += FILM
    if ground.electrostatic is not None and model.scene.robot.feet[model.foot].electrode is not None:
        names += ATTRACTION
    if not names:
        raise InputError("the device's ground has no attraction, and no film that is still unknown")
    used, left = _apart(model, traces)
    if not used:
        raise InputError([str(one) for one in left])
    close = _prepared(model, used, tuple(names))
    prior = np.eye(len(names)) / _SPREAD**2
    none = np.zeros((len(used), 0))
    found = descend(
        lambda _, theta, __: close.equations(model, theta),
        none, close.centre, prior=(close.centre, prior), how=_DESCENT,
    )  # fmt: skip
    theta = found.shared
    residuals, _, flights = close.flown(model, theta)

    def again(values: Floats) -> Floats:
        moved = close.equations(known.model(values), theta)
        return theta + moved.step(0.0, prior, prior @ (close.centre - theta))[1]

    own = newton_draws(found.equations.shared, found.equations.right_shared, seed, prior)
    logs = theta + own + carried(again, known.values, known.samples)
    samples = np.exp(np.clip(logs, *_LIMITS))

    return StepResult(
        "electrostatics",
        close.names,
        np.exp(theta),
        samples,
        combinations=combinations_of(close.names, min((one.gap or 0.0) for one in used), theta, logs),
        residuals=tuple(
            over_noise(trace.file, one) for trace, one in zip(close.traces, residuals, strict=True)
        ),
        used=(Used("records close to the ground", len(used), len(traces)),),
        files=frozenset(trace.file for trace in used),
        left_out=tuple(left),
        panels=_panels(model, close, residuals, flights),
    )


def _apart(model: FootModel, traces: Sequence[Trace]) -> tuple[list[Trace], list[Excluded]]:
    """Records whose foot stays clear of the ground, and the others."""
    used, left = [], []
    rest = model.static_load * float(model.law.force(np.zeros(1), model.history)[0])
    for trace in traces:
        gap = model.gap if trace.gap is None else trace.gap
        lowest = gap + rest + float(np.min(model.normal * trace.x[trace.point(model.foot_point)]))
        if lowest > _CLOSEST * gap:
            used.append(trace)
        else:
            text = f"the foot comes within {1e6 * max(lowest, 0.0):.2g} um of the ground and may touch it"
            left.append(Excluded(trace.file, model.foot_point, text))
    return used, left


def _prepared(model: FootModel, traces: Sequence[Trace], names: tuple[str, ...]) -> _Close:
    first = [int(np.searchsorted(trace.time, -1e-9)) for trace in traces]
    counts = [
        min(len(trace.time) - start, round(LONGEST / trace.step))
        for trace, start in zip(traces, first, strict=True)
    ]
    gap = float(np.median([model.gap if trace.gap is None else trace.gap for trace in traces]))
    volts = max(float(np.max(np.abs(trace.volts))) for trace in traces)
    guess = {
        FILM[0]: model.like_damping * gap**3,
        FILM[1]: 0.3 * gap,
    } | _first_attraction(model, volts, gap)
    return _Close(
        tuple(traces),
        tuple(trace.between for trace in traces),
        tuple(first),
        tuple(counts),
        names,
        np.log([guess[name] for name in names]),
    )


def _first_attraction(model: FootModel, volts: float, gap: float) -> dict[str, float]:
    """An attraction of a fiftieth of the drive's force at so many volts, which hardly grows towards the ground."""
    force = float(np.max(np.abs(model.law.force(np.array([volts]), model.history))))
    offset = 10.0 * gap
    return dict(zip(ATTRACTION, (0.02 * force / volts**2 * (gap + offset) ** 2, offset), strict=True))


def wide_attraction(model: FootModel, volts: float, seed: int) -> StepResult:
    """The attraction as an unknown that no record tells, for drives of up to so many volts: draws as wide as what keeps
    fits of it from running away."""
    values = np.array(list(_first_attraction(model, volts, model.gap).values()))
    logs = _SPREAD * np.random.default_rng([seed, 31]).standard_normal((DRAWS, len(values)))
    return StepResult("electrostatics", ATTRACTION, values, values * np.exp(logs), taken=ATTRACTION)


def combinations_of(
    paths: Sequence[str], gap: float, theta: Floats, logs: Floats
) -> dict[str, tuple[float, Floats, str]]:
    """What records tell better than the constants alone, damping and attraction at the smallest gap [m], from the
    logarithms (p,) of the constants at these paths and their draws (draws, p)."""
    out: dict[str, tuple[float, Floats, str]] = {}
    for names, power, label, unit in (
        (FILM, 3, "C / (g + g0)^3", "N s/m"),
        (ATTRACTION, 2, "C_e / (g + g_e)^2", "N/V^2"),
    ):
        if names[0] not in paths:
            continue
        a, b = paths.index(names[0]), paths.index(names[1])
        value = float(np.exp(theta[a]) / (gap + np.exp(theta[b])) ** power)
        draws = np.exp(logs[:, a]) / (gap + np.exp(logs[:, b])) ** power
        out[f"{label} at g = {1e6 * gap:.3g} um"] = (value, draws, unit)
    return out


def _panels(
    model: FootModel, close: _Close, residuals: Sequence[Floats], flights: Sequence[Floats]
) -> tuple[Panel, ...]:
    k = model.points.index(model.foot_point)
    panels = []
    for r in evenly(range(len(close.traces)), _SHOWN):
        trace = close.traces[r]
        time = trace.time[close.first[r] : close.first[r] + close.counts[r]]
        gap = model.gap if trace.gap is None else trace.gap
        fitted = gap + model.normal * flights[r][k]
        left = model.normal * residuals[r][k] * trace.noise_x[k]
        panels.append(measured_and_fitted(trace.file, ("time", "s", "gap", "m"), time, fitted, left))
    return tuple(panels)
