"""MATLAB files: version 5 and older by scipy, version 7.3 (HDF5) by h5py."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tarsus.base.errors import InputError
from tarsus.formats.hdf import is_hdf, values_in
from tarsus.formats.raw import RawFile, check_values, parsing
from tarsus.formats.tables import Array, file_of

_HEADER = 128
"""Bytes, by the format (MAT-File Level 5), as the next two."""
_TAG = 8
"""Bytes of the tag of an element."""
_COMPRESSED = 15  # miCOMPRESSED
"""Kind of a compressed element."""


def is_mat(head: bytes) -> bool:
    """Whether a file begins like a MATLAB file of version 5 or 7.3."""
    return head.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"))


def read_mat(path: Path, data: bytes) -> RawFile:
    """Vectors and tables of a MATLAB file; fields of structures have their names behind a dot.

    Raises
    ------
    InputError
        If the file is damaged or truncated.
    """
    head = data[:1024]
    if is_mat(head) and not is_hdf(head) and _is_cut(data):
        raise InputError(f"{path.name} is truncated: its last variable does not end")
    with parsing(path.name, "a MATLAB file"):
        content = _read_7_3(path) if is_hdf(head) else _read_5(path, data)
    return variables_of(path.name, content)


def variables_of(source: str, content: dict[str, Any]) -> RawFile:
    """Series of variables: arrays, structures as tables of fields, cells as lists. Units are those in a structure
    ``units`` that has a field of the variable's name."""
    if "yspec" in content and {"freq", "npts"} <= content.keys():
        content = _with_lines(content)
    units = content.pop("units", {})
    arrays = [
        Array(name, values, {"units": units[name]} if isinstance(units, Mapping) and name in units else {})
        for name, values in _flat(content, "")
    ]
    return file_of(source, arrays)


def _with_lines(content: Mapping[str, Any]) -> dict[str, Any]:
    """A file of the logger of Cambridge University with its frequencies, which it gives as the sampling rate ``freq``
    and the length ``npts`` of the transform."""
    rate, count = (np.asarray(content[name], dtype=float).ravel() for name in ("freq", "npts"))
    rows = max(np.shape(content["yspec"]), default=0)
    if len(rate) != 1 or len(count) != 1 or not count[0] > 0.0 or "frequency" in content:
        return dict(content)
    rest = {name: value for name, value in content.items() if name not in ("freq", "npts")}
    return {**rest, "frequency": rate[0] / count[0] * np.arange(rows)}


def _is_cut(data: bytes) -> bool:
    """Whether the variables of a version 5 file announce more bytes than there are; scipy may crash on such a file."""
    return any(place + size > len(data) for place, _, size in _variables(data))


def _variables(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Place, kind and size in bytes of each variable of a version 5 file, as it is stored there."""
    place = _HEADER
    while place + _TAG <= len(data):
        kind, size = _tag(data, data[place : place + _TAG])
        yield place + _TAG, kind, size
        place += _TAG + size


def _tag(data: bytes, tag: bytes) -> tuple[int, int]:
    """Kind and size that a tag announces, in the file's order of bytes."""
    order: Literal["little", "big"] = "little" if data[126:128] == b"IM" else "big"
    return int.from_bytes(tag[:4], order), int.from_bytes(tag[4:], order)


def _flat(content: Mapping[str, Any], before: str) -> Iterator[tuple[str, np.ndarray]]:
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{name}.")
        elif isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):  # cells
            cells = {str(i): one for i, one in enumerate(np.ravel(np.asarray(value, dtype=object)), start=1)}
            yield from _flat(cells, f"{before}{name}/")
        elif isinstance(value, (np.ndarray, np.generic, str, float, int, complex)):
            yield f"{before}{name}", np.asarray(value)


def _unpacked(data: bytes) -> int:
    """Bytes that the variables of a version 5 file unpack to, as they announce themselves."""
    total = 0
    for place, kind, size in _variables(data):
        if kind == _COMPRESSED:  # it begins with the tag of what it unpacks to
            size = _tag(data, zlib.decompressobj().decompress(data[place : place + size], _TAG))[1]
        total += size
    return total


def _read_5(path: Path, data: bytes) -> dict[str, Any]:
    from scipy.io import loadmat, whosmat

    if is_mat(data[:1024]):
        check_values(path.name, _unpacked(data) // 8)
    check_values(path.name, sum(math.prod(shape) for _, shape, _ in whosmat(path)))
    content = loadmat(path, simplify_cells=True)
    return {name: value for name, value in content.items() if not name.startswith("__")}


def _read_7_3(path: Path) -> dict[str, Any]:
    import h5py

    with h5py.File(path, "r") as file:
        check_values(path.name, values_in(file))
        return _group(file)


def _group(group: Any) -> dict[str, Any]:
    """Content of a group of a 7.3 file: arrays transposed, characters as text, references left out."""
    import h5py

    out: dict[str, Any] = {}
    for name, item in group.items():
        if name.startswith("#"):
            continue
        if isinstance(item, h5py.Group):
            out[name] = _group(item)
            continue
        kind = item.attrs.get("MATLAB_class", b"")
        values = item[()]
        if kind == b"char":
            out[name] = "".join(chr(code) for code in np.ravel(values)) if item.dtype.kind in "ui" else ""
        elif item.dtype.names == ("real", "imag"):
            out[name] = (values["real"] + 1j * values["imag"]).T
        elif item.dtype.kind in "fiuc" and "MATLAB_empty" not in item.attrs:
            out[name] = values.T
    return out
