"""The axis of what a file holds: which series it is, whether it is even, and whether it agrees with the header."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import some_of
from tarsus.formats.numerals import rounding_of_step
from tarsus.formats.raw import Axis, Declared, Domain, RawFile, RawSeries
from tarsus.formats.unit_names import frequency_factor, time_factor

_NAMES = {
    Domain.TIME: {
        "t",
        "time",
        "times",
        "time_domain",
        "time_s",
        "timestamp",
        "zeit",
        "temps",
        "tiempo",
        "tempo",
        "t_s",
        "x_value",
    },
    Domain.FREQUENCY: {
        "f",
        "freq",
        "freqs",
        "frequency",
        "frequencies",
        "freq_domain",
        "frequency_hz",
        "frequenz",
        "fréquence",
        "frecuencia",
        "freq_hz",
        "f_hz",
    },
}
_FACTOR = {Domain.TIME: time_factor, Domain.FREQUENCY: frequency_factor}
_SI = {Domain.TIME: "s", Domain.FREQUENCY: "Hz"}
_AGREES = 2e-4
"""Relative difference of two sampling steps that is no disagreement, beyond the step of their digits."""

_ROUNDED = 0.1
"""Share of a header's step beyond which another is no rounding of it, though it has one digit (2e-05 and 1e-05)."""


class Sampling(NamedTuple):
    """An even time axis [s]; rounding: share by which the step may be off, by the digits it was written in."""

    step: float
    start: float
    rounding: float = 0.0


def axis_series(
    raw: RawFile, domain: Domain, chosen: str | None = None, groups: Collection[str] = ()
) -> RawSeries | None:
    """The series of times or frequencies: the one chosen, or the only one that its unit or its name shows to be it.

    groups: those of the channels that are read, by their names; an axis in the only group is nearer.

    Raises
    ------
    InputError
        If the one chosen is not there, or several are possible.
    """
    if chosen is not None:
        return raw.named(chosen)
    found = [one for one in raw.series if is_axis(one, domain)]
    named = [one for one in found if _has_name(one, domain)]
    if len(found) > 1 and len(named) == 1:
        return named[0]
    if len(found) > 1 and all(_same(one, found[0]) for one in found):
        return found[0]  # the times of every channel, which are the same
    grouped = [one for one in found if {one.name.rpartition("/")[0]} == set(groups)]
    if len(found) > 1 and len(grouped) == 1:
        return grouped[0]
    if len(found) > 1:
        shown = " and ".join(f"'{one.name}'" for one in found)
        raise InputError(f"{raw.source}: {shown} may each be the axis; say which with axis")
    return found[0] if found else None


def _same(one: RawSeries, other: RawSeries) -> bool:
    groups = {series.name.rpartition("/")[0] for series in (one, other)}
    return len(groups) == 1 and one.unit == other.unit and np.array_equal(one.values, other.values)


def is_axis(series: RawSeries, domain: Domain) -> bool:
    """Whether a series may be the axis, by its unit, or by its name where it has none."""
    if np.iscomplexobj(series.values) or len(series.values) < 2 or series.axis is not None:
        return False
    if series.unit:
        return _FACTOR[domain](series.unit) is not None
    return _has_name(series, domain)


def _has_name(series: RawSeries, domain: Domain) -> bool:
    name = series.name.rpartition("/")[2].rpartition(".")[2].strip().lower()
    return name.removesuffix("[0]") in _NAMES[domain]


