"""What instruments add to the motion of a device: gains, signs and delays of channels, and a low-pass before them.

A displacement is the integral of the velocity of the same point in every record, whatever the structure: that gives
their ratio and the delay of the one behind the other. How late both are behind the drive the sweeps in the air show
(`tarsus.identify.delay`). Records are brought back to what happened before any step sees them; instruments between
which no difference is found leave their records as they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tarsus.base.arrays import Complexes, Floats
from tarsus.identify.clock import PACE, stretched
from tarsus.identify.consistency import ALIKE, COARSE, Relation, relations_of
from tarsus.identify.delay import SAMPLES, Delay, LowPass, delay_of, passed
from tarsus.identify.with_error import UNKNOWN, WithError
from tarsus.modes.modal import ModalFit
from tarsus.records.measurement import Measurement, Quantity

GAIN = 0.005
"""Part of a gain that is corrected at least: what vibrometers are calibrated to."""
_MOST = 1.5
"""Factor of a gain beyond which it is no instrument's: a unit, a scale or another point's channel."""
_MIDDLE = 1.2533
"""Standard error of a median over that of a mean, of normal numbers."""
_STRONGEST = 4.0
"""Factor at most by which what a low-pass has weakened is brought back: noise is, too."""
_PROMPT = Delay(UNKNOWN, None)
"""Of channels that are not known to be late."""


@dataclass(frozen=True)
class Instruments:
    """What instruments add to records.

    step [s]: between samples of the sweeps, or the finest of the other records; gains: by point, of its displacement
    over the integral of its velocity; lag [s]: of displacements behind velocities; velocities: points of which the
    velocity, not the displacement, has the gain; delay: of the sweeps' channels behind the drive, as far as it is
    known; of: the quantity of these channels; pace: share by which the clock of the motion is slow against that of the
    drive, as far as it is known; starts [s]: by source, how much later than the others a sweep comes behind its drive;
    lost: samples of sweeps were, which both correct in part; relations: by point, of displacement and velocity in each
    of the records that were compared, nothing of those that are too coarse.
    """

    step: float
    gains: Mapping[str, WithError] = field(default_factory=dict)
    lag: WithError = UNKNOWN
    velocities: frozenset[str] = frozenset()
    delay: Delay = _PROMPT
    of: Quantity = Quantity.DISPLACEMENT
    pace: WithError = UNKNOWN
    starts: Mapping[str, float] = field(default_factory=dict)
    lost: bool = False
    relations: Sequence[Mapping[str, Relation]] = ()

    @property
    def wrong(self) -> dict[str, WithError]:
        """Gains that are an instrument's, by point."""
        return {point: one for point, one in self.gains.items() if one.off(1.0, GAIN)}

    def gain(self, point: str, quantity: Quantity) -> float:
        """Factor that a channel of a point has too much."""
        turned = point in self.velocities
        if point not in self.wrong or turned is not (quantity is Quantity.VELOCITY):
            return 1.0
        return 1.0 / self.gains[point].value if turned else self.gains[point].value

    @property
    def lags(self) -> float:
        """Time [s] by which displacements come behind velocities."""
        return self.lag.beyond(0.0, SAMPLES * self.step)

    @property
    def delay_time(self) -> float:
        """Time [s] by which velocities, and displacements that were brought to them, come behind the drive."""
        return self.delay.time.value if self.delay.off(self.step) else 0.0

    @property
    def slow(self) -> float:
        """Share by which the steps between samples of the motion are longer than stated."""
        return self.pace.beyond(0.0, PACE)

    def low(self, quantity: Quantity) -> LowPass | None:
        """Low-pass before the channels of a quantity: that of the sweeps, and the other one unless it is not delayed by
        it."""
        return None if self.lags and quantity is not self.of else self.delay.low

    def hypotheses(self) -> tuple[Instruments, ...]:
        """These, and where a gain was found the same with the other channel of its point at fault."""
        return (self, replace(self, velocities=frozenset(self.wrong))) if self.wrong else (self,)

    def behind(self, fit: ModalFit) -> Instruments | None:
        """The same with the delay that modes show, None where they show none."""
        found = delay_of(fit)
        if found is None or fit.frf.quantity not in (Quantity.DISPLACEMENT, Quantity.VELOCITY):
            return None
        late = replace(self, delay=found, of=fit.frf.quantity)
        return late if found.off(late.step) else None

    def uncertain(self) -> tuple[Instruments, ...]:
        """The same with each gain that was corrected moved by its standard error; errors of delays and paces are too
        small to change a number."""
        moved = ({**self.gains, point: one.moved} for point, one in self.wrong.items())
        return tuple(replace(self, gains=gains) for gains in moved)

    @property
    def errors(self) -> tuple[float, float]:
        """Standard errors [s] of what was corrected: the delay of displacements behind velocities, and of all channels
        behind the drive."""
        return self.lag.error if self.lags else 0.0, self.delay.time.error if self.delay_time else 0.0

    @property
    def shared(self) -> float:
        """Part of itself by which the gain that all channels share is unknown: where all displacements differ from
        their velocities by one factor, no shape shows which of both are wrong."""
        if not self.wrong or len(self.wrong) < len(self.gains):
            return 0.0
        mean = float(np.mean([one.value for one in self.gains.values()]))
        return 0.0 if any(one.off(mean, GAIN) for one in self.gains.values()) else abs(mean - 1.0)

    @property
    def prompt(self) -> Instruments:
        """The gains alone, as if no channel were late."""
        return replace(self, lag=UNKNOWN, delay=_PROMPT)

    @property
    def delaying(self) -> bool:
        """Whether any channel is late, or behind a low-pass."""
        return bool(self.lags or self.delay_time or self.low(self.of))

    @property
    def differ(self) -> bool:
        """Whether there is anything to correct."""
        return bool(self.wrong or self.delaying or self.slow or self.starts)

    def seen(self, motion: Floats, quantity: Quantity, step: float) -> Floats:
        """Motion (np, nt) from the rest, samples a step [s] apart, as late and behind the low-pass as channels of a
        quantity show it."""
        low, late = self.low(quantity), self.delay_time + (self.lags if quantity is Quantity.DISPLACEMENT else 0.0)
        if low is None and not late:
            return motion

        def factor(s: Complexes) -> Complexes:
            delay = np.exp(-s * late)
            return delay if low is None else delay * low.response(s) * np.exp(s * low.delay)

        return np.array([passed(one, step, factor) for one in motion])

    def corrected(self, record: Measurement, swept: bool) -> Measurement:
        """A record as if its instruments had neither gains nor lags; ``swept``: nor a low-pass, nor a delay behind the
        drive, which other records keep: what jumps there would ring."""
        if not self.differ:
            return record
        values = record.values.copy()
        if swept and self.slow and record.drive is not None:
            at = record.index(record.drive)
            values[at] = stretched(values[at], self.slow)
            record = replace(record, step=record.step * (1.0 + self.slow))
        rows = {(one.at, one.quantity): k for k, one in enumerate(record.channels)}
        moving = {key: k for key, k in rows.items() if key[1] in (Quantity.DISPLACEMENT, Quantity.VELOCITY)}
        for (point, quantity), k in moving.items():
            values[k] /= self.gain(point, quantity)
            if quantity is Quantity.DISPLACEMENT and self.lags:
                values[k] = _divided(values[k], record.step, self.lags, None)
        late = self.delay_time + self.starts.get(record.source, 0.0)
        for (_, quantity), k in moving.items() if swept and (late or self.low(self.of)) else ():
            values[k] = _divided(values[k], record.step, late, self.low(quantity))
        return replace(record, values=values)

    def sentences(self) -> list[str]:
        """What was found and corrected."""
        out = []
        if self.lost:
            out.append(
                "samples of the motion were lost in the sweeps, the later ones having moved up: no clock and no "
                "trigger turns them so; what a pace and delays explain is corrected, record them again without a gap"
            )
        elif self.slow:
            out.append(
                f"the clock of the motion runs {1e6 * abs(self.slow):.4g} +- {2e6 * self.pace.error:.1g} ppm "
                f"{'slow' if self.slow > 0.0 else 'fast'} against that of the drive, as sweeps up and down show: "
                "corrected"
            )
        if self.starts and not self.lost:
            apart = max(self.starts.values()) - min(self.starts.values())
            out.append(
                f"the sweeps begin up to {1e6 * apart:.3g} us apart from their drive, as by a trigger with a varying "
                "delay: corrected for each; other records begin as late, by how much each is not known"
            )
        for point, one in self.wrong.items():
            which, other = ("velocity", "displacement") if point in self.velocities else ("displacement", "velocity")
            gain = self.gain(point, Quantity[which.upper()])
            out.append(
                f"the {which} of point '{point}' is {gain:.4g} +- {2.0 * one.error:.1g} times what its {other} makes "
                "it: taken for the gain of its channel, and divided out"
            )
        if self.shared:
            out.append(
                f"all displacements differ from their velocities by one factor, and no record shows which is wrong: "
                f"{100.0 * self.shared:.2g} % of the gain that all channels share is in all intervals"
            )
        if self.lags:
            word = "after" if self.lags > 0.0 else "before"
            out.append(
                f"displacements come {1e6 * abs(self.lags):.4g} +- {2e6 * self.lag.error:.1g} us {word} their "
                "velocities: a delay of their channels, corrected"
            )
        if self.delay_time or self.low(self.of) is not None:
            late, low = self.delay.time, self.delay.low
            word = "after" if late.value > 0.0 else "before"
            by = "" if low is None else f", as behind a {low.name} at {low.corner:.4g} Hz"
            out.append(
                f"the sweeps show the motion {1e6 * abs(late.value):.4g} +- {2e6 * late.error:.1g} us {word} the "
                f"drive{by}: a delay of the instruments, corrected"
            )
        return out


