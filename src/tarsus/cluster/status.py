"""How a sweep goes, from its folder alone, by whoever can see it; needs nothing but Python.

``python -m tarsus.cluster.status DIR`` is what `tarsus show DIR` prints.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

SILENT = 30.0
"""Seconds without a sign of life after which a process counts as lost: six signs (`progress.EVERY`)."""


@dataclass(frozen=True)
class Status:
    """How a sweep goes.

    runs, units: of the plan; runs_done, units_done: finished; finished: whether all is collected; working, lost, ended:
    processes that work, that fell silent, and that came to their end; runs_per_second: of those that work;
    seconds_left: at that pace, None without one; nodes: runs made by node, by processes that are known.
    """

    runs: int
    runs_done: int
    units: int
    units_done: int
    finished: bool
    working: int
    lost: int
    ended: int
    runs_per_second: float
    seconds_left: float | None
    nodes: dict[str, int]


def status_of(folder: Path) -> Status:
    """How the sweep in a folder goes.

    Raises
    ------
    ValueError
        With a sentence, where the folder holds no sweep.
    """
    try:
        plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
        runs, units, chunk = int(plan["runs"]), int(plan["units"]), int(plan["chunk"])
    except (OSError, ValueError, KeyError, TypeError):
        raise ValueError(
            f"'{folder}' holds no sweep: it has no plan.json, or a damaged one, or one of an earlier version"
        ) from None
    if runs < 1:
        raise ValueError(
            f"'{folder}' holds no sweep but what another verb keeps, which continues it with --resume and writes "
            "its page"
        )
    done = _units_done(folder / "units")
    finished = (folder / "sweep.nc").exists()
    done = units if finished else done
    runs_done = runs if done >= units else done * chunk
    counts = {"working": 0, "lost": 0, "ended": 0}
    rate, nodes = 0.0, {}
    for age, said in _workers(folder):
        made = sum(said["runs"].values())
        state = "ended" if said["ended"] else "lost" if age > SILENT else "working"
        counts[state] += 1
        rate += made / said["seconds"] if state == "working" and said["seconds"] > 0 else 0.0
        for who, count in said["runs"].items():
            node = who.partition(":")[0]
            nodes[node] = nodes.get(node, 0) + count
    left = (runs - runs_done) / rate if rate > 0 else None
    return Status(
        runs, runs_done, units, done, finished, **counts, runs_per_second=rate, seconds_left=left, nodes=nodes
    )


def _units_done(place: Path) -> int:
    """Files of units that are listed; none where a process has just begun and made no folder for them yet."""
    try:
        folders = [one.path for one in os.scandir(place) if one.is_dir()]
    except FileNotFoundError:
        return 0
    return sum(one.name.endswith(".npz") for folder in folders for one in os.scandir(folder))


def _workers(folder: Path) -> list[tuple[float, dict]]:
    """What processes say of themselves, each with its age [s] by the clock of the disk that holds the folder."""
    place = folder / "workers"
    if not place.is_dir():
        return []
    try:
        with tempfile.NamedTemporaryFile(dir=place, prefix=".now-") as stamp:
            now = os.stat(stamp.name).st_mtime
    except OSError:  # who may only read has to trust the own clock
        now = time.time()
    found = []
    for file in sorted(place.glob("*.json")):
        try:
            found.append((now - file.stat().st_mtime, json.loads(file.read_text(encoding="utf-8"))))
        except (OSError, ValueError):  # cleared away, or just being replaced
            continue
    return found


def status_lines(status: Status) -> list[str]:
    """The status in words."""
    share = 100.0 * status.runs_done / max(status.runs, 1)
    lines = [
        f"{status.runs_done} of {status.runs} runs done ({share:.1f} %), {status.units_done} of {status.units} units"
    ]
    if status.finished:
        return [*lines, "finished and collected"]
    if status.units_done >= status.units:
        lines.append("nothing is missing: the next task, or `tarsus sweep` of this folder, collects it")
    elif status.lost or not status.working:
        lines.append("to go on with what is missing: `tarsus sweep` of this folder, here or with --array")
    lines.append(f"{status.working} processes work, {status.lost} are lost, {status.ended} have ended")
    if status.seconds_left is not None:
        lines.append(f"{status.runs_per_second:.3g} runs a second; {_span(status.seconds_left)} left")
    lines += [f"  {count:>10}  {node}" for node, count in sorted(status.nodes.items())]
    return lines


def _span(seconds: float) -> str:
    for unit, length in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.0f} s"


def main(words: list[str]) -> int:
    """The command line."""
    try:
        status = status_of(Path(words[0]) if words else Path("."))
    except ValueError as error:
        print(f"tarsus: {error}", file=sys.stderr)
        return 2
    print(json.dumps(asdict(status)) if "--json" in words else "\n".join(status_lines(status)))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
