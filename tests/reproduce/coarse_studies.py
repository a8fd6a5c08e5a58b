"""The millipede's studies with few values each, for tests."""

from __future__ import annotations

from contextlib import contextmanager

import pytest

from tarsus.study.studyfile import load_sweep
from tarsus.study.sweep import Sweep
from tarsus_reproduce import millipede


def coarse(name: str) -> Sweep:
    """A packaged study with 9 values of what varies, at two restitutions."""
    packaged = load_sweep(name)
    path, restitution = packaged.vary
    axis = packaged.vary[path].model_copy(update={"count": 9})
    return packaged.model_copy(update={"vary": {path: axis, restitution: [0.1, 0.9]}})


@contextmanager
def few_runs():
    """While it lasts, reproductions of the millipede take the coarse studies."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(millipede, "load_sweep", coarse)
        yield patch
