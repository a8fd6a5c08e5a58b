"""`tarsus new`: a file to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from tarsus.cli.front import worded
from tarsus.cli.options import Json


@worded
def new(
    kind: Literal["device", "law", "study", "campaign"],
    path: Path,
    /,
    *,
    device: str | None = None,
    legs: int | None = None,
    mass: str | None = None,
    json: Json = False,
) -> int:
    import tarsus
    from tarsus.cli import console

    return console.show(tarsus.new(kind, path, device=device, legs=legs, mass=mass), json)
