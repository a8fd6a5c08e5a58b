"""Where a process of the command line begins: its streams, its garbage, its threads of linear algebra."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    argv
        words after `tarsus`; the process's own when None.

    Returns
    -------
    int
        0 done, 1 the physics or a check failed, 2 bad input, 130 interrupted.
    """

    def run(words: list[str]) -> int:
        from tarsus.cli.app import run

        return run(words)

    return alone(run) if argv is None else run(list(argv))


def alone(do: Callable[[list[str]], int]) -> int:
    """The exit code of a process of its own, which does nothing else with the words it was called with.

    What it loads stays, and to search that for garbage takes a tenth of a run. On matrices as small as ours the threads
    of BLAS, which numpy would start, only wait for each other.
    """
    _open_streams()
    gc.set_threshold(100_000)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    code = do(sys.argv[1:])
    gc.freeze()  # nor is it searched once more at the end
    return code


def _open_streams() -> None:
    """A process may be started with streams closed (``>&-``): what would go there goes nowhere, and no file that is
    opened later takes their place."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115, it stays open
