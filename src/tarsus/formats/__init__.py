"""Files of vibrometers, recorders and oscilloscopes: one file a format, and the function that finds the right one.

What a file holds is the same for every reader: records, frequency responses, and the volts of a signal.
"""

from __future__ import annotations

from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.formats.hdf import is_hdf, is_netcdf_classic, read_hdf, read_netcdf_classic
from tarsus.formats.lvm import is_lvm, read_lvm
from tarsus.formats.mat import is_mat, read_mat
from tarsus.formats.npz import is_npz, read_npz
from tarsus.formats.octave import is_octave, read_octave
from tarsus.formats.raw import RawFile, read_bytes
from tarsus.formats.tdms import is_tdms, read_tdms
from tarsus.formats.text import read_text
from tarsus.formats.uff import is_uff, read_uff

__all__ = ["content_of"]

_POLYTEC = (
    "a binary file of the Polytec software; export it there as Universal File Format (UFF 58) or as ASCII"
)
_ELSEWHERE = {
    ".svd": _POLYTEC,
    ".pvd": _POLYTEC,
    ".xls": "a spreadsheet; save the sheet as CSV",
    ".xlsx": "a spreadsheet; save the sheet as CSV",
    ".ods": "a spreadsheet; save the sheet as CSV",
    ".npy": "an array of numpy, without names and units; write it with scipy.io.savemat or as HDF5",
    ".wav": "a sound file, whose numbers have no unit; export the record with its units as UFF 58 or CSV",
    ".tdm": "the header of a TDM/TDX pair; save it as TDMS",
    ".tdx": "the numbers of a TDM/TDX pair; save it as TDMS",
}
_KNOWN = "UFF 55/58/58b, MATLAB, HDF5, NetCDF, TDMS, LVM, CSV or ASCII"
_HEAD = 4096
"""Bytes that tell the format: headers name it at their beginning."""


def content_of(path: Path) -> RawFile:
    """Series of a file, by the format that its first bytes show. Raises InputError where it cannot be read."""
    if path.is_dir():
        raise InputError(f"{path} is a folder; name a file in it")
    if path.suffix == ".toml" and path.is_file():
        raise InputError(f"{path.name} is a description (TOML), no record")
    content = read_bytes(path)
    head = content[:_HEAD]
    if not content:
        raise InputError(f"{path.name} is empty")
    if path.suffix.lower() == ".mat" and is_hdf(head):
        return read_mat(path, content)  # as other programs than MATLAB write version 7.3, without its words
    for is_it, read in (
        (is_mat, read_mat),
        (is_hdf, read_hdf),
        (is_netcdf_classic, read_netcdf_classic),
        (is_tdms, read_tdms),
        (is_lvm, read_lvm),
        (is_uff, read_uff),
        (is_npz, read_npz),
        (is_octave, read_octave),
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
