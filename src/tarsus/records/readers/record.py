"""From what a file holds to a `Measurement`: channels in SI on one even time axis, each fault one sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tarsus.base.errors import Fault, InputError, InputProblem
from tarsus.base.messages import nearest, some_of
from tarsus.formats.axes import Sampling, axis_series, check_declared, even, is_axis, series_axis
from tarsus.formats.raw import Domain, RawFile, RawSeries, Role
from tarsus.formats.unit_names import frequency_factor, scaled
from tarsus.records.clipping import clipped_samples
from tarsus.records.measurement import Measurement, Quantity
from tarsus.records.readers.choices import Choices
from tarsus.records.readers.selecting import (
    Selected,
    channel_of,
    check_count,
    chosen_series,
    not_finite,
    scaled_series,
    unit_note,
    without_units,
)

_COARSE = 1e-4
"""Share of the sampling rate from which its rounding is noted: records determine a frequency to some 1e-4."""


def measurement_of(raw: RawFile, choices: Choices) -> Measurement:
    """The channels chosen from a file, in SI.

    Raises
    ------
    InputError
        With every fault found: file, channel and cause.
    """
    raw = raw.one(choices.record)
    column = None if choices.step is not None else axis_series(raw, Domain.TIME, choices.axis, choices.groups)
    over_lines = _over_lines(raw, column is not None or choices.step is not None)
    candidates = [
        one
        for one in raw.series
        if one is not column
        and one.role is Role.SIGNAL
        and not np.iscomplexobj(one.values)
        and (one.axis is None or one.axis.domain is Domain.TIME)
        and (frequency_factor(one.unit) is None or scaled(one.unit) is not None)
        and (one.name not in over_lines or one.name in choices.channels)
    ]
    if not candidates:
        raise InputError(_no_series(raw))
    selected, notes = _with_units(raw, choices, candidates)
    notes = [*raw.notes, *notes, *_left_out(raw, candidates, column)]
    if choices.channels:
        notes += _not_chosen(raw, candidates, selected)
    selected, length, more = _same_length(raw, choices, selected, column)
    sampling, on_time = _sampling(raw, choices, [one.series for one in selected], column, length)
    problems = [
        text
        for one in selected
        for text in (*check_count(raw.source, one.series), *not_finite(raw.source, one.series, length))
    ]
    if problems:
        raise InputError(problems)
    values = np.array([one.series.values[:length].astype(float) * one.scaled.factor for one in selected])
    drive = _drive(raw, choices, selected)
    if sampling.rounding > _COARSE:
        on_time.append(
            f"{raw.source}: the sampling rate of {1.0 / sampling.step:.6g} Hz may be wrong by "
            f"{100.0 * sampling.rounding:.2g} %, since the file writes times or steps in few digits"
        )
    notes += [*more, *on_time, *_clipping(raw, selected, values), *_constant(raw, selected, values, drive)]
    if drive is None:
        notes.append(f"{raw.source}: no channel is known to be the drive; name it with drive")
    channels = tuple(channel_of(raw.source, one) for one in selected)
    try:
        return Measurement(
            channels, values, sampling.step, sampling.start, raw.source, drive, tuple(notes), sampling.rounding
        )
    except InputError as error:
        raise InputError([f"{raw.source}: {problem}" for problem in error.problems]) from None


def _over_lines(raw: RawFile, timed: bool) -> set[str]:
    """Names of the frequencies of complex responses, and of what has as many numbers where no times are known:
    coherences, amplitudes."""
    if not any(np.iscomplexobj(one.values) for one in raw.series):
        return set()
    axes = [one for one in raw.series if is_axis(one, Domain.FREQUENCY)]
    counts = set() if timed or raw.declared else {len(one.values) for one in axes}
    others = [one for one in raw.series if one.declared is None and len(one.values) in counts]
    return {one.name for one in (*axes, *others)}


def _no_series(raw: RawFile) -> InputProblem:
    said = f"{raw.source} holds no time series"
    if any(one.role is Role.RESPONSE or np.iscomplexobj(one.values) for one in raw.series):
        said += "; it holds frequency responses: read them with read_response"
        return InputProblem(said, fault=Fault.RESPONSES)
    return InputProblem(said, fault=Fault.NO_SERIES)


def _with_units(raw: RawFile, choices: Choices, candidates: Sequence[RawSeries]) -> tuple[list[Selected], list[str]]:
    """Series whose quantity is known; the others are a problem if they were asked for, else a note."""
    selected, notes = [], []
    unknown: dict[str, list[str]] = {}
    for series, choice in chosen_series(raw, choices, candidates):
        found = scaled_series(series, choice)
        if found is not None:
            selected.append(Selected(series, choice, found))
            notes += unit_note(raw.source, series, choice)
            continue
        unknown.setdefault(choice.unit or series.unit, []).append(series.name)
    cure = "give its unit under channels"
    without = [
        (
            f"{raw.source}: nothing says what "
            + (f"channel {some_of(names)} measures" if len(names) == 1 else f"channels {some_of(names)} measure")
            + (f" ('{said}' is no unit of a known quantity)" if said else ""),
            cure,
            names,
        )
        for said, names in unknown.items()
    ]
    return selected, [*notes, *without_units(without, asked=bool(choices.channels or not selected))]


def _left_out(raw: RawFile, candidates: Sequence[RawSeries], column: RawSeries | None) -> list[str]:
    other = [one.name for one in raw.series if one is not column and not any(one is c for c in candidates)]
    return [f"{raw.source}: not used, since no time series: {some_of(other)}"] if other else []


def _not_chosen(raw: RawFile, candidates: Sequence[RawSeries], selected: Sequence[Selected]) -> list[str]:
    chosen = {id(one.series) for one in selected}
    other = [one.name for one in candidates if id(one) not in chosen]
    return [f"{raw.source}: not chosen: {some_of(other)}"] if other else []


def _same_length(
    raw: RawFile, choices: Choices, selected: list[Selected], column: RawSeries | None
) -> tuple[list[Selected], int, list[str]]:
    """Channels that share the axis, their number of samples, and what is said about the others."""
    lengths = [len(one.series.values) for one in selected] + ([] if column is None else [len(column.values)])
    wanted = max(lengths) if column is None else lengths[-1]
    if raw.ragged:
        shortest = int(np.min(lengths))
        notes = [
            f"{raw.source}: channel '{one.series.name}' goes on for {length - shortest} samples after the shortest "
            "column ends; they are not used"
            for one, length in zip(selected, lengths, strict=False)
            if length > shortest
        ]
        return selected, shortest, notes
    fitting = [one for one in selected if len(one.series.values) == wanted]
    other = [one for one in selected if len(one.series.values) != wanted]
    against = "others have" if column is None else f"'{column.name}' has"
    texts = [
        InputProblem.of_channel(
            raw.source, one.series.name, f"has {len(one.series.values)} samples where {against} {wanted}"
        )
        for one in other
    ]
    if texts and (choices.channels or not fitting):
        raise InputError(texts)
    return fitting, wanted, [f"{text}: not used" for text in texts]


def _sampling(
    raw: RawFile, choices: Choices, used: Sequence[RawSeries], column: RawSeries | None, length: int
) -> tuple[Sampling, list[str]]:
    if choices.step is not None:
        notes = check_declared(raw, used, choices.step, 0.0, True, "the step that was given")
        return Sampling(choices.step, 0.0), notes
    if column is not None:
        axis = series_axis(raw, column, Domain.TIME, choices.axis_unit, choices.axis is not None)
        sampling = even(raw.source, axis.values[:length], axis.resolution)
        sampling = sampling._replace(start=sampling.start + axis.origin)
        shown = f"the column '{column.name}'"
        resolution = axis.resolution / max(length - 1, 1)
        notes = check_declared(raw, used, sampling.step, resolution, choices.axis is not None, shown)
        return _sharper(raw, used, sampling) if not notes else sampling, notes
    own = [(one, one.axis) for one in used if one.axis is not None]
    if len(own) == len(used):
        found = [(one, even(raw.source, axis.values[:length], axis.resolution)) for one, axis in own]
        first = found[0][1]
        problems = [
            InputProblem.of_channel(
                raw.source,
                one.name,
                f"is sampled every {other.step:g} s from {other.start:g} s, '{found[0][0].name}' every "
                f"{first.step:g} s from {first.start:g} s; read them one at a time",
            )
            for one, other in found[1:]
            if abs(other.step - first.step) > 1e-9 * first.step or abs(other.start - first.start) > 0.01 * first.step
        ]
        if problems:
            raise InputError(problems)
        of_header = max((one.declared.rounding for one in used if one.declared is not None), default=0.0)
        first = first._replace(rounding=max(first.rounding, of_header))
        return first, check_declared(raw, used, first.step, 0.0, False, "the axis of the file")
    declared = [one.declared or raw.declared for one in used]
    known = [one for one in declared if one is not None]
    if len(known) < len(used):
        raise InputError(
            f"{raw.source} says neither times nor a sampling rate; give step, or the series of times with axis"
        )
    notes = check_declared(raw, used, known[0].step, known[0].resolution, False, f"{known[0].where} elsewhere")
    return Sampling(known[0].step, known[0].start, known[0].rounding), [
        *notes,
        f"{raw.source}: the sampling step of {known[0].step:g} s is that of {known[0].where}",
    ]


def _sharper(raw: RawFile, used: Sequence[RawSeries], sampling: Sampling) -> Sampling:
    """The sampling of a column of times, with the step of the header that agrees with it where that has more digits."""
    stated = [found for one in used if (found := one.declared or raw.declared) is not None]
    best = min(stated, key=lambda one: one.rounding, default=None)
    if best is None or best.rounding >= sampling.rounding:
        return sampling
    return sampling._replace(step=best.step, rounding=best.rounding)


def _drive(raw: RawFile, choices: Choices, selected: Sequence[Selected]) -> str | None:
    """Name of the drive's channel: the one named, else the only one that the file or its quantity marks."""
    if choices.drive is not None:
        for one in selected:
            if choices.drive in (one.name, one.series.name):
                return one.name
        names = [one.name for one in selected]
        raise InputError(
            f"{raw.source}: the drive is missing: no channel '{choices.drive}' was read{nearest(choices.drive, names)}"
        )
    marked = [one.name for one in selected if one.series.excitation]
    volts = [one.name for one in selected if one.scaled.quantity is Quantity.VOLTAGE]
    forces = [one.name for one in selected if one.scaled.quantity is Quantity.FORCE]
    for names in (marked, volts, forces):
        if names:
            return names[0] if len(names) == 1 else None
    return None


