"""Several files as one set of frequency responses: roving points, repeats, several drives, different sampling."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray
from scipy.signal import coherence, resample, welch
from scipy.sparse.csgraph import connected_components

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.formats.freedoms import along_axis
from tarsus.modes.agreement import alike
from tarsus.modes.frf import MOTIONS, ROTATIONS, Frf, estimate_frf
from tarsus.records.measurement import Channel, FrequencyResponse, Measurement, Quantity

_AT_REST = 0.05
"""Part of a record at its end in which the drive of a burst is small."""
_QUIET = 0.1
"""Root mean square of the drive there, in parts of its whole one."""
_OVERLAP = 0.5
"""Likeness of the amplitude spectra of the first and last eighth of a drive: pi / 4 for random ones of one spectrum, 0
for a sweep."""
_AVERAGES = 16
"""Averages of a random drive: half overlapping, they leave a quarter of the noise's amplitude."""
_EXCITED = 1e-4
"""Power of the drive, in parts of its largest, from which on a line counts as excited: 40 dB."""
_SMOOTHED = 0.01
"""Part of the lines over which the power of the drive is averaged."""
_SAME_LINE = 0.01
"""Parts of a line's spacing by which lines of two files may differ."""
_WHOLE = 1e-3
"""Parts of a sample by which the common length may miss a whole number of samples of a record."""


def merged(responses: Sequence[FrequencyResponse]) -> Frf:
    """One set of responses of files that hold different points, drives or repeats.

    Responses of the same point to the same drive are repeats and averaged. Points that the files do not name
    themselves, such as one column of each file, and that respond differently are different ones, named by the files.
    Motions of other kinds become the one that most responses are of, the least often differentiated where several are.
    Degrees of freedom, such as ``12-Z``, become those along the positive axes. The order of the files is that of the
    points, and nothing else.

    Raises
    ------
    InputError
        For lines that are not the same, responses of no motion, pairs of point and drive that no file holds, and points
        named alike that respond differently.
    """
    responses = _named_apart(_on_common_lines([_along_axes(one) for one in responses]))
    measured = [output.quantity for one in responses for output in one.outputs]
    quantity = max(measured, key=lambda one: (one not in ROTATIONS, measured.count(one), -MOTIONS.get(one, 0)))
    frequency = responses[0].frequency
    cells: dict[tuple[str, str], list[NDArray[np.complex128]]] = {}
    files: dict[str, str] = {}
    for one in responses:
        for o, output in enumerate(one.outputs):
            if output.quantity not in MOTIONS or quantity not in MOTIONS:
                raise InputError(
                    f"{one.source}: '{output.name}' in {output.quantity.unit} is no motion: are drive and response "
                    "channels swapped?"
                )
            power = (2.0j * np.pi * frequency) ** (MOTIONS[quantity] - MOTIONS[output.quantity])
            files.setdefault(output.at, one.source)
            for i, source in enumerate(one.inputs):
                cells.setdefault((output.at, source.at), []).append(one.values[o, i] * power)
    outputs = list(dict.fromkeys(o for o, _ in cells))
    inputs = list(dict.fromkeys(i for _, i in cells))
    missing = [(o, i) for o in outputs for i in inputs if (o, i) not in cells]
    if missing:
        raise InputError(
            [f"the response of '{o}' to '{i}' is in no file: each point needs one to each drive" for o, i in missing]
        )
    grid = [cells[o, i] for o in outputs for i in inputs]
    shape = (len(outputs), len(inputs), len(frequency))
    mean = np.array([np.mean(found, axis=0) for found in grid]).reshape(shape)
    repeats = None
    counts = {len(found) for found in grid}
    if len(counts) == 1 and counts != {1}:
        repeats = np.swapaxes(grid, 0, 1).reshape(-1, *shape)
    apart = tuple(files[o] for o in outputs)
    return Frf(
        frequency, mean, tuple(outputs), tuple(inputs), quantity, repeats, files=apart if len(set(apart)) > 1 else ()
    )


def _along_axes(one: FrequencyResponse) -> FrequencyResponse:
    """The same with motions and forces along negative axes turned to the positive ones."""
    sides, signs = [], []
    for side in (one.outputs, one.inputs):
        turned = [along_axis(channel.at) for channel in side]
        signs.append(np.array([sign for _, sign in turned]))
        sides.append(
            tuple(
                channel if sign > 0.0 else replace(channel, point=name)
                for channel, (name, sign) in zip(side, turned, strict=True)
            )
        )
    values = one.values * signs[0][:, None, None] * signs[1][:, None]
    return replace(one, outputs=sides[0], inputs=sides[1], values=values)


