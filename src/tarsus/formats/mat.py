"""MATLAB files: version 5 and older by scipy, one variable at a time, version 7.3 (HDF5) by h5py."""

from __future__ import annotations

import io
import math
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from tarsus.base.errors import InputError
from tarsus.formats.hdf import is_hdf, values_in
from tarsus.formats.raw import MOST_VALUES, RawFile, check_values, parsing
from tarsus.formats.tables import Array, file_of

_HEADER = 128
"""Bytes, by the format (MAT-File Level 5), as the next ones."""
_TAG = 8
"""Bytes of the tag of an element."""
_COMPRESSED = 15  # miCOMPRESSED
"""Kind of a compressed element."""
_OPAQUE = 17  # mxOPAQUE_CLASS
"""Class of objects of MATLAB's own classes, such as strings, dates and tables."""
_SUBSYSTEM = slice(116, 124)
"""Where the header says where the data of objects lie."""
_BEGINNING = 512
"""Bytes of a variable that hold its class and its name."""
_DEEPEST = 32
"""Cells and structures within each other up to which they are followed."""
_WAYS = {
    "string": "save it as a character array",
    "datetime": "save its times as seconds: seconds(t - t(1))",
    "duration": "save it as seconds: seconds(t)",
    "table": "save its columns as vectors: v = T.v",
    "timetable": "save its times and columns as vectors: t = seconds(T.Time - T.Time(1)), v = T.v",
    "timeseries": "save its times and data as vectors: t = ts.Time, v = ts.Data",
}
"""How objects become arrays, by their classes."""


@dataclass(frozen=True)
class _Left:
    """A variable that is not read, and why, as what follows its name."""

    why: str


def _object(kind: str) -> _Left:
    """An object of a class."""
    way = f"; {_WAYS[kind]}" if kind in _WAYS else ""
    return _Left(f"an object of MATLAB's class {kind or 'unknown'}{way}")


def is_mat(head: bytes) -> bool:
    """Whether a file begins like a MATLAB file of version 5 or 7.3."""
    if head.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")):
        return True
    return head[124:128] in (b"\x00\x01IM", b"\x01\x00MI")


def read_mat(path: Path, data: bytes) -> RawFile:
    """Vectors and tables of a MATLAB file; fields of structures have their names behind a dot, cells and elements of
    arrays of structures their number, by columns, behind a slash.

    Units are those in a structure ``units`` that has a field of the variable's name. Objects, and single variables that
    cannot be read, are left out with a note.

    Raises
    ------
    InputError
        If the file is damaged or truncated, or none of MATLAB's.
    """
    head = data[:1024]
    with parsing(path.name, "a MATLAB file"):
        if is_hdf(head):
            content = _read_7_3(path)
        elif is_mat(head):
            content = _read_5(path.name, data)
        else:
            content = _read_4(path, data)
    return variables_of(path.name, content)


def variables_of(source: str, content: dict[str, Any]) -> RawFile:
    """Series of variables: arrays, structures as tables of fields, cells as lists. Units are those in a structure
    ``units`` that has a field of the variable's name."""
    if "yspec" in content and {"freq", "npts"} <= content.keys():
        content = _with_lines(content)
    units = content.pop("units", {})
    arrays: list[Array] = []
    notes: list[str] = []
    for name, value in _flat(content, "", _DEEPEST):
        if isinstance(value, _Left):
            notes.append(f"{source}: not used: '{name}', {value.why}")
            continue
        unit = units.get(name) if isinstance(units, Mapping) else None
        arrays.append(Array(name, value, {} if unit is None else {"units": unit}))
    return file_of(source, arrays, notes)


def _with_lines(content: Mapping[str, Any]) -> dict[str, Any]:
    """A file of the logger of Cambridge University with its frequencies, which it gives as the sampling rate ``freq``
    and the length ``npts`` of the transform."""
    rate, count = (np.asarray(content[name], dtype=float).ravel() for name in ("freq", "npts"))
    rows = max(np.shape(content["yspec"]), default=0)
    if len(rate) != 1 or len(count) != 1 or not count[0] > 0.0 or "frequency" in content:
        return dict(content)
    rest = {name: value for name, value in content.items() if name not in ("freq", "npts")}
    return {**rest, "frequency": rate[0] / count[0] * np.arange(rows)}


