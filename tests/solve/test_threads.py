"""Threads of BLAS are limited where the work is done, and only there."""

import numpy as np
import threadpoolctl

from tarsus.base.threads import single_threaded


def threads() -> set[int]:
    """Threads of every BLAS that is loaded."""
    np.linalg.eigh(np.eye(2))
    return {one["num_threads"] for one in threadpoolctl.threadpool_info() if one["user_api"] == "blas"}


def test_one_thread_inside_and_as_before_outside():
    with threadpoolctl.threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        assert single_threaded(threads)() == {1}
        assert threads() == before
