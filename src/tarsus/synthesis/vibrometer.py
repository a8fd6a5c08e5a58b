"""A synthetic laser vibrometer: what an instrument would have recorded of a run."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field
from scipy.signal import lfilter

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import Amount, Description, MaybeAmount, quantity, with_values
from tarsus.impacts.free import point_rows
from tarsus.records.measurement import Channel, Measurement, Quantity

if TYPE_CHECKING:
    from tarsus.solve import Run


_OVERSAMPLING = 16
"""Samples of the run per recorded sample where the bandwidth of the instrument is limited."""


class Vibrometer(Description):
    """An instrument that records the velocity of points, and the volts of the drives with it.

    The velocity is that of the run itself, without interpolation, at times ``delay + k / rate``; then come, in this
    order, the bandwidth (a first-order low-pass), offset and drift of the zero, white noise, and rounding to the
    steps of the converter. A wrong zero of the displacement comes from integrating, as in (3.34).
    """

    rate: Amount = quantity("Hz", "samples per second", default=200e3, gt=0)
    noise: Amount = quantity("m/s", "standard deviation of the white noise of a sample", default=0.0, ge=0)
    full_scale: MaybeAmount = quantity(
        "m/s", "largest velocity the converter can give; beyond it the record is clipped", default=None, gt=0
    )
    bits: int = Field(default=16, ge=2, le=32, description="bits of the converter, used with a full scale")
    offset: Amount = quantity("m/s", "standard deviation of the zero from record to record", default=0.0, ge=0)
    drift: Amount = quantity(
        "m/s", "standard deviation by which the zero has wandered after one second", default=0.0, ge=0
    )
    jitter: Amount = quantity("s", "the trigger is late by anything from 0 to this", default=0.0, ge=0)
    bandwidth: MaybeAmount = quantity("Hz", "frequency at which 3 dB are lost", default=None, gt=0)

    def at_level(self, run: Run, points: Iterable[str], decibels: float) -> Vibrometer:
        """The same instrument with noise ``decibels`` below the root mean square velocity of all ``points``."""
        velocity = point_velocities(run, tuple(points), np.arange(0.0, run.end_time, 1.0 / self.rate))
        level = float(np.sqrt(np.mean(velocity**2)))
        return with_values(self, {"noise": level * 10.0 ** (-decibels / 20.0)})

    def measure(self, run: Run, points: Iterable[str], seed: int) -> Measurement:
        """Record a run.

        Parameters
        ----------
        run
            Recorded by `tarsus.simulate`.
        points
            Names of points of its structure, one channel of velocity each.
        seed
            Of the random numbers; the same seed gives the same record.

        Raises
        ------
        InputError
            For a point that the structure does not have, or a run shorter than two samples.
        """
        names = tuple(points)
        random = np.random.default_rng(seed)
        delay = float(random.uniform(0.0, self.jitter)) if self.jitter else 0.0
        count = int(np.floor((run.end_time - delay) * self.rate * (1.0 + 1e-12))) + 1
        if count < 2:
            raise InputError(
                f"the run of {run.end_time:g} s is shorter than two samples of a vibrometer with {self.rate:g} Hz"
            )
        times = np.minimum(delay + np.arange(count) / self.rate, run.end_time)
        velocity = self._converted(self._passed(run, names, times), random)
        channels = [
            Channel(name, Quantity.VELOCITY, noise=self._floor() or None, full_scale=self.full_scale) for name in names
        ]
        volts = []
        signals = run.scene.actuator_volts
        for drive in run.scene.waveforms:
            channels.append(Channel(f"{drive} volts", Quantity.VOLTAGE))
            volts.append(signals[drive].volts(times))
        return Measurement(
            tuple(channels), np.vstack([velocity, *volts]), 1.0 / self.rate, source=f"vibrometer of {run.scene.name}"
        )

    def _floor(self) -> float:
        """Standard deviation of a sample [m/s]: noise, and rounding as the uniform error it nearly is."""
        rounding = self._step() / np.sqrt(12.0)
        return float(np.hypot(self.noise, rounding))

    def _step(self) -> float:
        return 0.0 if self.full_scale is None else 2.0 * self.full_scale / 2.0**self.bits

    def _passed(self, run: Run, names: tuple[str, ...], times: Floats) -> Floats:
        """Velocities (np, nt) behind the low-pass."""
        if self.bandwidth is None:
            return point_velocities(run, names, times)
        fine = 1.0 / (self.rate * _OVERSAMPLING)
        dense = times[0] + fine * np.arange((len(times) - 1) * _OVERSAMPLING + 1)
        velocity = point_velocities(run, names, np.minimum(dense, run.end_time))
        share = -np.expm1(-2.0 * np.pi * self.bandwidth * fine)
        start = (1.0 - share) * velocity[:, :1]
        passed, _ = lfilter([share], [1.0, share - 1.0], velocity, axis=1, zi=start)
        return passed[:, ::_OVERSAMPLING]

    def _converted(self, velocity: Floats, random: np.random.Generator) -> Floats:
        out = velocity + self.offset * random.standard_normal((len(velocity), 1))
        if self.drift:
            steps = random.standard_normal(velocity.shape) * (self.drift / np.sqrt(self.rate))
            out = out + np.cumsum(steps, axis=1)
        out = out + self.noise * random.standard_normal(velocity.shape)
        if self.full_scale is None:
            return out
        step = self._step()
        return np.clip(np.round(out / step) * step, -self.full_scale, self.full_scale)


def point_velocities(run: Run, points: tuple[str, ...], times: Floats) -> Floats:
    """Velocities of points along +z [m/s], shape (np, nt), at ``times`` [s] of a run.

    Raises
    ------
    InputError
        For a point that the structure does not have.
    """
    return point_rows(run.scene.robot.structure, points) @ run.at(times).state.v