def _clipping(raw: RawFile, selected: Sequence[Selected], values: np.ndarray) -> list[str]:
    """Notes on clipped channels that were accepted; the others are refused. Volts may stay at an extreme: a square."""
    notes, problems = [], []
    for one, row in zip(selected, values, strict=True):
        channel = channel_of(raw.source, one)
        count = 0 if one.scaled.quantity is Quantity.VOLTAGE else clipped_samples(row)
        cause = "stand in runs at its largest or smallest value"
        if channel.full_scale is not None:
            reached = int(np.count_nonzero(np.abs(row) >= channel.full_scale))
            if reached > count:
                count = reached
                cause = f"reach its full scale of {channel.full_scale:g} {one.scaled.quantity.unit}"
        if not count:
            continue
        text = f"is clipped: {count} of {len(row)} samples {cause}"
        if one.choice.accept_clipped:
            notes.append(f"{raw.source}: channel '{one.series.name}' {text}; it is used, as chosen")
        else:
            cure = "measure in a wider range, or take it with accept_clipped"
            problems.append(InputProblem.of_channel(raw.source, one.series.name, f"{text}; {cure}"))
    if problems:
        raise InputError(problems)
    return notes


def _constant(raw: RawFile, selected: Sequence[Selected], values: np.ndarray, drive: str | None) -> list[str]:
    """Notes on channels that never change; a drive that never changes is missing."""
    notes = []
    for one, row in zip(selected, values, strict=True):
        if row.min() < row.max():
            continue
        said = f"channel '{one.series.name}' is {row[0]:g} {one.scaled.quantity.unit} throughout"
        if one.name == drive:
            raise InputError(f"{raw.source}: the drive is missing: {said}")
        notes.append(f"{raw.source}: {said}")
    return notes
