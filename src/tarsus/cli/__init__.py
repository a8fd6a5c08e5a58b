"""The command line: one short file a verb, no numerics.

Nothing heavy is imported before a verb runs, so `tarsus --help` answers at once.
"""

from __future__ import annotations

import gc
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
    if argv is None:  # a process of its own: what it loads stays, and to search that for garbage takes a tenth of a run
        gc.set_threshold(100_000)
    from tarsus.cli.app import run

    return run(list(sys.argv[1:] if argv is None else argv))


if __name__ == "__main__":
    sys.exit(main())
