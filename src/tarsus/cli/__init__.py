"""The command line: one short file a verb, no numerics.

Nothing heavy is imported before a verb runs, so `tarsus --help` answers at once.
"""

from tarsus.cli.entry import main

__all__ = ["main"]
