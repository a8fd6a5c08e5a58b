"""Series as compact text for scripts of a page."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
from markupsafe import Markup


def packed(values: np.ndarray, bits: int, *, gaps: bool = False) -> dict[str, Any]:
    """Numbers (rows, nt) as base64 of little-endian integers q of 8 or 16 bits: value = (low + q) step.

    Zero is kept exactly where it is among the values or between them. What is not finite becomes zero; with `gaps`
    it becomes the largest q, which stands for no number.
    """
    known = np.isfinite(values)
    finite = np.where(known, values, 0.0)
    inside = finite[known] if gaps else finite
    least, most = float(inside.min(initial=0.0)), float(inside.max(initial=0.0))
    if inside.size and (inside.min() > 0.0 or inside.max() < 0.0):
        least, most = float(inside.min()), float(inside.max())
    largest = 2**bits - 1 - gaps
    step = (most - least) / (largest - 1) or abs(most) or 1.0
    low = int(np.floor(least / step))
    whole = np.clip(np.rint(finite / step) - low, 0, largest)
    if gaps:
        whole = np.where(known, whole, 2**bits - 1)
    whole = whole.astype("<u2" if bits == 16 else "u1")
    return {"bits": bits, "low": low, "step": step, "data": base64.b64encode(whole.tobytes()).decode()}


def packed_times(values: np.ndarray) -> dict[str, Any]:
    """Numbers (n,) as base64 of 32-bit floats: as fine at the end of a series as its zoom goes."""
    data = base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode()
    return {"bits": 32, "low": 0, "step": 1, "data": data}


def script_text(content: Any) -> Markup:
    """JSON that no HTML parser can mistake for markup."""
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return Markup(text.replace("<", "\\u003c"))
