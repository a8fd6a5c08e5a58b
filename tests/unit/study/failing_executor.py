"""An executor whose workers die: it does everything in one thread and loses some of it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any


class FailingExecutor(Executor):
    """Call number i is lost where ``dies(i)``, before or after the work; every call goes through pickle, as between
    processes."""

    def __init__(self, dies: Callable[[int], bool]) -> None:
        self.calls = 0
        self._dies = dies

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        import pickle

        future: Future[Any] = Future()
        number, self.calls = self.calls, self.calls + 1
        if self._dies(number):
            future.set_exception(EOFError("the worker died"))
            return future
        fn, args = pickle.loads(pickle.dumps((fn, args)))
        try:
            future.set_result(pickle.loads(pickle.dumps(fn(*args, **kwargs))))
        except Exception as error:
            future.set_exception(pickle.loads(pickle.dumps(error)))
        return future
