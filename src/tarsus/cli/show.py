"""`tarsus show`: every value of a device, with its unit and where it comes from."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter


def show(
    name: str,
    /,
    *,
    json: Annotated[bool, Parameter(negative=())] = False,
) -> int:
    """Show every value of a device or scene file: path, value, unit, provenance.

    Parameters
    ----------
    name
        a device (see `tarsus devices`) or a scene file.
    json
        print one JSON object instead of a table.
    """
    from tarsus.cli import console
    from tarsus.files.library import load_scene
    from tarsus.spec import float_paths
    from tarsus.units import format_quantity

    scene = load_scene(name)
    rows = []
    for path, info in float_paths(scene).items():
        origin = scene.provenance.get(path)
        rows.append(
            {
                "path": path,
                "value": info.value,
                "unit": info.unit,
                "meaning": info.doc,
                "source": str(getattr(origin.source, "value", origin.source)) if origin else None,
                "note": origin.note if origin else None,
            }
        )
    if json:
        console.print_json({"device": scene.name, "values": rows, "citations": list(scene.citations)})
        return 0
    print(scene.name)
    print()
    console.table(
        ("path", "value", "source", "why"),
        [
            (
                row["path"],
                format_quantity(row["value"], row["unit"]),
                row["source"] or "-",
                row["note"] or row["meaning"],
            )
            for row in rows
        ],
        numbers_from=4,
    )
    for citation in scene.citations:
        print(f"\n{citation}")
    return 0
