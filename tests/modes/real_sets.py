"""Measured frequency responses from tests/data/real."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import loadmat

from tarsus.modes import Frf
from tarsus.records.measurement import Quantity

DATA = Path(__file__).parents[1] / "data" / "real"


def cued() -> Frf:
    """One accelerance, 0 to 1500 Hz."""
    file = loadmat(DATA / "cued_transfer_function_clean.mat")
    step = file["freq"].item() / file["npts"].item()
    values = file["yspec"].T[None]
    return Frf(step * np.arange(values.shape[-1]), values, ("plate",), ("hammer",), Quantity.ACCELERATION)


def vtb(case: int) -> Frf:
    """A response of the vibration toolbox."""
    file = loadmat(DATA / f"vtb_case{case}.mat")
    frequency = file["Freq_domain"][:, 0].astype(float)
    return Frf(frequency, file["Hf_chan_2"].T[None], ("beam",), ("hammer",), Quantity.ACCELERATION)


def beam() -> Frf:
    """Three accelerances of a free beam, a line every hertz."""
    rows = [np.loadtxt(DATA / f"pyuff_meas_point_{k}.txt", dtype=complex, converters=complex)[None] for k in (1, 2, 3)]
    values = np.array(rows)
    return Frf(np.arange(values.shape[-1], dtype=float), values, ("p1", "p2", "p3"), ("h",), Quantity.ACCELERATION)
