"""A command line whose sweep cannot end by itself: `python held_sweep.py MOST sweep ...`.

Only MOST units of work are done; every further one waits for an interrupt, so that a test that kills or interrupts the
process finds it at work however fast the machine is.
"""

from __future__ import annotations

import itertools
import signal
import sys
import threading

from tarsus.cli import main
from tarsus.study import sweeping

PATIENCE = 300.0
"""Seconds after which a unit goes on by itself, so that a failing test leaves no process behind."""


def hold(most: int) -> None:
    """Let so many units be done, and make the others wait for the interrupt."""
    begun, whole, interrupted = itertools.count(), sweeping.work_unit, threading.Event()

    def held(*words, **options):
        if next(begun) >= most:
            interrupted.wait(PATIENCE)
        return whole(*words, **options)

    def interrupt(number, frame):
        interrupted.set()
        signal.default_int_handler(number, frame)

    sweeping.work_unit = held
    signal.signal(signal.SIGINT, interrupt)


if __name__ == "__main__":
    hold(int(sys.argv[1]))
    sys.exit(main(sys.argv[2:]))
