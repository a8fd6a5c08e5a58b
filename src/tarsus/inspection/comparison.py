"""Two runs, or two scenes, number by number."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from tarsus.base.events import EVENT_WORDS
from tarsus.base.spec import float_paths, get_value
from tarsus.files.ledger import ledger_lines
from tarsus.tables.numbers import spaced
from tarsus.tables.table import ROW, Column, Table
from tarsus.tables.view import View

if TYPE_CHECKING:
    import numpy as np

    from tarsus.model.scene import Scene
    from tarsus.solve import Run

SAME_EVENT = 1e-6
"""Times of events that differ by less than this part of the run's duration are the same: runs are computed to some
1e-9, measured grounds are never known to 1e-6."""


def of_scenes(names: tuple[str, str], a: Scene, b: Scene) -> View:
    """Values of two scenes that differ, and those that one has alone."""
    data = _names(names) | _values(a, b)
    return View(data, Table(_title(data), (), (), parts=_of_values(data)))


def of_runs(names: tuple[str, str], a: Run, b: Run) -> View:
    """Where the events of two runs part, their measures and energies, and the values of their scenes that differ."""
    of_b = dict(ledger_lines(b))
    measures = [
        _compared("name", name, one.unit, one.value, b.measures[name].value)
        for name, one in a.measures.items()
        if name in b.measures
    ]
    energies = [_compared("name", name, "J", value, of_b[name]) for name, value in ledger_lines(a) if name in of_b]
    data = {
        **_names(names),
        **_values(a.scene, b.scene),
        "codes": [a.code.name, b.code.name],
        "events": [len(a.events), len(b.events)],
        "parting": _parting(a, b),
        "measures": measures,
        "energies": energies,
    }
    ended = "ended as {} and {}; {} and {} events".format(*data["codes"], *data["events"])
    parts = [
        Table("", (), (), (ended, _of_parting(data["parting"]))),
        *(_differences(key, data[key], "name") for key in ("measures", "energies")),
    ]
    return View(data, Table(_title(data), (), (), parts=[*parts, *_of_values(data)]))


def _names(names: tuple[str, str]) -> dict[str, Any]:
    return dict(zip(("first", "second"), names, strict=True))


def _title(data: dict[str, Any]) -> str:
    return f"first: {data['first']}\nsecond: {data['second']}"


def _values(a: Scene, b: Scene) -> dict[str, Any]:
    of_a, of_b = float_paths(a), float_paths(b)
    both = {path: (one, of_b[path].value) for path, one in of_a.items() if path in of_b}
    return {
        "values": [
            _compared("path", path, one.unit, one.value, other) | {"inside": _inside(a, b, path)}
            for path, (one, other) in both.items()
            if one.value != other
        ],
        "same": sum(one.value == other for one, other in both.values()),
        "first_alone": [path for path in of_a if path not in of_b],
        "second_alone": [path for path in of_b if path not in of_a],
    }


def _compared(key: str, name: str, unit: str, a: float, b: float) -> dict[str, Any]:
    """Both numbers, and what the second has more as a part of the first."""
    known = a != 0.0 and math.isfinite(a) and math.isfinite(b)
    return {key: name, "unit": unit, "first": a, "second": b, "difference": (b - a) / abs(a) if known else None}


def _inside(a: Scene, b: Scene, path: str) -> bool | None:
    """Whether the value of one lies in the 95 % interval that the other states; None where none is stated."""
    for one, other in ((a, b), (b, a)):
        interval = one.interval(path)
        if interval is not None:
            return interval[0] <= get_value(other, path) <= interval[1]
    return None


def _parting(a: Run, b: Run) -> dict[str, Any] | None:
    """The first event at which two runs do something else, or at another time; None if they never do."""
    close = SAME_EVENT * max(a.duration, b.duration)
    for i in range(max(len(a.events), len(b.events))):
        one, other = (_event(run, run.events[i]) if i < len(run.events) else None for run in (a, b))
        if one is None or other is None:
            return {"number": i + 1, "first": one, "second": other}
        alike = all(one[key] == other[key] for key in ("kind", "foot"))
        if not alike or abs(one["time"] - other["time"]) > close:
            return {"number": i + 1, "first": one, "second": other}
    return None


def _event(run: Run, event: np.void) -> dict[str, Any]:
    return {
        "kind": EVENT_WORDS[int(event["kind"])],
        "foot": run.foot_names[int(event["foot"])],
        "time": float(event["time"]),
    }


def _of_parting(parting: dict[str, Any] | None) -> str:
    if parting is None:
        return f"the same events in the same order, at the same times (to {SAME_EVENT:g} of the duration)"
    one, other = (
        "nothing further" if one is None else f"{one['kind']} of {one['foot']} at {one['time'] * 1e3:.6g} ms"
        for one in (parting["first"], parting["second"])
    )
    return f"they part at event {parting['number']}: {one}, {other}"


def _of_values(data: dict[str, Any]) -> list[Table]:
    differing = data["values"]
    notes = [
        f"only the {one} has: {', '.join(data[f'{one}_alone'])}" for one in ("first", "second") if data[f"{one}_alone"]
    ]
    if not differing:
        return [Table("", (), (), (f"all {data['same']} values that both have are equal", *notes))]
    notes.insert(0, f"{data['same']} more values are equal")
    judged = [row["inside"] for row in differing if row["inside"] is not None]
    if judged:
        notes.append(f"{sum(judged)} of {len(judged)} values with a 95 % interval have the other's value inside")
    return [_differences("values", differing, "path", notes)]


def _differences(heading: str, rows: list[dict[str, Any]], key: str, notes: list[str] | tuple[()] = ()) -> Table:
    columns = [heading, Column("first", ROW), Column("second", ROW), Column("difference", "%", 3)]
    cells = [
        [spaced(row[key]) if key == "name" else row[key], *(row[one] for one in ("first", "second", "difference"))]
        for row in rows
    ]
    if key == "path":
        columns.append("95 % interval")
        words = {None: None, True: "inside", False: "outside"}
        cells = [[*cell, words[row["inside"]]] for cell, row in zip(cells, rows, strict=True)]
    return Table("", columns, cells, notes, units=[row["unit"] for row in rows])
