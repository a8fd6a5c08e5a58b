"""The engine's rooms: headers know only headers of rooms below, so that each can be read without those above."""

import re
from itertools import chain
from pathlib import Path

ROOT = Path(__file__).parents[2]
NATIVE = ROOT / "src" / "tarsus" / "core" / "native"
FLOORS = [{"base"}, {"laws", "drives"}, {"march"}, {"measure", "modal", "legged"}, {"flights"}, {"packet"}]
"""From below; rooms of one floor do not know each other. Bindings (*.cpp) are doors, and may know every room."""


def known_by(header: Path) -> set[str]:
    """Rooms whose headers it includes."""
    return set(re.findall(r'^#include "(\w+)/', header.read_text(encoding="utf-8"), re.MULTILINE))


def test_headers_know_rooms_below_only() -> None:
    floor_of = {room: n for n, floor in enumerate(FLOORS) for room in floor}
    wrong = [
        f"{header.relative_to(NATIVE)} includes {room}"
        for header in NATIVE.glob("*/*.hpp")
        for room in known_by(header) - {header.parent.name}
        if floor_of[room] >= floor_of[header.parent.name]
    ]
    assert wrong == []


def test_every_room_is_on_a_floor() -> None:
    assert {path.parent.name for path in NATIVE.glob("*/*.[hc]pp")} == set(chain.from_iterable(FLOORS))
