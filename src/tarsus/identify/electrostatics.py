"""Records close to the ground, without contact -> electrostatics and film.

From rest on, the structure moves under the drive's force, the film's ``-C g' / (g + g0)^3`` (3.26) and, where the
foot has an electrode, the attraction ``-C_e V^2 / (g + g_e)^2`` (3.25). Whole records at several gaps and voltages
are fitted together by the logarithms of the constants. Near one gap only ``C / (g + g0)^3`` and ``C_e / (g +
g_e)^2`` are seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.fit.normal_equations import Descent
from tarsus.identify.draws import DRAWS
from tarsus.identify.estimates import Estimates
from tarsus.identify.flight import ATTRACTION, FILM, FlightParameters, FlightProblem, FlightSide, SegmentStart
from tarsus.identify.foot import FootModel
from tarsus.identify.step import StepResult, Used
from tarsus.identify.traces import Trace
from tarsus.records.excluded import Excluded, evenly

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


class CloseRecords(FlightProblem):
    """Whole records from rest, whose foot the squared volts attract; none has unknowns of its own."""

    def _prepare(self, items: Sequence[SegmentStart], model: FootModel) -> None:
        super()._prepare(items, model)
        self.squares = self.squared()

    def of_sides(self) -> tuple[FlightSide, ...]:
        """Onward, with a start that is known."""
        return (FlightSide(np.zeros((2 * len(self.model.row), 0)), (0.0, 0.0)),)

    def still(self, trace: Trace) -> Floats:
        """Coordinates (n,) at rest before the drive of a record."""
        force = float(self.model.law.force(trace.volts[:1], self.model.history)[0])
        return np.asarray(np.linalg.solve(self.model.stiffness, self.model.load) * force, dtype=np.float64)

    def states(self, unknowns: Floats, side: int = -1) -> Floats:
        """At rest."""
        x = np.array([self.still(self.traces[one.trace]) for one in self.items])
        return np.hstack([x, np.zeros_like(x)])

    def rest(self, trace: Trace) -> Floats:
        """Of the points at rest, from the neutral position."""
        return self.model.rows @ self.still(trace)

    def gap(self, trace: Trace) -> float:
        """The record's own, where it is known."""
        return self.model.gap if trace.gap is None else trace.gap


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
    firsts = [int(np.searchsorted(trace.time, -1e-9)) for trace in used]
    items = [
        SegmentStart(k, first - 1, 0, min(len(trace.time) - first, round(LONGEST / trace.step)))
        for k, (trace, first) in enumerate(zip(used, firsts, strict=True))
    ]
    close = CloseRecords(used, items, 0.0, model)
    volts = max(float(np.max(np.abs(trace.volts))) for trace in used)
    parameters = _parameters(model, names, float(np.median(close.gaps)), volts)
    fitted = close.together(np.zeros((len(items), 0)), parameters, parameters.centre, _DESCENT)
    own, before = fitted.drawn(known, np.full(DRAWS, fitted.problem.level), seed)
    panels = tuple(fitted.panel(r, used[r].file, "time", 0.0) for r in evenly(range(len(used)), _SHOWN))
    gap = min((one.gap or 0.0) for one in used)
    step = fitted.step("electrostatics", fitted.place + own + before, gap, panels)
    count = Used("records close to the ground", len(used), len(traces))
    return replace(step, used=(count,), left_out=tuple(left))


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


def _parameters(model: FootModel, names: Sequence[str], gap: float, volts: float) -> FlightParameters:
    """Constants by their logarithms, about a film that damps the foot as much as the structure's first mode does, and
    an attraction of a fiftieth of the drive's force at so many volts, which hardly grows towards the ground."""
    force = float(np.max(np.abs(model.law.force(np.array([volts]), model.history))))
    offset = 10.0 * gap
    guess = dict(zip(ATTRACTION, (0.02 * force / volts**2 * (gap + offset) ** 2, offset), strict=True))
    guess |= {FILM[0]: model.like_damping * gap**3, FILM[1]: 0.3 * gap}
    centre = np.log([guess[name] for name in names])
    return FlightParameters(tuple(names), np.eye(len(names)), centre, np.eye(len(names)) / _SPREAD**2)


def wide_attraction(model: FootModel, volts: float, seed: int) -> StepResult:
    """The attraction as an unknown that no record shows, for drives of up to so many volts."""
    return _parameters(model, ATTRACTION, model.gap, volts).wide("electrostatics", seed)
