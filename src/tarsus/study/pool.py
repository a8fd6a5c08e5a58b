"""Units of a sweep on the workers of any executor, whose processes may be on other machines."""

from __future__ import annotations

import contextlib
import os
import socket
import tempfile
import time
import zlib
from collections import Counter, deque
from collections.abc import Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.workers import places
from tarsus.files.runstore import RunStore, digest_of
from tarsus.files.version import versions
from tarsus.solve import Shared
from tarsus.study.layout import values_of
from tarsus.study.studyfile import frozen_sweep, frozen_texts
from tarsus.study.workunit import work_unit

if TYPE_CHECKING:
    from tarsus.files.memo import Arrays
    from tarsus.study.progress import Progress
    from tarsus.study.sweep import Sweep

AHEAD = 3
"""Units handed to an executor for each of its workers: one at work, and enough that none waits for the next one."""

FEWEST = 16
"""Units handed out at least: an executor that grows must see that there is work."""

TRIES = 5
"""Times that a unit is handed out whose workers die: a unit that kills its worker must not go round for ever."""

LATE = 5.0
"""A unit that takes this many times the median is handed out once more when nothing else is waiting: its node may be
gone or slow, and to do a unit twice is harmless."""

LOOK = 1.0
"""Seconds between two looks for late units."""

RECENT = 200
"""Units whose median is the usual time: enough of them, and none from before a cluster became slower."""

KEPT = "finished parts are kept, continue with --resume"


class WorkerPool:
    """The workers of an executor, which may die or be slow: they get the sweep as texts and give arrays back, which
    this process writes.

    So workers need no file system in common with this process, and nothing but Tarsus.
    """

    def __init__(self, sweep: Sweep, store: RunStore, executor: Executor, progress: Progress) -> None:
        self._store, self._executor, self._progress = store, executor, progress
        texts = {name: zlib.compress(text.encode()) for name, text in frozen_texts(sweep).items()}
        self._plan = SentPlan(
            tuple(texts.items()), store.digest, tuple(sorted(versions().items())), socket.gethostname()
        )
        self._waiting: deque[int] = deque()
        self._missing: set[int] = set()
        self._under_way: dict[Future[tuple[str, Arrays]], tuple[int, float]] = {}
        self._tries: Counter[int] = Counter()
        self._seconds: deque[float] = deque(maxlen=RECENT)

    def do(self, units: Sequence[int]) -> None:
        """Have units done and kept, however often workers die; those that appear in the store meanwhile are skipped.

        Raises
        ------
        InputError
            When a unit's workers died `TRIES` times, a worker has another version, or the disk is full or gone.
        """
        self._waiting, self._missing = deque(units), set(units)
        try:
            while self._missing:
                self._hand_out()
                ready, _ = wait(self._under_way, timeout=LOOK, return_when=FIRST_COMPLETED)
                for future in ready:
                    self._receive(future)
                if not ready and not self._waiting:
                    self._hand_out_late_ones()
        except BaseException:
            self._keep_finished()
            raise
        finally:
            for future in self._under_way:
                future.cancel()

    def _hand_out(self) -> None:
        wanted = max(places(self._executor) * AHEAD, FEWEST)
        while self._waiting and len(self._under_way) < wanted:
            unit = self._waiting.popleft()
            if unit not in self._missing:
                continue
            if self._store.has(unit):  # another process was here
                self._done(unit, None)
                continue
            part = self._store.part(unit)
            try:
                future = self._executor.submit(remote_unit, self._plan, part.start, part.stop)
            except RuntimeError as error:
                raise InputError(f"no worker takes units any more ({error}); {KEPT}") from error
            self._under_way[future] = unit, time.monotonic()

    def _receive(self, future: Future[tuple[str, Arrays]]) -> None:
        unit, begin = self._under_way.pop(future)
        if unit not in self._missing:
            return
        try:
            who, arrays = future.result()
        except InputError:
            raise
        except Exception as error:  # a worker died, or was taken away
            self._tries[unit] += 1
            if self._tries[unit] >= TRIES:
                raise InputError(
                    f"unit {unit} was begun {TRIES} times and its worker did not come back "
                    f"({type(error).__name__}: {error}); {KEPT}"
                ) from error
            self._waiting.append(unit)
            return
        self._store.write(unit, arrays)
        self._seconds.append(time.monotonic() - begin)
        self._done(unit, who)

    def _done(self, unit: int, who: str | None) -> None:
        self._missing.discard(unit)
        self._progress.count(who, self._store.size(unit))

    def _hand_out_late_ones(self) -> None:
        """Units that are late wait once more."""
        if not self._seconds:
            return
        limit = max(LATE * float(np.median(self._seconds)), LOOK)
        count = Counter(unit for unit, _ in self._under_way.values())
        now = time.monotonic()
        self._waiting.extend(
            unit for unit, begin in self._under_way.values() if now - begin > limit and count[unit] == 1
        )

    def _keep_finished(self) -> None:
        """What workers have given back is kept, also when the sweep stops."""
        for future, (unit, _) in self._under_way.items():
            if future.done() and not future.cancelled() and future.exception() is None and unit in self._missing:
                with contextlib.suppress(InputError):  # why the sweep stops is said already
                    self._store.write(unit, future.result()[1])


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
