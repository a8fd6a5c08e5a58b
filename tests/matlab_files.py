"""MATLAB files of every version, with variables of every class beside the vectors, read back by scipy or h5py."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import loadmat, savemat
from scipy.sparse import csc_array

from record_case import Case, Held

STEP = 50e-6
N = np.arange(64)
TIMES = N * STEP
TIP = 0.2 * np.cos(0.3 * N) + 0.01 * np.sin(2.0 * N)
CHOSEN = {"channels": {"v": "mm/s"}, "axis": "t"}
BESIDE: dict[str, Any] = {
    "words": "a remark",
    "lines": np.array(["one", "three"]),
    "on": np.array([True, False]),
    "cells": np.array([[TIP, "x"]], dtype=object),
    "runs": np.array([{"a": 1.0}, {"a": 2.0}], dtype=object),
    "one": {"deep": {"er": TIP}},
    "matrix": csc_array(np.eye(3)),
    "H": TIP * 1j,
    "empty": np.zeros((0, 0)),
    "cube": np.zeros((2, 3, 4)),
    "n": 3.0,
}


def _savemat(
    values: np.ndarray = TIP, beside: Mapping[str, Any] = BESIDE, column: bool = False, **how: Any
) -> Callable[[Path], Held]:
    """Times and a velocity in mm/s, beside whatever else."""

    def write(path: Path) -> Held:
        savemat(path, {"t": TIMES, "v": values, **beside}, oned_as="column" if column else "row", **how)
        read = np.asarray(loadmat(path, variable_names=["v"])["v"], dtype=float).ravel()
        return Held({"v": ("m/s", 1e-3 * read)}, STEP)

    return write


def _nested(path: Path) -> Held:
    """Vectors in structures, cells and arrays of structures."""
    run = {"t": TIMES, "v": TIP, "label": "first", "at": np.array([[1.0, "x"]], dtype=object)}
    savemat(path, {"runs": np.array([{"t": 2 * TIMES, "v": 0 * TIP}, run], dtype=object)})
    read = loadmat(path, simplify_cells=True)["runs"][1]
    return Held({"runs/2.v": ("m/s", 1e-3 * read["v"])}, STEP)


def _in_cells(path: Path) -> Held:
    """Vectors of one length in cells of two rows, which are counted by columns."""
    cells = np.empty((2, 2), dtype=object)
    for place, one in (((0, 0), TIMES), ((1, 0), TIP), ((0, 1), 2 * TIP), ((1, 1), 3 * TIP)):
        cells[place] = one
    savemat(path, {"c": cells})
    read = loadmat(path)["c"]
    return Held({"c/2": ("m/s", 1e-3 * read[1, 0].ravel()), "c/3": ("m/s", 1e-3 * read[0, 1].ravel())}, STEP)


def _big_endian(path: Path) -> Held:
    """Version 5 with its most significant bytes first."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack(">II", kind, len(data)) + data + b"\0" * (-len(data) % 8)

    def vector(name: bytes, values: np.ndarray, kind: int, stored: str) -> bytes:
        parts = element(6, struct.pack(">II", kind, 0)) + element(5, struct.pack(">ii", len(values), 1))
        return element(14, parts + element(1, name) + element(9, values.astype(stored).tobytes()))

    head = b"MATLAB 5.0 MAT-file, Platform: SOL2".ljust(124) + struct.pack(">H", 0x0100) + b"MI"
    path.write_bytes(head + vector(b"t", TIMES, 6, ">f8") + vector(b"v", TIP, 6, ">f8"))
    return Held({"v": ("m/s", 1e-3 * loadmat(path)["v"].ravel())}, STEP)


def _hdf(values: np.ndarray = TIP, kind: str = "double", **create: Any) -> Callable[[Path], Held]:
    """Version 7.3: rows are columns, and classes are attributes."""

    def write(path: Path) -> Held:
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, one, of in (("t", TIMES, "double"), ("v", values, kind)):
                made = file.create_dataset(name, data=one[None, :], **create)
                made.attrs["MATLAB_class"] = np.bytes_(of)
            file["words"] = np.array([[104], [105]], dtype="u2")
            file["words"].attrs["MATLAB_class"] = np.bytes_("char")
            file["on"] = np.array([[1, 0]], dtype="u1")
            file["on"].attrs["MATLAB_class"] = np.bytes_("logical")
            file["none"] = np.zeros(2, dtype="u8")
            file["none"].attrs.update({"MATLAB_class": np.bytes_("double"), "MATLAB_empty": np.uint8(1)})
        with path.open("r+b") as stream:
            stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")
        with h5py.File(path, "r") as file:
            read = np.asarray(file["v"], dtype=float).ravel()
        return Held({"v": ("m/s", 1e-3 * read)}, STEP)

    return write


COUNTS = np.round(100 * TIP)

CASES = [
    Case("version 5.mat", _savemat(), CHOSEN),
    Case("version 5, compressed.mat", _savemat(do_compression=True), CHOSEN),
    Case("version 5, columns.mat", _savemat(column=True), CHOSEN),
    Case("version 5, long names.mat", _savemat(beside={"a": {"f" * 60: 1.0}}, long_field_names=True), CHOSEN),
    Case("version 4.mat", _savemat(beside={"words": "a remark", "H": TIP * 1j, "n": 3.0}, format="4"), CHOSEN),
    *(
        Case(f"version 5, {kind}.mat", _savemat(COUNTS.astype(kind)), CHOSEN)
        for kind in ("i1", "i2", "i4", "i8", "f4", "f8")
    ),
    *(
        Case(f"version 5, {kind}.mat", _savemat((COUNTS + 100).astype(kind)), CHOSEN)
        for kind in ("u1", "u2", "u4", "u8")
    ),
    Case("version 5, most significant first.mat", _big_endian, CHOSEN),
    Case("version 5, in structures.mat", _nested, {"channels": {"runs/2.v": "mm/s"}, "axis": "runs/2.t"}),
    Case("version 5, in cells.mat", _in_cells, {"channels": {"c/2": "mm/s", "c/3": "mm/s"}, "axis": "c/1"}),
    Case("version 7.3.mat", _hdf(), CHOSEN),
    Case("version 7.3, compressed.mat", _hdf(chunks=(1, 9), compression="gzip"), CHOSEN),
    Case("version 7.3, single.mat", _hdf(TIP.astype("f4"), "single"), CHOSEN),
    Case("version 7.3, int16.mat", _hdf(COUNTS.astype("i2"), "int16"), CHOSEN),
    Case("version 7.3, uint32.mat", _hdf((COUNTS + 100).astype("u4"), "uint32"), CHOSEN),
]
