"""The readers of MATLAB, HDF5, NetCDF and TDMS files, on files that their libraries write."""

from __future__ import annotations

import sys
from pathlib import Path

import h5netcdf
import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter
from scipy.io import netcdf_file, savemat

import tarsus as ts
from tarsus.formats import raw
from tarsus.records.measurement import Quantity
from tarsus.records.readers import read_measurement, read_response

TIME = 0.25 + 1e-3 * np.arange(200)
RANDOM = np.random.default_rng(2)
TIP, VOLTS = RANDOM.normal(size=200), np.sign(np.sin(40 * TIME))
LINES = np.arange(50.0)
RESPONSE = RANDOM.normal(size=50) + 1j * RANDOM.normal(size=50)
REAL = Path(__file__).parents[2] / "data" / "real"


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


def test_matlab_structures_tables_and_units(tmp_path):
    path = tmp_path / "record.mat"
    savemat(
        path, {"run": {"time": TIME[:, None], "ch": np.column_stack([TIP, VOLTS])}, "units": {"gain": "V"}}
    )
    with pytest.raises(ts.InputError, match=r"nothing says what channel 'run\.ch/1' measures"):
        read_measurement(path)
    record = read_measurement(
        path,
        channels={"run.ch/1": {"unit": "mm/s", "name": "tip", "noise": "2 um/s"}, "run.ch/2": {"unit": "V"}},
    )
    check(record, "tip", "run.ch/2")
    assert record.channel("tip").noise == pytest.approx(2e-6)
    savemat(
        path, {"time": TIME, "tip": TIP, "volts": VOLTS, "units": {"tip": "mm/s", "volts": "V", "time": "s"}}
    )
    check(read_measurement(path), "tip", "volts")


def test_times_at_odds_with_the_rate_are_refused_until_one_is_chosen(tmp_path):
    path = tmp_path / "record.mat"
    savemat(path, {"t": TIME, "tip": TIP, "fs": 1010.0})
    said = r"'fs' says one sample every 0\.000990099 s for 'tip', but the column 't' has one every 0\.001 s; say which"
    with pytest.raises(ts.InputError, match=said):
        read_measurement(path, channels={"tip": "m/s"})
    assert read_measurement(path, channels={"tip": "m/s"}, axis="t").step == pytest.approx(1e-3)
    assert read_measurement(path, channels={"tip": "m/s"}, step=1 / 1010).step == 1 / 1010
    savemat(path, {"tip": TIP, "fs": 1010.0})
    assert read_measurement(path, channels={"tip": "m/s"}).step == pytest.approx(1 / 1010)
    savemat(path, {"tip": TIP})
    with pytest.raises(ts.InputError, match="says neither times nor a sampling rate"):
        read_measurement(path, channels={"tip": "m/s"})


def test_vectors_of_another_length(tmp_path):
    path = tmp_path / "record.mat"
    units = {"tip": "mm/s", "volts": "V", "short": "V"}
    savemat(path, {"t": TIME, "tip": TIP, "volts": VOLTS, "short": VOLTS[:50], "units": units})
    record = read_measurement(path)
    check(record, "tip", "volts")
    assert "record.mat: channel 'short' has 50 samples where 't' has 200: not used" in record.notes
    with pytest.raises(ts.InputError, match="channel 'short' has 50 samples where 't' has 200"):
        read_measurement(path, channels=["tip", "short"])


def test_measured_responses_of_others():
    one = read_response(
        REAL / "vtb_case1.mat",
        channels={"Hf_chan_2": {"unit": "m/s^2", "coherence": "Hf_coh_chan_2"}},
        input_unit="N",
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
    with pytest.raises(ts.InputError, match="says no frequencies; give frequency_step"):
        read_response(REAL / "pyuff_meas_point_1.txt", channels={"column 1": "m/s^2/N"})


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


def test_a_run_that_tarsus_kept(tmp_path):
    from tarsus.files.series import Variable, write_netcdf

    variables = {
        "time": Variable(("time",), TIME, {"units": "s"}),
        "gap": Variable(("time", "foot"), np.column_stack([TIP, -TIP]), {"units": "m"}),
        "foot": Variable(("foot",), np.array(["left", "right"]), {}),
    }
    write_netcdf(variables, {}, tmp_path / "run.nc")
    record = read_measurement(tmp_path / "run.nc")
    assert record.names == ("gap/left", "gap/right") and record["gap/right"] == pytest.approx(-TIP)


def test_classic_netcdf(tmp_path):
    path = tmp_path / "record.nc"
    with netcdf_file(str(path), "w") as file:
        file.createDimension("time", 200)
        for name, values, unit in (("time", TIME, "s"), ("tip", TIP, "mm/s"), ("volts", VOLTS, "V")):
            variable = file.createVariable(name, "d", ("time",))
            variable[:] = values
            variable.units = unit
    check(read_measurement(path), "tip", "volts")


def tdms(path: Path) -> Path:
    with TdmsWriter(path) as writer:
        waveform = {"wf_increment": 1e-3, "wf_start_offset": 0.25}
        writer.write_segment(
            [
                ChannelObject("run", "tip", TIP, {**waveform, "unit_string": "mm/s"}),
                ChannelObject("run", "volts", VOLTS, {**waveform, "NI_UnitDescription": "Volts"}),
                ChannelObject("run", "remarks", ["a", "b"]),
            ]
        )
    return path


def test_tdms(tmp_path):
    record = read_measurement(tdms(tmp_path / "record.tdms"))
    check(record, "run/tip", "run/volts")
    assert "they hold no series of numbers: 'run/remarks'" in "\n".join(record.notes)


def test_tdms_without_its_library_says_what_to_do(tmp_path, monkeypatch):
    path = tdms(tmp_path / "record.tdms")
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(
        ts.InputError, match=r"install it with pip install 'tarsus\[tdms\]', or export the file as LVM"
    ):
        read_measurement(path)


def test_truncated_files_are_told(tmp_path):
    savemat(tmp_path / "five.mat", {"t": TIME, "tip": TIP})
    matlab_7_3(tmp_path / "seven.mat", {"t": TIME, "tip": TIP})
    tdms(tmp_path / "record.tdms")
    for name in ("five.mat", "seven.mat", "record.tdms"):
        path = tmp_path / name
        path.write_bytes(path.read_bytes()[:-700])
        with pytest.raises(ts.InputError, match=f"{name} is (damaged or )?truncated"):
            read_measurement(path, channels={"tip": "m/s"})


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


def test_a_file_larger_than_memory_takes_is_refused_unread(tmp_path):
    file = tmp_path / "sparse.mat"
    with file.open("wb") as opened:
        opened.write(b"MATLAB 5.0 MAT-file".ljust(126) + b"IM")
        opened.truncate(8 << 30)
    with pytest.raises(ts.InputError, match=r"^sparse\.mat is larger than the 2 GiB that are read"):
        read_measurement(file)
