"""Every value of a scene, with its unit, how sure it is, and where it comes from."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from tarsus.base.spec import FloatInfo, float_paths
from tarsus.base.units import format_quantity
from tarsus.impacts.energy import directed
from tarsus.model.laws import MassWeighted
from tarsus.model.scene import Scene
from tarsus.model.values import ValueRow, value_rows
from tarsus.tables.table import Table
from tarsus.tables.view import View

LONGEST_LIST = 8
"""Lists of more numbers than this are shown by their size and range: eight fill a line."""


def scene_view(scene: Scene) -> View:
    """Path, value, unit, 95 % interval and provenance of every value; impact map, landing rule, citations."""
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
    parts = [*sections, Table("", (), (), _of_ground(scene, impact))] if impact else sections
    return View(data, Table(scene.name, (), (), parts=[*parts, Table("", (), (), scene.citations)]))


def _of_ground(scene: Scene, impact: dict[str, Any]) -> list[str]:
    how = "as it is" if not impact["passive"] or impact["map"] == "mass-weighted" else "made passive"
    most = f"one impact multiplies kinetic energy by at most {impact['worst_gain']:.3g}"
    return [
        f"impact map: {impact['map']}, {how}; {most}",
        f"landing: {scene.ground.landing_rule.title}",
    ]


def _section(scene: Scene, name: str, members: list[ValueRow]) -> Table:
    """The values of one part of the scene; those of a list in one row."""
    rows = [
        (one.path, _values(one), _intervals(scene, one), one.source or None, one.note or one.doc)
        for one in members
    ]
    columns = (name, "value", "95 % interval", "source", "why")
    if not any(row[2] for row in rows):
        columns, rows = columns[:2] + columns[3:], [row[:2] + row[3:] for row in rows]
    return Table("", columns, rows)


def _impact(scene: Scene) -> dict[str, Any] | None:
    """The impact map at the first foot, and the largest factor by which it can multiply kinetic energy."""
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


def _values(row: ValueRow) -> str:
    """One value or a short list in full, as it can be given again; size and range of a long one."""
    texts = [format_quantity(value, row.unit) for value in row.numbers]
    if len(texts) <= LONGEST_LIST:
        return ", ".join(texts)
    low, high = (format_quantity(value, row.unit) for value in (min(row.numbers), max(row.numbers)))
    return f"{len(texts)} values, {low} to {high}"


def _intervals(scene: Scene, row: ValueRow) -> str:
    """95 % intervals of one value or a short list: as wide on both sides where they are, else from where to where."""
    single = scene.interval(row.path)
    found = [single] if single else [scene.interval(f"{row.path}.{i}") for i in range(len(row.numbers))]
    if len(row.numbers) > LONGEST_LIST or not any(found):
        return ""
    texts = []
    for value, interval in zip(row.numbers, found, strict=True):
        if interval is None:
            texts.append("-")
            continue
        low, high = interval
        below, above = value - low, high - value
        ends = [format_quantity(float(f"{end:.3g}"), row.unit) for end in (low, high, (high - low) / 2.0)]
        even = min(below, above) > 0.0 and abs(above - below) < 0.1 * (above + below)
        texts.append(f"± {ends[2]}" if even else f"{ends[0]} to {ends[1]}")
    return ", ".join(texts)
