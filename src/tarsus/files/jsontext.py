"""JSON as every verb writes it: plain values, and null for a number that is not finite, which JSON has no word for."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def plain(value: Any) -> Any:
    """`value` with numpy scalars, arrays, enums and non-finite numbers turned into what JSON has."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set):
        return [plain(item) for item in value]
    if isinstance(value, bool | int | str) or value is None:
        return value
    if isinstance(value, float):
        return value if value - value == 0.0 else None
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    return str(value)


def json_text(value: Any, indent: int = 2) -> str:
    """Text of a value made `plain`, letters as they are; no newline at its end."""
    return json.dumps(plain(value), indent=indent, ensure_ascii=False, allow_nan=False)
