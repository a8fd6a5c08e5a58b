"""`tarsus validate`: published experiments against what is computed of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tarsus.cli import console
from tarsus.cli.asked import Asked
from tarsus.cli.options import FLAG

if TYPE_CHECKING:
    from tarsus.validation import Suite, Validation

ONE = ("report.html", "validation.json", "validation.csv")
"""What is written of one experiment."""

FILES = ("index.html", *ONE, *(f"*/{file}" for file in ONE))
"""And of all, a folder each."""


def validate(asked: Asked, *, all: Annotated[bool, FLAG] = False) -> int:
    """The exit code is 1 where a claim that should hold fails, or one that is known to fail holds.

    Parameters
    ----------
    all
        Every packaged experiment; with -o into a folder of its own, with an index.
    """
    from tarsus.base.errors import InputError
    from tarsus.validation import Suite, experiment_names

    name, folder = asked.words["name"], asked.folder()
    if all == (name is not None):
        raise InputError(f"name an experiment ({', '.join(experiment_names())}) or its folder, or give --all")
    asked.check(folder)
    with asked.calling() as function:
        found = function()
    written: list[Path] = []
    if folder is not None:
        with console.spinner("writing the report"), asked.writing(folder):
            written = _write_suite(found, folder) if isinstance(found, Suite) else _write(found, folder)
    console.show(found, asked.pages.json, written)
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
    for file, text in zip(ONE, texts, strict=True):
        write_text(folder / file, text)
    return [folder / file for file in ONE]


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
