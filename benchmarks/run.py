# ruff: noqa: E402  (the thread limits have to be set before numpy is loaded)
"""Tarsus and its peers on P1 and P2, interleaved in one process.

    python benchmarks/run.py                      # P1 n = 2 and P2, all peers that are installed
    python benchmarks/run.py --sizes 2 6 32 --repeats 9 --json out.json
    python benchmarks/run.py --peers heyoka --members 256
    python benchmarks/run.py --scan heyoka        # error against tolerance instead of a timing

Every sequence is checked before its time is printed; a peer that gets it wrong is shown with its number of
wrong events. Times are CPU time of the whole process (all threads), after one unmeasured call that compiles.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import argparse
import importlib
import json
import platform
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from problems import (
    SIZES,
    FloatArray,
    PairReference,
    check_pairs,
    check_sequence,
    horizon,
    load,
    pair_reference,
    subset,
)
from tarsus.study import bench

OWN = "tarsus"
# peer -> (module for P1, module for P2, sizes it does in reasonable time, longest P1 [ms], members of P2)
PEERS: dict[str, tuple[str, str, tuple[int, ...], float, int]] = {
    "heyoka": ("peers.heyoka_peer", "peers.heyoka_batch", (2, 6, 32), 1000.0, 256)
}


@dataclass
class Row:
    """One line of the table. ``unit`` is "ms/s" (CPU ms per simulated second) or "traj/s"."""

    problem: str
    solver: str
    best: float
    median: float
    unit: str
    checked: str
    wrong: int
    worst: float
    ratio: float | None = None


@dataclass
class Entry:
    """A solver ready to be timed: ``call`` answers, ``seconds`` collects CPU times of the right answers."""

    name: str
    call: Callable[[], tuple[Any, float]]
    check: Callable[[Any], tuple[str, int, float]]
    scale: Callable[[float], float]
    seconds: list[float]
    verdict: tuple[str, int, float] = ("", 0, 0.0)


def _timed(function: Callable[[], Any]) -> tuple[Any, float]:
    start = time.process_time()
    answer = function()
    return answer, time.process_time() - start


def _own_pairs(reference: PairReference) -> tuple[Any, float]:
    """Members of P2 by the general engine; as compiling is for the peers, building scene and tables is not timed."""
    (counts, first, tenth), seconds = bench.run_pairs(*reference.pairs.T)
    return (counts, first * 1e3, tenth * 1e3), seconds


def _peer(name: str, which: int) -> Any | None:
    try:
        return importlib.import_module(PEERS[name][which])
    except ImportError as missing:
        print(f"# {name} left out: {missing}")
        return None


def _entries_p1(n: int, names: Sequence[str]) -> list[Entry]:
    entries = []
    problem = load(n)

    def checker(duration: float) -> Callable[[Any], tuple[str, int, float]]:
        def check(times: FloatArray) -> tuple[str, int, float]:
            result = check_sequence(times, n, duration)
            return f"{result.found} of {result.expected} impacts", result.wrong, result.worst

        return check

    if OWN in names:
        span = horizon(n)
        chain = bench.TimedChain(n, span * 1e-3)
        entries.append(
            Entry(OWN, lambda: _timed(lambda: chain.impacts() * 1e3), checker(span), lambda s: s * 1e6 / span, [])
        )
    for name in names:
        if name == OWN or n not in PEERS[name][2]:
            continue
        peer = _peer(name, 0)
        if peer is None:
            continue
        span = min(horizon(n), PEERS[name][3])
        entries.append(
            Entry(
                peer.NAME,
                lambda peer=peer, span=span: _timed(lambda: peer.p1(problem, span)),
                checker(span),
                lambda s, span=span: s * 1e6 / span,
                [],
            )
        )
    return entries


def _entries_p2(names: Sequence[str], members: int | None) -> list[Entry]:
    entries = []

    def checker(reference: PairReference) -> Callable[[Any], tuple[str, int, float]]:
        def check(answer: Any) -> tuple[str, int, float]:
            result = check_pairs(*answer, reference)
            return f"{result.members} members", result.wrong_counts + result.wrong_times, result.worst

        return check

    if OWN in names:
        reference = pair_reference().take(subset(members or 4096))
        entries.append(
            Entry(OWN, lambda r=reference: _own_pairs(r), checker(reference), lambda s, r=reference: len(r) / s, [])
        )
    for name in names:
        if name == OWN:
            continue
        peer = _peer(name, 1)
        if peer is None:
            continue
        reference = pair_reference().take(subset(members or PEERS[name][4]))
        entries.append(
            Entry(
                peer.NAME,
                lambda peer=peer, r=reference: _timed(lambda: peer.p2(r.pairs)),
                checker(reference),
                lambda s, r=reference: len(r) / s,
                [],
            )
        )
    return entries


BLOCK = 10
"""Runs of P1 in a row that one time is the mean of: a single run of a millisecond is timed with what the solver before
it left in the caches."""
LONGEST = 2.0
"""[s] A block is cut to about so much."""


def measure(problem: str, unit: str, entries: list[Entry], repeats: int, block: int = 1) -> list[Row]:
    """Run every entry once to compile and check, then ``repeats`` rounds of blocks over all of them in turn."""
    blocks = []
    for entry in entries:
        entry.verdict = entry.check(entry.call()[0])
        blocks.append(max(1, min(block, int(LONGEST / max(entry.call()[1], 1e-9)))))
    for _ in range(repeats):
        for entry, count in zip(entries, blocks, strict=True):
            answers, seconds = zip(*(entry.call() for _ in range(count)), strict=True)
            entry.seconds.append(sum(seconds) / count)
            for verdict in map(entry.check, answers):
                if verdict[1] >= entry.verdict[1]:
                    entry.verdict = verdict  # the worst of all repeats
    rows = []
    for entry in entries:
        checked, wrong, worst = entry.verdict
        best, median = min(entry.seconds), statistics.median(entry.seconds)
        rows.append(Row(problem, entry.name, entry.scale(best), entry.scale(median), unit, checked, wrong, worst))
    own = next((row for row in rows if row.solver == OWN), None)
    if own is not None:
        for row in rows:
            row.ratio = row.median / own.median if unit == "ms/s" else own.median / row.median
    return rows


def show(rows: list[Row]) -> None:
    """The table; ratio is how many times slower than Tarsus, by medians."""
    head = ("problem", "solver", "best", "median", "unit", "ratio", "checked", "wrong", "worst")
    lines = [head]
    for row in rows:
        ratio = "" if row.ratio is None else f"{row.ratio:.1f}"
        lines.append(
            (
                row.problem,
                row.solver,
                f"{row.best:.3g}" if row.best < 1000 else f"{row.best:.0f}",
                f"{row.median:.3g}" if row.median < 1000 else f"{row.median:.0f}",
                row.unit,
                ratio,
                row.checked,
                str(row.wrong),
                f"{row.worst:.1e}",
            )
        )
    widths = [max(len(line[k]) for line in lines) for k in range(len(head))]
    for line in lines:
        print("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip())


def scan(name: str, sizes: Sequence[int]) -> None:
    """Wrong events and worst relative error against tolerance, for choosing a peer's tolerance."""
    peer = _peer(name, 0)
    if peer is None:
        return
    print(f"# {peer.NAME}: n, tolerance, CPU ms/s, wrong events, worst relative error")
    for n in sizes:
        if n not in PEERS[name][2]:
            continue
        problem, span = load(n), min(horizon(n), PEERS[name][3])
        for exponent in range(4, 13):
            tolerance = 10.0**-exponent
            peer.p1(problem, span, tolerance)
            start = time.process_time()
            times = peer.p1(problem, span, tolerance)
            seconds = time.process_time() - start
            check = check_sequence(times, n, span)
            per_second = seconds * 1e6 / span
            print(f"{n:3d}  {tolerance:.0e}  {per_second:8.4g}  {check.wrong:4d}  {check.worst:.1e}")