SOUND = Instruments(1.0)
"""Of records of which nothing is known to be wrong."""


def compared(records: Sequence[Measurement], points: Sequence[str]) -> Instruments:
    """Gains and lag of displacements against velocities: medians over records, weighted by their information; and how
    both are related in each once these are corrected."""
    step = min(record.step for record in records)
    fine = [record.step < COARSE * step for record in records]
    first = _compared(records, fine, points, step)
    if not first.differ:
        return first
    # gains and lags are distinguished once most of both is corrected
    again = _compared([first.corrected(record, False) for record in records], fine, points, step)
    gains = {
        point: WithError(first.gain(point, Quantity.DISPLACEMENT) * one.value, one.error)
        for point, one in again.gains.items()
    }
    return replace(again, gains=gains, lag=WithError(first.lags + again.lag.value, again.lag.error))


def _compared(records: Sequence[Measurement], fine: Sequence[bool], points: Sequence[str], step: float) -> Instruments:
    relations = tuple(relations_of(r, points) if yes else {} for r, yes in zip(records, fine, strict=True))
    found = {point: [r[point] for r in relations if point in r and _of_instrument(r[point])] for point in points}
    gains = {point: middle_of([one.gain for one in known]) for point, known in found.items() if known}
    lags = [one.lag for known in found.values() for one in known]
    return Instruments(step, gains, middle_of(lags) if lags else UNKNOWN, relations=relations)


