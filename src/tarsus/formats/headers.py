"""What the header of a table in text says: names and units of columns, sampling step, start, number of samples.

Headers of oscilloscopes are keys with values, in lines of their own or behind the names of the columns.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from tarsus.formats.cells import SplitText, cells_of
from tarsus.formats.numerals import digit_step, number, rounding_of_rate, rounding_of_step
from tarsus.formats.parts import is_decibel
from tarsus.formats.raw import Declared
from tarsus.formats.unit_names import frequency_factor, ratio_of, scaled, time_factor

_UNIT_IN_NAME = re.compile(r"^(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|<([^>]*)>|\{([^}]*)\})\s*$")
_UNIT_BEHIND = (
    re.compile(r"^(?:(.+?)\s+)?in\s+(\S.*)$"),  # CH1 in V
    re.compile(r"^(.+?)\s*[,;]\s*([^,;]+)$"),  # Time, s
    re.compile(r"^(.+?)\s+/\s+(.+)$"),  # t / s, by DIN 461
    re.compile(r"^(.+?)[\s._]+([^\W\d_]+/[^\W\d_]+(?:\^?2|²)?)$"),  # v mm/s, v_mm/s
    re.compile(r"^([^/\s]+)/(.+)$"),  # t/s
    re.compile(r"^(.+?)[\s._]([numkµ](?:V|N|Hz|s)|V|Hz|[numµ]m(?:_s)?)$"),  # drive_mV, v_mm_s, U V
    re.compile(r"^(t|time|zeit)[\s._](s)$", re.I),  # time_s
    re.compile(r"^(CH\s?\d+)\s?([mu]?V|A)$", re.I),  # CH1V
)
"""Ways to write a unit behind a name, without brackets. Each counts only where a unit is found."""
_NO_UNIT = ("", "-", "1")
_COUNTERS = {"sequence", "sample", "samples", "index", "point", "points", "pt", "#", "no", "no.", "nr", "nr."}
"""Names and units of columns that count rows."""

_RATE = r"sampl\w*[ _]?(?:rate|freq\w*)|abtast(?:rate|frequenz)|fs"
_STEP = (
    r"sampl\w*[ _]?(?:interval|step|period|time)|abtastintervall|dt|delta[ _]?[tx]|resolution|h[ _]?resolution"
    r"|time[ _]?(?:step|interval|increment|resolution)|x[ _]?inc(?:rement)?|t[ _]?inc|increment|horizontal interval"
)
_START = r"x[ _]?org|x[ _]?origin|x0|t0|h[ _]?offset|start(?:[ _]?time)?|time[ _]?offset"
_COUNT = r"samples|number of samples|lines|record length|points|number of points|block[ _]?size"
_Y_UNIT = r"vertical units?|[vy][ _]?units?"
_X_UNIT = r"horizontal units?|[hx][ _]?units?"
_SOURCE = r"source|trace[ _]?name"
_KEY = re.compile(
    rf"\W*(?:(?P<rate>{_RATE})|(?P<step>{_STEP})|(?P<start>{_START})|(?P<count>{_COUNT})|(?P<y_unit>{_Y_UNIT})"
    rf"|(?P<x_unit>{_X_UNIT})|(?P<source>{_SOURCE}))\s*(?:[\[(](?P<unit>[^\])]*)[\])])?\s*",
    re.I,
)
_VALUE = re.compile(r"([+-]?(?:\d[\d.,]*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*([^\W\d]*(?:/\w+)?)\.?")
_COMMENT = re.compile(r"^\s*(?:[#%]+|//|\*+)\s?")


@dataclass
class Header:
    """What a header says of the columns.

    names, units: one for each column, empty where it says none; declared: sampling step and start; count: number of
    samples; unused: names of columns that hold no numbers.
    """

    names: list[str]
    units: list[str]
    declared: Declared | None = None
    count: int | None = None
    unused: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class _Fact:
    """A key of a header with its values, and the unit behind the key; said: the line."""

    kind: str
    values: tuple[str, ...]
    unit: str
    said: str


def header_of(lines: SplitText) -> Header:
    """What the header of a table says of its columns."""
    rows = _cells(lines)
    facts = list(_facts(rows if lines.separator else [[" ".join(row)] for row in rows]))
    keyed = any(fact.kind == "y_unit" for fact in facts)  # units stand behind keys, of which the last is no name
    valued = keyed and any(_VALUE.match(cell) for cell in rows[-1][1:])
    labels = [] if lines.left or valued else [_without_facts(row) for row in rows]
    names, units, unused = _labels(labels, lines.width, lines.separator is not None)
    header = Header(names, units, _declared(facts, lines.comma), _announced(facts), unused)
    _complete(header, facts)
    for i, name in enumerate(header.names):
        if not header.units[i]:
            header.names[i], header.units[i] = split_name(name)
    return header


def is_unit(text: str) -> bool:
    """Whether a text is a unit of anything that is read."""
    plain = text.strip().strip("[]()").strip()
    known = (scaled, ratio_of, time_factor, frequency_factor)
    return (
        any(parse(plain) is not None for parse in known)
        or is_decibel(plain)
        or plain.lower() in ("deg", "°", "rad", *_NO_UNIT[1:])
    )


def is_counter(name: str, unit: str) -> bool:
    """Whether a column counts the rows, by its name or its unit."""
    return (unit or name).strip().lower() in _COUNTERS


def split_name(name: str) -> tuple[str, str]:
    """Name and unit of a column whose unit stands in its name, in brackets or as oscilloscopes write it."""
    match = _UNIT_IN_NAME.match(name)
    if match is not None:
        found = in_brackets(name)
        index = found == "1" and not re.search(r"\s[\[(]", name)  # Y[1], of which there is a Y[0]
        known = (is_unit(found) or found in _NO_UNIT) and not index
        return (match[1].rstrip(" /,;:"), found) if known else (name, "")
    if _motion_or_time(name):
        return name, name.strip()
    for pattern in _UNIT_BEHIND:
        match = pattern.match(name)
        found = match[2].strip().replace("m_s", "m/s") if match else ""
        if match and _motion_or_time(found):
            return match[1] or "", found
    return name, ""


def in_brackets(name: str) -> str:
    """What stands in brackets behind a name; empty if nothing does."""
    match = _UNIT_IN_NAME.match(name)
    return "" if match is None else next((one for one in match.groups()[1:] if one), "").strip()


def _motion_or_time(text: str) -> bool:
    """Whether a text without brackets is a unit: one of a quantity, a ratio, a time or a frequency, and no number."""
    plain = text.strip()
    if not plain or plain in _NO_UNIT or plain.lower() in ("t", "f", "g"):
        return False
    return any(parse(plain) is not None for parse in (scaled, ratio_of, time_factor, frequency_factor))


def _cells(lines: SplitText) -> list[list[str]]:
    """Cells of the lines of a header that are not empty, without marks of comments."""
    plain = (_COMMENT.sub("", line) for line in lines.header)
    if lines.separator is None and lines.width == 1:
        return [[line.strip()] for line in plain if line.strip()]
    return [cells for cells in (cells_of(line, lines.separator) for line in plain) if any(cells)]


def _facts(rows: Sequence[Sequence[str]]) -> Iterator[_Fact]:
    """Keys with their values: in a line of their own, in one cell, or with the value in the cell below."""
    for k, row in enumerate(rows):
        whole = " ".join(row)
        match = _KEY.match(row[0])
        if match is not None and match.end() == len(row[0].rstrip(": =")) and len(row) > 1:
            yield _Fact(_kind(match), tuple(row[1:]), match["unit"] or "", whole)
            continue
        for i, cell in enumerate(row):
            match = _KEY.match(cell)
            if match is None:
                continue
            rest = cell[match.end() :]
            below = rows[k + 1][i] if k + 1 < len(rows) and i < len(rows[k + 1]) else ""
            if rest[:1] in (":", "="):
                values = (rest[1:].strip(), *(row[1:] if i == 0 else ()))
                yield _Fact(_kind(match), values, match["unit"] or "", cell)
            elif not rest and i > 0 and _VALUE.fullmatch(below):
                yield _Fact(_kind(match), (below,), match["unit"] or "", cell)
            elif i == 0 and len(row) == 1 and rest and (cell[match.end() - 1].isspace() or match["unit"]):
                yield _Fact(_kind(match), (rest,), match["unit"] or "", cell)


def _kind(match: re.Match[str]) -> str:
    return next(name for name, text in match.groupdict().items() if text is not None and name != "unit")


def _without_facts(row: Sequence[str]) -> list[str]:
    """Cells of a row of names before those that are keys of the header, such as ``t0 = 0`` or Start and Increment."""
    for i, cell in enumerate(row):
        match = _KEY.match(cell)
        if i and match and _kind(match) in ("start", "step") and cell[match.end() :][:1] in ("", ":", "="):
            return list(row[:i])
    return list(row)


def _labels(rows: list[list[str]], width: int, separated: bool) -> tuple[list[str], list[str], list[str]]:
    """Names and units of the columns from the last lines of the header, empty where it says none; and names of columns
    without numbers; separated: by another sign than blanks, of which a sentence has many."""
    rows = [list(row) for row in rows]
    units = [""] * width
    if rows and len(rows[-1]) >= width and _is_unit_row(rows[-1], width):
        units = [re.sub(r"^[\[(]\s*(.*?)\s*[\])]$", r"\1", cell) for cell in rows.pop()[:width]]
    fits = bool(rows) and len(rows[-1]) >= width and (len(rows[-1]) == width or (width > 1 and separated))
    names = list(rows[-1][:width]) if fits else [""] * width
    unused = [cell for cell in rows[-1][width:] if cell] if fits else []
    if len(rows) > 1 and len(rows[-2]) == width > 1:
        above = rows[-2]
        bare = [not name or any(pattern.fullmatch(name) for pattern in PARTS) for name in names]
        if all(bare) and any(names):
            names = [f"{one} {name}".strip() for one, name in zip(above, names, strict=True)]
    if width == 1 and names[0] and not any(units) and len(rows) > 1 and _UNIT_IN_NAME.match(names[0]) is None:
        names = [""]
    return names, units, unused


def _is_unit_row(row: Sequence[str], width: int) -> bool:
    """Whether a line is one of units: all its cells are, or stand in brackets."""
    cells = row[:width]
    if not any(is_unit(cell) for cell in cells):
        return False
    return all(not cell or is_unit(cell) or cell.lower() in _COUNTERS for cell in cells) or all(
        not cell or cell.startswith(("[", "(")) for cell in cells
    )


def _complete(header: Header, facts: Sequence[_Fact]) -> None:
    """Units and names that stand behind keys of the header, given to the columns that have none."""
    y_units, x_units, sources = (
        [_behind_colon(value) for fact in facts if fact.kind == kind for value in fact.values if value]
        for kind in ("y_unit", "x_unit", "source")
    )
    width, named = len(header.names), any(header.names)
    if not (y_units or x_units) or any(header.units) or any(split_name(name)[1] for name in header.names):
        return
    first = int(bool(x_units) and width == len(y_units) + 1)
    if first and not header.units[0]:
        header.units[0] = x_units[0]
        header.names[0] = header.names[0] or "time"
    if width - first != len(y_units):
        return
    header.units[first:] = y_units
    if not named and len(sources) == len(y_units):
        header.names[first:] = sources


def _behind_colon(text: str) -> str:
    """A value without the channel it is of, as in ``CH1:V``."""
    return text.rpartition(":")[2].strip()


def _declared(facts: Sequence[_Fact], comma: bool) -> Declared | None:
    """The sampling step that a header states, and the start."""
    x_unit = next((one.values[0] for one in facts if one.kind == "x_unit"), "")
    start = next((found[0] for one in facts if one.kind == "start" if (found := _seconds(one, comma, x_unit))), 0.0)
    for one in facts:
        if one.kind not in ("rate", "step"):
            continue
        found = _seconds(one, comma, x_unit)
        if found is None or not found[0] > 0.0:
            continue
        value, digits = found
        step = 1.0 / value if one.kind == "rate" else value
        resolution = 0.5 * digits / value**2 if one.kind == "rate" else digits
        rounding = rounding_of_rate(value, digits) if one.kind == "rate" else rounding_of_step(value, digits)
        return Declared(f"the header ('{one.said.strip()[:60]}')", step, resolution, start, rounding)
    return None


def _seconds(fact: _Fact, comma: bool, x_unit: str) -> tuple[float, float] | None:
    """Value and step of its digits of a time [s] or a rate [Hz]; None if there is none."""
    values = [_behind_colon(value) for value in fact.values if value]
    match = _VALUE.fullmatch(values[0].strip()) if values else None
    if match is None:
        return None
    parse = frequency_factor if fact.kind == "rate" else time_factor
    behind = values[1] if len(values) > 1 and is_unit(values[1]) else ""
    unit = match[2] or fact.unit or behind or ("" if fact.kind == "rate" else x_unit)
    if not unit and "resolution" in fact.said.lower():
        return None  # it may be that of the converter
    factor = parse(unit) if unit else 1.0
    if factor is None and match[2].lower() in ("sa/s", "samples/s", "s/s", "hz", "sps"):
        factor = 1.0
    text = match[1].rstrip(".,")
    try:
        return None if factor is None else (number(text, comma) * factor, digit_step(text, comma) * factor)
    except ValueError:
        return None


def _announced(facts: Sequence[_Fact]) -> int | None:
    """Number of rows that the header announces."""
    for one in facts:
        if one.kind == "count" and re.fullmatch(r"\d+(?:\.\d*)?(?:[eE]\+?\d+)?", one.values[0].strip()):
            return round(float(one.values[0]))
    return None


def _word(*words: str) -> re.Pattern[str]:
    """A pattern for one of some words, which marks, digits and underscores may end."""
    return re.compile(rf"(?<![^\W\d_])(?:{'|'.join(words)})(?![^\W\d_])", re.I)


REAL = _word("real(?: part)?", "re", "realteil", "partie r[eé]elle", "parte reale?")
IMAGINARY = _word("imag(?:inary)?(?: part)?", "im", "imagin[aä]rteil", "partie imaginaire", "parte im+ag\\w+")
MAGNITUDE = _word("magnitude", "amplitude", "mag", "abs", "betrag", "module", "modulo", "db")
PHASE = _word("phase", "angle", "phasenwinkel", "winkel", "fase")
PARTS = (REAL, IMAGINARY, MAGNITUDE, PHASE)
"""Words for the parts of a complex response."""
