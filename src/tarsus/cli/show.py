"""`tarsus show`: every value of a device, with its unit, how sure it is, and where it comes from."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from tarsus.cli.options import Json, LawFiles

LONGEST_LIST = 8
"""Lists of more numbers than this are shown by their size and range."""


def show(
    name: str,
    /,
    *,
    law: LawFiles = None,
    json: Json = False,
) -> int:
    """Show every value of a device or scene file: path, value, unit, 95 % interval, provenance.

    Parameters
    ----------
    name
        a device (see `tarsus devices`) or a scene file.
    """
    from tarsus.base.spec import float_paths
    from tarsus.cli import console
    from tarsus.cli.requests import laws_of
    from tarsus.files.library import load_scene

    scene = load_scene(name, laws=laws_of(law or ()))
    rows = [_row(scene, path, info) for path, info in float_paths(scene).items()]
    if json:
        console.print_json(
            {
                "device": scene.name,
                "values": rows,
                "impact_map": _impact(scene),
                "landing": scene.ground.landing_rule.kind if scene.robot.feet else None,
                "citations": list(scene.citations),
            }
        )
        return 0
    print(scene.name)
    for section, members in groupby(rows, key=lambda row: row["path"].split(".")[0]):
        print()
        lists = [list(group) for _, group in groupby(members, key=lambda row: _without_index(row["path"]))]
        cells = [
            (
                _without_index(group[0]["path"]),
                _values(group),
                _intervals(group),
                group[0]["source"] or "-",
                _why(group[0]),
            )
            for group in lists
        ]
        shown = [0, 1, 2, 3, 4] if any(row[2] for row in cells) else [0, 1, 3, 4]
        headings = (section, "value", "95 % interval", "source", "why")
        console.table(
            [headings[i] for i in shown], [[row[i] for i in shown] for row in cells], numbers_from=len(shown)
        )
    impact = _impact(scene)
    if impact is not None:
        how = "as it is" if not impact["passive"] or impact["map"] == "mass-weighted" else "made passive"
        print(
            f"\nimpact map: {impact['map']}, {how}; one impact multiplies kinetic energy by at most "
            f"{impact['worst_gain']:.3g}"
        )
        print(f"landing: {scene.ground.landing_rule.title}")
    for citation in scene.citations:
        print(f"\n{citation}")
    return 0


def _impact(scene: Any) -> dict[str, Any] | None:
    """The impact map at the first foot, and the largest factor by which it can multiply kinetic energy."""
    if not scene.robot.feet:
        return None
    from tarsus.impacts.energy import directed
    from tarsus.model.laws import MassWeighted

    chosen = scene.ground.impact or MassWeighted()
    gain = directed(scene, chosen).gain(passive=chosen.passive)
    return {"map": chosen.title, "passive": chosen.passive, "worst_gain": gain}


def _row(scene: Any, path: str, info: Any) -> dict[str, Any]:
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


def _without_index(path: str) -> str:
    """The path of the list a value is in, or its own."""
    parts = path.split(".")
    while parts[-1].isdecimal():
        parts.pop()
    return ".".join(parts)


def _values(group: list[dict[str, Any]]) -> str:
    """One value, or a short list, or the size and range of a long one."""
    from tarsus.base.units import format_quantity

    texts = [format_quantity(row["value"], row["unit"]) for row in group]
    if len(texts) <= LONGEST_LIST:
        return ", ".join(texts)
    ends = sorted(group, key=lambda row: row["value"])
    low, high = (format_quantity(row["value"], row["unit"]) for row in (ends[0], ends[-1]))
    return f"{len(texts)} values, {low} to {high}"


def _intervals(group: list[dict[str, Any]]) -> str:
    """95 % intervals of one value or a short list: as wide on both sides where they are, else from where to where."""
    from tarsus.base.units import format_quantity

    if len(group) > LONGEST_LIST or not any(row["interval"] for row in group):
        return ""
    texts = []
    for row in group:
        if row["interval"] is None:
            texts.append("-")
            continue
        low, high = row["interval"]
        below, above = row["value"] - low, high - row["value"]
        ends = [format_quantity(float(f"{end:.3g}"), row["unit"]) for end in (low, high, (high - low) / 2.0)]
        even = min(below, above) > 0.0 and abs(above - below) < 0.1 * (above + below)
        texts.append(f"± {ends[2]}" if even else f"{ends[0]} to {ends[1]}")
    return ", ".join(texts)


def _why(row: dict[str, Any]) -> str:
    return row["note"] or row["meaning"]
