"""Work spread over threads: jobs within jobs stay on their thread, and long ones hear that nobody waits any more."""

from __future__ import annotations

import threading

import pytest

from tarsus.base.workers import spread


def test_a_job_that_spreads_work_does_it_on_its_own_thread():
    barrier = threading.Barrier(2, timeout=10.0)  # both jobs run at the same time

    def outer(job: int) -> set[int]:
        barrier.wait()
        return {threading.get_ident(), *spread(lambda _: threading.get_ident(), range(8), 4)}

    first, second = spread(outer, [1, 2], 2)
    assert len(first) == len(second) == 1 and first != second
    assert list(spread(lambda n: n * n, range(5), 3)) == [0, 1, 4, 9, 16], "elsewhere threads are free again"


def test_long_jobs_hear_when_one_has_failed():
    stop = threading.Event()

    def job(number: int) -> int:
        if number == 0:
            raise ValueError("broken")
        assert stop.wait(10.0), "told at once"
        return number

    with pytest.raises(ValueError, match="broken"):
        list(spread(job, [0, 1], 2, stop))
