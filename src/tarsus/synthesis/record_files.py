"""Records written as instruments and their users write them: UFF 58b, MATLAB, HDF5, Polytec ASCII, CSV."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.files.steady import SteadyFile
from tarsus.files.whole import write_text, written_whole
from tarsus.records.measurement import Channel, Measurement, Quantity
from tarsus.records.readers.choices import ChannelChoice

Choices = dict[str, ChannelChoice]

_UNITS = {
    Quantity.DISPLACEMENT: ("um", 1e6),
    Quantity.VELOCITY: ("mm/s", 1e3),
    Quantity.ACCELERATION: ("m/s^2", 1.0),
    Quantity.VOLTAGE: ("V", 1.0),
    Quantity.FORCE: ("N", 1.0),
    Quantity.CHARGE: ("pC", 1e12),
    Quantity.CURRENT: ("nA", 1e9),
    Quantity.ANGLE: ("mrad", 1e3),
    Quantity.ANGULAR_VELOCITY: ("rad/s", 1.0),
}
"""Units that the files are written in, with their factors, as instruments of the field have them."""
_UFF_TYPES = {Quantity.DISPLACEMENT: 8, Quantity.VELOCITY: 11, Quantity.ACCELERATION: 12, Quantity.FORCE: 13}
"""Codes of the quantities in universal files, by the format."""


def _choice(channel: Channel, name: str | None = None, unit: str | None = None) -> ChannelChoice:
    point = None if channel.point is None else channel.point
    return ChannelChoice(name=name, unit=unit, point=point)


def write_uff(record: Measurement, path: Path) -> Choices:
    """A universal file of data sets 58b in SI; channels are degrees of freedom 1+Z, 2+Z, ... in their order.

    Returns what has to be said of each channel when the file is read.
    """
    import pyuff

    sets, said = [], {}
    for number, (channel, values) in enumerate(zip(record.channels, record.values, strict=True), start=1):
        unit = channel.quantity.unit
        sets.append(
            pyuff.prepare_58(
                binary=1,
                func_type=1,
                rsp_node=number,
                rsp_dir=3,
                ref_node=0,
                ref_dir=0,
                data=values,
                x=record.step * np.arange(record.count),
                abscissa_spacing=1,
                abscissa_inc=record.step,
                abscissa_spec_data_type=17,
                ordinate_spec_data_type=_UFF_TYPES.get(channel.quantity, 0),
                ordinate_axis_units_lab=unit,
                orddenom_spec_data_type=0,
                id1=channel.name,
            )
        )
        said[f"{number}+Z"] = _choice(channel, channel.name, unit)
    with written_whole(path) as part:
        pyuff.UFF(str(part)).write_sets(sets, mode="add")
    return said


def write_mat(record: Measurement, path: Path) -> Choices:
    """A MATLAB file of version 5: vectors in mm/s, um and V, and the sampling rate ``fs``; it states no units."""
    from scipy.io import savemat

    content: dict[str, object] = {"fs": record.rate}
    said = {}
    for channel, values in zip(record.channels, record.values, strict=True):
        unit, factor = _UNITS[channel.quantity]
        name = channel.name.replace(" ", "_")
        content[name] = values * factor
        said[name] = _choice(channel, channel.name, unit)
    with written_whole(path) as part:
        savemat(part, content, do_compression=True)
    return said


def write_hdf(record: Measurement, path: Path) -> Choices:
    """An HDF5 file with its units and points as attributes."""
    import h5py

    said = {}
    with written_whole(path) as part, SteadyFile(part) as disk, h5py.File(disk, "w") as file:
        file["sample_rate"] = record.rate
        for channel, values in zip(record.channels, record.values, strict=True):
            unit, factor = _UNITS[channel.quantity]
            data = file.create_dataset(channel.name, data=values * factor, compression="gzip")
            data.attrs["units"] = unit
            if channel.point is not None:
                data.attrs["point"] = channel.point
            said[channel.name] = _choice(channel)
    return said


def write_polytec(record: Measurement, path: Path) -> Choices:
    """A table as the Polytec software exports it: Latin-1, tabs, names, units in brackets below them."""
    units = [_UNITS[channel.quantity] for channel in record.channels]
    head = [
        f"Source File Name:\t{path.stem}.pvd",
        "Signal:\tTime - Vib & Ref",
        f"Samples:\t{record.count}",
        "",
        "\t".join(["Time", *(channel.name for channel in record.channels)]),
        "\t".join(["[ s ]", *(f"[ {unit} ]".replace("um", "µm") for unit, _ in units)]),
    ]
    rows = _rows(record, [factor for _, factor in units])
    lines = ["\t".join(f"{value:.7E}" for value in row) for row in rows]
    with written_whole(path) as part:
        part.write_bytes(("\n".join([*head, *lines]) + "\n").encode("latin-1"))
    return {channel.name: _choice(channel) for channel in record.channels}


def write_csv(record: Measurement, path: Path) -> Choices:
    """A comma-separated table with units behind the names."""
    units = [_UNITS[channel.quantity] for channel in record.channels]
    names = [f"{channel.name} [{unit}]" for channel, (unit, _) in zip(record.channels, units, strict=True)]
    rows = _rows(record, [factor for _, factor in units])
    lines = [",".join(["t [s]", *names]), *(",".join(f"{value:.8g}" for value in row) for row in rows)]
    write_text(path, "\n".join(lines) + "\n")
    return {channel.name: _choice(channel) for channel in record.channels}


def _rows(record: Measurement, factors: list[float]) -> Floats:
    """Times and channels in the units written (ns, 1 + nc)."""
    time = record.step * np.arange(record.count)
    return np.concatenate([time[:, None], record.values.T * np.array(factors)], axis=1).astype(np.float64)
