"""What readers are tried on: a file that is written, and what it holds by a reader that is not ours."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Held:
    """What a file holds.

    channels: by name the SI unit and the values in it (ns,); step [s] and start [s] of the samples; digits: step of the
    last digit of the values, relative to the largest, where the file has fewer than a double.
    """

    channels: Mapping[str, tuple[str, NDArray[np.float64]]]
    step: float
    start: float = 0.0
    digits: float = 1e-12


@dataclass(frozen=True)
class Case:
    """One file. name: of the case, and with its suffix of the file; write: writes it and says what it holds, as the
    format's own library reads it back; choices: what the user must say, as `tarsus.read_measurement` takes it."""

    name: str
    write: Callable[[Path], Held]
    choices: Mapping[str, Any] = field(default_factory=dict)
