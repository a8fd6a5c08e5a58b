"""HDF5 and NetCDF files, old (classic) and new (HDF5)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tarsus.formats.raw import RawFile, check_values, parsing
from tarsus.formats.tables import Array, file_of

_SIGNATURE = b"\x89HDF\r\n\x1a\n"


def is_hdf(head: bytes) -> bool:
    """Whether a file begins like HDF5; a block of the user may come first, as in MATLAB files."""
    return any(head[offset : offset + 8] == _SIGNATURE for offset in (0, 512))


def is_netcdf_classic(head: bytes) -> bool:
    """Whether a file begins like a classic NetCDF file."""
    return head[:3] == b"CDF" and head[3:4] in (b"\x01", b"\x02")


def read_hdf(path: Path, _: bytes) -> RawFile:
    """Numeric data sets of an HDF5 file, NetCDF 4 included; names are paths without the first slash.

    Attributes ``units``, ``point``, ``noise`` and ``full_scale`` of a data set are those of the channel, the last two
    in its unit. A table whose first dimension has names in the file is one series for each of them.

    Raises
    ------
    InputError
        If the file is damaged or truncated.
    """
    import h5py

    arrays: list[Array] = []

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.shape is not None and not _bare_dimension(item):
            values = item[()]
            if item.dtype.names in (("real", "imag"), ("r", "i")):
                first, second = item.dtype.names
                values = values[first] + 1j * values[second]
            values, rows = _along_samples(np.asarray(values), _scales(item))
            arrays.append(Array(name, values, dict(item.attrs), rows))

    with parsing(path.name, "HDF5"), h5py.File(path, "r") as file:
        check_values(path.name, values_in(file))
        file.visititems(visit)
    return file_of(path.name, arrays)


def values_in(file: Any) -> int:
    """Number of values that the data sets of an open HDF5 file unpack to."""
    sizes: list[int] = []
    file.visititems(lambda name, item: sizes.append(int(getattr(item, "size", 0) or 0)))
    return sum(sizes)


def _bare_dimension(item: Any) -> bool:
    """Whether a data set only stands for a dimension of NetCDF without values."""
    name = item.attrs.get("NAME", b"")
    return isinstance(name, bytes) and name.startswith(
        b"This is a netCDF dimension but not a netCDF variable"
    )


def _scales(item: Any) -> list[Any]:
    """The scale of each dimension of a data set, or None."""
    return [dim[0][()] if len(dim) else None for dim in item.dims]


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
        return tuple(
            one.decode("utf-8", errors="replace") if isinstance(one, bytes) else str(one) for one in array
        )
    return ()


def read_netcdf_classic(path: Path, _: bytes) -> RawFile:
    """Numeric variables of a classic NetCDF file; as `read_hdf`.

    Raises
    ------
    InputError
        If the file is damaged or truncated.
    """
    from scipy.io import netcdf_file

    with parsing(path.name, "NetCDF"), netcdf_file(str(path), "r", mmap=False) as file:
        arrays = [
            Array(name, np.array(variable.data), dict(variable._attributes))
            for name, variable in file.variables.items()
        ]
    return file_of(path.name, arrays)
