"""The three files of a validation, the same for every experiment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tarsus.files.output import OutputFolder

FILES = ("validation.csv", "validation.json", "validation.html")


def target(folder: Path, overwrite: bool) -> OutputFolder:
    """The folder of a validation."""
    return OutputFolder(folder, "validate", FILES, overwrite)


def write(
    target: OutputFolder,
    table: str,
    result: Mapping[str, Any],
    write_page: Callable[[Path], object],
    *,
    quiet: bool,
) -> None:
    """Write validation.csv (`table`), validation.json (`result`) and validation.html (`write_page(path)`)."""
    import json

    from tarsus.cli import console
    from tarsus.files.store import write_text

    with target.writing() as folder:
        write_text(folder / "validation.csv", table)
        text = json.dumps(console.plain(result), indent=2, ensure_ascii=False)
        write_text(folder / "validation.json", f"{text}\n")
        with console.spinner("writing the report"):
            write_page(folder / "validation.html")
    if not quiet:
        print()
        for name in FILES:
            print(f"wrote {folder / name}")
