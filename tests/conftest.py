"""Every run of the tests tries the same random examples; ``--hypothesis-profile=search`` looks for new ones."""

import gc
import os

# Before numpy is loaded: on matrices as small as ours the threads of BLAS only wait for each other, and on a busy
# machine they spend several times the work on it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=40)
settings.register_profile("search", max_examples=2000, deadline=None)
settings.load_profile("repeatable")

gc.set_threshold(100_000)  # as a command line does: to search thousands of tests for garbage takes a twentieth of them


def pytest_collection_finish() -> None:
    """What was loaded stays, and is not searched again."""
    gc.freeze()
