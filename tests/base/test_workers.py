"""Work spread over threads: jobs within jobs, jobs that nobody waits for any more, and threads of BLAS."""

from __future__ import annotations

import threading

import numpy as np
import pytest
import threadpoolctl

from tarsus.base.threads import single_threaded
from tarsus.base.workers import spread, workers


def test_a_job_that_spreads_work_does_it_on_its_own_thread():
    barrier = threading.Barrier(2, timeout=10.0)  # both jobs run at the same time

    def outer(job: int) -> set[int]:
        barrier.wait()
        return {threading.get_ident(), *spread(lambda _: threading.get_ident(), range(8), 4)}

    first, second = spread(outer, [1, 2], 2)
    assert len(first) == len(second) == 1 and first != second
    assert list(spread(lambda n: n * n, range(5), 3)) == [0, 1, 4, 9, 16], "elsewhere threads are free again"


def test_a_scheduler_lends_as_many_processors_as_there_are_at_most(monkeypatch):
    own = workers()
    for lent, found in (("1", 1), ("1000000", own)):
        monkeypatch.setenv("SLURM_CPUS_PER_TASK", lent)
        assert workers() == found


def test_long_jobs_hear_when_one_has_failed():
    stop = threading.Event()

    def job(number: int) -> int:
        if number == 0:
            raise ValueError("broken")
        assert stop.wait(10.0), "told at once"
        return number

    with pytest.raises(ValueError, match="broken"):
        list(spread(job, [0, 1], 2, stop))


def threads() -> set[int]:
    """Threads of every BLAS that is loaded."""
    np.linalg.eigh(np.eye(2))
    return {one["num_threads"] for one in threadpoolctl.threadpool_info() if one["user_api"] == "blas"}


def test_one_thread_inside_and_as_before_outside():
    with threadpoolctl.threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        assert single_threaded(threads)() == {1}
        assert threads() == before
