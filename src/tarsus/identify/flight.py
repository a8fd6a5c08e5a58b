"""Free flights of a foot's model, and stretches of records fitted with them.

At an impact, and where the foot lets go, it is on the ground, so that the state there has few unknowns: the moment,
where the rest of the structure is, and how fast. From such a moment the structure flies free under the drive's force
and the film's (`tarsus.solve.flights`): onward, and back to what was before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.fit.normal_equations import NormalEquations
from tarsus.identify.foot import FootModel
from tarsus.identify.traces import Trace
from tarsus.identify.volts import Volts
from tarsus.solve.flights import SUBSTEPS, Flow, Launches, Varied

__all__ = [
    "SUBSTEPS",
    "FilmConstants",
    "FlightSide",
    "FlownStretches",
    "Moment",
    "Stretches",
    "Varied",
    "equations_of",
    "of_model",
]  # fmt: skip


_REACH = 8
"""Samples beside a flight in which its moment may lie: more than a guess is ever off."""


@dataclass(frozen=True)
class FilmConstants:
    """Film coefficient C [N m^2 s] and thickness g0 [m]."""

    coefficient: float
    thickness: float

    def law(self, by_log: Floats | None = None) -> Varied:
        """The law (4,) as flights feel it, without an attraction. by_log (2, p): derivatives of the logarithms of C and
        g0 by p numbers; these logarithms themselves unless given."""
        value = np.array([self.coefficient, self.thickness, 0.0, 1.0])
        slopes = value[:2, None] * (np.eye(2) if by_log is None else by_log)
        return Varied(value, np.pad(slopes, ((0, 2), (0, 0))))


def of_model(model: FootModel, step: float) -> Flow:
    """Steps of a model's free flights, of so many seconds."""
    return Flow(model.flow, model.inputs, model.row, step)


@dataclass(frozen=True)
class Moment:
    """A moment in a record at which the foot is on the ground: the last sample before it, and how many samples are
    used before and after it."""

    trace: int
    last: int
    before: int
    after: int


Item = TypeVar("Item", bound=Moment)


class Stretches(Generic[Item]):
    """Stretches of records about moments, ready to be fitted with any model.

    Parameters
    ----------
    traces
        The records.
    items
        Their moments.
    level
        Contact level from the rest [m].
    """

    none = ""
    """What is said where there are no moments."""

    def __init__(
        self, traces: Sequence[Trace], items: Sequence[Item], level: float, volts: Mapping[int, Volts] | None = None
    ) -> None:  # fmt: skip
        if not items:
            raise InputError(self.none)
        self.traces, self.items, self.level = tuple(traces), tuple(items), level
        numbers = {one.trace for one in items}
        if len({round(self.traces[k].step, 12) for k in numbers}) > 1:
            raise InputError("records that are fitted together are sampled at different rates")
        self.step = self.traces[items[0].trace].step
        self.volts = {k: self.traces[k].between for k in numbers} if volts is None else volts

    @property
    def files(self) -> frozenset[str]:
        """Files of which there is one."""
        return frozenset(self.traces[one.trace].file for one in self.items)

    def chosen(self, keep: NDArray[np.bool_]) -> Self:
        """Some of them."""
        kept = [one for one, yes in zip(self.items, keep, strict=True) if yes]
        return type(self)(self.traces, kept, self.level, self.volts)


@dataclass(frozen=True)
class FlightSide:
    """Flights to one side of moments.

    back: to what was before; rates (2n, q): of the state at the moment by the unknowns; begin [s]: the moment is
    begin[0] + begin[1] times the first unknown after the first sample of this side; offset (2, q): rates of a force
    beside the drive's at the first sample [N], and of its drift [N/s].
    """

    rates: Floats
    begin: tuple[float, float]
    back: bool = False
    offset: Floats | None = None


