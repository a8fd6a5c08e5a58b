"""The relative error of every comparison with an experiment, in one definition."""

from __future__ import annotations

import math


def relative_error(reference: float | None, simulated: float | None) -> float | None:
    """(reference - simulated)/reference, the definition of Tables 2.3, 3.2 and A.1.

    0 against 0 is no error; anything else against 0, or against an empty cell, has none (None).
    """
    if reference is None or simulated is None or not math.isfinite(simulated):
        return None
    if reference == 0.0:
        return 0.0 if simulated == 0.0 else None
    return (reference - simulated) / reference
