"""What instruments add to the motion of a device: gains, signs and delays of channels, and a low-pass before them.

A displacement is the integral of the velocity of the same point in every record, whatever the structure: that gives
their ratio and the delay of the one behind the other. How late both are behind the drive the sweeps in the air show
(`tarsus.identify.lateness`). Records are brought back to what happened before any step sees them; instruments between
which no difference is found leave their records as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.fft import next_fast_len
from scipy.ndimage import binary_dilation, convolve1d

from tarsus.base.arrays import Complexes, Floats
from tarsus.identify.clock import PACE, stretched
from tarsus.identify.lateness import SAMPLES, Lateness, LowPass, lateness_of
from tarsus.identify.volts import jumps_of
from tarsus.identify.with_error import UNTOLD, WithError, regressed
from tarsus.modes.modal import ModalFit
from tarsus.records.measurement import Measurement, Quantity

GAIN = 0.005
"""Part of a gain that is corrected at least: what vibrometers are calibrated to."""
_MOST = 1.5
"""Factor of a gain beyond which it is no instrument's: a unit, a scale or another point's channel."""
_WIDTH = 3.0
"""Samples (standard deviation) of the Gaussian through which both are compared: wide enough for velocities that jump at
impacts, and narrow enough for a delay to turn what is left."""
_REACH = 15
"""Samples to either side that the Gaussian reaches, and around jumps of the drive that are not compared: the
acceleration jumps with it, and a difference of samples is off."""
_FEWEST = 200
"""Samples that make a comparison."""
_COARSE = 4.0
"""Steps of the finest record from which on another is not compared: modes that the one shows lie between the samples of
the other, whose differences are no velocities then. Slow loops at 1 kHz show center and tip a quarter of a sample apart
where nothing is late."""
_ALIKE = 0.9
"""Least correlation of channels that are compared: others are not of one point."""
_MIDDLE = 1.2533
"""Standard error of a median over that of a mean, of normal numbers."""
_STRONGEST = 4.0
"""Factor at most by which what a low-pass has weakened is brought back: noise is, too."""
_BLEND = 256
"""Samples over which the end of a record is led back to its beginning for a transform."""
_PROMPT = Lateness(UNTOLD, None)
"""Of channels that are not known to be late."""


@dataclass(frozen=True)
class Relation:
    """Of displacement and velocity of a point: gain of the one over the integral of the other, and lag [s] of the one
    behind the other."""

    gain: WithError
    lag: WithError


@dataclass(frozen=True)
class Instruments:
    """What is taken off records.

    relations: by point, of those that can be compared; velocities: points of which the velocity, not the displacement,
    has the gain; lateness: of the sweeps' channels behind the drive, as far as it is known; of: the quantity of
    these channels; step [s]: between samples of the sweeps, or the finest of the other records; pace: share by which
    the clock of the motion is slow beside that of the drive, as far as it is known; starts [s]: by source, how
    much later than the others a sweep comes behind its drive; lost: samples of sweeps were, which both mend in part.
    """

    relations: dict[str, Relation]
    step: float
    velocities: frozenset[str] = frozenset()
    lateness: Lateness = _PROMPT
    of: Quantity = Quantity.DISPLACEMENT
    pace: WithError = UNTOLD
    starts: Mapping[str, float] = field(default_factory=dict)
    lost: bool = False

    def gain(self, point: str, quantity: Quantity) -> float:
        """Factor that a channel of a point has too much."""
        found = self.relations.get(point)
        of = Quantity.VELOCITY if point in self.velocities else Quantity.DISPLACEMENT
        gain = found.gain.beyond(1.0, GAIN) if found is not None and quantity is of else 1.0
        return gain if of is Quantity.DISPLACEMENT else 1.0 / gain

    def lag(self, point: str) -> float:
        """Time [s] by which the displacement of a point comes behind its velocity."""
        found = self.relations.get(point)
        return found.lag.beyond(0.0, SAMPLES * self.step) if found is not None else 0.0

    @property
    def lags(self) -> bool:
        """Whether any displacement comes behind its velocity, or before it."""
        return any(self.lag(point) for point in self.relations)

    @property
    def late(self) -> float:
        """Time [s] by which velocities, and displacements that were brought to them, come behind the drive."""
        return self.lateness.late.value if self.lateness.off(self.step) else 0.0

    @property
    def slow(self) -> float:
        """Share by which the steps between samples of the motion are longer than stated."""
        return self.pace.beyond(0.0, PACE)

    def low(self, quantity: Quantity) -> LowPass | None:
        """Low-pass before the channels of a quantity: that of the sweeps, and the other one unless it is not delayed by
        it."""
        return None if self.lags and quantity is not self.of else self.lateness.low

    def hypotheses(self) -> tuple[Instruments, ...]:
        """These, and where a gain was found the same with the other channel of its point at fault."""
        turned = frozenset(p for p, one in self.relations.items() if one.gain.off(1.0, GAIN))
        return (self, replace(self, velocities=turned)) if turned else (self,)

    def behind(self, fit: ModalFit) -> Instruments | None:
        """The same with the lateness that modes show, None where they show none."""
        found = lateness_of(fit)
        if found is None or fit.frf.quantity not in (Quantity.DISPLACEMENT, Quantity.VELOCITY):
            return None
        late = replace(self, lateness=found, of=fit.frf.quantity)
        return late if found.off(late.step) else None

    def delays(self, point: str, quantity: Quantity) -> tuple[LowPass | None, float]:
        """Low-pass before a channel, and the time [s] by which it is late beside that of what passes this slowly."""
        low = self.low(quantity)
        late = self.late + (self.lag(point) if quantity is Quantity.DISPLACEMENT else 0.0)
        return low, late - (0.0 if low is None else low.delay)

    def nudged(self) -> tuple[Instruments, ...]:
        """The same with each number that delays the records moved by its standard error."""
        out = []
        for lag in {one.lag for point, one in self.relations.items() if self.lag(point)}:
            those = {p: replace(one, lag=lag.moved) for p, one in self.relations.items() if one.lag == lag}
            out.append(replace(self, relations={**self.relations, **those}))
        if self.lateness.off(self.step):
            low = self.lateness.low
            out.append(replace(self, lateness=replace(self.lateness, late=self.lateness.late.moved)))
            if low is not None:
                wider = replace(low, corner=low.corner * (1.0 + self.lateness.corner))
                out.append(replace(self, lateness=replace(self.lateness, low=wider)))
        return tuple(out)

    def uncertain(self) -> tuple[Instruments, ...]:
        """The same with each number that was taken off moved by its standard error, but for delays and paces whose
        errors are too small to do harm."""
        harm, out = SAMPLES * self.step, []
        for point, one in self.relations.items():
            if one.gain.off(1.0, GAIN):
                moved = {**self.relations, point: replace(one, gain=one.gain.moved)}
                out.append(replace(self, relations=moved))
        errors = [one.lag.error for point, one in self.relations.items() if self.lag(point)]
        if self.lateness.off(self.step):
            low = self.lateness.low
            errors += [self.lateness.late.error, 0.0 if low is None else low.delay * self.lateness.corner]
        if max(errors, default=0.0) > harm:
            out += self.nudged()
        if self.slow and self.pace.error > PACE:
            out.append(replace(self, pace=self.pace.moved))
        return tuple(out)

    @property
    def shared(self) -> float:
        """Part of itself by which the gain that all channels share is unknown: where all displacements are off their
        velocities by one factor, no shape tells which of both are wrong."""
        gains = [one.gain for one in self.relations.values()]
        if not gains or not all(one.off(1.0, GAIN) for one in gains):
            return 0.0
        mean = float(np.mean([one.value for one in gains]))
        return 0.0 if any(one.off(mean, GAIN) for one in gains) else abs(mean - 1.0)

    @property
    def prompt(self) -> Instruments:
        """The gains alone, as if no channel were late."""
        still = {point: replace(one, lag=WithError(0.0, one.lag.error)) for point, one in self.relations.items()}
        return replace(self, relations=still, lateness=_PROMPT)

    @property
    def delaying(self) -> bool:
        """Whether any channel is late, or behind a low-pass."""
        return bool(self.late or self.low(self.of) or self.lags)

    @property
    def differ(self) -> bool:
        """Whether there is anything to take off."""
        quantities = Quantity.DISPLACEMENT, Quantity.VELOCITY
        gains = (self.gain(point, one) for point in self.relations for one in quantities)
        return self.delaying or bool(self.slow or self.starts) or any(gain != 1.0 for gain in gains)

    def taken_off(self, record: Measurement, swept: bool) -> Measurement:
        """A record as if its instruments had neither gains nor lags nor a low-pass; ``swept``: nor a delay behind the
        drive, which other records keep."""
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
        for (point, quantity), k in moving.items():
            if quantity is Quantity.DISPLACEMENT and (lag := self.lag(point)):
                values[k] = _divided(values[k], record.step, lag, None)
        for (_, quantity), k in moving.items():
            low, late = self.low(quantity), self.late + self.starts.get(record.source, 0.0) if swept else 0.0
            if low is not None or late:
                values[k] = _divided(values[k], record.step, late, low)
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
        for point, one in self.relations.items():
            for quantity, other in ((Quantity.DISPLACEMENT, "velocity"), (Quantity.VELOCITY, "displacement")):
                if (gain := self.gain(point, quantity)) != 1.0:
                    out.append(
                        f"the {quantity.name.lower()} of point '{point}' is {gain:.4g} +- {2.0 * one.gain.error:.1g} "
                        f"times what its {other} makes it: taken for the gain of its channel, and divided out"
                    )
        if self.shared:
            out.append(
                f"all displacements differ from their velocities by one factor, and no record shows which is wrong: "
                f"{100.0 * self.shared:.2g} % of the gain that all channels share is in all intervals"
            )
        lags = {one.lag for point, one in self.relations.items() if self.lag(point)}
        for lag in sorted(lags, key=lambda one: one.value):
            named = ", ".join(f"'{point}'" for point, one in self.relations.items() if one.lag == lag)
            word = "after" if lag.value > 0.0 else "before"
            out.append(
                f"displacements of {named} come {1e6 * abs(lag.value):.4g} +- {2e6 * lag.error:.1g} us {word} their "
                "velocities: a delay of their channels, corrected"
            )
        if self.late or self.low(self.of) is not None:
            late, low = self.lateness.late, self.lateness.low
            word = "after" if late.value > 0.0 else "before"
            by = "" if low is None else f", as behind a {low.name} at {low.corner:.4g} Hz"
            out.append(
                f"the sweeps show the motion {1e6 * abs(late.value):.4g} +- {2e6 * late.error:.1g} us {word} the "
                f"drive{by}: a delay of the instruments, corrected"
            )
        return out


def relations_of(records: Sequence[Measurement], points: Sequence[str]) -> dict[str, Relation]:
    """Relations of displacements and velocities, by point: medians over records, weighted by what each tells. Lags that
    agree are one."""
    step = min(record.step for record in records)
    records = [record for record in records if record.step < _COARSE * step]
    first = _relations(records, points)
    if not first:
        return first
    rough = Instruments(first, step)
    if not rough.differ:
        return first
    # gains and lags are told apart once most of both is gone
    second = _relations([rough.taken_off(record, False) for record in records], points)
    out = {}
    for point, one in first.items():
        if (again := second.get(point)) is not None:
            gain = one.gain.value if rough.gain(point, Quantity.DISPLACEMENT) != 1.0 else 1.0
            one = Relation(
                WithError(gain * again.gain.value, again.gain.error),
                WithError(rough.lag(point) + again.lag.value, again.lag.error),
            )
        out[point] = one
    return out


def _relations(records: Sequence[Measurement], points: Sequence[str]) -> dict[str, Relation]:
    found = {point: [one for r in records if (one := _compared(r, point)) is not None] for point in points}
    tables = {point: np.array(one) for point, one in found.items() if one}
    gains = {point: middle_of(one[:, 0], one[:, 1]) for point, one in tables.items()}
    lags = {point: middle_of(one[:, 2], one[:, 3]) for point, one in tables.items()}
    weight = np.array([one.error**-2.0 for one in lags.values()])
    if len(lags):
        mean = float(weight @ [one.value for one in lags.values()] / weight.sum())
        if not any(one.off(mean, 0.0) for one in lags.values()):
            lags = dict.fromkeys(lags, WithError(mean, float(weight.sum() ** -0.5)))
    return {point: Relation(gains[point], lags[point]) for point in tables}


def middle_of(values: Floats, errors: Floats) -> WithError:
    """Weighted median of values (n,) with standard errors: a record with another fault counts as one of many."""
    order, weight = np.argsort(values), errors**-2.0
    share = np.cumsum(weight[order]) / weight.sum()
    middle = float(values[order][np.searchsorted(share, 0.5)])
    scatter = 1.4826 * np.median(np.abs(values - middle) / errors) if len(values) > 2 else 1.0
    return WithError(middle, float(_MIDDLE * max(scatter, 1.0) * weight.sum() ** -0.5))


def _compared(record: Measurement, point: str) -> tuple[float, float, float, float] | None:
    """Gain and its error, lag and its error [s], of a point in a record."""
    rows = {one.quantity: k for k, one in enumerate(record.channels) if one.at == point}
    if not {Quantity.DISPLACEMENT, Quantity.VELOCITY} <= set(rows) or record.count < _FEWEST:
        return None
    x, v = record.values[rows[Quantity.DISPLACEMENT]], record.values[rows[Quantity.VELOCITY]]
    place = np.arange(-_REACH, _REACH + 1)
    smooth = np.exp(-0.5 * (place / _WIDTH) ** 2)
    smooth /= smooth.sum()
    slope = -place / _WIDTH**2 * smooth
    used = np.ones(record.count, dtype=bool)
    if record.drive is not None:
        jumped = np.zeros(record.count, dtype=bool)
        jumped[jumps_of(record[record.drive])] = True
        used &= np.logical_not(binary_dilation(jumped, iterations=2 * _REACH))
    used[:_REACH] = used[-_REACH:] = False
    if np.count_nonzero(used) < _FEWEST:
        return None
    speed = (convolve1d(x, slope) / record.step)[used]
    known, rising = convolve1d(v, smooth)[used], (convolve1d(v, slope) / record.step)[used]
    design = np.column_stack([known, -rising, np.ones(len(known))])
    found = regressed(speed, design)
    if found is None or abs(np.corrcoef(speed, known)[0, 1]) < _ALIKE:
        return None
    # samples through a Gaussian are as many as lie its effective width apart
    (gain, lag, _), error = found[0], found[1] * np.sqrt(2.0 * np.sqrt(np.pi) * _WIDTH)
    if not 1.0 / _MOST < abs(gain) < _MOST:
        return None
    return float(gain), float(error[0]), float(lag / gain), float(error[1] / abs(gain))


def _divided(values: Floats, step: float, late: float, low: LowPass | None) -> Floats:
    """Values (ns,) brought forward by ``late`` [s] and out from behind a low-pass, but for the delay of what is slow,
    which ``late`` holds."""

    def factor(s: Complexes) -> Complexes:
        if low is None:
            return np.exp(s * late)
        response = low.response(s) * np.exp(s * low.delay)
        return np.exp(s * late) / (response * np.maximum(1.0, 1.0 / (_STRONGEST * np.abs(response))))

    return _passed(values, step, factor)


def _passed(values: Floats, step: float, factor: Callable[[Complexes], Complexes]) -> Floats:
    """Values (ns,) with their transform multiplied by a factor of s [rad/s]; the end is led back to the beginning."""
    count = len(values)
    whole = int(next_fast_len(count + _BLEND, real=True) or count + _BLEND)
    ends = np.linspace(0.0, np.pi, whole - count + 2)[1:-1]
    led = values[0] + (values[-1] - values[0]) * 0.5 * (1.0 + np.cos(ends))
    s = np.asarray(2.0j * np.pi * np.fft.rfftfreq(whole, step), dtype=np.complex128)
    return np.fft.irfft(np.fft.rfft(np.concatenate([values, led])) * factor(s), whole)[:count]
