"""The waveforms that come with the library: those of the files beside this one. A new file is a new waveform."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from functools import lru_cache

from tarsus.base.discover import classes_beside
from tarsus.model.drive.signal import Signal


@lru_cache(maxsize=1)
def built_in() -> Mapping[str, type[Signal]]:
    """Waveforms by kind, in the order of their files: every signal with a field ``kind``."""
    return classes_beside(__package__ or "", Signal, _kind)


def _kind(wave: type[Signal]) -> str | None:
    field = wave.model_fields.get("kind")
    return None if field is None or inspect.isabstract(wave) else field.default
