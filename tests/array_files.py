"""NetCDF and HDF5 files with every attribute that changes numbers or times, read back by xarray or h5py."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr

from record_case import Case, Held

STEP = 50e-6
N = np.arange(64)
TIP = 0.2 * np.cos(0.3 * N) + 0.01 * np.sin(2.0 * N)
PACKED = {"scale_factor": 1e-5, "add_offset": 0.1}


def _netcdf(
    encoding: Mapping[str, Any] = {},
    *,
    classic: str = "",
    time: Any = None,
    time_encoding: Mapping[str, Any] = {},
    attributes: Mapping[str, Any] = {},
    step: float = STEP,
    start: float = 0.0,
) -> Callable[[Path], Held]:
    """A velocity over times, as xarray writes and reads it."""

    def write(path: Path) -> Held:
        times = N * STEP if time is None else time
        units = {"units": "s"} if time is None else {}
        made = xr.Dataset(
            {"velocity": ("time", TIP, {"units": "m/s", **attributes})}, coords={"time": ("time", times, units)}
        )
        how: dict[str, Any] = {"engine": "scipy", "format": classic} if classic else {"engine": "h5netcdf"}
        with warnings.catch_warnings():  # that there would be no fill value for gaps
            warnings.simplefilter("ignore", xr.SerializationWarning)
            made.to_netcdf(path, encoding={"velocity": dict(encoding), "time": dict(time_encoding)}, **how)
        with xr.open_dataset(path, engine=how["engine"], decode_times=False) as read:
            values = np.asarray(read["velocity"].values, dtype=float)
        return Held({"velocity": ("m/s", values)}, step, start, digits=1e-6 if "f4" in str(encoding) else 1e-12)

    return write


def _raw(
    values: np.ndarray,
    attributes: Mapping[str, Any],
    *,
    times: np.ndarray | None = None,
    time_unit: str = "s",
    root: Mapping[str, Any] = {},
    create: Mapping[str, Any] = {},
    start: float = 0.0,
) -> Callable[[Path], Held]:
    """A velocity in HDF5, which h5py reads and its attributes change, by hand."""

    def write(path: Path) -> Held:
        with h5py.File(path, "w") as file:
            file.create_dataset("velocity", data=values, **create).attrs.update({"units": "m/s", **attributes})
            if times is not None:
                file.create_dataset("time", data=times).attrs["units"] = time_unit
            file.attrs.update(root)
        with h5py.File(path, "r") as file:
            read = file["velocity"][()].astype(float)  # type: ignore[index]
        if str(attributes.get("_Unsigned", "")) == "true":
            read = np.where(read < 0, read + 2.0 ** (8 * values.dtype.itemsize), read)
        meant = read * attributes.get("scale_factor", 1.0) + attributes.get("add_offset", 0.0)
        return Held({"velocity": ("m/s", meant)}, STEP, start)

    return write


EVEN = N * STEP
COUNTS = np.round(1e4 * TIP).astype("i2")
FAST = (N * 50).astype("timedelta64[us]").astype("timedelta64[ns]")

CASES = [
    *(
        Case(f"packed {kind}.nc", _netcdf({"dtype": kind, "_FillValue": None, **PACKED}))
        for kind in ("i2", "i4", ">i2", ">i4")
    ),
    Case("packed i1.nc", _netcdf({"dtype": "i1", "_FillValue": None, "scale_factor": 2e-3})),
    Case(
        "packed u1, no sign.nc", _netcdf({"dtype": "u1", "_FillValue": None, "scale_factor": 2e-3, "add_offset": -0.25})
    ),
    Case(
        "packed i2 of u2.nc",
        _netcdf(
            {"dtype": "i2", "_Unsigned": "true", "_FillValue": np.int16(-1), "scale_factor": 1e-5, "add_offset": -0.3}
        ),
    ),
    Case("fill value.nc", _netcdf({"dtype": "i2", "_FillValue": np.int16(-32768), **PACKED})),
    Case("missing value.nc", _netcdf({"dtype": "i2", "missing_value": np.int16(-9999), "_FillValue": None, **PACKED})),
    Case("fill value of floats.nc", _netcdf({"dtype": "f4", "_FillValue": np.float32(1e20)})),
    Case("valid range.nc", _netcdf(attributes={"valid_range": np.array([-1.0, 1.0])})),
    Case("big-endian.nc", _netcdf({"dtype": ">f8"})),
    Case("half.nc", _netcdf({"dtype": "f4"})),
    Case(
        "compressed.nc",
        _netcdf({"zlib": True, "complevel": 9, "shuffle": True, "fletcher32": True, "chunksizes": (7,)}),
    ),
    *(
        Case(f"classic {kind}.nc", _netcdf({"dtype": kind, "_FillValue": None, **PACKED}, classic=form))
        for kind, form in (("i2", "NETCDF3_CLASSIC"), ("i4", "NETCDF3_64BIT"))
    ),
    Case("classic f4.nc", _netcdf({"dtype": "f4"}, classic="NETCDF3_64BIT")),
    Case("classic f8.nc", _netcdf(classic="NETCDF3_CLASSIC")),
    Case(
        "classic fill.nc", _netcdf({"dtype": "i2", "_FillValue": np.int16(-32768), **PACKED}, classic="NETCDF3_CLASSIC")
    ),
    Case("timedelta.nc", _netcdf(time=FAST)),
    *(
        Case(f"timedelta in {unit}.nc", _netcdf(time=FAST, time_encoding={"units": unit, "dtype": kind}))
        for unit, kind in (("microseconds", "i8"), ("nanoseconds", "i8"), ("seconds", "f8"), ("milliseconds", "f8"))
    ),
    Case(
        "datetime.nc",
        _netcdf(
            time=np.datetime64("2026-01-01", "ns") + FAST,
            time_encoding={"units": "microseconds since 2026-01-01", "dtype": "i8"},
        ),
    ),
    Case(
        "datetime in seconds.nc",
        _netcdf(
            time=np.datetime64("2026-01-01", "ns") + FAST,
            time_encoding={"units": "seconds since 2026-01-01 00:00:00", "dtype": "f8"},
        ),
    ),
    Case("packed times.nc", _netcdf(time_encoding={"dtype": "i4", "scale_factor": STEP})),
    *(
        Case(f"counts {kind}.h5", _raw(COUNTS.astype(kind), {"scale_factor": 1e-4, "add_offset": -0.5}, times=EVEN))
        for kind in ("<i2", ">i2", "<i8", ">i4", "f4", "f2", ">f8")
    ),
    Case(
        "no sign.h5",
        _raw((COUNTS % 256).astype("u1").view("i1"), {"_Unsigned": "true", "scale_factor": 0.5}, times=EVEN),
    ),
    Case("chunks.h5", _raw(TIP, {}, times=EVEN, create={"chunks": (5,), "compression": "gzip", "shuffle": True})),
    Case("microseconds.h5", _raw(TIP, {}, times=N * 50, time_unit="microseconds")),
    Case("rounded us.h5", _raw(TIP, {}, times=np.round(EVEN * 1e6 + 3.2).astype("i8"), time_unit="us", start=3e-6)),
    Case(
        "epoch ns.h5",
        _raw(
            TIP,
            {},
            times=1_780_000_000_000_000_000 + N * 50_000,
            time_unit="nanoseconds since 1970-01-01",
            start=1.78e9,
        ),
    ),
    Case("rate of the file.h5", _raw(TIP, {}, root={"sample_rate_hz": 1 / STEP})),
    Case("rate as text.h5", _raw(TIP, {}, root={"Sampling Frequency": "20 kHz"})),
    Case("rate of the data.h5", _raw(TIP, {"dt_us": 50})),
]
