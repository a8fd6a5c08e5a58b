"""A walker's events are the same to the last bit whichever kernels the linear algebra library takes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

TESTS = Path(__file__).parents[1]
SCRIPT = f"""
import sys
sys.path.insert(0, {str(TESTS)!r})
import tarsus as ts
from walking_scenes import trotter
scenes = [trotter(1), trotter(3), ts.load_scene("millipede")]
for run in (ts.simulate(scene, 0.02) for scene in scenes):
    assert run.ok and len(run.events) > 5
    for event in run.events.tolist():
        print([float(number).hex() for number in event])
"""


def events_with(kernels: str) -> str:
    """Of a fresh process that takes these kernels; they run on every x86-64, and elsewhere nothing knows the word."""
    given = os.environ | {"OPENBLAS_CORETYPE": kernels}
    return subprocess.run(
        [sys.executable, "-c", SCRIPT], env=given, capture_output=True, text=True, check=True
    ).stdout


def test_walkers_have_the_same_events_to_the_last_bit_with_other_kernels() -> None:
    """Matrices of nodes, and polynomials of the drives, came from a library: event times differed by 1e-13."""
    assert events_with("Prescott") == events_with("Sandybridge")
