"""Who does the units of a sweep: threads of this process, or any executor, whose processes may be on other machines."""

from __future__ import annotations

import os
import socket
import tempfile
import zlib
from collections.abc import Mapping
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.workers import places
from tarsus.files.runstore import RunStore, digest_of
from tarsus.files.version import versions
from tarsus.solve.simulate import Shared
from tarsus.study.layout import UnitPlan, values_of
from tarsus.study.studyfile import frozen_sweep, frozen_texts
from tarsus.study.sweep import Sweep
from tarsus.study.workunit import work_unit

__all__ = ["Remote", "Threads", "WorkerPool"]

Arrays = dict[str, np.ndarray]

AHEAD = 3
"""Units handed to an executor for each of its workers: one at work, and enough that none waits for the next one."""

FEWEST = 16
"""Units handed out at least: an executor that grows must see that there is work."""


class WorkerPool(Protocol):
    """Does units.

    elsewhere: whether in other processes, which may die or be slow.
    """

    elsewhere: bool

    def submit(self, unit: int) -> Future[tuple[str, Arrays | None]]:
        """Have a unit done: who did it, and its arrays, None where they are in the store already."""
        ...

    def wanted(self) -> int:
        """Units that should be under way or waiting."""
        ...

    def close(self, *, wait: bool) -> None:
        """Take back what is waiting, and with `wait` see what is under way to its end."""
        ...


class Threads:
    """Threads of this process, which write what they made themselves."""

    elsewhere = False

    def __init__(self, sweep: Sweep, layout: UnitPlan, store: RunStore, threads: int) -> None:
        self._sweep, self._layout, self._store = sweep, layout, store
        self._count = threads
        self._shared = Shared()
        self._pool = ThreadPoolExecutor(self._count)
        self._name = socket.gethostname()

    def submit(self, unit: int) -> Future[tuple[str, Arrays | None]]:
        return self._pool.submit(self._work, unit)

    def _work(self, unit: int) -> tuple[str, None]:
        points = self._sweep.points(self._layout.part(unit))
        arrays = work_unit(self._sweep, points, self._shared)
        if not self._store.has(unit):  # another process may have been faster
            self._store.write(unit, arrays)
        return self._name, None

    def wanted(self) -> int:
        return self._count * AHEAD

    def close(self, *, wait: bool) -> None:
        self._pool.shutdown(wait=wait, cancel_futures=True)


class Remote:
    """An executor: it gets the sweep as texts, and gives arrays back, which this process writes.

    So workers need no file system in common with this process, and nothing but Tarsus.
    """

    elsewhere = True

    def __init__(self, sweep: Sweep, layout: UnitPlan, store: RunStore, executor: Executor) -> None:
        self._layout, self._executor = layout, executor
        texts = {name: zlib.compress(text.encode()) for name, text in frozen_texts(sweep).items()}
        self._plan = SentPlan(
            tuple(texts.items()), store.digest, tuple(sorted(versions().items())), socket.gethostname()
        )
        self._waiting: set[Future[tuple[str, Arrays | None]]] = set()

    def submit(self, unit: int) -> Future[tuple[str, Arrays | None]]:
        part = self._layout.part(unit)
        future: Future[tuple[str, Arrays | None]] = self._executor.submit(
            remote_unit, self._plan, part.start, part.stop
        )
        self._waiting.add(future)
        future.add_done_callback(self._waiting.discard)
        return future

    def wanted(self) -> int:
        return max(places(self._executor) * AHEAD, FEWEST)

    def close(self, *, wait: bool) -> None:
        for future in list(self._waiting):
            future.cancel()


@dataclass(frozen=True)
class SentPlan:
    """A sweep on its way to another process: compressed texts by name, digest, versions, and the node it is from."""

    texts: tuple[tuple[str, bytes], ...]
    digest: str
    versions: tuple[tuple[str, str], ...]
    node: str


def remote_unit(plan: SentPlan, start: int, stop: int) -> tuple[str, Arrays]:
    """Runs from `start` to before `stop` of a sent sweep: who made them, and their arrays.

    Raises
    ------
    InputError
        When this process would give other results than the one that sent the sweep: the sentence names both nodes and
        what differs.
    """
    sweep, shared = _received(plan)
    arrays = work_unit(sweep, sweep.points(slice(start, stop)), shared)
    return f"{socket.gethostname()}:{os.getpid()}", arrays


@lru_cache(maxsize=2)
def _received(plan: SentPlan) -> tuple[Sweep, Shared]:
    here = versions()
    differing = [key for key, value in plan.versions if here.get(key) != value]
    if differing:
        there = dict(plan.versions)
        mine, own = (", ".join(f"{key} {one.get(key, '?')}" for key in differing) for one in (here, there))
        raise InputError(
            f"node {socket.gethostname()} has {mine}, and the sweep was begun on {plan.node} with {own}: all nodes "
            "need the same version"
        )
    with tempfile.TemporaryDirectory(prefix="tarsus-") as place:
        _unpack(dict(plan.texts), Path(place))
        sweep = frozen_sweep(Path(place))
    texts = {name: zlib.decompress(text).decode() for name, text in plan.texts}
    if digest_of(texts, values_of(sweep)) != plan.digest:
        raise InputError(
            f"node {socket.gethostname()} reads the sweep otherwise than {plan.node} does, where it was begun: all "
            "nodes need the same versions of numpy and scipy"
        )
    return sweep, Shared()


def _unpack(texts: Mapping[str, bytes], place: Path) -> None:
    for name, text in texts.items():
        (place / name).parent.mkdir(exist_ok=True)
        (place / name).write_bytes(zlib.decompress(text))
