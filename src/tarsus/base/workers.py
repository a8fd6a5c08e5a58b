"""Threads for work that can be done at the same time."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

__all__ = ["spread", "workers"]

J = TypeVar("J")
R = TypeVar("R")


def workers(threads: int | None = None) -> int:
    """Number of threads to use: as many as asked for, else one for each processor that this process may run on.

    A scheduler or container that lends a process some of a machine's processors says so by its affinity, or in an
    environment variable (`LENT`); where a system has none, all of its processors count.
    """
    if threads is not None:
        return max(threads, 1)
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    lent = next((text for text in map(os.environ.get, LENT) if text and text.isdecimal()), None)
    return max(min(own or 1, int(lent or own or 1)), 1)


LENT = ("SLURM_CPUS_PER_TASK", "SLURM_CPUS_ON_NODE", "NSLOTS", "LSB_DJOB_NUMPROC", "NCPUS")
"""Where schedulers (SLURM, Grid Engine, LSF, PBS) say how many processors a job may use: the first one set."""


def spread(work: Callable[[J], R], jobs: Sequence[J], threads: int | None = None) -> Iterator[R]:
    """Results of jobs in their order, done on `workers` threads."""
    count = min(workers(threads), len(jobs))
    if count <= 1:
        yield from map(work, jobs)
        return
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(count) as pool:
        yield from pool.map(work, jobs)
