"""Which tests are heavy: the lane `full`, read from the list beside this file, and how that list is made.

``pytest --weigh FILE`` adds a line for each case to FILE: the CPU time of it, its fixtures and the processes it
started. ``python tests/heavy.py FILE`` makes `heavy.txt` anew from such lines: cases of more than `LIMIT`, or a whole
function where at least half of its cases are; what was not weighed stays as it is. Everything else is the default lane,
which README's test command runs.
"""

from __future__ import annotations

import os
import sys
import tomllib
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

LIMIT = 0.12
"""CPU seconds of one case. At this limit the rest, 4,500 cases and their collection, are under two minutes of CPU."""
LIST = Path(__file__).with_suffix(".txt")
PROJECT = Path(__file__).parents[1] / "pyproject.toml"


def declared() -> list[str]:
    """The lanes: markers of `pyproject.toml`, by the words before their colons."""
    options = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["tool"]["pytest"]["ini_options"]
    return [one.split(":")[0] for one in options["markers"]]


FIRST = ("core/test_page_engine.py", "report/", "docs/", "examples/", "validation/", "lint/test_reference.py")
"""Files whose cases take ten seconds and more: begun first, so that at the end no core waits for them. Those that
need the engine for pages are side by side: one process has them all, and compiles it once."""


def function_of(case: str) -> str:
    """`file::test`, or `file::Class::test`, of a case with parameters."""
    return case.split("[", 1)[0]


def mark(items: Iterable[pytest.Item]) -> None:
    """Put the marker `full` on the cases of the list that have no lane of their own."""
    heavy = set(LIST.read_text(encoding="utf-8").splitlines())
    others = set(declared()) - {"full"}
    for item in items:
        case = item.nodeid.removeprefix("tests/")
        if {case, function_of(case)} & heavy and others.isdisjoint(one.name for one in item.iter_markers()):
            item.add_marker(pytest.mark.full)


def in_order(items: list[pytest.Item]) -> None:
    """Put the cases of `FIRST` before all others, where any of them is run; all else stays as it is."""
    places = {file: place for place, file in enumerate(FIRST)}

    def place(item: pytest.Item) -> int:
        case = item.nodeid.removeprefix("tests/")
        return next((at for file, at in places.items() if case.startswith(file)), len(places))

    items.sort(key=place)


def cpu() -> float:
    """CPU seconds of this process and of those it has waited for."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


class Scale:
    """Plugin that weighs every case."""

    def __init__(self, file: str) -> None:
        self.file = Path(file)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        before = cpu()
        result = yield
        with self.file.open("a", encoding="utf-8") as out:
            out.write(f"{cpu() - before:.3f} {item.nodeid.removeprefix('tests/')}\n")
        return result


def heavy_of(weights: dict[str, float]) -> list[str]:
    """Lines of the list for CPU seconds by case."""
    cases = defaultdict(list)
    for case, weight in weights.items():
        cases[function_of(case)].append((case, weight > LIMIT))
    lines = []
    for function, those in cases.items():
        heavy = [case for case, is_heavy in those if is_heavy]
        lines += [function] if 2 * len(heavy) >= len(those) else heavy
    return sorted(lines)


def main(file: str) -> None:
    weights: dict[str, float] = {}
    for line in Path(file).read_text(encoding="utf-8").splitlines():
        weight, case = line.split(" ", 1)
        weights[case] = max(float(weight), weights.get(case, 0.0))
    kept = [
        line
        for line in LIST.read_text(encoding="utf-8").splitlines()
        if line not in weights and not any(function_of(case) == line for case in weights)
    ]
    lines = sorted({*heavy_of(weights), *kept})
    LIST.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    left = sum(weight for case, weight in weights.items() if not {case, function_of(case)} & set(lines))
    print(f"{len(lines)} lines; the other cases take {left:.0f} of {sum(weights.values()):.0f} s of CPU")


if __name__ == "__main__":
    main(sys.argv[1])
