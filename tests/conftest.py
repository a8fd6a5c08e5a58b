"""Every run of the tests tries the same random examples; ``--hypothesis-profile=search`` looks for new ones."""

import gc
import os
from pathlib import Path

# Before numpy is loaded: on matrices as small as ours the threads of BLAS only wait for each other, and on a busy
# machine they spend several times the work on it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings

from heavy import Scale, in_order, mark

settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=40)
settings.register_profile("search", max_examples=2000, deadline=None)
settings.load_profile("repeatable")

# As a command line does: to search thousands of tests for garbage takes a twentieth of them.
gc.set_threshold(100_000)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--last-bit", type=int, metavar="SEED", help="move linear algebra by its last bit")
    parser.addoption("--weigh", metavar="FILE", help="add the CPU time of each case to FILE")


def pytest_configure(config: pytest.Config) -> None:
    if (seed := config.getoption("--last-bit")) is not None:
        from last_bit import install

        install(seed)
    if file := config.getoption("--weigh"):
        config.pluginmanager.register(Scale(file))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    mark(items)
    in_order(items)


@pytest.fixture(scope="module")
def alone(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a module's ``SWEEP``, on this process alone."""
    from tarsus.study.sweeping import run_sweep

    folder = tmp_path_factory.mktemp("alone")
    run_sweep(request.module.SWEEP, folder)
    return folder


def pytest_report_header(config: pytest.Config) -> str:
    """What the numbers of this run come from, for whoever has others."""
    from kernels import line

    seed = config.getoption("--last-bit")
    return line() + ("" if seed is None else f"; the last bit of linear algebra is moved, seed {seed}")


def pytest_collection_finish() -> None:
    """What was loaded stays, and is not searched again."""
    gc.freeze()
