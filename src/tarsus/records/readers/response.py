"""From what a file holds to a `FrequencyResponse`: outputs and inputs in SI on one axis, each fault one sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest, some_of
from tarsus.formats.axes import axis_series, series_axis
from tarsus.formats.raw import Axis, Domain, RawFile, RawSeries, Reference, Role
from tarsus.formats.unit_names import Scaled, ratio_of, scaled
from tarsus.records.measurement import Channel, FrequencyResponse
from tarsus.records.readers.choices import ChannelChoice, Choices
from tarsus.records.readers.complexes import with_chosen_parts
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

_ONE_INPUT = "input"
"""Name of the input of a file that names none."""
_REAL_ONLY = (
    "; it holds series of real numbers: name the second part of a response under channels, as imaginary or phase, or "
    "read time series with read_measurement"
)
_OUTPUT = ("what it is of", "what they are of", "give its unit under channels")
_INPUT = ("its input", "their input", "give input_unit")
"""What is not known of one response and of several, and what to do."""


@dataclass(frozen=True)
class _Response:
    """A response with its output, its input and the unit of that."""

    output: Selected
    input: str
    input_scaled: Scaled

    @property
    def factor(self) -> float:
        return self.output.scaled.factor / self.input_scaled.factor


def response_of(raw: RawFile, choices: Choices) -> FrequencyResponse:
    """The responses chosen from a file, in SI.

    Raises
    ------
    InputError
        With every fault found: file, response and cause.
    """
    raw = with_chosen_parts(raw.one(choices.record), choices)
    candidates = [
        one
        for one in raw.series
        if one.role is Role.RESPONSE or (one.role is Role.SIGNAL and np.iscomplexobj(one.values))
    ]
    if not candidates:
        signals = any(one.role is Role.SIGNAL for one in raw.series)
        nothing = f"{raw.source} holds no complex frequency response" + (_REAL_ONLY if signals else "")
        raise InputError(nothing)
    found, notes = _with_units(raw, choices, _of_inputs(raw, choices, candidates))
    axis, on_lines = _lines(raw, choices, [one.output.series for one in found])
    first = 1 if _bad_zero(found, axis) else 0
    if first:
        on_lines = [*on_lines, f"{raw.source}: no finite number at 0 Hz: that line is not used"]
    problems = [
        text
        for one in found
        for text in (
            *check_count(raw.source, one.output.series),
            *_length_fault(raw.source, one.output.series, axis),
            *not_finite(raw.source, one.output.series, len(axis.values), first),
        )
    ]
    if problems:
        raise InputError(problems)
    outputs = list(dict.fromkeys(one.output.name for one in found))
    inputs = list(dict.fromkeys(one.input for one in found))
    shape = (len(outputs), len(inputs), len(axis.values))
    values = np.zeros(shape, dtype=complex)
    coherence = np.full(shape, np.nan)
    missing = {(o, i) for o in outputs for i in inputs}
    for one in found:
        place = outputs.index(one.output.name), inputs.index(one.input)
        if (one.output.name, one.input) not in missing:
            problems.append(f"{raw.source}: the response of '{one.output.name}' to '{one.input}' is there twice")
        missing.discard((one.output.name, one.input))
        values[place][first:] = one.output.series.values[first:] * one.factor
        coherence[place], more = _coherence(raw, one, shape[-1])
        notes += more
    problems += [f"{raw.source}: the response of '{o}' to '{i}' is missing" for o, i in sorted(missing)]
    if problems:
        raise InputError([f"{text}; choose with channels and inputs" for text in problems])
    left = [one.name for one in candidates if not any(one is used.output.series for used in found)]
    if left:
        notes.append(f"{raw.source}: responses not used: {some_of(left)}")
    by_output = {one.output.name: channel_of(raw.source, one.output) for one in found}
    by_input = {one.input: Channel(one.input, one.input_scaled.quantity) for one in found}
    known = None if np.all(np.isnan(coherence)) else coherence
    try:
        return FrequencyResponse(
            tuple(by_output[name] for name in outputs),
            tuple(by_input[name] for name in inputs),
            axis.values[first:],
            values[..., first:],
            None if known is None else known[..., first:],
            raw.source,
            tuple([*raw.notes, *notes, *on_lines]),
        )
    except InputError as error:
        raise InputError([f"{raw.source}: {problem}" for problem in error.problems]) from None


def _of_inputs(raw: RawFile, choices: Choices, candidates: Sequence[RawSeries]) -> list[RawSeries]:
    """Responses to the inputs that were asked for."""
    if not choices.inputs:
        return list(candidates)
    known = list(dict.fromkeys(_reference(one).name for one in candidates))
    missing = [name for name in choices.inputs if name not in known]
    if missing:
        raise InputError([f"{raw.source} has no input '{name}'{nearest(name, known)}" for name in missing])
    return [one for one in candidates if _reference(one).name in choices.inputs]


def _reference(series: RawSeries) -> Reference:
    return series.reference or Reference(_ONE_INPUT, "")


def _with_units(raw: RawFile, choices: Choices, candidates: Sequence[RawSeries]) -> tuple[list[_Response], list[str]]:
    """Responses whose quantities are known; the others are a problem if they were asked for, else a note."""
    found, notes = [], []
    unknown: dict[tuple[str, ...], list[str]] = {}
    for series, choice in chosen_series(raw, choices, candidates):
        output, source = _quantities(series, choice, choices)
        if output is not None and source is not None:
            found.append(_Response(Selected(series, choice, output), _reference(series).name, source))
            notes += unit_note(raw.source, series, choice)
            continue
        for known, *words in ((output, *_OUTPUT), (source, *_INPUT)):
            if known is None:
                unknown.setdefault(tuple(words), []).append(series.name)
    without = [
        (
            f"{raw.source}: nothing says of the response{'s' * (len(names) > 1)} {some_of(names)} "
            f"{one if len(names) == 1 else many}",
            cure,
            (),
        )
        for (one, many, cure), names in unknown.items()
    ]
    return found, [*notes, *without_units(without, asked=bool(choices.channels or not found))]


def _quantities(series: RawSeries, choice: ChannelChoice, choices: Choices) -> tuple[Scaled | None, Scaled | None]:
    """Output and input of a response: from a unit of both, such as ``m/s/N``, or from a unit of each."""
    reference = _reference(series)
    of_input = scaled(reference.unit)
    if of_input is not None:
        of_input = of_input._replace(factor=of_input.factor * reference.factor)
    of_file = ratio_of(series.unit) or (scaled_series(series, ChannelChoice()), of_input)
    given = (None, None)
    if choice.unit is not None:
        given = ratio_of(choice.unit) or (scaled(choice.unit), None)
        if given[0] is None:
            return None, given[1]
    source = None if choices.input_unit is None else scaled(choices.input_unit)
    return given[0] or of_file[0], source or given[1] or of_file[1]


def _lines(raw: RawFile, choices: Choices, used: Sequence[RawSeries]) -> tuple[Axis, list[str]]:
    """The common frequencies."""
    if choices.frequency_step is not None:
        count = len(used[0].values)
        return Axis(Domain.FREQUENCY, choices.frequency_step * np.arange(count, dtype=float)), [
            f"{raw.source}: lines every {choices.frequency_step:g} Hz from 0 Hz, as given"
        ]
    own = [one.axis for one in used if one.axis is not None]
    if len(own) == len(used) and choices.axis is None:
        other = [
            f"{raw.source}: the responses '{used[0].name}' and '{one.name}' have different frequencies; read them one "
            "at a time"
            for one, axis in zip(used, own, strict=True)
            if len(axis.values) != len(own[0].values) or not np.allclose(axis.values, own[0].values, rtol=1e-9)
        ]
        if other:
            raise InputError(other)
        return own[0], []
    column = axis_series(raw, Domain.FREQUENCY, choices.axis, choices.groups)
    if column is None:
        raise InputError(
            f"{raw.source} says no frequencies; give frequency_step (lines from 0 Hz), or the series of "
            "frequencies with axis"
        )
    return series_axis(raw, column, Domain.FREQUENCY, choices.axis_unit, choices.axis is not None), []


def _bad_zero(found: Sequence[_Response], axis: Axis) -> bool:
    """Whether a response has no finite number at 0 Hz, as after a division by its frequency."""
    return axis.values[0] == 0.0 and any(not np.isfinite(one.output.series.values[:1]).all() for one in found)


def _length_fault(source: str, series: RawSeries, axis: Axis) -> list[str]:
    if len(series.values) == len(axis.values):
        return []
    return [
        f"{source}: the response '{series.name}' has {len(series.values)} lines where the axis has {len(axis.values)}"
    ]


def _coherence(raw: RawFile, one: _Response, count: int) -> tuple[NDArray[np.float64], list[str]]:
    """Coherence of a response (nf,), nan where it is not known or not between 0 and 1, with a note."""
    named = one.output.choice.coherence
    fitting = (
        series
        for series in raw.series
        if series.role is Role.COHERENCE
        and series.name == one.output.series.name
        and _reference(series).name == one.input
    )
    series = next(fitting, None) if named is None else raw.named(named)
    if series is None:
        return np.full(count, np.nan), []
    if len(series.values) != count or np.iscomplexobj(series.values):
        raise InputError(
            f"{raw.source}: the coherence '{series.name}' is not {count} real numbers, as its response has"
        )
    values = series.values.astype(float)
    inside = (values >= 0.0) & (values <= 1.0)
    values[~inside] = np.nan
    bad = int(np.count_nonzero(~inside))
    return values, [
        f"{raw.source}: the coherence of '{one.output.name}' is not between 0 and 1 at {bad} lines; it counts as "
        "unknown there"
    ] if bad else []
