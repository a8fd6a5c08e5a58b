"""`tarsus compare`: two runs, or two descriptions of devices or scenes, number by number."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.cli.options import Json, LawFiles

if TYPE_CHECKING:
    import numpy as np

    from tarsus.files.store import StoredRun
    from tarsus.model.scene import Scene

SAME_EVENT = 1e-6
"""Times of events that differ by less than this part of the run's duration are told as the same: runs are computed to
some 1e-9, measured grounds are never known to 1e-6."""


def compare(
    first: str,
    second: str,
    /,
    *,
    law: LawFiles = None,
    json: Json = False,
) -> int:
    """Compare two folders that `simulate` wrote, or two devices or scene files, such as one identified and its truth.

    Parameters
    ----------
    first
        a run's folder, a device (see `tarsus devices`) or a scene file.
    second
        what it is compared with, of the same sort.
    """
    from tarsus.base.errors import InputError
    from tarsus.cli import console
    from tarsus.cli.requests import laws_of
    from tarsus.files.library import load_scene
    from tarsus.files.store import read_run

    laws = laws_of(law or ())
    runs = [Path(name).is_dir() for name in (first, second)]
    if runs[0] != runs[1]:
        folder, other = (first, second) if runs[0] else (second, first)
        raise InputError(
            f"'{folder}' is a folder of a run and '{other}' is none: compare two runs or two descriptions"
        )
    if runs[0]:
        a, b = (read_run(name, laws) for name in (first, second))
        found = {**_values(a.scene, b.scene), **_runs(a, b)}
    else:
        found = _values(*(load_scene(name, laws=laws) for name in (first, second)))
    found = {"first": first, "second": second, **found}
    if json:
        console.print_json(found)
    else:
        _show(found)
    return 0


def _values(a: Scene, b: Scene) -> dict[str, Any]:
    """Values of two scenes that differ, and those that one has alone."""
    from tarsus.base.spec import float_paths

    of_a, of_b = float_paths(a), float_paths(b)
    return {
        "values": [
            {
                "path": path,
                "unit": one.unit,
                "first": one.value,
                "second": of_b[path].value,
                "difference": _part(one.value, of_b[path].value),
                "inside": _inside(a, b, path),
            }
            for path, one in of_a.items()
            if path in of_b and one.value != of_b[path].value
        ],
        "same": sum(path in of_b and one.value == of_b[path].value for path, one in of_a.items()),
        "first_alone": [path for path in of_a if path not in of_b],
        "second_alone": [path for path in of_b if path not in of_a],
    }


def _part(a: float, b: float) -> float | None:
    """What the second has more, as a part of the first."""
    return (b - a) / abs(a) if a != 0.0 and math.isfinite(a) and math.isfinite(b) else None


def _inside(a: Scene, b: Scene, path: str) -> bool | None:
    """Whether the value of one lies in the 95 % interval that the other states; None where none is stated."""
    from tarsus.base.spec import get_value

    for one, other in ((a, b), (b, a)):
        interval = one.interval(path)
        if interval is not None:
            return interval[0] <= get_value(other, path) <= interval[1]
    return None


def _runs(a: StoredRun, b: StoredRun) -> dict[str, Any]:
    """Measures, energies and events of two runs."""
    from tarsus.files.ledger import ledger_lines

    measures = [
        {
            "name": name,
            "unit": one.unit,
            "first": one.value,
            "second": b.measures[name].value,
            "difference": _part(one.value, b.measures[name].value),
        }
        for name, one in a.measures.items()
        if name in b.measures
    ]
    of_b = dict(ledger_lines(b))
    energies = [
        {
            "name": name,
            "unit": "J",
            "first": value,
            "second": of_b[name],
            "difference": _part(value, of_b[name]),
        }
        for name, value in ledger_lines(a)
        if name in of_b
    ]
    return {
        "codes": [a.code.name, b.code.name],
        "events": [len(a.events), len(b.events)],
        "parting": _parting(a, b),
        "measures": measures,
        "energies": energies,
    }


def _parting(a: StoredRun, b: StoredRun) -> dict[str, Any] | None:
    """The first event at which two runs do something else, or at another time; None if they never do."""
    close = SAME_EVENT * max(a.duration, b.duration)
    for i in range(max(len(a.events), len(b.events))):
        told = [_event(run, run.events[i]) if i < len(run.events) else None for run in (a, b)]
        one, other = told
        if one is None or other is None:
            return {"number": i + 1, "first": one, "second": other}
        same = (one["kind"], one["foot"]) == (other["kind"], other["foot"])
        if not (same and abs(one["time"] - other["time"]) <= close):
            return {"number": i + 1, "first": one, "second": other}
    return None


def _event(run: StoredRun, event: np.void) -> dict[str, Any]:
    from tarsus.base.events import EVENT_WORDS

    return {
        "kind": EVENT_WORDS[int(event["kind"])],
        "foot": run.foot_names[int(event["foot"])],
        "time": float(event["time"]),
    }


def _show(found: dict[str, Any]) -> None:
    print(f"first: {found['first']}\nsecond: {found['second']}")
    if "measures" in found:
        print("\nended as {} and {}; {} and {} events".format(*found["codes"], *found["events"]))
        print(_of_parting(found["parting"]))
        for heading in ("measures", "energies"):
            print()
            _table(heading, found[heading], "name")
    print()
    differing = found["values"]
    if not differing:
        print(f"all {found['same']} values that both have are equal")
    else:
        _table("values", differing, "path")
        print(f"\n{found['same']} more values are equal")
    for which in ("first", "second"):
        alone = found[f"{which}_alone"]
        if alone:
            print(f"only the {which} has: {', '.join(alone)}")
    judged = [row["inside"] for row in differing if row["inside"] is not None]
    if judged:
        print(f"{sum(judged)} of {len(judged)} values with a 95 % interval have the other's value inside")


def _of_parting(parting: dict[str, Any] | None) -> str:
    if parting is None:
        return f"the same events in the same order, at the same times (to {SAME_EVENT:g} of the duration)"
    told = [
        "nothing further" if one is None else f"{one['kind']} of {one['foot']} at {one['time'] * 1e3:.6g} ms"
        for one in (parting["first"], parting["second"])
    ]
    return f"they part at event {parting['number']}: {told[0]}, {told[1]}"


def _table(heading: str, rows: list[dict[str, Any]], key: str) -> None:
    from tarsus.cli import console
    from tarsus.cli.summary import short

    cells = []
    for row in rows:
        inside = row.get("inside")
        part = row["difference"]
        cells.append(
            (
                row[key].replace("_", " ") if key == "name" else row[key],
                *(short(row[one], row["unit"]) for one in ("first", "second")),
                "-" if part is None else f"{100.0 * part:+.3g} %",
                *(() if key == "name" else ("-" if inside is None else "inside" if inside else "outside",)),
            )
        )
    headings = (heading, "first", "second", "difference", *(() if key == "name" else ("95 % interval",)))
    console.table(headings, cells)
