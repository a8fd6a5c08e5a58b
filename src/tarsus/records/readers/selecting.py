"""Which series of a file become channels, and what is said about the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.errors import Fault, InputError, InputProblem
from tarsus.base.messages import nearest
from tarsus.base.units import parse_quantity
from tarsus.formats.raw import RawFile, RawSeries, truncated
from tarsus.formats.unit_names import Scaled, scaled
from tarsus.records.measurement import Channel
from tarsus.records.readers.choices import ChannelChoice, Choices


@dataclass(frozen=True)
class Selected:
    """A series with what was chosen for it, and its quantity and factor to SI."""

    series: RawSeries
    choice: ChannelChoice
    scaled: Scaled

    @property
    def name(self) -> str:
        """Name of the channel."""
        return self.choice.name or self.series.name


def scaled_series(series: RawSeries, choice: ChannelChoice) -> Scaled | None:
    """Quantity and factor to SI of a series: what was chosen, else what the file says; None if neither is known."""
    factor = (1.0 if choice.factor is None else choice.factor) * (series.factor if choice.unit is None else 1.0)
    found = scaled(series.unit if choice.unit is None else choice.unit)
    return None if found is None else found._replace(factor=found.factor * factor)


def chosen_series(
    raw: RawFile, choices: Choices, candidates: Sequence[RawSeries]
) -> list[tuple[RawSeries, ChannelChoice]]:
    """Series that were asked for, the drive with them, or all candidates where nothing was.

    Raises
    ------
    InputError
        For every name asked for that is not there.
    """
    if not choices.channels:
        return [(one, ChannelChoice()) for one in candidates]
    known = replace(raw, series=tuple(candidates)).names
    chosen, missing = {}, []
    for name, choice in choices.channels.items():
        found = [name] if name in known else _columns(name, choice, known)
        chosen.update(dict.fromkeys(found, choice))
        missing += [] if found else [name]
    if choices.drive in known and choices.drive not in {choice.name for choice in choices.channels.values()}:
        chosen.setdefault(choices.drive, ChannelChoice())  # who names the drive asks for it
    if missing:
        raise InputError(
            [
                f"{raw.source}: '{name}' is not of the kind asked for"
                if name in raw.names
                else InputProblem(
                    f"{raw.source} has no channel '{name}'{nearest(name, known)}",
                    path=raw.source,
                    channel=name,
                    fault=Fault.NO_CHANNEL,
                )
                for name in missing
            ]
        )
    return [(one, choice) for name, choice in chosen.items() for one in candidates if one.name == name]


def _columns(table: str, choice: ChannelChoice, known: Sequence[str]) -> list[str]:
    """Names of the columns of a table that is chosen as a whole, which then keep their own names."""
    return [name for name in known if name.rpartition("/")[0] == table] if choice.name is None else []


def unit_note(source: str, series: RawSeries, choice: ChannelChoice) -> list[str]:
    """A note where the unit that was given is not the one in the file."""
    if (
        choice.unit is None
        or not series.unit
        or scaled_series(series, choice) == scaled_series(series, ChannelChoice())
    ):
        return []
    return [
        f"{source}: '{series.name}' is taken in {choice.unit} as chosen; the file says '{series.unit}'"
        + (f" times {series.factor:g}" if series.factor != 1.0 else "")
    ]


def without_units(unknown: Sequence[tuple[str, str, Sequence[str]]], *, asked: bool) -> list[str]:
    """Notes on channels that are left out as nothing says their units: of each a sentence, what to do, and names.

    Raises InputError with the sentences and what to do where these channels were asked for.
    """
    if unknown and asked:
        raise InputError(
            InputProblem(f"{text}; {cure}", channels=names, fault=Fault.NO_UNIT, cure=cure)
            for text, cure, names in unknown
        )
    return [f"{text}: not used" for text, _, _ in unknown]


def check_count(source: str, series: RawSeries) -> list[str]:
    """A sentence if a series has fewer values than the file announces."""
    if series.count is None or len(series.values) >= series.count:
        return []
    return [truncated(source, series.name, len(series.values), series.count)]


def not_finite(source: str, series: RawSeries, length: int, first: int = 0) -> list[str]:
    """A sentence if values from ``first`` and before ``length`` are gaps."""
    bad = first + np.flatnonzero(~np.isfinite(series.values[first:length]))
    if not len(bad):
        return []
    gaps = 1 + int(np.count_nonzero(np.diff(bad) > 1))
    return [
        InputProblem.of_channel(
            source,
            series.name,
            f"has {gaps} {'gap' if gaps == 1 else 'gaps'}: {len(bad)} samples are no finite number, the first at "
            f"sample {bad[0]}",
        )
    ]


def channel_of(source: str, one: Selected) -> Channel:
    """Channel of a series, with noise and full scale in SI; raises InputError if one of them has another unit."""
    levels = []
    for given, in_file in ((one.choice.noise, one.series.noise), (one.choice.full_scale, one.series.full_scale)):
        if given is not None:
            try:
                levels.append(parse_quantity(given, one.scaled.quantity.unit))
            except InputError as error:
                raise InputError(f"{source}: channel '{one.name}': {error}") from None
        else:
            levels.append(None if in_file is None else in_file * one.scaled.factor)
    return Channel(one.name, one.scaled.quantity, one.choice.point or one.series.point, levels[0], levels[1])