def _on_common_lines(responses: Sequence[FrequencyResponse]) -> list[FrequencyResponse]:
    """The same on the lines that all have, without 0 Hz and lines just above it, which may be off the grid."""
    spacing = [float(np.median(np.diff(one.frequency))) for one in responses]
    low = max(0.5 * max(spacing), *(float(one.frequency[0]) for one in responses))
    high = min(float(one.frequency[-1]) for one in responses)
    if high < low:
        raise InputError(f"the files have no lines in common: {_spans(responses)}")
    edge = 0.5 * min(spacing)
    cut = [one.between(max(low - edge, edge), high + edge) for one in responses]
    if len({len(one.frequency) for one in cut}) == 1:
        lines = np.array([one.frequency for one in cut])
        if np.max(np.ptp(lines, axis=0)) <= _SAME_LINE * min(spacing):
            return [replace(one, frequency=np.median(lines, axis=0)) for one in cut]
    raise InputError(f"the lines of the files are not the same: {_spans(responses)}; export them with one spacing")


def _spans(responses: Sequence[FrequencyResponse]) -> str:
    return "; ".join(
        f"{one.source} {one.frequency[0]:g} Hz to {one.frequency[-1]:g} Hz in steps of "
        f"{np.median(np.diff(one.frequency)):g} Hz"
        for one in responses
    )


def _named_apart(responses: Sequence[FrequencyResponse]) -> list[FrequencyResponse]:
    """The same, with points that share a name but not a response named by their files."""
    seen: dict[str, list[int]] = {}
    for k, one in enumerate(responses):
        for output in one.outputs:
            seen.setdefault(output.at, []).append(k)
    stems = [PurePath(one.source).stem for one in responses]
    renamed: dict[tuple[int, str], str] = {}
    for name, holding in seen.items():
        groups = _alike_in_groups(responses, name, holding)
        for group in groups if len(groups) > 1 else ():
            channel = next(c for c in responses[group[0]].outputs if c.at == name)
            if channel.point is not None:
                raise InputError(
                    f"{responses[groups[1][0]].source}: point '{name}' does not respond as in another file: is it the "
                    "same point, with the same units and signs?"
                )
            file = stems[group[0]] if stems.count(stems[group[0]]) == 1 else responses[group[0]].source
            renamed |= {(k, name): f"{file} {channel.name}".strip() for k in group}
    return [
        replace(one, outputs=tuple(replace(c, point=renamed.get((k, c.at), c.point)) for c in one.outputs))
        for k, one in enumerate(responses)
    ]


def _alike_in_groups(responses: Sequence[FrequencyResponse], name: str, holding: Sequence[int]) -> list[list[int]]:
    """Numbers of the responses that hold a point, in groups of which each member is like another one to every drive
    that both have."""
    rows = []
    for one in (responses[k] for k in holding):
        values = one.values[[c.at for c in one.outputs].index(name)]
        rows.append(dict(zip((source.at for source in one.inputs), values, strict=True)))
    near = [[all(alike(a[at], b[at]) or alike(b[at], a[at]) for at in a.keys() & b.keys()) for b in rows] for a in rows]
    count, group = connected_components(np.array(near), directed=False)
    return [[k for k, own in zip(holding, group, strict=True) if own == number] for number in range(count)]


