"""Archives of numpy (.npz): arrays by name, without units."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np

from tarsus.formats.format import Format
from tarsus.formats.raw import RawFile, check_values, parsing
from tarsus.formats.tables import Array, file_of


def is_npz(head: bytes) -> bool:
    """Whether a file is a zip archive whose first member is an array."""
    return head.startswith(b"PK\3\4") and b".npy" in head[:512]


def read_npz(path: Path, content: bytes) -> RawFile:
    """Arrays of an archive by their names.

    Raises
    ------
    InputError
        If the archive is damaged, or unpacks to more than is read.
    """
    with parsing(path.name, "an archive of numpy"):
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            check_values(path.name, sum(one.file_size for one in archive.infolist()) // 8)
        with np.load(io.BytesIO(content), allow_pickle=False) as stored:
            arrays = [Array(name, stored[name]) for name in stored.files]
    return file_of(path.name, arrays)


FORMATS = (Format("npz", is_npz, read_npz),)
