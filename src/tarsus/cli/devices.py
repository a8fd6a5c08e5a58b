"""`tarsus devices`: the devices that can be named."""

from __future__ import annotations

from tarsus.cli.options import Json


def devices(*, json: Json = False) -> int:
    """List the packaged devices and those that installed packages add."""
    from tarsus.cli import console
    from tarsus.files.library import device_names, load_scene

    listing = []
    for name in device_names():
        scene = load_scene(name)
        listing.append((name, scene.name, len(scene.robot.feet), sorted(scene.robot.drives)))
    if json:
        console.print_json(
            {"devices": [dict(zip(("name", "title", "feet", "drives"), row, strict=True)) for row in listing]}
        )
        return 0
    console.table(
        ("device", "title", "feet", "drives"),
        [(name, title, str(feet), _names(drives)) for name, title, feet, drives in listing],
        numbers_from=4,
    )
    return 0


def _names(drives: list[str]) -> str:
    return ", ".join(drives) if len(drives) <= 6 else f"{len(drives)} drives, {drives[0]} to {drives[-1]}"