def middle_of(found: Sequence[WithError]) -> WithError:
    """Weighted median of some values: a record with another fault counts as one of many."""
    values, errors = np.array([(one.value, one.error) for one in found]).T
    order, weight = np.argsort(values), errors**-2.0
    share = np.cumsum(weight[order]) / weight.sum()
    middle = float(values[order][np.searchsorted(share, 0.5)])
    scatter = 1.4826 * np.median(np.abs(values - middle) / errors) if len(values) > 2 else 1.0
    return WithError(middle, float(_MIDDLE * max(scatter, 1.0) * weight.sum() ** -0.5))


def _of_instrument(found: Relation) -> bool:
    """Whether an instrument may explain the gain and the lag of a point in a record."""
    return found.between and abs(found.alike) >= ALIKE and 1.0 / _MOST < abs(found.gain.value) < _MOST


def _divided(values: Floats, step: float, late: float, low: LowPass | None) -> Floats:
    """Values (ns,) brought forward by ``late`` [s] and out from behind a low-pass, but for the delay of what is slow,
    which ``late`` holds."""

    def factor(s: Complexes) -> Complexes:
        if low is None:
            return np.exp(s * late)
        response = low.response(s) * np.exp(s * low.delay)
        return np.exp(s * late) / (response * np.maximum(1.0, 1.0 / (_STRONGEST * np.abs(response))))

    return passed(values, step, factor)
