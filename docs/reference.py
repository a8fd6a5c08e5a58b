"""Examples of the reference: doctests in `docs/reference/*.txt`, each shown on the pages of the names that it uses.

A section begins with `## ` and full names, one for each object, and where it takes long ` # full` or ` # slow` behind
them, the lane that runs it; the lines below it are one doctest, run by a test.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

PLACE = Path(__file__).resolve().parent / "reference"


class Example(NamedTuple):
    """names: full names that it shows; text: a doctest; line: where it begins in `file`, from 1;
    lane: of what takes more than a second or two, else empty."""

    names: tuple[str, ...]
    text: str
    file: Path
    line: int
    lane: str


def examples() -> list[Example]:
    """All examples, file by file."""
    found = []
    for file in sorted(PLACE.glob("*.txt")):
        text = file.read_text(encoding="utf-8")
        for section in re.finditer(r"^## (.+)\n((?:(?!## ).*\n?)*)", text, re.MULTILINE):
            line = text.count("\n", 0, section.start(2)) + 1
            names, _, lane = section[1].partition(" # ")
            found.append(Example(tuple(names.split()), section[2].strip() + "\n", file, line, lane))
    return found


def object_of(full: str) -> Any:
    """The object of a full name; what a package offers hides a file of the same name."""
    place, *parts = full.split(".")
    one: Any = import_module(place)
    for part in parts:
        place = f"{place}.{part}"
        one = getattr(one, part) if hasattr(one, part) else import_module(place)
    return one


def setup(app) -> dict[str, bool]:
    """Append an example to the docstring of every object that one shows, after it was read."""
    by_object = {id(object_of(name)): one for one in examples() for name in one.names}

    def add_example(app, what, name, obj, options, lines) -> None:
        one = by_object.get(id(obj))
        if one is not None and not any(">>>" in line for line in lines):
            lines += ["", ".. rubric:: Example", "", ".. code-block:: pycon", ""]
            lines += [f"   {line}" for line in one.text.splitlines()] + [""]

    app.connect("autodoc-process-docstring", add_example, priority=950)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
