"""Benchmark figures over versions: add those of a run, or compare versions on one machine.

    python benchmarks/run.py --json out.json && python benchmarks/history.py add out.json
    python benchmarks/history.py compare

Lines of `benchmarks/history.jsonl` hold the version, the commit, the machine and each figure. Times of two machines, or
of a calm and a crowded one, say nothing about versions: only ratios within a machine are printed.
"""

from __future__ import annotations

import argparse
import json
import platform
import statistics
import subprocess
import sys
from collections import defaultdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

HISTORY = Path(__file__).with_name("history.jsonl")


def machine() -> str:
    """Name of this processor, with how many of it."""
    import os

    name = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        name = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    return f"{name}, {os.cpu_count()} processors, {platform.system()}"


def commit() -> str:
    """The commit of this checkout; empty outside one."""
    told = subprocess.run(
        ["git", "describe", "--always", "--dirty"], cwd=HISTORY.parent, capture_output=True, text=True, check=False
    )
    return told.stdout.strip()


def add(file: Path, history: Path) -> dict[str, Any]:
    """Append the figures of one run of `benchmarks/run.py`: the median of each problem and solver that was right."""
    rows = json.loads(file.read_text(encoding="utf-8"))["rows"]
    figures = {f"{row['problem']} {row['solver']} [{row['unit']}]": row["median"] for row in rows if not row["wrong"]}
    entry = {"version": version("tarsus"), "commit": commit(), "machine": machine(), "figures": figures}
    with history.open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(entry) + "\n")
    return entry


def compare(history: Path) -> list[str]:
    """For each machine and figure the median of each version, over that of the first version there."""
    found: dict[str, dict[str, dict[str, list[float]]]] = defaultdict(lambda: defaultdict(lambda: defaultdict(list)))
    lines = history.read_text(encoding="utf-8").splitlines() if history.exists() else []
    for entry in map(json.loads, lines):
        for name, value in entry["figures"].items():
            found[entry["machine"]][name][entry["version"]].append(value)
    told = []
    for where, figures in found.items():
        told.append(where)
        for name, versions in figures.items():
            medians = {one: statistics.median(values) for one, values in versions.items()}
            first = next(iter(medians.values()))
            told.append(f"  {name}: " + ", ".join(f"{one} {value / first:.2f}" for one, value in medians.items()))
    return told


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    verbs.add_parser("add").add_argument("file", type=Path)
    verbs.add_parser("compare")
    options = parser.parse_args()
    if options.verb == "add":
        print(add(options.file, HISTORY))
    else:
        print("\n".join(compare(HISTORY)) or "nothing was added yet")
    sys.exit(0)
