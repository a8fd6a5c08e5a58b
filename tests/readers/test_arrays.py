"""The readers of MATLAB, HDF5, NetCDF and TDMS files, on files that their libraries write."""

from __future__ import annotations

import struct
import sys
import zlib
from pathlib import Path

import h5netcdf
import h5py
import numpy as np
import pytest
from scipy.io import netcdf_file, savemat

import tarsus as ts
import tdms_files
from tarsus.formats import raw
from tarsus.formats.content import content_of
from tarsus.records.measurement import Quantity
from tarsus.records.readers import read_measurement, read_response
from universal_files import function58, units164

TIME = 0.25 + 1e-3 * np.arange(200)
RANDOM = np.random.default_rng(2)
TIP, VOLTS = RANDOM.normal(size=200), np.sign(np.sin(40 * TIME))
LINES = np.arange(50.0)
RESPONSE = RANDOM.normal(size=50) + 1j * RANDOM.normal(size=50)
REAL = Path(__file__).parents[1] / "data" / "real"


def check(record, tip: str, volts: str, start: float = 0.25) -> None:
    assert record[tip] == pytest.approx(1e-3 * TIP)
    assert record[volts] == pytest.approx(VOLTS)
    assert record.channel(tip).quantity is Quantity.VELOCITY
    assert record.drive == volts
    assert record.step == pytest.approx(1e-3) and record.start == pytest.approx(start)


def matlab_7_3(path: Path, content: dict[str, np.ndarray]) -> Path:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in content.items():
            if np.iscomplexobj(values):
                table = np.zeros(values.shape, dtype=[("real", "f8"), ("imag", "f8")])
                table["real"], table["imag"] = values.real, values.imag
                values = table
            file[name] = np.atleast_2d(values)
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
        file["#refs#/a"] = np.zeros(3)
        file["remark"] = np.array([[104], [105]], dtype=np.uint16)
        file["remark"].attrs["MATLAB_class"] = np.bytes_("char")
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512))
    return path


def test_matlab_structures_tables_and_units(tmp_path):
    path = tmp_path / "record.mat"
    savemat(path, {"run": {"time": TIME[:, None], "ch": np.column_stack([TIP, VOLTS])}, "units": {"gain": "V"}})
    record = read_measurement(
        path, channels={"run.ch/1": {"unit": "mm/s", "name": "tip", "noise": "2 um/s"}, "run.ch/2": {"unit": "V"}}
    )
    check(record, "tip", "run.ch/2")
    assert record.channel("tip").noise == pytest.approx(2e-6)
    savemat(path, {"time": TIME, "tip": TIP, "volts": VOLTS, "units": {"tip": "mm/s", "volts": "V", "time": "s"}})
    check(read_measurement(path), "tip", "volts")
    units = {"run": {"tip": "mm/s", "volts": "V"}}
    savemat(path, {"run": {"time": TIME, "tip": TIP, "volts": VOLTS}, "units": units})
    check(read_measurement(path), "run.tip", "run.volts")


def test_times_at_odds_with_the_rate_are_chosen_between(tmp_path):
    path = tmp_path / "record.mat"
    savemat(path, {"t": TIME, "tip": TIP, "fs": 1010.0})
    assert read_measurement(path, channels={"tip": "m/s"}, axis="t").step == pytest.approx(1e-3)
    assert read_measurement(path, channels={"tip": "m/s"}, step=1 / 1010).step == 1 / 1010
    savemat(path, {"tip": TIP, "fs": 1010.0})
    assert read_measurement(path, channels={"tip": "m/s"}).step == pytest.approx(1 / 1010)


def test_measured_responses_of_others():
    one = read_response(
        REAL / "vtb_case1.mat", channels={"Hf_chan_2": {"unit": "m/s^2", "coherence": "Hf_coh_chan_2"}}, input_unit="N"
    )
    assert one.values.shape == (1, 1, 1601) and one.frequency[1] == pytest.approx(0.3125)
    assert "the coherence of 'Hf_chan_2' is not between 0 and 1 at 5 lines" in "\n".join(one.notes)
    assert one.coherence is not None and int(np.isnan(one.coherence).sum()) == 5
    near = one.between(205.0, 220.0)  # published: 212.0925 Hz
    assert near.frequency[np.abs(near.values[0, 0]).argmax()] == pytest.approx(212.09, abs=0.3125)
    records = read_measurement(REAL / "vtb_case1.mat", channels={"Time_chan_1": "N", "Time_chan_2": "g"})
    assert records.count == 4096 and records.drive == "Time_chan_1"
    other = read_response(REAL / "cued_transfer_function_clean.mat", channels={"yspec": "m/s^2/N"})
    assert other.frequency[1] == pytest.approx(0.33336667)
    near = other.between(600.0, 620.0)  # published: 608.920 Hz
    assert near.frequency[np.abs(near.values[0, 0]).argmax()] == pytest.approx(608.92, abs=0.33)