def responses_of(
    records: Sequence[Measurement], drive: str | None, band: tuple[float, float] | None, segment: float | None
) -> Frf:
    """Responses of every record to its drive, on lines that all share, merged (`merged`).

    A record without the drive is read on one clock (`synchronised`) with the drive that it follows best. A sweep or a
    burst is transformed whole, with silence behind it up to the longest record; any other drive is taken for random and
    cut into segments.

    Raises
    ------
    InputError
        As `estimate_frf`, and where no record has a drive.
    """
    driven = _with_drives(records, drive)
    sweeps = segment is None and all(_is_sweep(record) for record in driven)
    length = max(record.count * record.step for record in driven)
    if not sweeps:
        shortest = min(record.count * record.step for record in driven)
        length = segment if segment is not None else 2.0 * shortest / (_AVERAGES + 1)
    length = _common_length(length, [record.step for record in driven])
    out = []
    for record in driven:
        if sweeps:
            record = _padded(record, length)
        assert record.drive is not None
        span = band or excited_band(record)
        names = [c.name for c in record.channels if c.name != record.drive and c.quantity in MOTIONS]
        if not names:
            raise InputError(f"{record.source} has no channel of a motion (m, m/s or m/s^2) but its drive")
        by_quantity: dict[Quantity, list[str]] = {}
        for name in names:
            by_quantity.setdefault(record.channel(name).quantity, []).append(name)
        for same in by_quantity.values():
            frf = estimate_frf([record], [record.drive], same, span, segment=None if sweeps else length)
            channels = tuple(record.channel(name) for name in same)
            source = Channel(record.channel(record.drive).at, record.channel(record.drive).quantity)
            out.append(FrequencyResponse(channels, (source,), frf.frequency, frf.values, None, record.source))
    return replace(merged(out), hann=not sweeps, rounding=max(one.rounding for one in driven))


def _with_drives(records: Sequence[Measurement], drive: str | None) -> list[Measurement]:
    """Records with their drive; those without are read on the clock of one that has it."""
    names = [name for one in records for name in one.names]
    if drive is not None and drive not in names:
        raise InputError(f"drive: no record has a channel '{drive}'{nearest(drive, dict.fromkeys(names))}")
    known = [replace(one, drive=drive) if drive is not None and drive in one.names else one for one in records]
    with_drive = [one for one in known if one.drive is not None]
    if not with_drive:
        raise InputError(
            f"{', '.join(one.source for one in records)}: no channel is known to be the drive: name it (drive), or "
            "say that these are free decays (decay)"
        )
    return [one if one.drive is not None else _with_drive_of(with_drive, one) for one in known]


def _with_drive_of(driven: Sequence[Measurement], record: Measurement) -> Measurement:
    """A record with the drive that it follows best, of those that share its time."""
    found: list[Measurement] = []
    problems: list[str] = []
    for other in driven:
        try:
            found.append(synchronised(other, record))
        except InputError as error:
            problems += error.problems
    if not found:
        raise InputError(problems)
    return max(found, key=_followed)


