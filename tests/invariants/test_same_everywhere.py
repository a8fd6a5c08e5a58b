"""Events are the same to the last bit whichever kernels the linear algebra library takes for the processor it finds."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from kernels import KERNELS, in_use, missing
from last_bit import moved, same_for
from walking_scenes import trotter

DEVICES = ("cantilever", "cantilever-1", "hexapod", "quadruped", "millipede", "millipede-table", "millipede-30")
"""Modal and lumped, with general damping and impact maps, walkers by their legs and from a standing start."""


def events() -> list[str]:
    """All numbers of all events of short runs, bit by bit, by their names."""
    rough = {"kind": "random", "seed": 2, "rms": 1e-7, "correlation_length": 1e-4, "spacing": 2e-5}
    uneven = ts.with_values(trotter(3), {"ground.profile": rough})
    scenes = [*(ts.load_scene(name) for name in DEVICES), trotter(1), trotter(3), uneven]
    runs = [ts.simulate(scene, 0.02) for scene in scenes]
    assert all(run.ok for run in runs) and sum(len(run.events) for run in runs) > 200
    return [run.events[name].tobytes().hex() for run in runs for name in run.events.dtype.names or ()]


def events_with(kernels: str | None) -> list[str]:
    """Those of a fresh process that takes these kernels, or those of this one: here last bits may be moved."""
    own = [str(Path(__file__).parent), str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    given = os.environ | {"PYTHONPATH": os.pathsep.join(own)}
    given |= {"OPENBLAS_CORETYPE": kernels} if kernels else {}
    there = subprocess.run(
        [sys.executable, "-c", "import test_same_everywhere as own; print('\\n'.join(own.events()))"],
        env=given,
        capture_output=True,
        text=True,
        check=True,
    )
    return there.stdout.splitlines()


@pytest.fixture(scope="module")
def here() -> list[str]:
    return events_with(None)


@pytest.mark.parametrize("kernels", [one for one in KERNELS if set(in_use().values()) != {one}])
def test_events_are_the_same_bits_with_other_kernels(kernels: str, here: list[str]) -> None:
    """Modes, nodes and polynomials of drives came from a library: times differed by 1e-13, chaotic motions wholly.

    Where the processor lacks what a name asks for, the library falls back or dies; elsewhere nothing knows the word.
    """
    if lacks := missing(kernels):
        pytest.skip(lacks)
    assert len(here) > 50 and events_with(kernels) == here


def test_a_result_is_moved_by_one_unit_and_a_zero_not_at_all() -> None:
    """By `pytest --last-bit`: linear algebra of a processor of no make, on which `.ci/kernels` runs the engine."""
    given = np.array([1.0, -3.0, 0.0, 1e-300, np.pi] * 40)
    found = moved(given, same_for(1, given))
    assert np.array_equal(found, moved(given, same_for(1, given)))
    assert 0.5 < np.mean(found != given) / np.mean(given != 0.0) < 0.8
    assert np.all(np.abs(found - given) <= np.spacing(np.abs(given)))
    assert np.all(found[2::5] == 0.0)
    _, vectors = moved(np.linalg.eigh(np.diag([1.0, 2.0])), same_for(1))
    assert np.array_equal(vectors == 0.0, [[False, True], [True, False]])
