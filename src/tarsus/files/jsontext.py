"""JSON as every verb writes and reads it: plain values; null for a number that is not finite, which JSON lacks."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError


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


def read_json(file: Path) -> dict[str, Any]:
    """The object in a JSON file; `InputError` where it cannot be read or holds none."""
    try:
        read = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot read {file}: {(error.strerror or str(error)).lower()}") from None
    except RecursionError:
        raise InputError(f"{file} is damaged: it is nested too deep") from None
    except ValueError as error:
        raise InputError(f"{file} is damaged: it is no JSON ({error})") from None
    if not isinstance(read, dict):
        raise InputError(f"{file} is damaged: it holds no JSON object")
    return read
