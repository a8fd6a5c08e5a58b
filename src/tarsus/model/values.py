"""The scene's numbers as rows of a table: path, value with unit, where it comes from; equal legs once."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

from tarsus.base.spec import float_paths
from tarsus.tables.numbers import amount, amounts
from tarsus.tables.table import Table

LONGEST_LIST = 6
"""Values of a list shown one by one; longer lists are described by their length and range."""

FEWEST = 3
"""Members of a robot that are shown as one where they are alike: two are quicker read than explained."""


@dataclass(frozen=True)
class ValueRow:
    """One row: `path` of the value or list, `value` for reading, `source` word or "", `note`, `doc`.

    `numbers` are its values in SI `unit`; `of` names whom a path with stars stands for: "all 30",
    "L1, L2, ... (15 of 30)", and `first` is the first of their paths; else both are empty.
    """

    path: str
    value: str
    source: str
    note: str
    doc: str
    numbers: tuple[float, ...] = ()
    unit: str = "1"
    of: str = ""
    first: str = ""

    @property
    def cells(self) -> tuple[str, str]:
        """Its path, with whom that stands for, and its value, whose numbers stay with their units."""
        unbroken = ", ".join(part.replace(" ", "\N{NO-BREAK SPACE}") for part in self.value.split(", "))
        return f"{self.path}\n{self.of}" if self.of else self.path, unbroken

    @property
    def origin(self) -> tuple[str | None, str]:
        """Its source, and where it comes from in words, else what it is."""
        return self.source or None, self.note or self.doc


def values_table(scene: Any) -> Table:
    """Every number of a scene with its source, what is alike once."""
    rows = [(*row.cells, *row.origin) for row in grouped(value_rows(scene))]
    laws = ", ".join(scene.ground.acting_laws) or "no law"
    feet = f"{len(scene.robot.feet)} {'foot' if len(scene.robot.feet) == 1 else 'feet'}"
    title = f"{scene.name}: {scene.robot.structure.kind}, {feet} on {laws}"
    return Table(title, ("path", "value", "source", "where it comes from"), rows)


def value_rows(scene: Any) -> list[ValueRow]:
    """All floats of a scene in its own order, lists gathered into one row, each with its provenance."""
    rows = []
    for path, group in groupby(float_paths(scene).items(), key=lambda item: _list_path(item[0])):
        infos = [info for _, info in group]
        source, note = _origin(scene, path)
        values, unit = tuple(info.value for info in infos), infos[0].unit
        rows.append(ValueRow(path, _value(values, unit), source, note, infos[0].doc, values, unit))
    return rows


def grouped(rows: Sequence[ValueRow]) -> list[ValueRow]:
    """The rows with those of members that are alike as one: `legs.*.mass` in place of `legs.L1.mass` and 29 more.

    Members are names below one path with the same values below them, such as the legs of a robot; a star stands for a
    member's name, in paths below it too. Where more than `LONGEST_LIST` of them all differ, their range is shown.
    """
    stems = _stems([row.path for row in rows])
    alike: dict[tuple[str, ...], list[ValueRow]] = defaultdict(list)
    places = [_place(row.path, stems) for row in rows]
    origins = [(*place[:2], row.source, row.note) for place, row in zip(places, rows, strict=True)]
    scattered = {
        key
        for key, count in Counter(origins).items()
        if count > LONGEST_LIST
        and len({row.value for own, row in zip(origins, rows, strict=True) if own == key}) > LONGEST_LIST
    }
    keys = [key if key in scattered else (*key, row.value) for key, row in zip(origins, rows, strict=True)]
    members: dict[tuple[str, ...], list[str]] = defaultdict(list)
    for key, (_, _, name), row in zip(keys, places, rows, strict=True):
        alike[key].append(row)
        members[key].append(name)
    out = []
    for key, same in alike.items():
        stem, rest = key[:2]
        if len(same) < 2 or not stem:
            out += same
            continue
        value = (
            same[0].value if key not in scattered else _value([n for row in same for n in row.numbers], same[0].unit)
        )
        whom = _whom(members[key], stems[stem])
        numbers = same[0].numbers if key not in scattered else tuple(n for row in same for n in row.numbers)
        path = f"{stem}.*.{rest}"
        out.append(replace(same[0], path=path, value=value, numbers=numbers, of=whom, first=same[0].path))
    return out


def _stems(paths: Sequence[str]) -> dict[str, int]:
    """Paths below which are members with the same values below them, and how many."""
    below: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for path in paths:
        parts = path.split(".")
        for i in range(1, len(parts) - 1):
            below[".".join(parts[:i])][parts[i]].append(_starred(".".join(parts[i + 1 :]), parts[i]))
    return {
        stem: len(members)
        for stem, members in below.items()
        if len(members) >= FEWEST and len({tuple(sorted(rest)) for rest in members.values()}) == 1
    }


def _place(path: str, stems: Mapping[str, int]) -> tuple[str, str, str]:
    """Where a value stands: the path above a member, that below it, and the member's name; else "", path, ""."""
    stem = next((one for one in stems if path.startswith(f"{one}.")), "")
    if not stem:
        return "", path, ""
    name, _, rest = path[len(stem) + 1 :].partition(".")
    return stem, _starred(rest, name), name


def _starred(rest: str, name: str) -> str:
    """A path below a member, with a star for its name."""
    return re.sub(rf"(?<![^.]){re.escape(name)}(?![^._])", "*", rest)


def _whom(names: list[str], of: int) -> str:
    if len(names) == of:
        return f"all {of}"
    shown = ", ".join(names) if len(names) <= 4 else f"{names[0]}, {names[1]}, … {names[-1]}"
    return f"{shown} ({len(names)} of {of})"


def _list_path(path: str) -> str:
    """The path without trailing indices: elements of one list or matrix share it."""
    parts = path.split(".")
    while len(parts) > 1 and parts[-1].isdigit():
        parts.pop()
    return ".".join(parts)


def _value(values: Sequence[float], unit: str) -> str:
    """Input values to six digits, which is all of them for a number typed by hand."""
    shown = [amount(value, unit, 6) for value in values]
    if len(shown) > 2 and len(set(shown)) == 1:
        return f"{shown[0]}, each of {len(shown)}"
    if len(values) <= LONGEST_LIST:
        return ", ".join(shown) if len(values) < 3 else amounts(values, unit, 6)
    return f"{len(values)} values, {amount(min(values), unit)} to {amount(max(values), unit)}"


def _origin(scene: Any, path: str) -> tuple[str, str]:
    """Source word and note of a value or list; of a list whose elements differ, those of the first."""
    found = scene.origin(path) or scene.origin(f"{path}.0")
    return (found.source.value, found.note) if found is not None else ("", "")