def _flat(content: Mapping[str, Any], before: str, deepest: int) -> Iterator[tuple[str, np.ndarray | _Left]]:
    """Arrays and what is left out, by their whole names."""
    from scipy.io.matlab import MatlabFunction, MatlabObject, MatlabOpaque
    from scipy.sparse import issparse

    for name, value in content.items():
        whole = f"{before}{name}"
        if deepest == 0:
            yield whole, _Left("too deep within structures and cells")
        elif isinstance(value, Mapping):
            yield from _flat(value, f"{whole}.", deepest - 1)
        elif isinstance(value, MatlabOpaque):
            yield whole, _object(_class_of(value))
        elif isinstance(value, MatlabFunction):
            yield whole, _object("function_handle")
        elif isinstance(value, MatlabObject):
            yield whole, _object(str(value.classname))
        elif issparse(value):
            large = math.prod(value.shape) > MOST_VALUES
            yield whole, _Left("a sparse matrix that is too large as a whole one") if large else value.toarray()
        elif isinstance(value, list):
            yield from _flat(_numbered(value), f"{whole}/", deepest - 1)
        elif isinstance(value, np.ndarray) and value.dtype == object:
            yield from _flat(_numbered(value.ravel(order="F").tolist()), f"{whole}/", deepest - 1)
        elif isinstance(value, _Left):
            yield whole, value
        else:
            yield whole, np.asarray(value)


def _numbered(values: Sequence[Any]) -> dict[str, Any]:
    return {str(number): one for number, one in enumerate(values, start=1)}


def _class_of(value: Any) -> str:
    """Class of an object as scipy has it: a record of name, system, class and data."""
    try:
        return str(value.ravel()[0]["s2"].decode("ascii", errors="replace"))
    except (AttributeError, IndexError, KeyError, TypeError, ValueError):
        return ""


class _Variable(NamedTuple):
    """A variable of a version 5 file: place and size of its element, whether it is compressed, and by its beginning its
    name, its class, and of an object the class of that."""

    place: int
    size: int
    compressed: bool
    name: str
    kind: int
    of: str