class FlownStretches(Generic[Item]):
    """Everything of stretches that depends on the model but not on the unknowns.

    The unknowns (nr, q) of each: the moment [s], places (m,) and velocities (m,) of the coordinates that a foot on the
    ground leaves free, and what its kind has besides.
    """

    def __init__(self, stretches: Stretches[Item], model: FootModel) -> None:
        self.stretches, self.model = stretches, model
        self.free = null_space(model.row[None, :])
        self.grounded = grounded(model)
        self.output = np.asarray(np.kron(np.eye(2), model.rows), dtype=np.float64)
        self.sides = self.of_sides()
        step = stretches.step / SUBSTEPS
        self.flows = [of_model(model, -step if one.back else step) for one in self.sides]
        items = stretches.items
        self.counts = [np.array([one.before if s.back else one.after for one in items]) for s in self.sides]
        self.drive = [np.zeros((len(items), SUBSTEPS * (int(c.max()) - 1) + 1)) for c in self.counts]
        self.near = [np.zeros((len(items), SUBSTEPS * _REACH + 1)) for _ in self.sides]
        self.squares: Floats | None = None
        self.measured, self.noise = list[Floats](), list[Floats]()
        for r, one in enumerate(items):
            trace, first = stretches.traces[one.trace], one.last + 1 - one.before
            part = slice(first, first + one.before + one.after)
            self.measured.append(
                np.concatenate([trace.x[:, part] + self.rest(trace)[:, None], trace.v[:, part]])
            )
            self.noise.append(np.concatenate([trace.noise_x, trace.noise_v]))
            self._driven(r, one, first)

    def of_sides(self) -> tuple[FlightSide, ...]:
        """To which sides flights go, earlier samples first."""
        raise NotImplementedError

    def rest(self, trace: Trace) -> Floats:
        """Displacements (np,) [m] of the points from the neutral position where those of a record are zero."""
        return self.model.rest(self.stretches.level)

    def gap(self, trace: Trace) -> float:
        """Gap at the neutral position in a record [m]."""
        return self.model.gap

    def _driven(self, r: int, one: Moment, first: int) -> None:
        """Force of the drive along the flights of a moment, and beside their first samples."""
        reach, seen = SUBSTEPS * _REACH, min(first, _REACH)
        count = seen + one.before + one.after
        force = self.stretches.volts[one.trace].force(self.model.law, self.model.history, first - seen, count)
        force = np.pad(force, (reach - SUBSTEPS * seen, reach), mode="edge")
        for side, drive, near in zip(self.sides, self.drive, self.near, strict=True):
            at = reach + SUBSTEPS * (one.before - side.back)
            along = force[at::-1] if side.back else force[at:]
            drive[r, : len(along)] = along[: drive.shape[1]]
            near[r] = force[at : at + reach + 1][::-1] if side.back else force[at - reach : at + 1]

    def states(self, unknowns: Floats, side: int = -1) -> Floats:
        """States (nr, 2n) at the moments."""
        base = np.concatenate([self.grounded, np.zeros(len(self.grounded))])
        return base + unknowns @ self.sides[side].rates.T

    def launches(self, unknowns: Floats, film: Varied, part: NDArray[np.intp], side: int = -1) -> Launches:
        """Flights of these numbers to one side, with derivatives by their unknowns and those p of the film's law (4,),
        as `FilmConstants.law` has them."""
        one, (count, q) = self.sides[side], unknowns.shape
        assert film.slopes is not None
        offset, p = np.zeros((2, q)) if one.offset is None else one.offset, film.slopes.shape[1]

        def varied(value: Floats, rates: Floats, more: Floats | None = None) -> Varied:
            wide = np.concatenate(
                [rates, np.zeros((*rates.shape[:-1], p)) if more is None else more], axis=-1
            )
            return Varied(value, np.broadcast_to(wide, (count, *wide.shape)))

        begin = one.begin[0] + one.begin[1] * unknowns[:, :1].sum(axis=1)
        gaps = np.array([self.gap(self.stretches.traces[self.stretches.items[int(r)].trace]) for r in part])
        return Launches(
            varied(self.states(unknowns, side), one.rates), varied(begin, one.begin[1] * np.eye(1, q)[0]),
            varied(unknowns @ offset.T, offset), varied(np.tile(film.value, (count, 1)), np.zeros((4, q)), film.slopes),
            gaps, self.near[side][part], self.flows[side].step,
        )  # fmt: skip

    def flown(
        self, unknowns: Floats, film: Varied, part: NDArray[np.intp] | None = None
    ) -> tuple[list[Floats], list[Floats], list[Floats]]:  # fmt: skip
        """Of the stretches of these numbers, or of all: what was measured less what is flown, over the noise (channels,
        samples), slopes (q + p, channels times samples) of what is flown, and the flights (channels, samples)."""
        part = np.arange(len(self.measured)) if part is None else part
        values, slopes = [list[Floats]() for _ in part], [list[Floats]() for _ in part]
        for k, side in enumerate(self.sides):
            counts, launches = self.counts[k][part], self.launches(unknowns, film, part, k)
            squares = None if self.squares is None else self.squares[part]
            found = self.flows[k].fly(launches, self.drive[k][part], counts, self.output, squares)
            for r, end in enumerate(np.cumsum(counts)):
                own, turn = slice(end - counts[r], end), slice(None, None, -1 if side.back else 1)
                values[r].append(found[0][own][turn].T)
                slopes[r].append(found[1][own][turn].transpose(2, 1, 0))
        flights = [np.concatenate(one, axis=1) for one in values]
        residuals, rows = list[Floats](), list[Floats]()
        for r, flight, by in zip(part.tolist(), flights, slopes, strict=True):
            white = self.noise[r][:, None]
            residuals.append((self.measured[r] - flight) / white)
            rows.append((np.concatenate(by, axis=2) / white).reshape(len(by[0]), -1))
        return residuals, rows, flights

    def equations(
        self, unknowns: Floats, film: Varied, part: NDArray[np.intp] | None = None
    ) -> NormalEquations:  # fmt: skip
        """Normal equations of the stretches of these numbers, which share those of the film."""
        residuals, slopes, _ = self.flown(unknowns, film, part)
        return equations_of(residuals, slopes, unknowns.shape[1])


def equations_of(residuals: Sequence[Floats], slopes: Sequence[Floats], own: int) -> NormalEquations:
    """Of stretches: what was measured less what was flown, and slopes (q + p, n) of the flights, over the noise."""
    return NormalEquations.of([-one.ravel() for one in residuals], [one.T for one in slopes], own)


def grounded(model: FootModel) -> Floats:
    """Coordinates (n,) with the foot on the ground, the shortest ones."""
    return -model.gap * model.row / float(model.row @ model.row)
