"""A class name exists once in the sources, private ones too, so that a name says what is meant wherever it stands."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

SOURCES = Path(__file__).parents[2] / "src"


def defined() -> dict[str, list[str]]:
    """Files by the names of the classes that they define, within functions and other classes as well."""
    found = defaultdict(list)
    for file in sorted(SOURCES.rglob("*.py")):
        for name in re.findall(r"^ *class (\w+)[(:\[]", file.read_text(encoding="utf-8"), re.MULTILINE):
            found[name].append(file.relative_to(SOURCES).as_posix())
    return found


def test_a_class_name_exists_once() -> None:
    twice = {name: files for name, files in defined().items() if len(files) > 1}
    assert twice == {}
