"""`tarsus validate`: published experiments against what is computed of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tarsus.cli.options import FLAG, Json, MaybeFolder, Overwrite, Threads

if TYPE_CHECKING:
    from tarsus.validation import Suite, Validation

FILES = ("report.html", "validation.json", "validation.csv")
"""What is written of one experiment."""


def validate(
    name: str | None = None,
    /,
    *,
    all: Annotated[bool, FLAG] = False,
    threads: Threads = None,
    output: MaybeFolder = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> int:
    """Compare a published experiment with what is computed of it, and judge the claims that were written about it.

    The exit code is 1 where a claim that should hold fails, or one that is known to fail holds.

    Parameters
    ----------
    name
        a packaged experiment, or a folder with device.toml, measured.csv, study.py, claims.toml and notes.md.
    all
        every packaged experiment; with -o into a folder of its own, with an index.
    output
        folder for report.html, validation.json and validation.csv.
    """
    from tarsus.base.errors import InputError
    from tarsus.cli import console
    from tarsus.files.output import OutputFolder
    from tarsus.validation import Suite, experiment_names
    from tarsus.validation import validate as validated

    if all == (name is not None):
        raise InputError(f"name an experiment ({', '.join(experiment_names())}) or its folder, or give --all")
    files = ("index.html", "validation.json", *(f"*/{file}" for file in FILES)) if all else FILES
    target = None if output is None else OutputFolder(output, "validate", files, overwrite)
    if target is not None:
        target.check()
    with console.progress_bar("comparing") as progress:
        found = validated(name, threads=threads, progress=progress)
    written: list[Path] = []
    if target is not None:
        with console.spinner("writing the report"), target.writing() as folder:
            written = _write_suite(found, folder) if isinstance(found, Suite) else _write(found, folder)
    console.show(found, json, written)
    several = found.validations.values() if isinstance(found, Suite) else [found]
    console.complain(sentence for one in several for sentence in _unexpected(one))
    return 0 if found.ok else 1


def _write(found: Validation, folder: Path) -> list[Path]:
    """The page, the plain data and the rows of one experiment."""
    from tarsus.files.jsontext import json_text
    from tarsus.files.whole import write_text
    from tarsus.report.validation_page import validation_html

    folder.mkdir(parents=True, exist_ok=True)
    texts = (validation_html(found), json_text(found.to_dict()) + "\n", found.csv())
    for file, text in zip(FILES, texts, strict=True):
        write_text(folder / file, text)
    return [folder / file for file in FILES]


def _write_suite(suite: Suite, folder: Path) -> list[Path]:
    """A folder an experiment, and the index with the plain data of all."""
    from tarsus.files.jsontext import json_text
    from tarsus.files.whole import write_text
    from tarsus.report.validation_page import suite_html

    for name, one in suite.validations.items():
        _write(one, folder / name)
    write_text(folder / "index.html", suite_html(suite))
    write_text(folder / "validation.json", json_text(suite.to_dict()) + "\n")
    return [folder / "index.html", folder / "validation.json"]


def _unexpected(one: Validation) -> list[str]:
    """A sentence for every claim that did not come out as it was stated, and for every one without rows."""
    return [
        f"{one.experiment.name}: the claim '{verdict.name}' {verdict.outcome.sentence}"
        for verdict in one.verdicts
        if verdict.outcome.sentence
    ]