def _read_5(source: str, data: bytes) -> dict[str, Any]:
    """The variables of a version 5 file. scipy, which may crash on a file that is cut, gets them one by one."""
    from scipy.io import loadmat

    elements = list(_elements(data))
    if any(place + size > len(data) for place, _, size in elements):
        raise InputError(f"{source} is truncated: its last variable does not end")
    check_values(source, _unpacked(data, elements) // 8)
    header = bytearray(data[:_HEADER])
    header[_SUBSYSTEM] = bytes(8)
    out: dict[str, Any] = {}
    for variable in (_variable(data, *element) for element in elements):
        if not variable.name:
            continue  # what the objects of the file share
        if variable.kind == _OPAQUE:
            out[variable.name] = _object(variable.of)
            continue
        element = data[variable.place - _TAG : variable.place + variable.size]
        try:
            found = loadmat(io.BytesIO(bytes(header) + element), simplify_cells=True)
        except (zlib.error, EOFError):
            raise
        except Exception as error:  # whatever scipy runs into costs this variable and no other
            out[variable.name] = _Left(f"which cannot be read ({error or type(error).__name__})")
            continue
        out |= {name: value for name, value in found.items() if not name.startswith("__")}
    return out


def _elements(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Place, kind and size in bytes of each variable of a version 5 file, as it is stored there."""
    place = _HEADER
    while place + _TAG <= len(data):
        kind, size = _tag(data, data[place : place + _TAG])
        yield place + _TAG, kind, size
        place += _TAG + size


def _order(data: bytes) -> Literal["little", "big"]:
    return "little" if data[126:128] == b"IM" else "big"


def _tag(data: bytes, tag: bytes) -> tuple[int, int]:
    """Kind and size that a tag announces, in the file's order of bytes."""
    order = _order(data)
    return int.from_bytes(tag[:4], order), int.from_bytes(tag[4:], order)


def _unpacked(data: bytes, elements: Sequence[tuple[int, int, int]]) -> int:
    """Bytes that the variables of a version 5 file unpack to, as they announce themselves."""
    total = 0
    for place, kind, size in elements:
        if kind == _COMPRESSED:  # it begins with the tag of what it unpacks to
            size = _tag(data, zlib.decompressobj().decompress(data[place : place + size], _TAG))[1]
        total += size
    return total


def _variable(data: bytes, place: int, kind: int, size: int) -> _Variable:
    """A variable by the beginning of its element: flags, dimensions unless it is an object, and names."""
    begins = data[place : place + min(size, _BEGINNING)]
    if kind == _COMPRESSED:
        begins = zlib.decompressobj().decompress(data[place : place + size], _BEGINNING)[_TAG:]
    flags, at = _part(data, begins, 0)
    of = int.from_bytes(flags[:4], _order(data)) & 0xFF
    words = []
    for _ in range(3 if of == _OPAQUE else 2):
        word, at = _part(data, begins, at)
        words.append(word.decode("latin-1").rstrip("\0"))
    if of == _OPAQUE:
        return _Variable(place, size, kind == _COMPRESSED, words[0], of, words[2])
    return _Variable(place, size, kind == _COMPRESSED, words[1], of, "")


def _part(data: bytes, begins: bytes, at: int) -> tuple[bytes, int]:
    """Content of an element within a variable, and where the next one begins; four bytes fit into the tag itself."""
    kind, size = _tag(data, begins[at : at + _TAG])
    if kind >> 16:
        return begins[at + 4 : at + 4 + (kind >> 16)], at + _TAG
    first = at + _TAG
    return begins[first : first + size], first + size + (-size % 8)


def _read_4(path: Path, data: bytes) -> dict[str, Any]:
    """The variables of a version 4 file, which has no signature: its first number is a code below 5000."""
    from scipy.io import loadmat, whosmat

    codes = [int.from_bytes(data[:4], order) for order in ("little", "big")]
    if len(data) < 20 or min(codes) >= 5000:
        raise InputError(f"{path.name} is no MATLAB file, whatever its name says")
    check_values(path.name, sum(math.prod(shape) for _, shape, _ in whosmat(path)))
    content = loadmat(path, simplify_cells=True)
    return {name: value for name, value in content.items() if not name.startswith("__")}


def _read_7_3(path: Path) -> dict[str, Any]:
    import h5py

    with h5py.File(path, "r") as file:
        check_values(path.name, values_in(file))
        return {name: _value(item, _DEEPEST) for name, item in file.items() if not name.startswith("#")}


def _value(item: Any, deepest: int) -> Any:
    """A variable of a 7.3 file as scipy has those of version 5: structures as tables by name, cells as lists."""
    import h5py

    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode() if isinstance(kind, bytes) else str(kind)
    if deepest == 0:
        return _Left("too deep within structures and cells")
    if "MATLAB_object_decode" in item.attrs or kind == "function_handle":
        return _object(kind)
    try:
        if isinstance(item, h5py.Group):
            return _sparse(item) if "MATLAB_sparse" in item.attrs else _structure(item, deepest)
        if "MATLAB_empty" in item.attrs:
            return np.zeros(0)
        values = item[()]
    except (OSError, KeyError, TypeError, ValueError) as error:
        return _Left(f"which cannot be read ({error or type(error).__name__})")
    if h5py.check_ref_dtype(item.dtype) is not None:
        return [_value(item.file[one], deepest - 1) for one in np.ravel(values)]
    if kind == "char":
        return "".join(chr(code) for code in np.ravel(values)) if item.dtype.kind in "ui" else ""
    if item.dtype.names == ("real", "imag"):
        return (values["real"] + 1j * values["imag"]).T
    return np.asarray(values).T


def _structure(group: Any, deepest: int) -> dict[str, Any] | list[dict[str, Any]]:
    """A structure, or an array of them, whose fields are references to those of its elements."""
    import h5py

    fields = {name: item for name, item in group.items() if not name.startswith("#")}
    several = fields and all(
        isinstance(item, h5py.Dataset)
        and h5py.check_ref_dtype(item.dtype) is not None
        and "MATLAB_class" not in item.attrs
        for item in fields.values()
    )
    read = {name: _value(item, deepest - 1) for name, item in fields.items()}
    if not several:
        return read
    return [dict(zip(read, one, strict=True)) for one in zip(*read.values(), strict=True)]


def _sparse(group: Any) -> np.ndarray | _Left:
    """A sparse matrix as a whole one: values, rows, and where each column begins."""
    rows, starts = int(group.attrs["MATLAB_sparse"]), np.asarray(group["jc"], dtype=np.int64)
    columns = len(starts) - 1
    if rows * columns > MOST_VALUES:
        return _Left("a sparse matrix that is too large as a whole one")
    values: Any = group["data"][()] if "data" in group else np.zeros(0)
    if values.dtype.names == ("real", "imag"):
        values = values["real"] + 1j * values["imag"]
    out = np.zeros((rows, columns), dtype=values.dtype)
    if len(values):
        out[np.asarray(group["ir"], dtype=np.int64), np.repeat(np.arange(columns), np.diff(starts))] = values
    return out
