"""Draws of numbers that belong together, as `tarsus identify` leaves them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.tables.numbers import percent


@dataclass(frozen=True)
class Reliance:
    """How far draws can be relied on: doubts: sentences on what the identification that they are of does not explain;
    missed: share of itself by which a speed of walks that it has not seen was off the middle of what draws predict."""

    doubts: tuple[str, ...] = ()
    missed: float = 0.0

    def sentences(self) -> list[str]:
        """What a reader of anything that is made with the draws must not miss."""
        out = []
        if self.doubts:
            first, *others = self.doubts
            more = f", and {len(others)} more" if others else ""
            out.append(f"the draws are of an identification in doubt: {first}{more}")
        if self.missed:
            said = f"walks that the identification has not seen were {percent(self.missed, 2)} off their prediction"
            out.append(f"intervals of speed are wider by so much: {said}")
        elif self.doubts:
            out.append("no interval of speed is stated: no walk that was left out says how far the doubt moves it")
        return out

    def widened(self, ends: tuple[float, float]) -> tuple[float, float]:
        """An interval that draws give, wider by what they miss; NaN where it is not known what a doubt moves."""
        if self.doubts and not self.missed:
            return math.nan, math.nan
        off = self.missed * max(abs(one) for one in ends)
        return ends[0] - off, ends[1] + off


SURE = Reliance()
"""Of draws of which nothing is doubted."""


def write_draws(file: Path, paths: Sequence[str], values: Floats, samples: Floats, reliance: Reliance = SURE) -> None:
    """Write values (np,) and draws (ns, np) of parameters [SI] as ``.npz``."""
    np.savez_compressed(
        file,
        paths=np.array(paths),
        values=values,
        samples=samples,
        doubts=np.array(reliance.doubts, dtype=str),
        missed=reliance.missed,
    )


def read_reliance(file: Path) -> Reliance:
    """How far the draws of a file can be relied on. Raises InputError as `read_draws` does."""
    read_draws(file)
    with np.load(file, allow_pickle=False) as stored:
        if "doubts" not in stored:
            return SURE
        return Reliance(tuple(str(one) for one in stored["doubts"]), float(stored["missed"]))


def read_draws(file: Path) -> dict[str, Floats]:
    """Draws (ns,) by path of an identification, from the ``draws.npz`` that `tarsus identify` writes.

    Raises
    ------
    InputError
        If the file is none.
    """
    if not file.exists():
        raise InputError(f"{file}: no such file")
    try:
        with np.load(file, allow_pickle=False) as stored:
            paths, samples = ([str(path) for path in stored["paths"]], np.asarray(stored["samples"], dtype=float))
    except (OSError, EOFError, KeyError, ValueError, BadZipFile) as error:  # an empty or cut file among them
        raise InputError(f"{file} holds no draws of an identification; expected a draws.npz") from error
    if samples.ndim != 2 or samples.shape[1] != len(paths) or not samples.size:
        raise InputError(f"{file} holds no draws of an identification: {len(paths)} paths, draws {samples.shape}")
    return {path: samples[:, j] for j, path in enumerate(paths)}
