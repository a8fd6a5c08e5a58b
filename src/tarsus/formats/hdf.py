"""HDF5 and NetCDF files, old (classic) and new (HDF5)."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.formats.format import Format
from tarsus.formats.raw import RawFile, check_values, parsing
from tarsus.formats.tables import Array, file_of

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_COMPLEX = (["real", "imag"], ["r", "i"], ["re", "im"])
"""Names of the two parts of a complex number, as libraries store it."""


def is_hdf(head: bytes) -> bool:
    """Whether a file begins like HDF5; a block of the user may come first, as in MATLAB files."""
    return any(head[offset : offset + 8] == _SIGNATURE for offset in (0, 512))


def _is_plain_hdf(head: bytes) -> bool:
    """As `is_hdf`, without the words that MATLAB writes into the block of the user."""
    return is_hdf(head) and not head.startswith(b"MATLAB")


def is_netcdf_classic(head: bytes) -> bool:
    """Whether a file begins like a classic NetCDF file."""
    return head[:3] == b"CDF" and head[3:4] in (b"\x01", b"\x02", b"\x05")


def read_hdf(path: Path, _: bytes) -> RawFile:
    """Numeric data sets of an HDF5 file, NetCDF 4 included; names are paths without the first slash, of a column of a
    table of records (compound) with its name behind.

    Attributes ``units``, ``point``, ``noise`` and ``full_scale`` of a data set are those of the channel, the last two
    in its unit; what packs its numbers is applied (`tarsus.formats.packing`). A table whose first dimension has names
    in the file is one series for each of them. A sampling rate may be an attribute of the data set, a group or the
    file.

    Raises
    ------
    InputError
        If the file is damaged or truncated.
    """
    import h5py

    arrays: list[Array] = []
    notes: list[str] = []
    groups: dict[str, dict[str, Any]] = {}

    def visit(stored: str | bytes, item: Any) -> None:
        name = _word(stored)
        try:
            if isinstance(item, h5py.Group):
                groups[name] = _attributes(item)
            elif item.shape is not None and not _bare_dimension(item):
                arrays.extend(_arrays(name, item))
        except (OSError, TypeError, ValueError) as error:  # one that h5py cannot read: its filter, or its type
            notes.append(f"{path.name}: not used: '{name}', which cannot be read ({error})")

    with parsing(path.name, "HDF5"), h5py.File(path, "r") as file:
        check_values(path.name, values_in(file))
        groups[""] = _attributes(file)
        file.visititems(visit)
    return file_of(path.name, arrays, notes, groups)


def _word(name: str | bytes) -> str:
    """A name, which h5py leaves in bytes where it is not UTF-8."""
    return name.decode("latin-1") if isinstance(name, bytes) else name


def _attributes(item: Any) -> dict[str, Any]:
    """Attributes of a group or data set, of those that h5py can read."""
    out = {}
    for name in item.attrs:
        with contextlib.suppress(OSError, TypeError, ValueError):
            out[_word(name)] = item.attrs[name]
    return out


def _arrays(name: str, item: Any) -> list[Array]:
    """A data set, or the columns of one of records."""
    values, attributes = np.asarray(item[()]), _attributes(item)
    parts = values.dtype.names
    if parts is None:
        table, rows = _along_samples(values, _scales(item))
        return [Array(name, table, attributes, rows)]
    if [part.lower() for part in parts] in _COMPLEX:
        table, rows = _along_samples(values[parts[0]] + 1j * values[parts[1]], _scales(item))
        return [Array(name, table, attributes, rows)]
    units = _names(next((attributes.pop(one) for one in ("units", "unit") if one in attributes), None))
    own = units if len(units) == len(parts) else ("",) * len(parts)
    return [
        Array(f"{name}/{part}", values[part], {**attributes, "units": unit})
        for part, unit in zip(parts, own, strict=True)
    ]


def values_in(file: Any) -> int:
    """Number of values that the data sets of an open HDF5 file unpack to."""
    sizes: list[int] = []
    file.visititems(lambda name, item: sizes.append(int(getattr(item, "size", 0) or 0)))
    return sum(sizes)


def _bare_dimension(item: Any) -> bool:
    """Whether a data set only stands for a dimension of NetCDF without values."""
    name = item.attrs.get("NAME", b"")
    return isinstance(name, bytes) and name.startswith(b"This is a netCDF dimension but not a netCDF variable")


def _scales(item: Any) -> list[Any]:
    """The scale of each dimension of a table, or None; none of other data sets."""
    return [dim[0][()] if len(dim) else None for dim in item.dims] if len(item.shape) == 2 else []


def _along_samples(values: np.ndarray, scales: list[Any]) -> tuple[np.ndarray, tuple[str, ...]]:
    """A table with its samples along the last dimension, and names of its rows where a scale holds text."""
    if values.ndim != 2 or len(scales) != 2:
        return values, ()
    for which, scale in enumerate(scales):
        names = _names(scale)
        if len(names) == values.shape[which]:
            return (values if which == 0 else values.T), names
    return values, ()


def _names(scale: Any) -> tuple[str, ...]:
    """Texts of a scale, which NetCDF may hold as a table of characters."""
    array = np.asarray(scale) if scale is not None else np.array(0.0)
    if array.dtype.kind == "S" and array.ndim == 2:
        return tuple(b"".join(row).decode("utf-8", errors="replace").strip("\0 ") for row in array)
    if array.dtype.kind in "SO" and array.ndim == 1:
        return tuple(one.decode("utf-8", errors="replace") if isinstance(one, bytes) else str(one) for one in array)
    return ()


def read_netcdf_classic(path: Path, content: bytes) -> RawFile:
    """Numeric variables of a classic NetCDF file; as `read_hdf`.

    Raises
    ------
    InputError
        If the file is damaged or truncated, or of the variant with 64-bit numbers (CDF-5), which scipy does not read.
    """
    from scipy.io import netcdf_file

    if content[3:4] == b"\x05":
        raise InputError(
            f"{path.name} is NetCDF of the variant CDF-5; convert it with: nccopy -k netCDF-4 {path.name} new.nc"
        )
    with parsing(path.name, "NetCDF"), netcdf_file(str(path), "r", mmap=False) as file:
        arrays = []
        for name, variable in file.variables.items():
            scales = [file.variables[dim].data if dim in file.variables else None for dim in variable.dimensions]
            values, rows = _along_samples(np.array(variable.data), scales)
            arrays.append(Array(name, values, dict(variable._attributes), rows))
        groups = {"": dict(file._attributes)}
    return file_of(path.name, arrays, groups=groups)


FORMATS = (
    Format("HDF5", _is_plain_hdf, read_hdf, (".h5", ".hdf5")),
    Format("NetCDF", is_netcdf_classic, read_netcdf_classic, (".nc",)),
)
