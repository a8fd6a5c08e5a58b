"""Dask's clusters as executors."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from typing import Any

from tarsus.base.errors import InputError

PATIENCE = "20 s"
"""How long a scheduler is waited for: what starts at the same time needs some seconds."""

FRESH = 2.0
"""Seconds for which a count of workers is taken to hold: asking costs the scheduler a message."""


class DaskExecutor(Executor):
    """A client of dask.distributed as an executor that knows how many workers there are just now."""

    def __init__(self, client: Any) -> None:
        self._client = client
        # not pure: a unit that is handed out twice is made twice
        self._executor = client.get_executor(pure=False)
        self._count, self._asked = 0, -FRESH

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        return self._executor.submit(fn, *args, **kwargs)

    def workers(self) -> int:
        """Threads of all workers that are there; clusters may grow and shrink."""
        if time.monotonic() - self._asked > FRESH:
            self._count, self._asked = sum(self._client.nthreads().values()), time.monotonic()
        return self._count

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the client as it is: it belongs to whoever made it."""


def executor_of(client: Any) -> Executor:
    """An executor from an executor, or from a client of dask.distributed.

    Raises
    ------
    InputError
        For anything else.
    """
    if isinstance(client, Executor):
        return client
    if hasattr(client, "get_executor") and hasattr(client, "nthreads"):
        return DaskExecutor(client)
    raise InputError(
        f"threads: expected a dask.distributed.Client or an executor of concurrent.futures, got {type(client).__name__}"
    )


@contextlib.contextmanager
def dask_executor(address: str, threads: int | None = None) -> Iterator[Executor]:
    """The workers of a Dask cluster for the length of a block.

    Parameters
    ----------
    address
        Of a scheduler (``tcp://host:8786``), path of its scheduler file (``.json``), or ``local``: processes of this
        machine, one for each processor that this one may use.
    threads
        Number of those processes.

    Raises
    ------
    InputError
        Without dask.distributed, and when no scheduler answers.
    """
    try:
        import distributed
    except ImportError:
        raise InputError("--on needs dask.distributed: pip install dask distributed") from None
    with contextlib.ExitStack() as stack:
        if address == "local":
            from tarsus.base.workers import workers

            cluster: Any = distributed.LocalCluster(
                n_workers=workers(threads), threads_per_worker=1, dashboard_address=":0"
            )
            words: dict[str, Any] = {"address": stack.enter_context(cluster)}
        else:
            words = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
        try:
            client = stack.enter_context(distributed.Client(**words, timeout=PATIENCE, set_as_default=False))
        except (OSError, ValueError) as error:
            raise InputError(f"--on: no scheduler answers at '{address}' ({error})") from error
        yield DaskExecutor(client)