def test_hdf5_with_attributes(tmp_path):
    path = tmp_path / "record.h5"
    with h5py.File(path, "w") as file:
        group = file.create_group("run")
        group["time"] = 1e3 * TIME
        group["time"].attrs["unit"] = "ms"
        group["tip"] = TIP
        group["tip"].attrs.update({"units": "mm/s", "point": "tip left", "noise": 0.5, "full_scale": 10.0})
        group["volts"] = VOLTS
        group["volts"].attrs["units"] = "V"
        group["H"] = RESPONSE
        group["f"] = LINES
    record = read_measurement(path)
    check(record, "run/tip", "run/volts")
    channel = record.channel("run/tip")
    assert (channel.at, channel.noise, channel.full_scale) == ("tip left", 0.5e-3, 10e-3)
    assert read_response(path, channels={"run/H": "m/s/V"}).values[0, 0] == pytest.approx(RESPONSE)


def test_netcdf_with_named_points(tmp_path):
    path = tmp_path / "record.nc"
    with h5netcdf.File(path, "w") as file:
        file.dimensions = {"time": 200, "point": 2, "width": 3}
        file.create_variable("time", ("time",), float, data=TIME).attrs["units"] = "s"
        names = np.array([list("tip"), list("hip")], dtype="S1")
        file.create_variable("point", ("point", "width"), "S1", data=names)
        table = np.column_stack([TIP, 2 * TIP])
        file.create_variable("velocity", ("time", "point"), float, data=table).attrs["units"] = "mm/s"
        file.create_variable("volts", ("time",), float, data=VOLTS).attrs["units"] = "V"
    record = read_measurement(path)
    check(record, "velocity/tip", "volts")
    assert record["velocity/hip"] == pytest.approx(2e-3 * TIP)


def test_tdms_without_its_library_says_what_to_do(tmp_path, monkeypatch):
    path = tmp_path / "record.tdms"
    next(case for case in tdms_files.CASES if case.name == "writer.tdms").write(path)
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(ts.InputError, match=r"install it with pip install nptdms, or export the file as LVM"):
        read_measurement(path)


@pytest.mark.parametrize("kind", ["mat", "struct", "plain", "hdf", "mat73"])
def test_files_that_unpack_to_too_much_are_refused_before_that(tmp_path, monkeypatch, kind):
    monkeypatch.setattr(raw, "MOST_VALUES", 1000)
    file = tmp_path / f"big.{'h5' if kind == 'hdf' else 'mat'}"
    zeros = np.zeros(1200)
    if kind in ("mat", "struct", "plain"):
        content = {"s": {"tip": zeros, "fs": 1e3}} if kind == "struct" else {"tip": zeros, "fs": 1e3}
        savemat(file, content, do_compression=kind != "plain")
    elif kind == "hdf":
        with h5py.File(file, "w") as opened:
            opened.create_dataset("tip", shape=(10**11,), dtype="f8", compression="gzip")
    else:
        matlab_7_3(file, {"tip": zeros})
    monkeypatch.setattr("scipy.io.loadmat", None)  # nothing is unpacked
    with pytest.raises(ts.InputError, match=rf"^{file.name} holds .* values, and at most 1e\+03 are read"):
        read_measurement(file)


def hdf(path: Path, *, attributes: dict | None = None, **arrays) -> Path:
    """An HDF5 file of a velocity, of what its attributes say, and of further arrays."""
    with h5py.File(path, "w") as file:
        values = arrays.pop("velocity", TIP)
        file.create_dataset("velocity", data=values).attrs.update({"units": "m/s", **(attributes or {})})
        for name, given in arrays.items():
            file[name] = given
    return path


def test_one_data_set_that_cannot_be_read_loses_no_other(tmp_path):
    path = hdf(tmp_path / "record.h5", time=TIME)
    with h5py.File(path, "a") as file:
        made = file.create_dataset("odd", data=np.arange(1000.0), chunks=(100,), compression="gzip")
        place = made.id.get_chunk_info(0).byte_offset
    content = bytearray(path.read_bytes())
    content[place : place + 20] = b"\xff" * 20
    path.write_bytes(content)
    record = read_measurement(path)
    assert record["velocity"] == pytest.approx(TIP)
    assert any("not used: 'odd', which cannot be read" in note for note in record.notes)


