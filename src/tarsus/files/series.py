"""Series as plain arrays with dimensions and units, and the files they are kept in: NetCDF and MATLAB.

NetCDF is written directly, so that keeping a run does not have to load xarray; xarray opens the file.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tarsus.base.errors import InputError
from tarsus.files.steady import SteadyFile

if TYPE_CHECKING:
    import xarray


class Variable(NamedTuple):
    """One series: names of its dimensions, values, and attributes such as ``units`` and ``long_name``."""

    dims: tuple[str, ...]
    values: np.ndarray
    attrs: Mapping[str, Any]


Variables = Mapping[str, Variable]
"""Series by name; one that bears the name of a dimension is its coordinate."""


def variables_of(dataset: xarray.Dataset) -> dict[str, Variable]:
    """The variables and coordinates of a dataset."""
    return {
        str(name): Variable(tuple(map(str, v.dims)), np.asarray(v.values), dict(v.attrs))
        for name, v in dataset.variables.items()
    }


def dataset_of(variables: Variables, attrs: Mapping[str, Any] | None = None) -> xarray.Dataset:
    """A dataset of the variables."""
    import xarray

    dims = {dim for variable in variables.values() for dim in variable.dims}
    data = {name: variable for name, variable in variables.items() if name not in dims}
    coords = {name: variable for name, variable in variables.items() if name in dims}
    return xarray.Dataset(data, coords=coords, attrs=dict(attrs or {}))


def outcome_variable(
    numbers: np.ndarray, meanings: Mapping[str, str], dims: tuple[str, ...], notes: Mapping[str, Any]
) -> Variable:
    """How runs ended: numbers of names, each with its sentence, as flags."""
    flags = {"flag_values": np.arange(len(meanings), dtype=np.int8), "flag_meanings": " ".join(meanings)}
    return Variable(dims, numbers, {"long_name": "how the run ended", **flags, **meanings, **notes})


def is_text(values: np.ndarray) -> bool:
    """Whether an array holds names."""
    return values.dtype.kind in "US" or values.dtype == object


def described(variables: Variables) -> dict[str, Variable]:
    """Plain types only: flags as int8 with meanings; every variable with units and long_name."""
    out = {}
    for name, (dims, values, given) in variables.items():
        if is_text(values):
            out[name] = Variable(dims, values, {"long_name": f"name of the {name}"} | dict(given))
            continue
        attrs = {"long_name": name.replace("_", " "), "units": "1"} | dict(given)
        if values.dtype == bool:
            values = values.astype(np.int8)
            attrs |= {"flag_values": np.array([0, 1], np.int8), "flag_meanings": "open contact"}
        out[name] = Variable(dims, values, attrs)
    return out


def write_netcdf(variables: Variables, attrs: Mapping[str, Any], path: Path, fill: Fill | None = None) -> None:
    """Write series as NetCDF 4 (HDF5); names are character arrays, which older readers know too.

    With `fill` the values of a variable may be `blank`: such a one is made with its shape and filled by
    ``fill(put)``, where ``put(name, first, values)`` writes values (k, ...) of its leading dimensions, taken in the
    order of a file as one, from number ``first`` on. So a file can be larger than the memory.

    Raises OSError where the disk takes no more.
    """
    import h5netcdf

    plain = described(variables)
    sizes = {dim: size for dims, values, _ in plain.values() for dim, size in zip(dims, values.shape, strict=True)}
    # the innermost block ends first: HDF5 has written all, or believes so, when the disk is asked
    with SteadyFile(path) as disk, h5netcdf.File(disk, "w") as file:
        file.dimensions = sizes
        file.attrs.update(attrs)
        for name in sorted(plain, key=lambda name: name not in sizes):
            dims, values, notes = plain[name]
            if is_text(values):
                dims, values = _characters(file, dims, values)
                notes = {**notes, "_Encoding": "utf-8"}
            data = {} if fill is not None and is_blank(values) else {"data": values}
            variable = file.create_variable(name, dims, values.dtype, chunking_heuristic="h5py", **data)
            variable.attrs.update(notes)
        if fill is not None:

            def put(name: str, first: int, values: np.ndarray) -> None:
                disk.check()
                _put(file[name], (), first, values)

            fill(put)


Put = Callable[[str, int, np.ndarray], None]
Fill = Callable[[Put], None]


def blank(shape: tuple[int, ...], dtype: Any = np.float64) -> np.ndarray:
    """What stands for values that are written later: an array without memory of its own."""
    return np.broadcast_to(np.zeros((), dtype), shape)


def is_blank(values: np.ndarray) -> bool:
    """Whether an array is a `blank`."""
    return values.size > 1 and not any(values.strides)


def _put(variable: Any, at: tuple[int, ...], first: int, values: np.ndarray) -> None:
    """Write values (k, ...) into a variable below the index `at`, from number `first` of its leading dimensions on."""
    shape = variable.shape[len(at) : variable.ndim - (values.ndim - 1)]
    if len(shape) == 1:
        variable[(*at, slice(first, first + len(values)))] = values
        return
    inner = int(np.prod(shape[1:]))
    row, begin = divmod(first, inner)
    if begin:
        most = min(inner - begin, len(values))
        _put(variable, (*at, row), begin, values[:most])
        row, values = row + 1, values[most:]
    whole = len(values) // inner
    if whole:
        block = values[: whole * inner].reshape(whole, *shape[1:], *values.shape[1:])
        variable[(*at, slice(row, row + whole))] = block
    if len(values) > whole * inner:
        _put(variable, (*at, row + whole), 0, values[whole * inner :])


def _characters(file: Any, dims: tuple[str, ...], values: np.ndarray) -> tuple[tuple[str, ...], np.ndarray]:
    """Names (n,) as single characters (n, width), with a dimension of that width in the file."""
    encoded = np.array([str(value).encode() for value in values], dtype=bytes)
    width = max(encoded.dtype.itemsize, 1)
    dim = f"string{width}"
    if dim not in file.dimensions:
        file.dimensions[dim] = width
    return (*dims, dim), encoded.astype(f"S{width}").view("S1").reshape(len(values), width)


def read_netcdf(path: Path) -> xarray.Dataset:
    """Read what `write_netcdf` wrote; flags are booleans again."""
    import xarray

    try:
        with xarray.open_dataset(path, engine="h5netcdf") as stored:
            dataset = stored.load()
    except OSError as error:
        reason = os.strerror(error.errno).lower() if error.errno else str(error)
        raise InputError([f"cannot read {path}: {reason}"]) from error
    for name, variable in dataset.data_vars.items():
        if variable.attrs.get("flag_meanings") == "open contact":
            attrs = {k: v for k, v in variable.attrs.items() if not k.startswith("flag_")}
            dataset[name] = (variable.dims, variable.values.astype(bool), attrs)
    return dataset


def is_ours(path: Path) -> bool:
    """Whether a file is NetCDF that a verb wrote, or a dataset of a run or batch that a user kept: their attributes say
    it."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            source = file.attrs.get("source", b"")
            said = source.decode(errors="replace") if isinstance(source, bytes) else str(source)
            return said.startswith("tarsus ") or {"title", "duration_s"} <= set(file.attrs)
    except (OSError, RuntimeError):
        return False


def matlab_content(variables: Variables) -> dict[str, Any]:
    """Series as MATLAB variables; units in the structure `units`, names in cell arrays."""
    content: dict[str, Any] = {}
    units: dict[str, str] = {}
    for name, (_, values, attrs) in described(variables).items():
        if is_text(values):
            content[f"{name}_names"] = np.array([str(v) for v in values], dtype=object)
        else:
            content[name] = values
            units[name] = str(attrs["units"])
    return content | {"units": units}
