"""MATLAB files: version 4 by scipy, version 5 by its elements (`mat5`), version 7.3 (HDF5) by h5py."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.formats.format import Format
from tarsus.formats.hdf import is_hdf, values_in
from tarsus.formats.mat5 import variables
from tarsus.formats.mat_parts import DEEPEST, TOO_DEEP, Left, an_object, whole
from tarsus.formats.raw import MOST_VALUES, RawFile, check_values, parsing
from tarsus.formats.tables import Array, file_of


def is_mat(head: bytes) -> bool:
    """Whether a file begins like a MATLAB file of version 5 or 7.3."""
    if head.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")):
        return True
    return head[124:128] in (b"\x00\x01IM", b"\x01\x00MI")


def _may_be_mat(head: bytes) -> bool:
    """As `is_mat`, or HDF5: other programs write version 7.3 without MATLAB's words."""
    return is_mat(head) or is_hdf(head)


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
            content = variables(path.name, data)
        else:
            content = _read_4(path, data)
    return variables_of(path.name, content)


def variables_of(source: str, content: dict[str, Any]) -> RawFile:
    """Series of variables: arrays, structures as tables of fields, cells as lists. Units are those in a structure
    ``units`` that has a field of the variable's name."""
    if "yspec" in content and {"freq", "npts"} <= content.keys():
        content = _with_lines(content)
    stated = content.pop("units", {})
    units = dict(_texts(stated, "")) if isinstance(stated, Mapping) else {}
    arrays: list[Array] = []
    notes: list[str] = []
    for name, value in _flat(content, "", DEEPEST):
        if isinstance(value, Left):
            notes.append(f"{source}: not used: '{name}', {value.why}")
            continue
        arrays.append(Array(name, value, {"units": units[name]} if name in units else {}))
    return file_of(source, arrays, notes)


def _texts(stated: Mapping[str, Any], before: str) -> Iterator[tuple[str, str]]:
    """Texts of structures within each other, by their whole names."""
    for name, value in stated.items():
        if isinstance(value, Mapping):
            yield from _texts(value, f"{before}{name}.")
        elif isinstance(value, str):
            yield f"{before}{name}", value


def _with_lines(content: Mapping[str, Any]) -> dict[str, Any]:
    """A file of the logger of Cambridge University with its frequencies, which it gives as the sampling rate ``freq``
    and the length ``npts`` of the transform."""
    rate, count = (np.asarray(content[name], dtype=float).ravel() for name in ("freq", "npts"))
    rows = max(np.shape(content["yspec"]), default=0)
    if len(rate) != 1 or len(count) != 1 or not count[0] > 0.0 or "frequency" in content:
        return dict(content)
    rest = {name: value for name, value in content.items() if name not in ("freq", "npts")}
    return {**rest, "frequency": rate[0] / count[0] * np.arange(rows)}


def _flat(content: Mapping[str, Any], before: str, deepest: int) -> Iterator[tuple[str, np.ndarray | Left]]:
    """Arrays and what is left out, by their whole names."""
    from scipy.sparse import issparse

    for name, value in content.items():
        whole_name = f"{before}{name}"
        if deepest == 0:
            yield whole_name, TOO_DEEP
        elif isinstance(value, Mapping):
            yield from _flat(value, f"{whole_name}.", deepest - 1)
        elif issparse(value):  # of version 4
            large = math.prod(value.shape) > MOST_VALUES
            yield whole_name, Left("a sparse matrix that is too large as a whole one") if large else value.toarray()
        elif isinstance(value, list):
            yield from _flat(_numbered(value), f"{whole_name}/", deepest - 1)
        elif isinstance(value, np.ndarray) and value.dtype == object:
            yield from _flat(_numbered(value.ravel(order="F").tolist()), f"{whole_name}/", deepest - 1)
        elif isinstance(value, Left):
            yield whole_name, value
        else:
            yield whole_name, np.asarray(value)


def _numbered(values: Sequence[Any]) -> dict[str, Any]:
    return {str(number): one for number, one in enumerate(values, start=1)}


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
        return {name: _value(item, DEEPEST) for name, item in file.items() if not name.startswith("#")}


def _value(item: Any, deepest: int) -> Any:
    """A variable of a 7.3 file as scipy has those of version 5: structures as tables by name, cells as lists."""
    import h5py

    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode() if isinstance(kind, bytes) else str(kind)
    if deepest == 0:
        return TOO_DEEP
    if "MATLAB_object_decode" in item.attrs or kind == "function_handle":
        return an_object(kind)
    try:
        if isinstance(item, h5py.Group):
            return _sparse(item) if "MATLAB_sparse" in item.attrs else _structure(item, deepest)
        if "MATLAB_empty" in item.attrs:
            return np.zeros(0)
        values = item[()]
    except (OSError, KeyError, TypeError, ValueError) as error:
        return Left(f"which cannot be read ({error or type(error).__name__})")
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


def _sparse(group: Any) -> np.ndarray | Left:
    """A sparse matrix as a whole one."""
    values: Any = group["data"][()] if "data" in group else np.zeros(0)
    if values.dtype.names == ("real", "imag"):
        values = values["real"] + 1j * values["imag"]
    rows = np.asarray(group["ir"] if "ir" in group else np.zeros(0), dtype=np.int64)
    starts = np.asarray(group["jc"], dtype=np.int64)
    return whole(values, rows, starts, int(group.attrs["MATLAB_sparse"]))


FORMATS = (Format("MATLAB", _may_be_mat, read_mat, (".mat",), unsigned=True),)
