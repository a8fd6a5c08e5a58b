"""Sampling rates and steps that a file states with its numbers, as attributes or as scalars."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.units import parse_quantity
from tarsus.formats.raw import Declared
from tarsus.formats.unit_names import frequency_factor, time_factor

_RATES = {
    "fs",
    "rate",
    "samplerate",
    "samplingrate",
    "samplefrequency",
    "samplingfrequency",
    "samplefreq",
    "samplingfreq",
    "sfreq",
    "timesamplerate",
    "acquisitionrate",
    "scanrate",
    "samplespersecond",
    "fsample",
    "fsamp",
    "framerate",
}
_STEPS = {
    "dt",
    "deltat",
    "samplingstep",
    "sampleinterval",
    "samplinginterval",
    "sampleperiod",
    "samplingperiod",
    "sampletime",
    "timestep",
    "timeincrement",
    "wfincrement",
    "tstep",
    "tsample",
}
"""Names, without their case, blanks and lines; so are those of rates."""
_WITH_UNIT = re.compile(r"^(.+?)(?:[_\s\-\[(]+|(?<=[a-z])(?=k?Hz$))(k?Hz|k?hz|MHz|sec|s|ms|us|ns)[\])]*$")
"""A name with its unit behind it: ``sample_rate_hz``, ``dt [us]``, ``SampleRateHz``."""
_RATE_RESOLUTION = 6e-8
"""Relative step of the digits of a rate in single precision."""
_SAME = 1e-6
"""Relative difference of two steps that say the same: some digits of single precision."""


def declared(where: str, name: str, value: Any, unit: str = "") -> Declared | None:
    """The sampling step that a name and its value state, in the unit given or that of the name, else Hz or s.

    None where the name is none of a rate or step, or the value is no such number.
    """
    plain = name.strip()
    found = _WITH_UNIT.match(plain)
    key = re.sub(r"[\s_\-]", "", plain).lower()
    if found is not None and key not in _RATES | _STEPS:
        key, unit = re.sub(r"[\s_\-]", "", found[1]).lower(), unit or found[2]
    if key not in _RATES | _STEPS:
        return None
    number = _number(value, "Hz" if key in _RATES else "s")
    factor = (frequency_factor(unit or "Hz") if key in _RATES else time_factor(unit or "s")) or 0.0
    if number is None or not number * factor > 0.0 or not np.isfinite(number):
        return None
    step = 1.0 / (number * factor) if key in _RATES else number * factor
    return Declared(where, step, _RATE_RESOLUTION * step)


def _number(value: Any, unit: str) -> float | None:
    array = np.asarray(value)
    if array.size != 1 or array.dtype.kind == "c":
        return None
    one = array.ravel()[0]
    if isinstance(one, bytes):
        one = one.decode("utf-8", errors="replace")
    try:
        return float(one)
    except (TypeError, ValueError):
        pass
    try:
        return float(parse_quantity(str(one), unit))
    except InputError:
        return None


def group_of(name: str) -> str:
    """Group of an array, by its name: all before the last slash or dot."""
    return name[: max(name.rfind("/"), name.rfind("."), 0)]


class Statements:
    """What the groups of a file state about sampling, by their names; the file itself is the group without one."""

    def __init__(self) -> None:
        self._groups: dict[str, list[Declared]] = {}

    def add(self, group: str, found: Declared | None) -> bool:
        """Take up a statement of a group, where there is one; whether there is."""
        if found is not None:
            self._groups.setdefault(group, []).append(found)
        return found is not None

    def add_attributes(self, group: str, attributes: Mapping[str, Any]) -> None:
        """Take up what the attributes of a group state."""
        for name, value in attributes.items():
            self.add(group, declared(f"'{group}/{name}'" if group else f"'{name}'", name, value))

    def nearest(self, name: str) -> Declared | None:
        """What the nearest group around an array states, of groups that have a name."""
        group = group_of(name)
        while group:
            if group in self._groups:
                return _agreed(self._groups[group])
            group = group_of(group)
        return None

    def of_file(self) -> Declared | None:
        """What the file states, else what all of its groups state alike."""
        return _agreed(self._groups.get("") or [one for found in self._groups.values() for one in found])

    def contradictions(self, source: str) -> list[str]:
        """A sentence for each group whose statements contradict each other."""
        return [
            f"{source}: {' and '.join(one.where for one in found)} contradict each other: none of them is relied on"
            for found in self._groups.values()
            if _agreed(found) is None
        ]


def _agreed(found: Sequence[Declared]) -> Declared | None:
    """The statement that all are, or None."""
    if not found or any(abs(one.step / found[0].step - 1.0) > _SAME for one in found):
        return None
    return found[0]
