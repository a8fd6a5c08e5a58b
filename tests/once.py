"""What many tests need and what takes long: made by one worker of a run, and read by the others."""

from __future__ import annotations

import os
import pickle
import tempfile
import time
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")
LONGEST = 900.0
"""[s] that a worker waits for another one before it makes the thing itself."""


def once(make: Callable[[], T]) -> Callable[[], T]:
    """The function of no arguments, called once by all workers of pytest-xdist together; what it returns is pickled."""

    @lru_cache(maxsize=1)
    def found() -> T:
        run = os.environ.get("PYTEST_XDIST_TESTRUNUID")
        if run is None:
            return make()
        home = Path(tempfile.gettempdir()) / f"tarsus-tests-{run}"
        home.mkdir(exist_ok=True)
        file, begun, part = (home / f"{make.__module__}.{make.__name__}{end}" for end in ("", ".begun", ".part"))
        try:
            begun.touch(exist_ok=False)
        except FileExistsError:
            until = time.monotonic() + LONGEST
            while not file.exists() and time.monotonic() < until:
                time.sleep(0.2)
            return pickle.loads(file.read_bytes()) if file.exists() else make()
        made = make()
        part.write_bytes(pickle.dumps(made))
        part.replace(file)
        return made

    return found
