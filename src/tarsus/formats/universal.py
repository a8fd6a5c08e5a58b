"""Data sets of universal files: functions (58 and 58b), data at nodes (55 and 2414) and units (164)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle, pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.formats.freedoms import freedom_name

_MARK = re.compile(rb"^[ \t]{0,4}-1[ \t]*\r?$", re.MULTILINE)
"""A line that begins or ends a data set."""
_BINARY = re.compile(rb"58b\s*(\d+)?\s*(\d+)?\s*(\d+)?\s*(\d+)?", re.IGNORECASE)
"""Kind of a binary data set: order of bytes, format of numbers, lines of text and bytes that follow."""
_LINES = 11
"""Lines of text before the numbers of a data set 58."""
_ORDERS: dict[int, Literal["<", ">"]] = {1: "<", 2: ">"}
_FLOATS = {1: "DEC VMS", 3: "IBM 370"}
"""Binary formats of numbers that are not IEEE 754, by their codes."""
_REAL, _COMPLEX, _DOUBLE = (2, 4), (5, 6), (4, 6)
"""Codes of the type of ordinates."""
_NODES, _MOTIONS = 1, (8, 11, 12)
"""Of a data set 2414: code of the nodes as the place of its data; kinds of these that are motions."""
_NO_LETTER = re.compile(r"(?<=\d)([+-]\d{3})$")
"""An exponent of three digits, for which Fortran leaves the letter out."""


@dataclass(frozen=True)
class UnitFactors:
    """A data set 164. SI numbers are those of the file divided by length and force; code: 1 is SI."""

    code: int
    length: float
    force: float


class DegreeOfFreedom(NamedTuple):
    """A degree of freedom: entity, node and code of its direction."""

    entity: str
    node: int
    direction: int

    @property
    def name(self) -> str:
        """Name, such as ``12+Z``."""
        return freedom_name(*self)


class AxisHead(NamedTuple):
    """What is said of an axis: code of its data type, and its unit as written, empty where there is none."""

    kind: int
    label: str


@dataclass(frozen=True)
class Function:
    """A data set 58 or 58b.

    function: code of its type; response, reference; count: of values that it announces; values (n,), real or complex,
    and x (n,) of an uneven abscissa, else None; start and step of an even one; units: that hold where it stands.
    """

    function: int
    response: DegreeOfFreedom
    reference: DegreeOfFreedom
    count: int
    values: NDArray[np.float64] | NDArray[np.complex128]
    x: NDArray[np.float64] | None
    start: float
    step: float
    abscissa: AxisHead
    ordinate: AxisHead
    denominator: AxisHead
    units: UnitFactors | None


@dataclass(frozen=True)
class AtNodes:
    """A data set 55, or a 2414 at nodes.

    analysis: code of its type; kind: code of its data type; identity: its five lines; reals: its parameters;
    values (nodes, values a node), real or complex; units: that hold where it stands.
    """

    analysis: int
    kind: int
    identity: tuple[str, ...]
    reals: tuple[float, ...]
    nodes: tuple[int, ...]
    values: NDArray[np.float64] | NDArray[np.complex128]
    units: UnitFactors | None


@dataclass(frozen=True)
class OtherSet:
    """A data set that is not read."""

    kind: int


DataSet = UnitFactors | Function | AtNodes | OtherSet


def data_sets(source: str, content: bytes) -> list[DataSet]:
    """All data sets of a universal file, in its order.

    Raises
    ------
    InputError
        With a sentence for every data set that does not end, is damaged, or is written as none is read.
    """
    if b"\n" not in content:
        content = content.replace(b"\r", b"\n")
    sets: list[DataSet] = []
    problems: list[str] = []
    units: UnitFactors | None = None
    for number, (kind, block) in enumerate(_blocks(source, content), start=1):
        try:
            found = _read(source, kind, block, units)
        except InputError as error:
            problems += error.problems
        except (ValueError, IndexError) as error:
            name = kind.split()[0].decode("latin-1")
            problems.append(f"{source}: data set {number} (type {name}) cannot be read: it is damaged ({error})")
        else:
            sets.append(found)
            units = found if isinstance(found, UnitFactors) else units
    if problems:
        raise InputError(problems)
    return sets


def _blocks(source: str, content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """The line with the kind of each data set, and what follows up to its last mark."""
    begin = _MARK.search(content)
    while begin is not None:
        line_end = content.find(b"\n", begin.end() + 1)
        kind = content[begin.end() : line_end].strip() if line_end > 0 else b""
        if not kind[:1].isdigit():
            ended = not content[begin.end() :].strip()
            cause = (
                "is truncated: its last data set does not end"
                if ended
                else "is damaged: a data set between its marks (-1) has no number"
            )
            raise InputError(f"{source} {cause}")
        first = line_end + 1
        if kind[:3].lower() == b"58b":
            end = _binary_end(kind, content, first)
        else:
            mark = _MARK.search(content, first)
            end = None if mark is None else mark.start()
        if end is None:
            raise InputError(f"{source} is truncated: its last data set does not end")
        yield kind, content[first:end]
        last = content.index(b"-1", end) + 2
        begin = _MARK.search(content, last)


def _binary_end(kind: bytes, content: bytes, first: int) -> int | None:
    """Where a binary data set ends: a mark after as many bytes as it announces or its values need, else the first mark
    after its text; what is between the lines of text and there are its bytes."""
    start = first
    for _ in range(_LINES):
        start = content.find(b"\n", start) + 1
        if start == 0:
            return None
    found = _BINARY.match(kind)
    announced = int(found[4]) if found is not None and found[4] else 0
    try:
        form = _ints(_text(content[first:start]).splitlines()[6], (10, 10, 10))
    except (ValueError, IndexError):
        form = [0, 0, 0]  # reported where the data set is read
    width = 8 if form[0] in _DOUBLE else 4
    each = width * (1 + (form[0] in _COMPLEX))
    for x in (announced, form[1] * (each + (form[2] == 0) * width), form[1] * (each + (form[2] == 0) * 4)):
        if x > 0 and re.match(rb"\s*-1\s*(?:[\r\n]|$)", content[start + x : start + x + 90]):
            return start + x
    mark = re.compile(rb"    -1[ \t]*(?:[\r\n]|$)").search(content, start)
    return None if mark is None else mark.start()


def _read(source: str, kind: bytes, block: bytes, units: UnitFactors | None) -> DataSet:
    number = int(re.match(rb"\d+", kind)[0])  # type: ignore[index]  # blocks begin with a number
    if number == 164:
        numbers = _floats(" ".join(_text(block).splitlines()[1:]))
        return UnitFactors(_ints(_text(block).splitlines()[0], (10,))[0], float(numbers[0]), float(numbers[1]))
    if number == 55:
        return _at_nodes(_text(block).splitlines(), units)
    if number == 2414:
        return _analysis(_text(block).splitlines(), units)
    if number == 58:
        return _function(source, kind, block, units)
    return OtherSet(number)


def _text(block: bytes) -> str:
    try:
        return block.decode("utf-8")
    except UnicodeDecodeError:
        return block.decode("latin-1")


def _function(source: str, kind: bytes, block: bytes, units: UnitFactors | None) -> Function:
    """A data set 58 from its kind's line and what follows."""
    lines = block.split(b"\n", _LINES)
    head = [_text(line).rstrip("\r") for line in lines[:_LINES]]
    function, response, reference = _freedoms(head[5])
    form, start, step = _form(head[6])
    if form[0] not in (*_REAL, *_COMPLEX):
        raise ValueError(f"its numbers are of the unknown type {form[0]}")
    uneven, complex_ones = form[2] == 0, form[0] in _COMPLEX
    each = 1 + complex_ones + uneven
    rest = lines[_LINES] if len(lines) > _LINES else b""
    name = response.name
    if kind[:3].lower() == b"58b":
        table = _binary(source, name, kind, rest, (form[0] in _DOUBLE, uneven, form[1], each))
    else:
        numbers = _floats(_text(rest), _columns(form[0] in _DOUBLE, uneven, complex_ones))
        table = numbers[: len(numbers) // each * each].reshape(-1, each)
    values = table[:, -2] + 1.0j * table[:, -1] if complex_ones else table[:, -1]
    x = table[:, 0].copy() if uneven else None
    abscissa, ordinate, denominator = (_described(line) for line in head[7:10])
    return Function(
        function, response, reference, form[1], values, x, start, step, abscissa, ordinate, denominator, units
    )


def _columns(double: bool, uneven: bool, complex_ones: bool) -> tuple[int, ...]:
    """Widths of the columns of numbers, of which a line repeats as many as it has room for."""
    if not double:
        return (13,)
    return ((13,) * uneven + (20,) * (1 + complex_ones)) if uneven else (20,)


def _binary(
    source: str, name: str, kind: bytes, rest: bytes, layout: tuple[bool, bool, int, int]
) -> NDArray[np.float64]:
    """Numbers of a binary data set (n, each); abscissas of double ordinates are double or, by the format, single."""
    double, uneven, count, each = layout
    found = _BINARY.match(kind)
    order, form = (int(found[k] or 0) if found is not None else 0 for k in (1, 2))
    if order not in _ORDERS:
        raise InputError(f"{source}: '{name}' does not say the order of its bytes (1 or 2, here {order})")
    if form in _FLOATS:
        raise InputError(
            f"{source}: '{name}' holds floating-point numbers of {_FLOATS[form]}; export it as IEEE 754, or as text"
        )
    end = _ORDERS[order]
    if double and uneven and len(rest) < 8 * each * count and len(rest) >= (8 * each - 4) * count:
        mixed = np.dtype([("x", f"{end}f4"), ("y", f"{end}f8", (each - 1,))])
        read = np.frombuffer(rest, mixed, count)
        return np.column_stack([read["x"], read["y"]]).astype(float)
    one = np.dtype(f"{end}f{8 if double else 4}")
    whole = min(len(rest) // (one.itemsize * each), count)
    return np.frombuffer(rest, one, whole * each).reshape(whole, each).astype(float)


def _freedoms(line: str) -> tuple[int, DegreeOfFreedom, DegreeOfFreedom]:
    """Record 6: type of the function, response and reference; by its words, or its columns where these touch."""
    words = line.split()
    try:
        if len(words) == 10:
            ints = [int(words[k]) for k in (0, 5, 6, 8, 9)]
            return ints[0], DegreeOfFreedom(words[4], ints[1], ints[2]), DegreeOfFreedom(words[7], ints[3], ints[4])
    except ValueError:
        pass
    function = _ints(line, (5,))[0]
    out = [
        DegreeOfFreedom(line[at + 1 : at + 11].strip(), *_ints(line[at + 11 :].ljust(14), (10, 4))) for at in (30, 55)
    ]
    return function, out[0], out[1]


def _form(line: str) -> tuple[list[int], float, float]:
    """Record 7: type of the ordinates, number of values, spacing; start and step."""
    words = line.replace("D", "E").replace("d", "e").split()
    try:
        if len(words) >= 5:
            return [int(word) for word in words[:3]], float(words[3]), float(words[4])
    except ValueError:
        pass
    numbers = _floats(line[30:], (13,))
    start, step = [*numbers.tolist(), 0.0, 0.0][:2]
    return _ints(line, (10, 10, 10)), start, step


def _described(line: str) -> AxisHead:
    """Records 8 to 10: type and unit of an axis."""
    label = line[47:67].strip()
    return AxisHead(_ints(line, (10,))[0], "" if label.upper() == "NONE" else label)


def _at_nodes(lines: Sequence[str], units: UnitFactors | None) -> AtNodes:
    """A data set 55."""
    _, analysis, _, kind, form, each = _ints(lines[5], (10,) * 6)
    ints, reals = _ints(lines[6], (10, 10))
    first = 6 + max(-(-(2 + ints) // 8), 1)
    after = first + max(-(-reals // 6), 1)
    parameters = _floats("\n".join(lines[first:after]), (13,))
    nodes, values = _table(lines[after:], form, each)
    return AtNodes(analysis, kind, tuple(lines[:5]), tuple(parameters.tolist()), nodes, values, units)


def _analysis(lines: Sequence[str], units: UnitFactors | None) -> DataSet:
    """A data set 2414; one of other places than nodes, or of no motion, is not read."""
    _, analysis, _, kind, form, each = _ints(lines[8], (10,) * 6)
    if _ints(lines[2], (10,))[0] != _NODES or kind not in _MOTIONS:
        return OtherSet(2414)
    frequency, _, mass, viscous, hysteretic = [*_floats(lines[11], (13,)).tolist(), *[0.0] * 6][1:6]
    complex_mode = tuple(_floats(lines[12], (13,)).tolist())
    parameters = {2: (frequency, mass, viscous, hysteretic), 3: complex_mode, 7: complex_mode, 5: (frequency,)}
    nodes, values = _table(lines[13:], form, each)
    return AtNodes(analysis, kind, tuple(lines[3:8]), parameters.get(analysis, ()), nodes, values, units)


def _table(
    lines: Sequence[str], form: int, each: int
) -> tuple[tuple[int, ...], NDArray[np.float64] | NDArray[np.complex128]]:
    """Nodes, and so many numbers for each (nodes, each), real or complex by the code of their type."""
    if form not in (*_REAL, *_COMPLEX):
        raise ValueError(f"its numbers are of the unknown type {form}")
    numbers = _floats("\n".join(lines), (13,) if form in (2, 5) else (20,))
    per = 1 + each * (1 + (form in _COMPLEX))
    if len(numbers) % per:
        raise ValueError(f"{len(numbers)} numbers where each node has {per}")
    table = numbers.reshape(-1, per)
    if np.any(table[:, 0] != np.round(table[:, 0])):
        raise ValueError("a node has no number")
    values = table[:, 1::2] + 1.0j * table[:, 2::2] if form in _COMPLEX else table[:, 1:]
    return tuple(int(node) for node in table[:, 0]), values


def _ints(line: str, widths: Sequence[int]) -> list[int]:
    """Whole numbers of a line by its words, or by its columns where these touch or are blank, which is 0."""
    words = line.split()
    try:
        if len(words) >= len(widths):
            return [int(word) for word in words[: len(widths)]]
    except ValueError:
        pass
    ends = np.cumsum([0, *widths])
    return [int(line[a:b].strip() or 0) for a, b in pairwise(ends)]


def _floats(text: str, widths: Sequence[int] = (25,)) -> NDArray[np.float64]:
    """Numbers of lines by their words, or by their columns where these touch; exponents may be Fortran's."""
    text = text.replace("D", "E").replace("d", "e")
    try:
        return np.array(text.split(), dtype=float)
    except ValueError:
        return np.array([number for line in text.splitlines() for number in _by_columns(line, widths)])


def _by_columns(line: str, widths: Sequence[int]) -> Iterator[float]:
    at = 0
    for width in cycle(widths):
        if at >= len(line):
            return
        word = line[at : at + width].strip()
        if word:
            yield float(_NO_LETTER.sub(r"E\1", word))
        at += width
