"""The same answer on every processor: tests of the engine once more, on other machine code of OpenBLAS.

Decisions of the engine must not hang on the last bit of an eigensolver. This process runs on one kernel; the tests
named here run on the others, each in a process of its own. By hand, all tests of the engine on one kernel:

    OPENBLAS_CORETYPE=Prescott pytest tests/analytic tests/conformance tests/invariants tests/core
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from kernels import KERNELS, in_use, missing

TESTS = Path(__file__).parents[1]
ENGINE = (
    "core/test_blocks.py",
    "core/test_redundant_feet.py",
    "conformance/test_walkers.py",
    "analytic/test_oracles_sequences.py",
)
"""Where contact modes, ties and zeros decide; 3 s of a processor. All tests of the engine: `.ci/kernels`."""


def run_engine(environment: dict[str, str], *options: str) -> str:
    """What the engine's tests print in a process with these variables set; a failing one fails here."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--tb=short", *options]
    done = subprocess.run(
        [*command, *(str(TESTS / file) for file in ENGINE)],
        cwd=TESTS.parent,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=540,
    )
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]
    return done.stdout


OTHERS = [kernel for kernel in KERNELS if set(in_use().values()) != {kernel}]


# Slow: by default events are compared to the last bit (invariants/test_same_everywhere.py), and last bits moved.
@pytest.mark.slow
@pytest.mark.parametrize("kernel", OTHERS)
def test_the_engine_on_other_kernels(kernel: str) -> None:
    here = in_use()
    if not here:
        pytest.skip("numpy and scipy have no OpenBLAS here, so there are no kernels to choose from")
    if lacking := missing(kernel):
        pytest.skip(lacking)
    probe = subprocess.run(
        [sys.executable, str(TESTS / "kernels.py")],
        env=os.environ | {"OPENBLAS_CORETYPE": kernel},
        capture_output=True,
        text=True,
    )
    assert re.findall(r"(\w+) in ", probe.stdout) == [kernel] * len(here), (probe.returncode, probe.stdout)
    said = run_engine({"OPENBLAS_CORETYPE": kernel})
    names = re.findall(r"(\w+) in ", next(line for line in said.splitlines() if "OpenBLAS: " in line))
    assert names == [kernel] * len(here)
