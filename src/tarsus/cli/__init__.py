"""The command line: one short file a verb, no numerics.

Nothing heavy is imported before a verb runs, so `tarsus --help` answers at once.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence

__all__ = ["main"]


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
    own = argv is None
    if own:
        _prepare()
    from tarsus.cli.app import run

    code = run(list(sys.argv[1:] if argv is None else argv))
    if own:
        gc.freeze()  # nor is it searched once more at the end
    return code


def _prepare() -> None:
    """What is right for a process of its own, before anything is loaded.

    What it loads stays, and to search that for garbage takes a tenth of a run. On matrices as small as ours the threads
    of BLAS, which numpy would start, only wait for each other.
    """
    gc.set_threshold(100_000)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


if __name__ == "__main__":
    sys.exit(main())
