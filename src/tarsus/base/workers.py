"""Threads, or the workers of an executor, for work that can be done at the same time."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, TypeAlias, TypeGuard, TypeVar

if TYPE_CHECKING:
    from concurrent.futures import Executor

Workers: TypeAlias = "int | Executor | None"
"""Who works: so many threads, the workers of an executor, or a thread for each processor."""

J = TypeVar("J")
R = TypeVar("R")


def workers(threads: Workers = None) -> int:
    """Number of threads to use: as many as asked for, of an executor its `places`, else one for each processor of
    this process.

    A scheduler or container that lends a process some of a machine's processors says so by its affinity, or in an
    environment variable (`LENT`); where a system has none, all of its processors count.
    """
    if is_executor(threads):
        return places(threads)
    if isinstance(threads, int):
        return max(threads, 1)
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    lent = next((text for text in map(os.environ.get, LENT) if text and text.isdecimal()), None)
    return max(min(own or 1, int(lent or own or 1)), 1)


LENT = ("SLURM_CPUS_PER_TASK", "SLURM_CPUS_ON_NODE", "NSLOTS", "LSB_DJOB_NUMPROC", "NCPUS")
"""Where schedulers (SLURM, Grid Engine, LSF, PBS) say how many processors a job may use: the first one set."""


def is_executor(threads: Workers) -> TypeGuard[Executor]:
    """Whether work goes to an executor, whose processes may be elsewhere: then it has to be picklable."""
    return hasattr(threads, "submit")


def places(executor: Executor) -> int:
    """Workers of an executor: as many as it says (`workers`, of `tarsus.cluster`; ``_max_workers``, of Python's own),
    else `UNKNOWN`."""
    count = getattr(executor, "workers", None)
    known = count() if callable(count) else getattr(executor, "_max_workers", UNKNOWN)
    return max(int(str(known)), 1)


UNKNOWN = 64
"""Workers that an executor is taken to have that does not say."""


def spread(
    work: Callable[[J], R], jobs: Sequence[J], threads: Workers = None, stop: threading.Event | None = None
) -> Iterator[R]:
    """Results of jobs in their order, done on `workers` threads or by the workers of an executor.

    A job that spreads work of its own over threads does it alone: threads do not multiply. stop: set when a job has
    failed or the caller leaves early, for long jobs that look at it.
    """
    if is_executor(threads):
        yield from threads.map(work, jobs)
        return
    count = 1 if getattr(_WITHIN, "worker", False) else min(workers(threads), len(jobs))
    if count <= 1:
        yield from map(work, jobs)
        return
    from concurrent.futures import ThreadPoolExecutor

    pool = ThreadPoolExecutor(count, initializer=_begin)
    try:
        yield from pool.map(work, jobs)
    finally:
        if stop is not None:
            stop.set()
        pool.shutdown(cancel_futures=True)


_WITHIN = threading.local()


def _begin() -> None:
    """Marks a thread as one of the workers."""
    _WITHIN.worker = True
