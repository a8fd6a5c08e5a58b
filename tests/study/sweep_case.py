"""A small sweep of the cantilever, and an executor whose workers die: it does everything in one thread."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import tarsus as ts
from tarsus.study.sweep import Sweep

RESTITUTION, RATE = "ground.restitution.coefficient", "ground.adhesion.rate"


def small(**changes: Any) -> Sweep:
    """Two axes, six runs of 20 ms in units of four, unless changed."""
    table: dict[str, Any] = {
        "name": "small",
        "scene": ts.load_scene("cantilever", wave="sine", hz=200),
        "duration": 0.02,
        "vary": {RESTITUTION: [0.2, 0.5], RATE: ["1 uN/s", "5 uN/s", "25 uN/s"]},
        "measures": ("contact_duration", "peak"),
        "chunk": 4,
    }
    return Sweep(**(table | changes))


def files(folder: Path) -> dict[str, bytes]:
    """Content of every file below a folder, by its path there."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


class FailingExecutor(Executor):
    """Call number i is lost where ``dies(i)``, before or after the work; every call goes through pickle, as between
    processes."""

    def __init__(self, dies: Callable[[int], bool]) -> None:
        self.calls = 0
        self._dies = dies

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
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
