"""Every value of a scene, with its unit, how sure it is, and where it comes from."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from tarsus.base.plausible import remarks
from tarsus.base.spec import FloatInfo, float_paths
from tarsus.model.impact_energy import directed
from tarsus.model.laws import MassWeighted
from tarsus.model.scene import Scene
from tarsus.model.values import LONGEST_LIST, ValueRow, grouped, value_rows
from tarsus.tables.numbers import amount, how_many
from tarsus.tables.table import Table
from tarsus.tables.view import View


def scene_view(scene: Scene) -> View:
    """Path, value, unit, 95 % interval and provenance of every value; impact law, landing rule, citations."""
    rows = [_row(scene, path, info) for path, info in float_paths(scene).items()]
    impact = _impact(scene)
    data = {
        "device": scene.name,
        "values": rows,
        "impact_map": impact,
        "landing": scene.ground.landing_rule.kind if scene.robot.feet else None,
        "citations": list(scene.citations),
    }
    sections = [
        _section(scene, section, list(members))
        for section, members in groupby(value_rows(scene), key=lambda row: row.path.split(".")[0])
    ]
    notes = [AT_AN_END] * any(one.flagged for one in sections)
    notes += _of_ground(scene, impact) if impact else []
    parts = [*sections, Table("", (), (), notes)] if notes else sections
    counts = {"drive": len(scene.robot.drives), "foot": len(scene.robot.feet), "value": len(rows)}
    many = ", ".join(how_many(n, one) for one, n in counts.items()).replace("foots", "feet")
    shown = Table(f"{scene.name} ({many})", (), (), parts=[*parts, Table("", (), (), scene.citations)])
    return View(data, shown, (*remarks(scene), *scene.signal_remarks))


def _of_ground(scene: Scene, impact: dict[str, Any]) -> list[str]:
    how = "as it is" if not impact["passive"] or impact["map"] == "mass-weighted" else "made passive"
    most = f"one impact multiplies kinetic energy by at most {impact['worst_gain']:.3g}"
    return [f"impact law: {impact['map']}, {how}; {most}", f"landing: {scene.ground.landing_rule.title}"]


def _section(scene: Scene, name: str, members: list[ValueRow]) -> Table:
    """The values of one part of the scene; those of a list in one row, and those of legs, feet and drives that are
    alike."""
    members = grouped(members)
    rows = [(*one.cells, _intervals(scene, one), *one.origin) for one in members]
    columns = (name, "value", "95 % interval", "source", "why")
    if not any(row[2] for row in rows):
        return Table("", columns[:2] + columns[3:], [row[:2] + row[3:] for row in rows])
    ends = [(i, 2) for i, one in enumerate(members) if _at_an_end(scene, one)]
    return Table("", columns, rows, flagged=ends)


AT_AN_END = "! The value lies at an end of its interval: known on one side only, or its fit stopped at a bound."


def _at_an_end(scene: Scene, row: ValueRow) -> bool:
    """Whether one of a row's numbers lies at an end of its own interval."""
    found = zip(row.numbers, _interval_of_each(scene, row), strict=True)
    return any(
        one is not None and one[0] < one[1] and min(value - one[0], one[1] - value) <= END * (one[1] - one[0])
        for value, one in found
    )


END = 0.01
"""Share of an interval's width that its end is: intervals are shown to three digits, and draws leave as much open."""


def _interval_of_each(scene: Scene, row: ValueRow) -> list[tuple[float, float] | None]:
    path = row.first or row.path
    single = scene.interval(path) if len(row.numbers) == 1 else None
    return [single] if single else [scene.interval(f"{path}.{i}") for i in range(len(row.numbers))]


def _impact(scene: Scene) -> dict[str, Any] | None:
    """The impact law at the first foot, and the largest factor by which it can multiply kinetic energy."""
    if not scene.robot.feet:
        return None
    chosen = scene.ground.impact or MassWeighted()
    gain = directed(scene, chosen).gain(passive=chosen.passive)
    return {"map": chosen.title, "passive": chosen.passive, "worst_gain": gain}


def _row(scene: Scene, path: str, info: FloatInfo) -> dict[str, Any]:
    origin = scene.origin(path)
    return {
        "path": path,
        "value": info.value,
        "unit": info.unit,
        "interval": scene.interval(path),
        "meaning": info.doc,
        "source": origin.source.value if origin else None,
        "note": origin.note if origin else None,
    }


JOINT = "\N{NO-BREAK SPACE}"


def _whole(value: float, unit: str) -> str:
    """An end of an interval with its unit, between which no line breaks."""
    return amount(value, unit, 3).replace(" ", JOINT)


def _intervals(scene: Scene, row: ValueRow) -> str:
    """95 % intervals of one value or a short list: as wide on both sides where they are, else from where to where."""
    found = _interval_of_each(scene, row)
    if len(row.numbers) > LONGEST_LIST or not any(found):
        return ""
    texts = []
    for value, interval in zip(row.numbers, found, strict=True):
        if interval is None:
            texts.append("-")
            continue
        low, high = interval
        below, above = value - low, high - value
        ends = [_whole(end, row.unit) for end in (low, high, (high - low) / 2.0)]
        even = min(below, above) > 0.0 and abs(above - below) < 0.1 * (above + below)
        number, _, unit = ends[0].partition(JOINT)
        first = number if unit == ends[1].partition(JOINT)[2] else ends[0]
        texts.append(f"±{JOINT}{ends[2]}" if even else f"{first} to {ends[1]}")
    return ", ".join(texts)
