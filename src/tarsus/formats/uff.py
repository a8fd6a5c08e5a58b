"""Universal files (UFF): data sets 58 and 58b (functions), 55 (data at nodes) and 164 (units), by pyuff."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.formats.raw import Axis, Domain, RawFile, RawSeries, Reference, Role, truncated
from tarsus.formats.unit_names import frequency_factor, scaled, time_factor

_MARK = b"-1"
_UNITS = {8: "m", 9: "N", 11: "m/s", 12: "m/s^2", 13: "N", 17: "s", 18: "Hz"}
"""SI unit of a specific data type."""
_TURNING = {8: "rad", 9: "", 11: "rad/s", 12: "", 13: ""}
"""The same of a rotational degree of freedom; moments and angular accelerations are no quantities that are read."""
_EXCITATION = 13
"""Code of an excitation force, by the format (dataset 58), as the next ones."""
_DIRECTIONS = {0: "", 1: "+X", 2: "+Y", 3: "+Z", 4: "+RX", 5: "+RY", 6: "+RZ"}
"""Directions by their codes."""
_ROLES = {1: Role.SIGNAL, 4: Role.RESPONSE, 6: Role.COHERENCE}
"""Roles by the code of the function."""
_FUNCTIONS = {
    0: "general functions",
    2: "auto spectra",
    3: "cross spectra",
    5: "transmissibilities",
    7: "auto correlations",
    8: "cross correlations",
    9: "power spectral densities",
    12: "spectra",
}
"""Functions that are no signals, by their codes."""
_DIGITS = 1e-5
"""Relative step of numbers written as E13.5."""


def is_uff(head: bytes) -> bool:
    """Whether a file begins like a universal file: with a line that holds -1."""
    lines = [line.strip() for line in head.splitlines() if line.strip()]
    return len(lines) > 1 and lines[0] == _MARK and lines[1][:1].isdigit()


def read_uff(path: Path, content: bytes) -> RawFile:
    """Functions of a universal file.

    Time responses become signals, frequency response functions responses, coherences theirs. Names are those of the
    response degree of freedom, such as ``12+Z``. Units are those of the labels, else those of the data type in the
    system of units of the file (data set 164; SI where there is none).

    Raises
    ------
    InputError
        If the file is truncated, or a data set cannot be read.
    """
    sets = data_sets(path, content)
    system = SystemOfUnits.of(sets)
    functions = [one for one in sets if one["type"] == 58]
    series = [_function(path.name, one, system) for one in functions if one["func_type"] in _ROLES]
    nodal = [one for one in sets if one["type"] == 55]
    spectra = [one for one in nodal if one["analysis_type"] == 5]
    series += _nodal(path.name, spectra, system)
    notes = _notes(path.name, sets, spectra) + _unit_notes(path.name, functions, system)
    return RawFile(path.name, tuple(_numbered(series)), notes=tuple(notes))


def data_sets(path: Path, content: bytes) -> list[dict[str, Any]]:
    """All data sets of a universal file as pyuff names their parts; of kinds that are not read the ``type`` alone.

    Raises
    ------
    InputError
        If the file is truncated, or a data set cannot be read.
    """
    if not content.rstrip().endswith(b"    " + _MARK):  # no line break need come before it in 58b
        raise InputError(f"{path.name} is truncated: its last data set does not end")
    with TemporaryDirectory() as folder:
        return _decoded(path, _in_utf_8(path, content, Path(folder)))


def _in_utf_8(path: Path, content: bytes, folder: Path) -> Path:
    """The file, or a copy in UTF-8 of one in Latin-1, whose units pyuff could not decode; binary ones stay."""
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        if b"\n    58b" not in content:
            copy = folder / "copy.uff"
            copy.write_bytes(content.decode("latin-1").encode("utf-8"))
            return copy
    return path


def _decoded(path: Path, readable: Path) -> list[dict[str, Any]]:
    """The data sets of a file that pyuff can decode."""
    import pyuff

    try:
        file = pyuff.UFF(str(readable))
        kinds = [int(kind) for kind in file.get_set_types()]
    except Exception as error:  # pyuff raises plain exceptions
        raise InputError(f"{path.name} cannot be read as a universal file: {error}") from None
    if 0 in kinds or not kinds:
        raise InputError(f"{path.name} is damaged: a data set between its marks (-1) has no number")
    sets: list[dict[str, Any]] = []
    problems = []
    for number, kind in enumerate(kinds):
        try:
            read: Any = file.read_sets(number) if kind in (55, 58, 164) else {"type": kind}
            sets.append(read)
        except Exception as error:  # as above
            problems.append(
                f"{path.name}: data set {number + 1} of {len(kinds)} (type {kind}) cannot be read: it is damaged or "
                f"truncated ({error})"
            )
    if problems:
        raise InputError(problems)
    return sets


def _unit_notes(source: str, functions: Sequence[Mapping[str, Any]], system: SystemOfUnits) -> list[str]:
    """What the file says twice, differently, about its units."""
    notes = []
    if not system.trusted:
        notes.append(
            f"{source}: its units are said to be SI (data set 164), but with {system.length:g} units of length a metre "
            f"and {system.force:g} units of force a newton: they are not relied on"
        )
    for one in functions:
        for which in ("ordinate", "orddenom"):
            label = _label(one, which)
            unit, factor = _typed(one, which, system)
            if scaled(label) is not None and unit and not _unit(one, which, system)[0]:
                name = freedom_name(one["rsp_ent_name"], one["rsp_node"], one["rsp_dir"])
                notes.append(
                    f"{source}: '{name}' is labelled '{label}', but its data type and the file's units say "
                    f"{factor:g} {unit}: neither is relied on"
                )
    return notes


def _notes(source: str, sets: Sequence[Mapping[str, Any]], spectra: Sequence[Any]) -> list[str]:
    """What the file holds besides what is read."""
    counts: dict[str, int] = {}
    for one in sets:
        if one["type"] == 58 and one["func_type"] not in _ROLES:
            what = _FUNCTIONS.get(one["func_type"], f"functions of type {one['func_type']}")
        elif one["type"] == 55 and not any(one is spectrum for spectrum in spectra):
            what = "shapes of modes (data set 55)"
        elif one["type"] not in (55, 58, 164):
            what = f"data sets of type {one['type']}"
        else:
            continue
        counts[what] = counts.get(what, 0) + 1
    return [f"{source}: not used: {count} {what}" for what, count in counts.items()]


def freedom_name(entity: str, node: int, direction: int) -> str:
    """Name of a degree of freedom, such as ``12+Z``; with its entity (``wing:12+Z``) where it is of one."""
    sign = _DIRECTIONS.get(abs(direction), f"({direction})")
    sign = sign.replace("+", "-") if direction < 0 else sign
    named = "" if entity.strip().upper() in ("", "NONE") else f"{entity.strip()}:"
    return f"{named}{node}{sign}"


def _function(source: str, one: Mapping[str, Any], system: SystemOfUnits) -> RawSeries:
    """A data set 58."""
    name = freedom_name(one["rsp_ent_name"], one["rsp_node"], one["rsp_dir"])
    role = _ROLES[one["func_type"]]
    values, count = np.asarray(one["data"]), int(one["num_pts"])
    if len(values) < count:
        raise InputError(truncated(source, name, len(values), count))
    domain = Domain.TIME if role is Role.SIGNAL else Domain.FREQUENCY
    reference = None
    if role is not Role.SIGNAL:
        freedom = freedom_name(one["ref_ent_name"], one["ref_node"], one["ref_dir"])
        reference = Reference(freedom, *_unit(one, "orddenom", system))
    unit, factor = _unit(one, "ordinate", system)
    return RawSeries(
        name,
        values[:count],
        unit,
        role,
        _axis(source, name, one, domain, count),
        reference=reference,
        point=str(one["rsp_node"]),
        excitation=one["ordinate_spec_data_type"] == _EXCITATION,
        factor=factor,
    )


def _axis(source: str, name: str, one: Mapping[str, Any], domain: Domain, count: int) -> Axis:
    label = _label(one, "abscissa")
    factor = 1.0
    if label:
        found = (time_factor if domain is Domain.TIME else frequency_factor)(label)
        if found is None:
            raise InputError(f"{source}: the axis of '{name}' is in '{label}', which is no unit of its axis")
        factor = found
    values = np.asarray(one["x"], dtype=float)[:count] * factor
    uneven = one["abscissa_spacing"] == 0
    largest = float(np.max(np.abs(values), initial=0.0))
    resolution = _DIGITS * 10.0 ** math.floor(math.log10(largest)) if uneven and largest > 0.0 else 0.0
    if not uneven and not one["abscissa_inc"] > 0.0:
        raise InputError(
            f"{source}: channel '{name}' has no sampling step: its header says {one['abscissa_inc']:g}"
        )
    return Axis(domain, values, resolution)


def _label(one: Mapping[str, Any], which: str) -> str:
    text = str(one.get(f"{which}_axis_units_lab", "")).strip()
    return "" if text.upper() == "NONE" else text


def _typed(one: Mapping[str, Any], which: str, system: SystemOfUnits) -> tuple[str, float]:
    """Unit and factor of an ordinate by its data type and its degree of freedom."""
    direction = abs(int(one["rsp_dir" if which == "ordinate" else "ref_dir"]))
    return system.unit(int(one[f"{which}_spec_data_type"]), _DIRECTIONS.get(direction, "").startswith("+R"))


def _unit(one: Mapping[str, Any], which: str, system: SystemOfUnits) -> tuple[str, float]:
    """Unit of an ordinate and a factor: its label, or its data type in the file's system of units.

    Empty where the two say different things.
    """
    label = _label(one, which)
    unit, factor = _typed(one, which, system)
    labelled, typed = scaled(label), scaled(unit)
    if labelled is None:
        return (unit, factor) if unit else (label, 1.0)
    if typed is None:
        return label, 1.0
    same = typed.quantity is labelled.quantity and math.isclose(
        typed.factor * factor, labelled.factor, rel_tol=1e-4
    )
    return (label, 1.0) if same else ("", 1.0)


@dataclass(frozen=True)
class SystemOfUnits:
    """System of units of a file: SI numbers are those of the file divided by these; trusted: it is not at odds with
    itself."""

    length: float = 1.0
    force: float = 1.0
    trusted: bool = True

    @classmethod
    def of(cls, sets: Sequence[Mapping[str, Any]]) -> SystemOfUnits:
        """That of the data set 164, else SI."""
        for one in sets:
            if one["type"] == 164:
                length, force = float(one["length"]), float(one["force"])
                is_si = int(one["units_code"]) == 1
                sound = length > 0.0 and force > 0.0
                return cls(length, force, sound and not (is_si and (length, force) != (1.0, 1.0)))
        return cls()

    def unit(self, kind: int, turns: bool = False) -> tuple[str, float]:
        """SI unit of a data type, of a rotation where it turns, and the factor to it; empty if neither is known."""
        if turns and kind in _TURNING:
            return _TURNING[kind], 1.0
        unit = _UNITS.get(kind, "")
        if not unit or (not self.trusted and unit[0] in "mN"):
            return "", 1.0
        return unit, 1.0 / {"m": self.length, "N": self.force}.get(unit[0], 1.0)


def _nodal(source: str, spectra: Sequence[Mapping[str, Any]], system: SystemOfUnits) -> list[RawSeries]:
    """Responses from data sets 55, one for each frequency."""
    if not spectra:
        return []
    ordered = sorted(spectra, key=lambda one: float(one["freq"]))
    nodes = [int(node) for node in ordered[0]["node_nums"]]
    for one in ordered:
        if [int(node) for node in one["node_nums"]] != nodes:
            raise InputError(f"{source}: the data sets 55 at different frequencies are not of the same nodes")
    axis = Axis(Domain.FREQUENCY, np.array([float(one["freq"]) for one in ordered]))
    unit, factor = system.unit(int(ordered[0]["spec_data_type"]))
    out = []
    for component, direction in (("r1", 1), ("r2", 2), ("r3", 3)):
        table = np.array([np.asarray(one[component]) for one in ordered], dtype=complex)
        out += [
            RawSeries(
                freedom_name("", node, direction),
                column,
                unit,
                Role.RESPONSE,
                axis,
                point=str(node),
                factor=factor,
            )
            for node, column in zip(nodes, table.T, strict=True)
            if np.any(column != 0.0)
        ]
    return out


def _numbered(series: Sequence[RawSeries]) -> list[RawSeries]:
    """Repeats of a degree of freedom told apart by a number behind its name."""
    seen: dict[tuple[Any, ...], int] = {}
    out = []
    for one in series:
        key = (one.role, one.name, one.reference.name if one.reference else None)
        seen[key] = seen.get(key, 0) + 1
        out.append(one if seen[key] == 1 else replace(one, name=f"{one.name} #{seen[key]}"))
    return out
