"""The waveforms that come with the library: those of the files next to this one. A new file is a new waveform."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from tarsus.base.discover import classes_in_folder, kind_of_class
from tarsus.model.drive.signal import Signal


@lru_cache(maxsize=1)
def built_in() -> Mapping[str, type[Signal]]:
    """Waveforms by kind, in the order of their files: every signal with a field ``kind``."""
    return classes_in_folder(__package__ or "", Signal, kind_of_class)