def environment() -> dict[str, Any]:
    return {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "processor": platform.processor(),
        "cores": os.cpu_count(),
        "load": os.getloadavg() if hasattr(os, "getloadavg") else None,
        "numpy": np.__version__,
    }


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Tarsus and its peers on P1 and P2")
    parser.add_argument("--sizes", type=int, nargs="*", choices=SIZES, default=[2], help="sizes of P1")
    parser.add_argument("--peers", nargs="*", choices=list(PEERS), default=list(PEERS))
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--members", type=int, default=None, help="members of P2 for all; 0 skips P2")
    parser.add_argument("--scan", choices=list(PEERS), default=None, help="error against tolerance on P1")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args(arguments)
    if options.scan:
        scan(options.scan, options.sizes)
        return
    names = [OWN, *options.peers]
    rows: list[Row] = []
    for n in options.sizes:
        rows += measure(f"P1 n={n}", "ms/s", _entries_p1(n, names), options.repeats, BLOCK)
    if options.members != 0:
        rows += measure("P2", "traj/s", _entries_p2(names, options.members), options.repeats)
    show(rows)
    if options.json:
        text = json.dumps({"environment": environment(), "rows": [asdict(row) for row in rows]}, indent=1)
        options.json.write_text(text + "\n")


if __name__ == "__main__":
    main()
