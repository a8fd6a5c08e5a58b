"""How predictions are printed."""

from __future__ import annotations

from collections.abc import Mapping

__all__ = ["interval", "share"]


def interval(found: Mapping[str, float | None], digits: int) -> str:
    """A prediction for reading: 12.3 (10.1 to 14.5)."""
    if found["median"] is None:
        return "-"
    return f"{found['median']:.{digits}f} ({found['low']:.{digits}f} to {found['high']:.{digits}f})"


def share(part: float | None) -> str:
    """A share in percent."""
    return "-" if part is None else f"{100.0 * part:.0f} %"
