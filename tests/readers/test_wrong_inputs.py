"""Files that cannot be read, or that leave open what they hold, and choices that are none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import h5py
import numpy as np
from scipy.io import savemat, wavfile

import tarsus as ts
import wrong_inputs
from readers import test_lvm as lvm
from readers.test_arrays import TIME, TIP, hdf, matlab_7_3
from readers.test_response_layouts import LINES, UNIT, H
from readers.test_text import POLYTEC, REAL
from readers.test_uff import TIMES, function, units, write
from tarsus.formats import wav
from tarsus.formats.content import formats
from tarsus.records.readers import read_measurement, read_response
from wrong_inputs import Ask, Said, written

Rows = dict[str, tuple[Ask, Said]]
Read = Callable[..., object]
"""`read_measurement` or `read_response`."""


def text(content: str | bytes, said: Said, name: str = "record.csv", then: Read = read_measurement, **choices: Any):
    """A row of a file of some content."""
    return written(content, name, lambda file: then(file, **choices)), said


def mat(said: Said, then: Read = read_measurement, choices: dict[str, Any] | None = None, **content: Any):
    """A row of a MATLAB file of some variables."""

    def ask(at: Path) -> object:
        savemat(at / "record.mat", content)
        return then(at / "record.mat", **(choices or {}))

    return ask, said


def hdf5(said: Said, velocity: Any = TIP, **attributes: Any):
    """A row of a velocity in HDF5 with attributes."""
    return lambda at: read_measurement(hdf(at / "a.h5", velocity=velocity, attributes=attributes, time=TIME)), said


def universal(
    said: Said, *sets: Any, then: Read = read_measurement, end: int | None = None, more: bytes = b"", **of: Any
):
    """A row of a universal file of some data sets, as many bytes of it, and further ones."""

    def ask(at: Path) -> object:
        path = write(at / "a.uff", list(sets))
        path.write_bytes(path.read_bytes()[:end] + more)
        return then(path, **of)

    return ask, said


def cut(write: Callable[[Path], object], name: str) -> tuple[Ask, Said]:
    """A row of a file without its last 700 bytes."""

    def ask(at: Path) -> object:
        write(at / name)
        (at / name).write_bytes((at / name).read_bytes()[:-700])
        return read_measurement(at / name, channels={"tip": "m/s"})

    return ask, (name, "truncated")


def sparse(at: Path) -> object:
    """A MATLAB file of 8 GiB of nothing."""
    with (at / "sparse.mat").open("wb") as file:
        file.write(b"MATLAB 5.0 MAT-file".ljust(126) + b"IM")
        file.truncate(8 << 30)
    return read_measurement(at / "sparse.mat")


def two_rates(at: Path) -> object:
    with h5py.File(at / "a.h5", "w") as file:
        file["slow/velocity"] = TIP
        file["slow/velocity"].attrs["units"] = "m/s"
        file["slow"].attrs.update({"fs": 1e3, "dt": 5e-3})
    return read_measurement(at / "a.h5", channels=["slow/velocity"])


def sound(at: Path, end: int | None, **choices: Any) -> object:
    wavfile.write(at / "leg.wav", 48000, np.zeros(2000, dtype="i2"))
    (at / "leg.wav").write_bytes((at / "leg.wav").read_bytes()[:end])
    return read_measurement(at / "leg.wav", **choices)


TIPS = {"channels": {"tip": "m/s"}}
GAP = ("channel 'velocity' has ", " gap", "no finite number")
COUNTS = np.round(100 * TIP).astype("i2")
SEVENTH = np.arange(200) == 7
ARRAYS: Rows = {
    "rate against times": mat(
        "'fs' says one sample every 0.000990099 s for 'tip', but the column 't' has one every 0.001 s; say which",
        choices=TIPS,
        t=TIME,
        tip=TIP,
        fs=1010.0,
    ),
    "no times": mat("says neither times nor a sampling rate", choices=TIPS, tip=TIP),
    "another length": mat(
        "channel 'short' has 50 samples where 't' has 200",
        choices={"channels": ["tip", "short"]},
        t=TIME,
        tip=TIP,
        short=TIP[:50],
        units={"tip": "m/s", "short": "V"},
    ),
    "no frequencies": (
        lambda at: read_response(REAL / "pyuff_meas_point_1.txt", channels={"column 1": "m/s^2/N"}),
        "says no frequencies; give frequency_step",
    ),
    "version 5, cut": cut(lambda path: savemat(path, {"t": TIME, "tip": TIP}), "five.mat"),
    "version 7.3, cut": cut(lambda path: matlab_7_3(path, {"t": TIME, "tip": TIP}), "seven.mat"),
    "larger than memory": (sparse, "sparse.mat is larger than the 2 GiB that are read"),
    "_FillValue": hdf5(GAP, COUNTS, _FillValue=np.int16(COUNTS[7])),
    "missing_value": hdf5(GAP, COUNTS, missing_value=np.array([COUNTS[7], 30000])),
    "valid_max": hdf5(GAP, COUNTS, valid_max=np.int16(COUNTS[7] - 1), valid_min=np.int16(-9999)),
    "valid_range": hdf5(GAP, np.where(SEVENTH, 2e3, TIP), valid_range=np.array([-1e3, 1e3])),
    "never written": hdf5(GAP, np.where(SEVENTH, 9.969209968386869e36, TIP)),
    "a fill value as text": hdf5(GAP, np.where(SEVENTH, -999.0, TIP), _FillValue="-999"),
    "two factors": hdf5("its attribute scale_factor has 2 numbers, where", COUNTS, scale_factor=[1.0, 2.0]),
    "factor in words": hdf5("its attribute scale_factor is no number", COUNTS, scale_factor="large"),
    "_Unsigned": hdf5("its attribute _Unsigned is 'perhaps', neither true nor false", COUNTS, _Unsigned="perhaps"),
    "two rates": (two_rates, "'slow/dt' and 'slow/fs' contradict each other: none of them is relied"),
    "CDF-5": text(b"CDF\x05" + bytes(60), "a.nc is NetCDF of the variant CDF-5; convert it with: nccopy", "a.nc"),
    "a response alone": mat("holds no time series; it holds frequency responses", f=LINES, H=H[0]),
    "sound of no unit": (lambda at: sound(at, None), "unit"),
    "sound, cut": (lambda at: sound(at, -100, channels={"1": "m/s"}), "leg.wav is damaged or truncated"),
}


def shock(old: str, new: str, said: Said) -> tuple[Ask, Said]:
    """A row of the first lines of a shock record with something changed."""
    return lambda at: read_measurement(lvm.changed(at, old, new), channels=lvm.CHANNELS, axis="time"), said


BLOCK = "X_Value\tdrive\ttip\n0.0\t0.5\t2.0\n0.001\t0.6\t2.5\n0.002\t0.7\t2.7\n"
HEAD = lvm.HEADER.format(columns="One", decimal=".")
TWO = HEAD + BLOCK + "\n" + HEAD[HEAD.index("Channels") :] + BLOCK
GOES_ON = lvm.HEADER.format(columns="No", decimal=".") + "X_Value\tdrive\ttip\n" + "\t1.5\t2.0\n" * 6
NONE, ANNOUNCED = "1 samples are no finite number, the first at sample ", "though its one header announces 3"
LABVIEW: Rows = {
    "no LabVIEW": shock("LabVIEW Measurement", "a table", "record.lvm is not what its name says"),
    "header cut": shock("***End_of_Header***", "", "record.lvm is truncated: its header does not end"),
    "uneven": shock(",0.000605,", ",0.000905,", "record.lvm: the sampling is not even"),
    "not a number": shock("0.187271", "nan", f"channel 'accelerometer_base' has 1 gap: {NONE}0"),
    "fewer": shock(",17", ",18", "channel 'accelerometer_base' has 17 values where the file announces 18"),
    "header against times": (
        lambda at: read_measurement(lvm.SHOCK / "shock_hit_0.5.lvm", channels=lvm.CHANNELS),
        ("every 0.000586 s", "but the column 'time' has one every 0.000605 s"),
    ),
    "no samples": text(HEAD.encode(), "ends after its header", "a.lvm"),
    "third of two": text(TWO, "has no record 3: it holds 2", "a.lvm", record=3),
    "two as one": text(TWO, "the times do not increase at sample 3", "a.lvm", record=0),
    "more than announced": text(GOES_ON, ("holds 2 records", ANNOUNCED, "say which with record"), "a.lvm"),
}


def polytec(old: str, new: str, said: Said) -> tuple[Ask, Said]:
    return text(POLYTEC.replace(old, new), said, "a.txt", channels=["Velocity", "Reference"])


FIXED = POLYTEC.replace("\t0,5\n", "\t0,500\n").replace("\t1,0\n", "\t1,000\n").replace("\t0,0\n", "\t0,000\n")
RATE = "Sample rate: 2 kHz\nSamples: {}\n{}"
TEXT: Rows = {
    "gap": polytec("2,000E+01", "NaN", f"channel 'Velocity' has 1 gap: {NONE}1"),
    "cell": polytec("4,000E+01", "4,0x", "line 9: column 'Velocity' has '4,0x' where a number is expected"),
    "last line": polytec("\t1,000E+01\t-1,0\n", "", "truncated: its last line 10 has 1 of 3 columns"),
    "uneven": polytec("2,000E-03\t4,000E+01\t0,0\n", "", "the sampling is not even"),
    "last number": text(FIXED.rstrip(), "a.txt is truncated: its last number '-1,0' is cut", "a.txt"),
    "rate against times": text(
        RATE.format(4, "t [s];tip [m/s]\n0.000;2\n0.001;4\n0.002;7\n0.003;1\n"),
        ("('Sample rate: 2 kHz') says one sample every 0.0005 s", "the column 't' has one every 0.001"),
    ),
    "responses for series": (
        lambda at: read_measurement(REAL / "pyuff_meas_point_1.txt"),
        "it holds frequency responses: read them with read_response",
    ),
    "phase without unit": text(
        "Frequency [Hz],FRF Magnitude [m/s/N],FRF Phase\n1,2,3\n2,3,4\n",
        "column 'FRF Phase' is a phase, but nothing says whether",
        then=read_response,
    ),
    "commas": text("t [s],tip [m/s]\n0,000,1,5\n0,001,2,5\n0,002,4,5\n", "commas part cells and decimals alike"),
    "infinite": text("Time,A\n(ms),(mm/s)\n0,1\n1,\u221e\n2,3\n", "channel 'A' has 1 gap"),
    "overload": text("time (s),tip (m/s)\n0,1\n1,9.91E+37\n2,3\n", "channel 'tip' has 1 gap"),
    "times of day": text(
        "t,x\n" + "".join(f"12:00:{0.01 * i:.2f},{i % 7}\n" for i in range(30)),
        "'12:00:0.29' where a number is expected; write times as seconds",
    ),
    "unit of another case": text("time (s),tip (mhz)\n0,1\n1,2\n2,3\n", "what channel 'tip (mhz)' measures"),
    "last line of more": text(
        "time (s),tip (mm/s),drive (V)\n0.0,1,1\n0.1,2,2\n0.2,4,1\n0.3,3,\n0.4,1\n",
        "is truncated: its last line 6 has 2 of 3 columns",
    ),
    "thousands or decimals": text(
        '"t (us)","tip (um/s)"\n"0","1,000"\n"20","1,001"\n"40","1,003"\n',
        "'1,000' has a decimal comma or one of thousands",
    ),
}

VALUES = np.sin(np.arange(300.0))
OF_1 = function(H[0, :40], LINES[:40], 4, 1)
UNKNOWN, CUT = "nothing says what channel '1+Z' measures", "a.uff is truncated: its last data set does not end"
LATE = np.where(np.arange(300) < 150, TIMES, TIMES + 3e-4)


UNIVERSAL: Rows = {
    "input": universal("no input '9-Z'", OF_1, then=read_response, inputs=["9-Z"]),
    "part of a matrix": universal(
        "the response of '2+Z' to '8-Z' is missing; choose with",
        *(function(H[0, :40], LINES[:40], 4, out, ref_node=into) for out, into in ((1, 7), (1, 8), (2, 7))),
        then=read_response,
    ),
    "label against data set 164": universal(
        UNKNOWN, units(1, 1.0, 1.0), function(VALUES, TIMES, 1, 1, ordinate_axis_units_lab="mm/s")
    ),
    "units that contradict themselves": universal(
        UNKNOWN, units(1, 3.28083989501312334, 0.224808943099710480), function(VALUES, TIMES, 1, 1)
    ),
    "two samplings": universal(
        "'2+Z' is sampled every 0.0002 s from 0 s, '1+Z' every 0.0001 s",
        *(function(VALUES, k * TIMES, 1, k) for k in (1, 2)),
    ),
    "uneven": universal(
        ("a.uff: the sampling is not even", "0.0004 s after sample 149"),
        function(VALUES, LATE, 1, 1, abscissa_spacing=0),
    ),
    "text, cut": universal(CUT, OF_1, OF_1, then=read_response, end=-300),
    "binary, cut": universal(CUT, *[function(H[0], LINES, 4, 1, binary=1)] * 2, then=read_response, end=-300),
    "cut and closed": universal("truncated", OF_1, OF_1, then=read_response, end=-300, more=b"\n    -1\n"),
    "marks": universal(
        "a.uff is damaged: a data set between its marks (-1) has no", OF_1, then=read_response, more=b"    -1\n" * 2
    ),
    "no phases": universal(
        "'1+Z' are real numbers throughout, without phases",
        function(np.abs(H[0, :40]), LINES[:40], 4, 1),
        then=ts.modes,
        band=(3.0, 20.0),
    ),
    "spectra": universal("not used: 1 power spectral densities", function(np.ones(40), LINES[:40], 9, 4)),
}


def pair(said: Said, **channel: str) -> tuple[Ask, Said]:
    """A row of a response by its amplitude and what is said of its phase."""
    content = {"mag": np.abs(H[0]), "phase": np.angle(H[0], deg=True), "other": LINES[:9], "z": H[1]}
    return mat(said, read_response, {"channels": {"mag": {"unit": UNIT, **channel}}}, f=LINES, **content)


BAD = np.where(np.arange(60) % 7 == 0, np.nan, H[0])
RESPONSES: Rows = {
    "second part": mat(
        "name the second part of a response under channels, as imaginary",
        read_response,
        f=LINES,
        Hre=H[0].real,
        Him=H[0].imag,
    ),
    "unit of a phase": pair("nothing says whether the phase 'phase' is in deg or rad", phase="phase"),
    "length of a phase": pair("differ in length", phase="other", phase_unit="deg"),
    "complex phase": pair("is complex", phase="z", phase_unit="deg"),
    "name of a phase": pair("did you mean 'phase'", phase="phas", phase_unit="deg"),
    "table": mat("has no channel 'FR'", read_response, {"channels": {"FR": UNIT}}, freq=LINES, FRF=H),
    "gap": mat("no finite number, the first at sample", read_response, {"channels": {"H": UNIT}}, f=LINES, H=BAD),
}

RAMP = "t [s],tip [m/s],a [V],b [V]\n" + "".join(f"{i / 1e3},{i % 9},{i % 5},0\n" for i in range(300))
CLIPPED = "t [s],tip [mm/s]\n" + "".join(f"{i / 1e3},{min(i % 50, 20)}\n" for i in range(2000))


def chosen(said: Said, **choices: Any) -> tuple[Ask, Said]:
    return text(RAMP, said, **choices)


CHOICES: Rows = {
    "clipped": text(CLIPPED, ("record.csv: channel 'tip' is clipped", "of 2000 samples stand in runs")),
    "full scale": chosen("its full scale of 0.0005 m/s", channels={"tip": {"unit": "mm/s", "full_scale": "0.5 mm/s"}}),
    "drive at rest": chosen("the drive is missing: channel 'b' is 0 V throughout", drive="b"),
    "no drive": chosen("the drive is missing: no channel 'c' was read", drive="c"),
    "word": chosen("unknown name 'chanels'; did you mean 'channels'", chanels=["tip"]),
    "channel": chosen("record.csv has no channel 'top'; did you mean 'tip'", channels=["top"]),
    "unit": chosen("channel 'tip' measures ('kg' is no unit of a known quantity)", channels={"tip": "kg"}),
    "axis": chosen("has no series 'T'", axis="T"),
    "unit of the axis": chosen("the axis 't' is in 'mm', which is no unit of time", axis_unit="mm"),
    "step": chosen("step: expected a time", step="-1 ms"),
    "noise": chosen("record.csv: channel 'tip': expected a velocity", channels={"tip": {"noise": "3 V"}}),
    "series for responses": chosen(
        ("no complex frequency response", "read time series with read_measurement"), then=read_response
    ),
    "folder": (lambda at: read_measurement(at), "is a folder"),
}

OLE = b"\xd0\xcf\x11\xe0\0\0"
OCTAVE = b"# Created by Octave 8\n# name: t\n# type: matrix\n# rows: 3\n# columns: 1\n 1\n 2\n"
UNREAD = {
    "scan.svd": (OLE, "scan.svd is a binary file of the Polytec software; export it there as Univ"),
    "leg.pvd": (OLE, ("leg.pvd is a binary file of the Polytec software;", "(UFF 58) or as ASCII")),
    "leg.xlsx": (b"PK\3\4\0", "leg.xlsx is a spreadsheet; save the sheet as CSV"),
    "leg.bin": (b"\1\0\2\0", ("leg.bin is a binary file of no known format; export it as one of:", "UFF")),
    "leg.uff": (b"\0\0\0\0", "leg.uff is not what its name says"),
    "empty.csv": (b"", "empty.csv is empty"),
    "leg.csv": (b"a,b\nc,d\n", "leg.csv holds no rows of numbers"),
    "leg.mat": (b"nothing that was ever MATLAB", "leg.mat is no MATLAB file, whatever its name says"),
    "octave.mat": (b"Octave-1-L\0", "octave.mat is in Octave's binary format; save it with -v7"),
    "cut.mat": (OCTAVE, "cut.mat is truncated: channel 't' has 2 values where the file announces 3"),
}
UNKNOWN_FORMATS: Rows = {
    f"{name} by {then.__name__}": text(content, said, name, then)
    for name, (content, said) in UNREAD.items()
    for then in ((read_measurement, read_response) if name in ("leg.bin", "leg.csv") else (read_measurement,))
}


def no_formats(folder: Path) -> object:
    """A file of the folder of formats whose ``FORMATS`` are none."""
    with mock.patch.object(wav, "FORMATS", ("WAV",)):
        return formats.__wrapped__()


UNKNOWN_FORMATS["a file that lists none"] = (no_formats, "wav.py: FORMATS: expected a tuple of Format(...), got ('WAV'")
ROOM = {
    f"{of}: {name}": row
    for of, rows in {
        "arrays": ARRAYS,
        "LabVIEW": LABVIEW,
        "text": TEXT,
        "universal": UNIVERSAL,
        "responses": RESPONSES,
        "choices": CHOICES,
        "formats": UNKNOWN_FORMATS,
    }.items()
    for name, row in rows.items()
}


@wrong_inputs.cases(ROOM)
def test_wrong_input_is_a_sentence(ask: Ask, said: Said, tmp_path: Path) -> None:
    wrong_inputs.is_refused(ask, said, tmp_path)