def _followed(record: Measurement) -> float:
    """How well the motions of a record follow its drive: mean coherence, by their power."""
    assert record.drive is not None
    rows = np.array([record[name] for name in record.names if name != record.drive])
    size = max(record.count // _AVERAGES, 8)
    found = coherence(record[record.drive], rows, record.rate, nperseg=size)[1]
    power = welch(rows, record.rate, nperseg=size)[1]
    return float(np.sum(found * power) / np.sum(power))


def synchronised(first: Measurement, second: Measurement) -> Measurement:
    """The drive of one record and the channels of another of the same experiment, on the higher of their sampling
    rates and the time they share.

    The slower ones are continued between their samples by their own spectrum (`scipy.signal.resample`), which is exact
    for what lies below half of their rate.

    Raises
    ------
    InputError
        For records that share no time.
    """
    step = min(first.step, second.step)
    start = max(first.start, second.start)
    end = min(first.start + first.count * first.step, second.start + second.count * second.step)
    if end - start < 8.0 * max(first.step, second.step):
        raise InputError(
            f"{first.source} and {second.source} share no time: from {first.start:g} s and from {second.start:g} s; "
            "records of one experiment need one clock"
        )
    assert first.drive is not None
    first = first.select([first.drive])
    rows = []
    for record in (first, second):
        part = record.between(start - 0.25 * record.step, end - 0.75 * record.step)
        count, values = round(part.count * record.step / step), part.values
        if count != part.count:
            mean = values.mean(axis=1, keepdims=True)
            values = np.asarray(resample(values - mean, count, axis=1)) + mean
        rows.append(values)
    count = min(one.shape[1] for one in rows)
    return Measurement(
        (*first.channels, *second.channels),
        np.concatenate([one[:, :count] for one in rows]),
        step,
        start,
        first.source,  # measured together
        first.drive,
        rounding=max(first.rounding, second.rounding),
    )


def excited_band(record: Measurement) -> tuple[float, float]:
    """Lowest and highest frequency [Hz] that the drive of a record excites within 40 dB of its strongest ones."""
    assert record.drive is not None
    row = record[record.drive]
    power = np.abs(np.fft.rfft(row - row.mean())) ** 2
    width = max(int(_SMOOTHED * len(power)), 1)
    power = np.convolve(power, np.ones(width) / width, "same")
    lines = np.flatnonzero(power >= _EXCITED * power.max())
    frequency = np.fft.rfftfreq(record.count, record.step)
    low, high = float(frequency[lines[0]]), float(frequency[lines[-1]])
    edge = 0.02 * (high - low)
    return low + edge, high - edge


def _is_sweep(record: Measurement) -> bool:
    """Whether the drive of a record ends at rest, as after an impact or a burst, or ends with other frequencies than it
    begins with; a random one has the same in both."""
    assert record.drive is not None
    row = record[record.drive] - np.median(record[record.drive])
    end = row[-max(int(_AT_REST * len(row)), 1) :]
    if np.sqrt(np.mean(end**2)) < _QUIET * np.sqrt(np.mean(row**2)):
        return True
    eighth = len(row) // 8
    first, last = (np.abs(np.fft.rfft(part * np.hanning(eighth))) for part in (row[:eighth], row[-eighth:]))
    return bool(first @ last < _OVERLAP * np.linalg.norm(first) * np.linalg.norm(last))


def _common_length(length: float, steps: Sequence[float], way: int = 1) -> float:
    """The length [s], or a little more (``way`` 1) or less (-1), that is a whole number of samples of every record."""
    coarse = max(steps)
    count = int(np.ceil(length / coarse - 1e-9) if way > 0 else np.floor(length / coarse + 1e-9))
    for more in range(min(1000, count)):
        tried = (count + way * more) * coarse
        if all(abs(tried / step - round(tried / step)) < _WHOLE for step in steps):
            return tried
    return count * coarse


def _padded(record: Measurement, length: float) -> Measurement:
    """A record of a sweep with rest behind it."""
    more = round(length / record.step) - record.count
    if more <= 0:
        return record
    rest = np.median(record.values, axis=1, keepdims=True)
    return replace(record, values=np.concatenate([record.values, np.repeat(rest, more, axis=1)], axis=1))


def decays(records: Sequence[Measurement], drive: str | None = None) -> Frf:
    """Free decays as responses: their spectra, on the lines of the time that they last, from their largest motion on.

    On these lines the spectrum of ``sum(A exp(p t))`` is that of responses with the poles p exactly, however short the
    record: cutting it off multiplies every residue by ``1 - exp(p T)``. Residues are turned as the motions began. Each
    record is an excitation of its own.

    Raises
    ------
    InputError
        For records with different channels, or of no motion.
    """
    if not records:
        raise InputError("there is no record of a free decay")
    known = [c.name for c in records[0].channels if c.quantity in MOTIONS and c.name != drive]
    problems = [
        f"{one.source} has other channels than {records[0].source}: free decays share no drive, so that points "
        "of several files cannot be merged"
        for one in records
        if {c.name for c in one.channels if c.quantity in MOTIONS and c.name != drive} != set(known)
    ]
    if not known:
        problems.append(f"{records[0].source} has no channel of a motion (m, m/s or m/s^2)")
    if problems:
        raise InputError(problems)
    free = []
    for one in records:
        rows = one.select(known).values
        rows = rows - np.median(rows[:, -max(one.count // 10, 1) :], axis=1, keepdims=True)
        size = np.max(np.abs(rows), axis=1, keepdims=True)
        begin = int(np.argmax(np.sum((rows / np.where(size > 0.0, size, 1.0)) ** 2, axis=0)))
        free.append(rows[:, begin:])
    shortest = min(rows.shape[1] * one.step for rows, one in zip(free, records, strict=True))
    length = _common_length(shortest, [one.step for one in records], -1)
    channels = tuple(records[0].channel(name) for name in known)
    out = []
    for k, (rows, one) in enumerate(zip(free, records, strict=True), start=1):
        count = round(length / one.step)
        spectra = np.fft.rfft(rows[:, None, :count], axis=2) * one.step
        release = (Channel(f"release {k}", channels[0].quantity),)
        lines = np.asarray(np.fft.rfftfreq(count, one.step), dtype=np.float64)
        out.append(FrequencyResponse(channels, release, lines, spectra))
    return replace(merged(out), forced=False, rounding=max(one.rounding for one in records))
