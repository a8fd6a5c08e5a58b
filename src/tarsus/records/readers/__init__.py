"""Files of vibrometers and recorders: one file a format, and two functions that find the right one."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.spec import validate
from tarsus.records.measurement import FrequencyResponse, Measurement
from tarsus.records.readers.choices import ChannelChoice, Choices
from tarsus.records.readers.hdf import is_hdf, is_netcdf_classic, read_hdf, read_netcdf_classic
from tarsus.records.readers.lvm import is_lvm, read_lvm
from tarsus.records.readers.mat import is_mat, read_mat
from tarsus.records.readers.raw import RawFile, read_bytes
from tarsus.records.readers.record import measurement_of
from tarsus.records.readers.response import response_of
from tarsus.records.readers.tdms import is_tdms, read_tdms
from tarsus.records.readers.text import read_text
from tarsus.records.readers.uff import is_uff, read_uff

__all__ = ["ChannelChoice", "Choices", "read_measurement", "read_response"]

_POLYTEC = (
    "a binary file of the Polytec software; export it there as Universal File Format (UFF 58) or as ASCII"
)
_ELSEWHERE = {
    ".svd": _POLYTEC,
    ".pvd": _POLYTEC,
    ".xls": "a spreadsheet; save the sheet as CSV",
    ".xlsx": "a spreadsheet; save the sheet as CSV",
    ".ods": "a spreadsheet; save the sheet as CSV",
    ".npz": "an archive of numpy; write its arrays with scipy.io.savemat or as HDF5",
    ".npy": "an array of numpy, without names and units; write it with scipy.io.savemat or as HDF5",
    ".wav": "a sound file, whose numbers have no unit; export the record with its units as UFF 58 or CSV",
    ".tdm": "the header of a TDM/TDX pair; save it as TDMS",
    ".tdx": "the numbers of a TDM/TDX pair; save it as TDMS",
}
_KNOWN = "UFF 55/58/58b, MATLAB, HDF5, NetCDF, TDMS, LVM, CSV or ASCII"
_HEAD = 4096
"""Bytes that tell the format: headers name it at their beginning."""


def read_measurement(path: str | os.PathLike[str], **choices: Any) -> Measurement:
    """Time series of a file, in SI. The format is told from the content.

    Parameters
    ----------
    path
        The file.
    choices
        Fields of `Choices`: what the file does not say, or says wrongly. ``channels`` (names, or names with units),
        ``axis``, ``axis_unit``, ``step``, ``drive``.

    Returns
    -------
    Measurement
        Channels by name with quantity and unit, their samples [SI], the sampling step [s] and where the drive is.

    Raises
    ------
    InputError
        If the file cannot be read (with the way to export it), or its data cannot be used: gaps, truncation, times
        that are uneven or contradict the header, clipped channels, a missing drive, channels of unknown unit. Each is
        a sentence with the file, the channel and the cause.
    """
    return measurement_of(_content(Path(path)), validate(Choices, choices))


def read_response(path: str | os.PathLike[str], **choices: Any) -> FrequencyResponse:
    """Frequency responses of a file, in SI; as `read_measurement`.

    Parameters
    ----------
    path
        The file.
    choices
        Fields of `Choices`: ``channels``, ``axis``, ``axis_unit``, ``frequency_step``, ``inputs``, ``input_unit``.

    Raises
    ------
    InputError
        As `read_measurement`.
    """
    return response_of(_content(Path(path)), validate(Choices, choices))


def _content(path: Path) -> RawFile:
    """Series of a file, by the format that its first bytes show."""
    if path.is_dir():
        raise InputError(f"{path} is a folder; name a file in it")
    if path.suffix == ".toml" and path.is_file():
        raise InputError(f"{path.name} is a description (TOML), no record")
    content = read_bytes(path)
    head = content[:_HEAD]
    if not content:
        raise InputError(f"{path.name} is empty")
    for is_it, read in (
        (is_mat, read_mat),
        (is_hdf, read_hdf),
        (is_netcdf_classic, read_netcdf_classic),
        (is_tdms, read_tdms),
        (is_lvm, read_lvm),
        (is_uff, read_uff),
    ):
        if is_it(head):
            return read(path, content)
    suffix = path.suffix.lower()
    if suffix in _ELSEWHERE:
        raise InputError(f"{path.name} is {_ELSEWHERE[suffix]}")
    if suffix == ".mat":
        return read_mat(path, content)  # version 4 has no signature
    if suffix in (".uff", ".unv", ".ufb", ".lvm", ".tdms", ".h5", ".hdf5", ".nc"):
        raise InputError(
            f"{path.name} is not what its name says: its content is damaged or truncated at the start"
        )
    if b"\0" in head and not head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError(f"{path.name} is a binary file of no known format; export it as one of: {_KNOWN}")
    return read_text(path, content)
