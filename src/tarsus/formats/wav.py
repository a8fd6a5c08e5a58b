"""Sound files (.wav), as audio interfaces record: channels by number, in shares of full scale."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np

from tarsus.base.errors import InputError
from tarsus.formats.format import Format
from tarsus.formats.raw import Declared, RawFile, RawSeries, parsing


def is_wav(head: bytes) -> bool:
    """Whether a file begins like RIFF/WAVE, of either byte order and of more than 4 GiB too."""
    return head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE"


def read_wav(path: Path, content: bytes) -> RawFile:
    """Channels named ``1``, ``2``, ... without a unit: 1 is the largest number that the file's integers can be.

    The unit, and what full scale is of it, are chosen when it is read (``channels``: ``unit``, ``factor``).

    Raises
    ------
    InputError
        If the file is damaged, truncated, or its samples are compressed.
    """
    from scipy.io import wavfile

    with parsing(path.name, "a sound file"), warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        rate, samples = wavfile.read(io.BytesIO(content))
    if any("EOF" in str(one.message) for one in warned):
        raise InputError(f"{path.name} is damaged or truncated: it ends before its header says")
    values = np.atleast_2d(samples.T).astype(float)
    scale, level = 1.0, 0.0
    if samples.dtype.kind in "iu":
        scale = float(1 << (8 * samples.dtype.itemsize - 1))  # 24 bits come in the upper ones of 32
        level = scale if samples.dtype.kind == "u" else 0.0  # 8 bits are counted from the lowest
    step = Declared("the sampling rate of its header", 1.0 / rate)
    series = (
        RawSeries(str(number), (one - level) / scale, resolution=1.0 / scale if scale > 1.0 else 0.0)
        for number, one in enumerate(values, 1)
    )
    return RawFile(path.name, tuple(series), step)


FORMATS = (Format("WAV", is_wav, read_wav, (".wav",)),)
