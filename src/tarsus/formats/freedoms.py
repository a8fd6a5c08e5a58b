"""Names of degrees of freedom, as universal files have them: entity, node and direction, such as ``12+Z``."""

from __future__ import annotations

import re

DIRECTIONS = {0: "", 1: "+X", 2: "+Y", 3: "+Z", 4: "+RX", 5: "+RY", 6: "+RZ"}
"""Directions by their codes; a negative code is the opposite one. Scalars have none."""
_NAME = re.compile(r"(?P<point>(?:.*:)?\d+)(?P<sign>[+-])(?P<axis>R?[XYZ])")


def freedom_name(entity: str, node: int, direction: int) -> str:
    """Name of a degree of freedom, such as ``12+Z``; with its entity (``wing:12+Z``) where it is of one."""
    sign = DIRECTIONS.get(abs(direction), f"({direction})")
    sign = sign.replace("+", "-") if direction < 0 else sign
    named = "" if entity.strip().upper() in ("", "NONE") else f"{entity.strip()}:"
    return f"{named}{node}{sign}"


def along_axis(name: str) -> tuple[str, float]:
    """The same degree of freedom along the positive axis, and the sign of what was measured there: ``12+Z`` and -1 of
    ``12-Z``; other names stay, with 1."""
    found = _NAME.fullmatch(name)
    if found is None or found["sign"] == "+":
        return name, 1.0
    return f"{found['point']}+{found['axis']}", -1.0


def component(name: str) -> tuple[int, int, float] | None:
    """Node, component (0 to 5: X, Y, Z, RX, RY, RZ) and sign of a degree of freedom of no entity, such as ``12-Z``;
    None for other names."""
    found = _NAME.fullmatch(name)
    if found is None or ":" in found["point"]:
        return None
    axis = list(DIRECTIONS.values()).index(f"+{found['axis']}") - 1
    return int(found["point"]), axis, -1.0 if found["sign"] == "-" else 1.0
