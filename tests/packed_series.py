"""Series of pages read back as their scripts read them."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np


def unpacked(channel: dict[str, Any], rows: int, *, gaps: bool = False) -> np.ndarray:
    """What `packed` made, (rows, nt), as scripts read it."""
    kind = "<u2" if channel["bits"] == 16 else "u1"
    whole = np.frombuffer(base64.b64decode(channel["data"]), dtype=kind)
    values = (channel["low"] + whole.astype(float)) * channel["step"]
    if gaps:
        values[whole == 2 ** channel["bits"] - 1] = np.nan
    return values.reshape(rows, -1)
