"""What a cluster of so many workers would make of a sweep: a simulation by events, fed with measured costs.

Every worker starts, takes unit after unit of its share, writes each, and may die. What is modelled is what has been
seen to matter: loading Python and the package, the spread of units' times, the file system that takes so many
operations a second from all workers together, deaths and requeues, the tail at the end.

``python benchmarks/cluster_model.py --workers 100 --runs 1e7`` prints one case.
"""

from __future__ import annotations

import heapq
import math
import random
from dataclasses import dataclass, replace

from tarsus.cluster.array import HELP

__all__ = ["Costs", "Outcome", "simulated"]


@dataclass(frozen=True)
class Costs:
    """What a sweep costs on a cluster, in seconds unless said otherwise.

    run: processor time of a run; spread: standard deviation of a unit's time over its mean; unit: time wanted of a
    unit; start: of a worker until its first unit; write: of a unit's file; operations: file system operations a
    second that all workers share; per_unit: operations that a unit takes; life: mean time to a worker's death,
    infinite for none; back: from a death to the next start; slow: share of workers that are half as fast.

    Defaults of spread, start, write and per_unit (ten calls of the system that reach the disk, one of them to sync)
    were measured on 800 walks of `millipede` in units of 20, start and write rounded up. Operations a second, life and
    slow workers are a cluster's own.
    """

    run: float = 3e-3
    spread: float = 0.15
    unit: float = 2.0
    start: float = 2.0
    write: float = 0.012
    operations: float = 1000.0
    per_unit: float = 10.0
    life: float = math.inf
    back: float = 30.0
    slow: float = 0.0

    @property
    def runs_per_unit(self) -> int:
        """Runs in a unit."""
        return max(round(self.unit / self.run), 1)


@dataclass(frozen=True)
class Outcome:
    """How it went: wall time [s]; efficiency: time of the runs over that of all workers until the end; deaths, each of
    which loses the unit under way; busy: share of the file system's operations that were used."""

    seconds: float
    efficiency: float
    deaths: int
    busy: float


def simulated(costs: Costs, workers: int, runs: int, *, strided: bool = True, seed: int = 0) -> Outcome:
    """A sweep on so many workers.

    Parameters
    ----------
    costs
        What things cost.
    workers
        Number of single-threaded workers.
    runs
        Number of runs.
    strided
        Each worker has a share of its own and then helps others, as tasks of an array do; else all take from one queue,
        as with Dask.
    seed
        Of times and deaths.
    """
    chance = random.Random(seed)
    units = -(-runs // costs.runs_per_unit)
    mean = costs.runs_per_unit * costs.run
    left = [units // workers + (one < units % workers) for one in range(workers)]
    pool, helps = units, [one // HELP for one in left]
    pace = [2.0 if chance.random() < costs.slow else 1.0 for _ in range(workers)]
    dies = [
        chance.expovariate(1.0 / costs.life) if math.isfinite(costs.life) else math.inf
        for _ in range(workers)
    ]
    # a cluster's file system as one server: an operation waits for those before it
    free, used, deaths, end = 0.0, 0.0, 0, 0.0
    serving = costs.per_unit / costs.operations
    queue = [(costs.start * chance.uniform(0.8, 1.5), one, False) for one in range(workers)]
    heapq.heapify(queue)
    while queue:
        now, one, made = heapq.heappop(queue)
        if made:  # the unit is computed: its file is written
            free = max(free, now) + serving
            used += serving
            now = max(now + costs.write, free)
            end = max(end, now)
        whose = one
        if strided and left[one] <= 0 and helps[one] > 0 and pool > 0:
            helps[one] -= 1
            whose = max(range(workers), key=left.__getitem__)
        if (left[whose] if strided else pool) <= 0:
            continue
        done = now + max(chance.gauss(1.0, costs.spread), 0.1) * mean * pace[one]
        if done > dies[one]:
            deaths += 1
            born = max(dies[one], now) + costs.back + costs.start
            dies[one] = born + chance.expovariate(1.0 / costs.life)
            heapq.heappush(queue, (born, one, False))
            continue
        left[whose] -= 1
        pool -= 1
        heapq.heappush(queue, (done, one, True))
    useful = runs * costs.run
    return Outcome(end, useful / (end * workers), deaths, used / end)


def main(words: list[str] | None = None) -> int:
    """The command line."""
    import argparse

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--workers", type=int, default=100)
    parser.add_argument("--runs", type=float, default=1e7)
    parser.add_argument("--queue", action="store_true", help="one queue instead of a share for each worker")
    fields = [name for name in Costs.__dataclass_fields__]
    for name in fields:
        parser.add_argument(f"--{name.replace('_', '-')}", type=float, default=getattr(Costs, name))
    given = parser.parse_args(words)
    costs = replace(Costs(), **{name: getattr(given, name) for name in fields})
    found = simulated(costs, given.workers, int(given.runs), strided=not given.queue)
    print(
        f"{int(given.runs)} runs in {-(-int(given.runs) // costs.runs_per_unit)} units on {given.workers} workers: "
        f"{found.seconds:.0f} s, efficiency {100.0 * found.efficiency:.1f} %, {found.deaths} deaths, file system "
        f"{100.0 * found.busy:.1f} % busy"
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