def mat_object(kind: str, name: bytes = b"label") -> bytes:
    """A variable of MATLAB's own class, as version 5 files hold it."""

    def element(number: int, data: bytes) -> bytes:
        return struct.pack("<II", number, len(data)) + data + b"\0" * (-len(data) % 8)

    inner = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 6, 1)) + element(1, b"")
    inner = element(14, inner + element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1)))
    words = element(1, name) + element(1, b"MCOS") + element(1, kind.encode())
    return element(14, element(6, struct.pack("<II", 17, 0)) + words + inner)


@pytest.mark.parametrize("kind", ["string", "datetime", "timetable", "my_class"])
@pytest.mark.parametrize("compressed", [False, True])
def test_objects_lose_no_vectors(tmp_path, kind, compressed):
    path = tmp_path / "record.mat"
    savemat(path, {"t": TIME, "tip": TIP}, do_compression=compressed)
    thing = mat_object(kind)
    if compressed:
        packed = zlib.compress(thing)
        thing = struct.pack("<II", 15, len(packed)) + packed
    path.write_bytes(path.read_bytes() + thing)
    record = read_measurement(path, channels={"tip": "m/s"})
    assert record["tip"] == pytest.approx(TIP) and record.step == pytest.approx(1e-3)
    (said,) = [note for note in record.notes if "'label'" in note]
    assert f"not used: 'label', an object of MATLAB's class {kind}" in said


def test_version_7_3_has_cells_structures_and_objects_as_version_7(tmp_path):
    path = tmp_path / "record.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        kept = file.create_group("#refs#")

        def stored(name: str, values: np.ndarray) -> h5py.Reference:
            kept[name] = np.atleast_2d(values)
            kept[name].attrs["MATLAB_class"] = np.bytes_("double")
            return kept[name].ref

        def several(place: h5py.Group, name: str, *references: h5py.Reference, kind: str = "") -> None:
            place[name] = np.array([references], dtype=h5py.ref_dtype)
            if kind:
                place[name].attrs["MATLAB_class"] = np.bytes_(kind)

        several(file, "cells", stored("a", TIME), stored("b", TIP), kind="cell")
        runs = file.create_group("runs")
        runs.attrs["MATLAB_class"] = np.bytes_("struct")
        several(runs, "t", stored("c", TIME), stored("d", 2 * TIME))
        several(runs, "v", stored("e", TIP), stored("f", 2 * TIP))
        file["label"] = np.array([[0xDD000000, 2, 1, 1, 1, 1]], dtype=np.uint32)
        file["label"].attrs["MATLAB_class"] = np.bytes_("datetime")
        file["label"].attrs["MATLAB_object_decode"] = np.int32(3)
        sparse = file.create_group("sparse")
        sparse.attrs.update({"MATLAB_sparse": np.uint64(3), "MATLAB_class": np.bytes_("double")})
        sparse["data"], sparse["ir"], sparse["jc"] = [5.0, 7.0], np.array([0, 2], "u8"), np.array([0, 1, 1, 2, 2], "u8")
        file["#subsystem#/MCOS"] = np.zeros(3)
    record = read_measurement(path, channels={"cells/2": "m/s"}, axis="cells/1")
    assert record["cells/2"] == pytest.approx(TIP)
    second = read_measurement(path, channels={"runs/2.v": "m/s"}, axis="runs/2.t")
    assert second["runs/2.v"] == pytest.approx(2 * TIP) and second.step == pytest.approx(2e-3)
    assert "not used: 'label', an object of MATLAB's class datetime" in "\n".join(record.notes)
    found = {one.name: one.values for one in content_of(path).series}
    assert found["sparse/1"].tolist() == [5.0, 0.0, 0.0, 0.0] and found["sparse/3"].tolist() == [0.0, 0.0, 7.0, 0.0]
    assert not any("#" in name for name in found)


def test_responses_without_a_unit_ask_for_theirs(tmp_path):
    savemat(tmp_path / "plate.mat", {"f": LINES, "H": RESPONSE, "coherence": np.ones(50)})
    with pytest.raises(ts.InputError, match="nothing says of the response 'H' what it is of") as caught:
        ts.modes(tmp_path / "plate.mat")
    assert "'f'" not in str(caught.value)
    shown = ts.show(tmp_path / "plate.mat")
    assert [one["name"] for one in shown.to_dict()["series"]] == ["f", "H", "coherence"]
    assert "nothing says of the response 'H'" in "\n".join(shown.remarks)


