"""Draws of numbers that belong together, as `tarsus identify` leaves them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError


def write_draws(file: Path, paths: Sequence[str], values: Floats, samples: Floats) -> None:
    """Write values (np,) and draws (ns, np) of parameters [SI] as ``.npz``."""
    np.savez_compressed(file, paths=np.array(paths), values=values, samples=samples)


def read_draws(file: Path) -> dict[str, Floats]:
    """Draws (ns,) by path of an identification, from the ``draws.npz`` that `tarsus identify` writes.

    Raises
    ------
    InputError
        If the file is none.
    """
    try:
        with np.load(file, allow_pickle=False) as stored:
            paths, samples = (
                [str(path) for path in stored["paths"]],
                np.asarray(stored["samples"], dtype=float),
            )
    except (OSError, EOFError, KeyError, ValueError, BadZipFile) as error:  # an empty or cut file among them
        raise InputError(f"{file} holds no draws of an identification: {error}") from error
    if samples.ndim != 2 or samples.shape[1] != len(paths) or not samples.size:
        raise InputError(
            f"{file} holds no draws of an identification: {len(paths)} paths, draws {samples.shape}"
        )
    return {path: samples[:, j] for j, path in enumerate(paths)}
