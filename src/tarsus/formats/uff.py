"""Universal files (UFF): functions of data sets 58 and 58b, and responses at nodes (55, 2414), as series."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.formats.format import Format
from tarsus.formats.freedoms import DIRECTIONS, freedom_name
from tarsus.formats.raw import Axis, Domain, RawFile, RawSeries, Reference, Role, truncated
from tarsus.formats.unit_names import Scaled, frequency_factor, ratio_of, scaled, time_factor
from tarsus.formats.universal import AtNodes, AxisHead, DataSet, Function, OtherSet, UnitFactors, data_sets

_UNITS = {8: "m", 9: "N", 11: "m/s", 12: "m/s^2", 13: "N", 17: "s", 18: "Hz"}
"""SI unit of a specific data type."""
_TURNING = {8: "rad", 9: "", 11: "rad/s", 12: "", 13: ""}
"""The same of a rotational degree of freedom; moments and angular accelerations are no quantities that are read."""
_EXCITATION = 13
"""Code of an excitation force, by the format (dataset 58), as the next ones."""
_ROLES = {1: Role.SIGNAL, 4: Role.RESPONSE, 6: Role.COHERENCE}
"""Roles by the code of the function."""
_GENERAL, _TIME = 0, 17
"""Code of a function of any kind, and of an abscissa that is the time."""
_FUNCTIONS = {
    0: "general functions",
    2: "auto spectra",
    3: "cross spectra",
    5: "transmissibilities",
    7: "auto correlations",
    8: "cross correlations",
    9: "power spectral densities",
    10: "energy spectral densities",
    12: "spectra",
    26: "multiple coherences",
}
"""Functions that are no signals, by their codes."""
_ANALYSES = {
    2: "normal modes (tarsus.modes.read_mode_table reads them)",
    3: "complex modes (tarsus.modes.read_mode_table reads them)",
    7: "complex modes of second order",
}
"""Data at nodes that are no responses, by the code of the analysis."""
_FREQUENCY_RESPONSE = 5
"""Code of the analysis whose data at nodes are responses."""
_KINDS = {
    15: "tables of nodes (data set 15)",
    82: "trace lines (data set 82)",
    151: "headers (data set 151)",
    2411: "tables of nodes (data set 2411)",
    2412: "tables of elements (data set 2412)",
    2414: "results of an analysis (data set 2414)",
}
"""Other data sets, by their numbers."""
_DIGITS = 1e-5
"""Relative step of numbers written as E13.5."""


def is_uff(head: bytes) -> bool:
    """Whether a file begins like a universal file: with a line that holds -1."""
    lines = [line.strip() for line in head.splitlines() if line.strip()]
    return len(lines) > 1 and lines[0] == b"-1" and lines[1][:1].isdigit()


def read_uff(path: Path, content: bytes) -> RawFile:
    """Functions of a universal file.

    Time responses become signals, frequency response functions responses, coherences theirs. Names and points are the
    response degree of freedom, such as ``12+Z`` or ``12-Z``, whose values are those along -Z. Units are those of the
    labels, else those of the data type in the system of units of the file (data set 164; SI where there is none).

    Raises
    ------
    InputError
        If the file is truncated, or a data set cannot be read.
    """
    sets = data_sets(path.name, content)
    functions = [one for one in sets if isinstance(one, Function) and _role(one) is not None]
    spectra = [one for one in sets if isinstance(one, AtNodes) and one.analysis == _FREQUENCY_RESPONSE]
    series = [_function(path.name, one) for one in functions] + _nodal(path.name, spectra)
    notes = [*_notes(path.name, sets), *_unit_notes(path.name, sets, functions), *_real(path.name, functions)]
    return RawFile(path.name, tuple(_numbered(series)), notes=tuple(notes))


def _role(one: Function) -> Role | None:
    """What a function is read as: also a general one of real numbers over time is a signal."""
    over_time = one.function == _GENERAL and one.abscissa.kind == _TIME and not np.iscomplexobj(one.values)
    return Role.SIGNAL if over_time else _ROLES.get(one.function)


def _notes(source: str, sets: Sequence[DataSet]) -> list[str]:
    """What the file holds besides what is read."""
    counts: dict[str, int] = {}
    for one in sets:
        match one:
            case Function(function=code) if _role(one) is None:
                what = _FUNCTIONS.get(code, f"functions of type {code}")
            case AtNodes(analysis=code) if code != _FREQUENCY_RESPONSE:
                what = _ANALYSES.get(code, f"sets of data at nodes of analysis type {code}")
            case OtherSet(kind=code):
                what = _KINDS.get(code, f"data sets of type {code}")
            case _:
                continue
        counts[what] = counts.get(what, 0) + 1
    return [f"{source}: not used: {count} {what}" for what, count in counts.items()]


def _unit_notes(source: str, sets: Sequence[DataSet], functions: Sequence[Function]) -> Iterator[str]:
    """What the file says twice, differently, about its units, and what it does not say."""
    for system in dict.fromkeys(SystemOfUnits.of(one) for one in sets if isinstance(one, UnitFactors)):
        if not system.trusted:
            yield (
                f"{source}: its units are said to be SI (data set 164), but with {system.length:g} units of length a "
                f"metre and {system.force:g} units of force a newton: they are not relied on"
            )
    for one in functions:
        for which in (one.ordinate, one.denominator):
            unit, factor = _typed(one, which)
            stated = _unit(one, which)
            if which.label and unit and not scaled(stated[0]) and not ratio_of(stated[0]):
                yield (
                    f"{source}: '{one.response.name}' is labelled '{which.label}', but its data type and the "
                    f"file's units say {factor:g} {unit}: neither is relied on"
                )
    assumed = list(dict.fromkeys(name for one in functions for name in _assumed(one)))
    if assumed:
        yield f"{source}: no units are stated (data set 164, or labels) of {', '.join(assumed)}: SI is assumed"


def _assumed(one: Function) -> Iterator[str]:
    """What of a function is in SI because nothing says otherwise."""
    role = _role(one)
    if one.units is not None or role is Role.COHERENCE or ratio_of(one.ordinate.label):
        return
    if not one.ordinate.label and _typed(one, one.ordinate)[0]:
        yield f"'{one.response.name}'"
    if role is Role.RESPONSE and not one.denominator.label and _typed(one, one.denominator)[0]:
        yield f"the input '{one.reference.name}'"


def _real(source: str, functions: Sequence[Function]) -> Iterator[str]:
    """Responses of real numbers."""
    names = [
        repr(one.response.name) for one in functions if _role(one) is Role.RESPONSE and not np.iscomplexobj(one.values)
    ]
    if names:
        yield (
            f"{source}: {', '.join(names)}: frequency responses of real numbers (data type 2 or 4), without phases; "
            "they are taken as real. Export them as complex ones"
        )


def _function(source: str, one: Function) -> RawSeries:
    """A data set 58."""
    name = one.response.name
    role = _role(one) or Role.SIGNAL
    if len(one.values) < one.count:
        raise InputError(truncated(source, name, len(one.values), one.count))
    domain = Domain.TIME if role is Role.SIGNAL else Domain.FREQUENCY
    reference = None
    if role is not Role.SIGNAL:
        reference = Reference(one.reference.name, *_unit(one, one.denominator))
    unit, factor = _unit(one, one.ordinate)
    return RawSeries(
        name,
        one.values[: one.count],
        unit,
        role,
        _axis(source, one, domain),
        reference=reference,
        point=name,
        excitation=one.ordinate.kind == _EXCITATION,
        factor=factor,
    )


def _axis(source: str, one: Function, domain: Domain) -> Axis:
    parse: Callable[[str], float | None] = time_factor if domain is Domain.TIME else frequency_factor
    factor = parse(one.abscissa.label) if one.abscissa.label else 1.0
    if factor is None:
        raise InputError(
            f"{source}: the axis of '{one.response.name}' is in '{one.abscissa.label}', which is no unit of its axis"
        )
    if one.x is not None:
        values = one.x[: one.count] * factor
        largest = float(np.max(np.abs(values), initial=0.0))
        return Axis(domain, values, _DIGITS * 10.0 ** math.floor(math.log10(largest)) if largest > 0.0 else 0.0)
    if not one.step > 0.0:
        raise InputError(f"{source}: channel '{one.response.name}' has no sampling step: its header says {one.step:g}")
    return Axis(domain, np.asarray((one.start + one.step * np.arange(one.count)) * factor, dtype=np.float64))


def _typed(one: Function, which: AxisHead) -> tuple[str, float]:
    """Unit and factor of an ordinate, or of its denominator, by its data type and its degree of freedom."""
    freedom = one.response if which is one.ordinate else one.reference
    turns = DIRECTIONS.get(abs(freedom.direction), "").startswith("+R")
    return SystemOfUnits.of(one.units).unit(which.kind, turns)


def _unit(one: Function, which: AxisHead) -> tuple[str, float]:
    """Unit of an ordinate and a factor: its label, or its data type in the system of units.

    Empty where the two say different things: of a label that differs by a factor alone only where the file states its
    system of units. A label that is no unit is not one of SI.
    """
    label = which.label
    unit, factor = _typed(one, which)
    ratio = ratio_of(label)
    labelled = scaled(label) or (ratio[0] if ratio else None)
    typed = scaled(unit)
    if labelled is None:
        return (label, 1.0) if not unit or (label and one.units is None) else (unit, factor)
    if typed is None:
        return label, 1.0
    same = typed.quantity is labelled.quantity and (one.units is None or _alike(typed, factor, labelled))
    return (label, 1.0) if same else ("", 1.0)


def _alike(typed: Scaled, factor: float, labelled: Scaled) -> bool:
    return math.isclose(typed.factor * factor, labelled.factor, rel_tol=1e-4)


@dataclass(frozen=True)
class SystemOfUnits:
    """System of units of a file: SI numbers are those of the file divided by these; trusted: it is not at odds with
    itself."""

    length: float = 1.0
    force: float = 1.0
    trusted: bool = True

    @classmethod
    def of(cls, units: UnitFactors | None) -> SystemOfUnits:
        """That of a data set 164, else SI."""
        if units is None:
            return cls()
        length, force = units.length, units.force
        sound = length > 0.0 and force > 0.0
        return cls(length, force, sound and not (units.code == 1 and (length, force) != (1.0, 1.0)))

    def unit(self, kind: int, turns: bool = False) -> tuple[str, float]:
        """SI unit of a data type, of a rotation where it turns, and the factor to it; empty if neither is known."""
        if turns and kind in _TURNING:
            return _TURNING[kind], 1.0
        unit = _UNITS.get(kind, "")
        if not unit or (not self.trusted and unit[0] in "mN"):
            return "", 1.0
        return unit, 1.0 / {"m": self.length, "N": self.force}.get(unit[0], 1.0)


def _nodal(source: str, spectra: Sequence[AtNodes]) -> list[RawSeries]:
    """Responses from data at nodes, one data set for each frequency."""
    if not spectra:
        return []
    ordered = sorted(spectra, key=lambda one: one.reals[0])
    first = ordered[0]
    if any(one.nodes != first.nodes or one.values.shape != first.values.shape for one in ordered):
        raise InputError(f"{source}: the data at nodes at different frequencies are not of the same nodes")
    axis = Axis(Domain.FREQUENCY, np.array([one.reals[0] for one in ordered]))
    system = SystemOfUnits.of(first.units)
    table = np.array([one.values for one in ordered], dtype=complex)
    reference = _reference(first, system)
    out = []
    for column in range(table.shape[2]):
        direction = column + 1 if table.shape[2] in (3, 6) else 0  # vectors of 3 or 6, else scalars
        unit, factor = system.unit(first.kind, direction > 3)
        for node, values in zip(first.nodes, table[:, :, column].T, strict=True):
            if np.any(values != 0.0):
                name = freedom_name("", node, direction)
                out.append(
                    RawSeries(name, values, unit, Role.RESPONSE, axis, reference=reference, point=name, factor=factor)
                )
    return out


def _reference(one: AtNodes, system: SystemOfUnits) -> Reference | None:
    """The input of responses at nodes, where the fifth line of a data set 55 is that of I-DEAS Test: node, direction,
    and the data types of response and input."""
    words = one.identity[4].split()
    if len(words) != 4 or not all(word.lstrip("-").isdigit() for word in words):
        return None
    node, direction, _, kind = map(int, words)
    return Reference(freedom_name("", node, direction), *system.unit(kind, abs(direction) > 3)) if node > 0 else None


def _numbered(series: Sequence[RawSeries]) -> list[RawSeries]:
    """Repeats of a degree of freedom distinguished by a number behind its name."""
    seen: dict[tuple[Any, ...], int] = {}
    out = []
    for one in series:
        key = (one.role, one.name, one.reference.name if one.reference else None)
        seen[key] = seen.get(key, 0) + 1
        out.append(one if seen[key] == 1 else replace(one, name=f"{one.name} #{seen[key]}"))
    return out


FORMATS = (Format("UFF 55/58/58b", is_uff, read_uff, (".uff", ".unv", ".ufb")),)
