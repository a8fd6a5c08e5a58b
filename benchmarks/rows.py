"""A file of rows, one a robot, that a run which was stopped goes on with."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any


def append_missing(file: Path, seeds: Iterable[int], row_of: Callable[[int], Mapping[str, Any]]) -> None:
    """Append the row of each seed that a CSV file does not hold yet, as soon as it is made, and print it."""
    there: set[int] = set()
    if file.exists():
        with file.open(newline="", encoding="utf-8") as lines:
            there = {int(one["seed"]) for one in csv.DictReader(lines)}
    for seed in seeds:
        if seed in there:
            continue
        row, begin = row_of(seed), not file.exists()
        with file.open("a", newline="", encoding="utf-8") as lines:
            writer = csv.DictWriter(lines, list(row))
            if begin:
                writer.writeheader()
            writer.writerow(row)
        print(", ".join(f"{key} {value}" for key, value in row.items()), flush=True)
