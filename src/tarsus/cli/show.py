"""`tarsus show`: what a name stands for, or how two of a kind differ."""

from __future__ import annotations

from tarsus.cli.front import worded
from tarsus.cli.options import Json, LawFiles, Many


@worded
def show(
    name: str,
    other: str | None = None,
    /,
    *,
    channel: Many = None,
    axis: str | None = None,
    axis_unit: str | None = None,
    step: str | None = None,
    drive: str | None = None,
    record: int | None = None,
    law: LawFiles = None,
    json: Json = False,
) -> int:
    import tarsus
    from tarsus.cli import console

    said = {"axis": axis, "axis_unit": axis_unit, "step": step, "drive": drive}
    found = tarsus.show(name, other, channel=channel or (), law=law or (), record=record, **said)
    return console.show(found, json)
