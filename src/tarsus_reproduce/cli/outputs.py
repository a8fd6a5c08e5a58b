"""The three files of a reproduction, the same for every experiment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

FILES = ("reproduction.csv", "reproduction.json", "reproduction.html", "readings-*.jsonl")
"""What a reproduction writes, as names or patterns."""


def write(
    folder: Path,
    table: str,
    result: Mapping[str, Any],
    write_page: Callable[[Path], object],
    *,
    quiet: bool,
) -> None:
    """Write reproduction.csv (`table`), reproduction.json (`result`) and reproduction.html (`write_page(path)`)."""
    from tarsus.cli import console
    from tarsus.files.jsontext import json_text
    from tarsus.files.whole import write_text

    write_text(folder / "reproduction.csv", table)
    write_text(folder / "reproduction.json", json_text(result) + "\n")
    with console.spinner("writing the report"):
        write_page(folder / "reproduction.html")
    if not quiet:
        print()
        console.wrote(folder / name for name in FILES[:3])
