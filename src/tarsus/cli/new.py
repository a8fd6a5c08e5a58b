"""`tarsus new`: a file to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from tarsus.cli.options import Json


def new(
    kind: Literal["device", "law", "study", "campaign"],
    path: Path,
    /,
    *,
    device: str | None = None,
    json: Json = False,
) -> int:
    """Write a file to begin with: a device, a law of the ground, a study, or the campaign of a folder of records.

    Parameters
    ----------
    kind
        device and study are scene and study files (TOML), law a Python file, campaign a campaign.toml for the records
        that lie in a folder.
    path
        the file to write; for a campaign the folder of its records.
    device
        what to begin with: of a device a packaged one to copy, of a study its scene, of a campaign what is known
        beforehand.
    """
    import tarsus
    from tarsus.cli import console

    return console.show(tarsus.new(kind, path, device=device), json)
