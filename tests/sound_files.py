"""Sound files of every width of sample, written and read back by the module of the standard library."""

from __future__ import annotations

import wave
from collections.abc import Callable
from pathlib import Path

import numpy as np

from record_case import Case, Held

RATE = 48000
N = np.arange(64)
SHARES = np.stack([0.6 * np.cos(0.3 * N), -0.9 * np.sin(0.2 * N)], axis=1)


def _sound(width: int, channels: int = 2) -> Callable[[Path], Held]:
    """Shares of full scale in samples of so many bytes; those of one byte are counted from the lowest."""
    full = 1 << (8 * width - 1)
    level = full if width == 1 else 0

    def write(path: Path) -> Held:
        counts = np.round(SHARES[:, :channels] * (full - 1)).astype(int) + level
        with wave.open(str(path), "wb") as file:
            file.setnchannels(channels)
            file.setsampwidth(width)
            file.setframerate(RATE)
            signed = width > 1
            file.writeframes(b"".join(int(one).to_bytes(width, "little", signed=signed) for one in counts.ravel()))
        with wave.open(str(path), "rb") as file:
            read, step = file.readframes(file.getnframes()), 1.0 / file.getframerate()
        cells = [int.from_bytes(read[k : k + width], "little", signed=signed) for k in range(0, len(read), width)]
        shares = (np.array(cells, dtype=float).reshape(-1, channels) - level) / full
        return Held({str(k): ("m/s", 0.05 * shares[:, k - 1]) for k in range(1, channels + 1)}, step)

    return write


def _of(channels: int) -> dict[str, dict[str, dict[str, object]]]:
    """That full scale is 50 mm/s."""
    return {"channels": {str(k): {"unit": "mm/s", "factor": 50.0} for k in range(1, channels + 1)}}


CASES = [
    *(Case(f"{8 * width} bits.wav", _sound(width), _of(2)) for width in (1, 2, 3, 4)),
    Case("one channel.wav", _sound(2, 1), _of(1)),
]