def test_many_series_of_which_the_same_is_said_are_one_sentence(tmp_path):
    series = {f"ch{k:02d}": np.sin(k * LINES) for k in range(1, 21)}
    label = np.array([f"label {k}" for k in range(300)], dtype=object)
    savemat(tmp_path / "many.mat", {"t": LINES, "label": label, **series})
    with pytest.raises(ts.InputError) as caught:
        ts.read_measurement(tmp_path / "many.mat")
    unknown, *_ = caught.value.problems
    assert "nothing says what channels 'ch01', 'ch02', " in unknown and "'ch12' and 8 more measure; give" in unknown
    assert "'label/12' and 288 more" in str(caught.value) and "'label/13'" not in str(caught.value)
    savemat(tmp_path / "plate.mat", {"f": LINES, "H1": RESPONSE, "H2": RESPONSE})
    with pytest.raises(ts.InputError, match="of the responses 'H1', 'H2' what they are of"):
        ts.modes(tmp_path / "plate.mat")


def test_a_table_of_records_is_its_columns(tmp_path):
    path = tmp_path / "record.h5"
    table = np.zeros(200, dtype=[("time", "f8"), ("velocity", "f4"), ("state", "S3")])
    table["time"], table["velocity"] = TIME, TIP
    with h5py.File(path, "w") as file:
        file["log"] = table
    shown = ts.show(path).to_dict()
    assert [(one["name"], one["values"]) for one in shown["series"]] == [("log/time", 200), ("log/velocity", 200)]
    record = read_measurement(path, channels={"log/velocity": "mm/s"})
    assert record["log/velocity"] == pytest.approx(1e-3 * TIP, rel=1e-6)
    with h5py.File(path, "a") as file:
        file["log"].attrs["units"] = ["ms", "mm/s", ""]
    assert read_measurement(path).step == pytest.approx(1e-6)


def damaged(content: bytes, number: int) -> bytes:
    """The content of a file cut, or with some bytes changed."""
    random = np.random.default_rng(number)
    if number % 3 == 0:
        return content[: random.integers(1, len(content))]
    changed = bytearray(content)
    for _ in range(number % 5 + 1):
        changed[random.integers(len(changed))] = random.integers(256)
    return bytes(changed)


@pytest.mark.parametrize("name", ["a.mat", "packed.mat", "four.mat", "a.h5", "a.nc", "a.uff"])
def test_damage_is_told_and_ends_nothing(tmp_path, name):
    path = tmp_path / name
    content = {"t": TIME, "tip": TIP, "cells": np.array([TIME, "x"], dtype=object), "one": {"deep": TIP}}
    if name == "four.mat":
        savemat(path, {"t": TIME, "tip": TIP}, format="4")
    elif name.endswith(".mat"):
        savemat(path, content, do_compression=name == "packed.mat")
    elif name == "a.h5":
        hdf(path, time=TIME, attributes={"scale_factor": 2.0})
    elif name == "a.nc":
        with netcdf_file(str(path), "w") as file:
            file.createDimension("time", 200)
            file.createVariable("tip", "d", ("time",))[:] = TIP
    else:
        path.write_bytes(function58(TIP, 1, 3) + function58(TIP, 2, 3, double=True, order="<") + units164(5, 1e3, 1e3))
    whole = path.read_bytes()
    refused = 0
    for number in range(40):
        path.write_bytes(damaged(whole, number))
        try:
            content_of(path)
        except ts.InputError:
            refused += 1
    assert refused >= 5


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_matlab_vectors(tmp_path, version):
    content = {"t": TIME, "tip": TIP, "volts": VOLTS, "H": RESPONSE, "f": LINES, "fs": np.array(1000.0)}
    path = tmp_path / "record.mat"
    if version == "5":
        savemat(path, {**content, "remark": "hi"})
    else:
        matlab_7_3(path, content)
    record = read_measurement(path, channels={"tip": "mm/s", "volts": "V"})
    check(record, "tip", "volts")
    notes = "\n".join(record.notes)
    assert "not used, since no time series: 'H'" in notes and "not used: 'remark'" in notes
    response = read_response(path, channels={"H": "m/s/N"})
    assert response.values[0, 0] == pytest.approx(RESPONSE)
    assert response.frequency == pytest.approx(LINES)


def test_numbers_that_may_have_to_be_multiplied_are_told(tmp_path):
    record = read_measurement(hdf(tmp_path / "record.h5", attributes={"gain": 0.5, "offset": 0.0}, time=TIME))
    said = [note for note in record.notes if "attribute" in note]
    assert said == ["record.h5: 'velocity' has the attribute gain = 0.5, which is of no convention and is not applied"]