def series_axis(raw: RawFile, series: RawSeries, domain: Domain, unit: str | None = None, chosen: bool = False) -> Axis:
    """A series of the file as axis, in SI; unit: the one given, in place of the file's; chosen: by its name.

    Raises
    ------
    InputError
        If its unit is none of a time or a frequency.
    """
    if np.iscomplexobj(series.values):
        raise InputError(f"{raw.source}: '{series.name}' is complex and cannot be the axis")
    said = unit or series.unit or _SI[domain]
    factor = _FACTOR[domain](said)
    if factor is None and unit is None and chosen:
        factor = 1.0  # chosen by name: a label that is no unit does not overrule it
    if factor is None:
        raise InputError(
            f"{raw.source}: the axis '{series.name}' is in '{said}', which is no unit of "
            f"{'time' if domain is Domain.TIME else 'frequency'}; give axis_unit"
        )
    whole = bool(np.all(series.values == np.rint(series.values)))  # which are exact, and differences of floats too
    rounding = 0.0 if whole else float(np.spacing(np.max(np.abs(series.values), initial=0.0)))
    # seconds since 1970 leave a double few digits: times count from the first
    first = series.values[0] if domain is Domain.TIME and len(series.values) and np.isfinite(series.values[0]) else 0
    values = (series.values - first).astype(float) * factor
    return Axis(domain, values, (series.resolution + rounding) * factor, float(first) * factor)


def sampling_step(time: ArrayLike, resolution: float = 0.0) -> float:
    """Step [s] of evenly sampled times (ns,).

    Parameters
    ----------
    time
        Times [s].
    resolution
        Step of the digits the times were written in [s], to which they are rounded: a step is wrong by as much at most.

    Raises
    ------
    InputError
        If a time is not finite, the times do not increase, or they are not evenly spaced within 1 % of a step and the
        rounding of their digits.
    """
    times = np.asarray(time, dtype=float)
    if times.ndim != 1 or len(times) < 2:
        raise InputError(f"expected at least 2 times, got an array of shape {times.shape}")
    if not np.all(np.isfinite(times)):
        bad = int(np.flatnonzero(~np.isfinite(times))[0])
        raise InputError(f"the time column has no finite number at sample {bad}")
    resolution += float(np.spacing(np.max(np.abs(times))))  # seconds since 1970 in double precision: 0.24 us
    step = float((times[-1] - times[0]) / (len(times) - 1))
    steps = np.diff(times)
    back = steps < 0.0 if 0.0 < step < resolution else steps <= 0.0  # finer than its digits, times repeat
    if step <= 0.0 or np.any(back):
        bad = int(np.flatnonzero(back)[0]) if np.any(back) else 0
        raise InputError(f"the times do not increase at sample {bad + 1}")
    off = np.abs(steps - step)
    if off.max() > 0.01 * step + resolution:
        bad = int(np.argmax(off))
        raise InputError(
            f"the sampling is not even: the step is {step:g} s on average and {steps[bad]:g} s after sample {bad}"
        )
    return step


def even(source: str, times: NDArray[np.float64], resolution: float) -> Sampling:
    """Step and start of a column of times, whose step is exact where all are alike and such as is set by hand.

    Raises
    ------
    InputError
        With the file's name, if they are not even.
    """
    try:
        step = sampling_step(times, resolution)
        alike = np.ptp(np.diff(times)) <= 4.0 * np.spacing(np.max(np.abs(times)))
        exact = alike and not rounding_of_step(step, resolution)
        rounding = 0.0 if exact else resolution / (step * (len(times) - 1))
        return Sampling(step, float(times[0]), rounding)
    except InputError as error:
        raise InputError(f"{source}: {error}") from None


def check_declared(
    raw: RawFile, channels: Iterable[RawSeries], step: float, resolution: float, chosen: bool, axis: str
) -> list[str]:
    """Notes on headers that say another step than the axis.

    Raises
    ------
    InputError
        If they disagree and nothing was chosen.
    """
    said: dict[tuple[str, float], tuple[Declared, list[str]]] = {}
    for one in channels:
        declared = one.declared or raw.declared
        if declared is None:
            continue
        rounded = min(declared.resolution, _ROUNDED * declared.step)
        if abs(declared.step - step) > _AGREES * step + rounded + resolution:
            said.setdefault((declared.where, declared.step), (declared, []))[1].append(one.name)
    texts = []
    for declared, names in said.values():
        texts.append(
            f"{raw.source}: {declared.where} says one sample every {declared.step:g} s for {some_of(names)}, "
            f"but {axis} has one every {step:g} s"
        )
    if texts and not chosen:
        raise InputError([f"{text}; say which holds with axis or step" for text in texts])
    return [f"{text}; {axis} is used, as chosen" for text in texts]
