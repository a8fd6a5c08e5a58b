"""One thread for matrices as small as ours."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def single_threaded(work: Callable[P, R]) -> Callable[P, R]:
    """A function that does its linear algebra in one thread; the caller's setting holds again afterwards.

    On matrices of some tens of columns the threads that BLAS starts by itself only wait for each other: an
    identification takes more than twice the processor time with two of them (22 s for 10), and no less of the clock.
    """

    @wraps(work)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        from threadpoolctl import threadpool_limits

        with threadpool_limits(limits=1, user_api="blas"):
            return work(*args, **kwargs)

    return limited
