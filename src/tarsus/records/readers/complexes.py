"""Responses whose two parts the user names: real and imaginary part, or amplitude and phase."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tarsus.base.errors import InputError
from tarsus.formats.parts import joined, phase_factor
from tarsus.formats.raw import RawFile, RawSeries
from tarsus.records.readers.choices import Choices


def with_chosen_parts(raw: RawFile, choices: Choices) -> RawFile:
    """The file with the responses whose two parts were named under ``channels``; their parts are series no more.

    Raises
    ------
    InputError
        For a part that is not there, is complex or of another length, and for a phase of unknown unit.
    """
    problems: list[str] = []
    used: set[str] = set()
    made: list[RawSeries] = []
    for name, choice in choices.channels.items():
        other = choice.imaginary or choice.phase
        if other is None:
            continue
        try:
            first, second = raw.named(name), raw.named(other)
        except InputError as error:
            problems += error.problems
            continue
        if np.iscomplexobj(first.values) or np.iscomplexobj(second.values):
            problems.append(f"{raw.source}: '{name}' or '{other}' is complex and no part of a response")
        elif len(first.values) != len(second.values):
            problems.append(f"{raw.source}: '{name}' and '{other}' differ in length")
        elif choice.imaginary is not None:
            made.append(joined(first, second, None))
        else:
            factor = phase_factor(choice.phase_unit or second.unit, other)
            if factor is None:
                problems.append(
                    f"{raw.source}: nothing says whether the phase '{other}' is in deg or rad: give phase_unit"
                )
                continue
            made.append(joined(first, second, factor))
        used |= {name, other}
    if problems:
        raise InputError(problems)
    return replace(raw, series=(*(one for one in raw.series if one.name not in used), *made)) if made else raw
