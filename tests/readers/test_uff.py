"""The reader of universal files, on files that pyuff writes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import pyuff

from tarsus.formats.uff import SystemOfUnits, _nodal, _reference
from tarsus.formats.universal import AtNodes, _at_nodes, _binary, _columns, _floats
from tarsus.records.measurement import Quantity
from tarsus.records.readers import read_measurement, read_response

RANDOM = np.random.default_rng(1)
LINES = 2.0 + 0.5 * np.arange(40)
TIMES = 1e-4 * np.arange(300)
H = RANDOM.normal(size=(2, 40)) + 1j * RANDOM.normal(size=(2, 40))


def write(path, sets):
    """A new file; pyuff's own mode "overwrite" writes a mark too many before binary data."""
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets(sets, mode="add")
    return path


def function(data: np.ndarray, x: np.ndarray, kind: int, node: int, **more: Any) -> dict[str, Any]:
    given = {
        "binary": 0,
        "func_type": kind,
        "rsp_node": node,
        "rsp_dir": 3,
        "ref_node": 1,
        "ref_dir": -3,
        "data": data,
        "x": x,
        "abscissa_spacing": 1,
        "abscissa_spec_data_type": 17 if kind == 1 else 18,
        "ordinate_spec_data_type": 11,
        "orddenom_spec_data_type": 13 if kind == 4 else 0,
    }
    return pyuff.prepare_58(**{**given, **more})


def units(code: int, length: float, force: float) -> dict[str, Any]:
    return pyuff.prepare_164(
        units_code=code, units_description="units", temp_mode=1, length=length, force=force, temp=1.0, temp_offset=0.0
    )


def test_responses_with_coherence(tmp_path):
    sets = [function(H[i], LINES, 4, i + 1, abscissa_spacing=0) for i in range(2)]
    sets.append(function(np.full(40, 0.9), LINES, 6, 2, abscissa_spacing=0))
    response = read_response(write(tmp_path / "frf.uff", sets))
    assert [one.name for one in response.outputs] == ["1+Z", "2+Z"] == [one.at for one in response.outputs]
    assert [(one.name, one.quantity) for one in response.inputs] == [("1-Z", Quantity.FORCE)]
    assert response.unit == (("m/s / N",), ("m/s / N",))
    assert response.frequency == pytest.approx(LINES, rel=1e-5)
    assert response.values[:, 0] == pytest.approx(H, rel=1e-11)
    assert response.coherence is not None
    assert response.coherence[1, 0] == pytest.approx(np.full(40, 0.9))
    assert np.all(np.isnan(response.coherence[0]))


def test_several_inputs_make_a_matrix_or_say_what_is_missing(tmp_path):
    sets = [function(H[i] + 10 * j, LINES, 4, i + 1, ref_node=j) for i in range(2) for j in (7, 8)]
    path = write(tmp_path / "frf.uff", sets)
    response = read_response(path)
    assert response.values.shape == (2, 2, 40)
    assert response.values[1, 1] == pytest.approx(H[1] + 80)
    assert read_response(path, inputs=["8-Z"]).values.shape == (2, 1, 40)
    write(path, sets[:3])
    assert read_response(path, inputs=["7-Z"]).values.shape == (2, 1, 40)


def test_what_is_no_time_series_is_noted_and_a_force_drives(tmp_path):
    sets = [
        units(5, 1000.0, 1000.0),
        function(np.arange(300.0), TIMES, 1, 4, binary=1, rsp_dir=4),
        function(np.sin(1e3 * TIMES), TIMES, 1, 9, binary=1, ordinate_spec_data_type=13),
        function(np.ones(40), LINES, 2, 4),
        {"type": 15} | {key: [1.0] for key in ("node_nums", "def_cs", "disp_cs", "color", "x", "y", "z")},
    ]
    record = read_measurement(write(tmp_path / "time.unv", sets))
    assert record.names == ("4+RX", "9+Z") and record.drive == "9+Z"
    assert record["4+RX"] == pytest.approx(np.arange(300.0))  # an angular velocity has no unit of length
    assert record["9+Z"] == pytest.approx(1e-3 * np.sin(1e3 * TIMES))
    notes = "\n".join(record.notes)
    assert "not used: 1 auto spectra" in notes and "not used: 1 tables of nodes (data set 15)" in notes


@pytest.mark.parametrize(
    "label, system",
    [("mm/s", True), ("g", False), ("thumbs", False)],
    ids=["against data set 164", "another quantity", "no unit"],
)
def test_a_label_at_odds_with_the_data_type_is_not_relied_on(tmp_path, label, system):
    velocity = RANDOM.normal(size=300)
    sets = [units(1, 1.0, 1.0)] * system
    sets += [function(velocity, TIMES, 1, 1, ordinate_axis_units_lab=label)]
    path = write(tmp_path / "time.uff", sets)
    chosen = read_measurement(path, channels={"1+Z": "mm/s"})
    assert chosen["1+Z"] == pytest.approx(1e-3 * velocity)
    said = f"'1+Z' is labelled '{label}', but its data type and the file's units say 1 m/s: neither is relied on"
    assert said in "\n".join(chosen.notes)


def test_the_unit_of_a_ratio_stands_at_the_ordinate_and_units_that_contradict_themselves_are_not_relied_on(tmp_path):
    data = function(H[0], LINES, 4, 1, ordinate_spec_data_type=12, ordinate_axis_units_lab="g/N")
    read = read_response(write(tmp_path / "frf.uff", [data]))
    assert read.unit == (("m/s^2 / N",),) and read.values[0, 0] == pytest.approx(9.80665 * H[0])
    sets = [units(1, 3.28083989501312334, 0.224808943099710480), function(RANDOM.normal(size=300), TIMES, 1, 1)]
    notes = read_measurement(write(tmp_path / "time.uff", sets), channels={"1+Z": "m/s"}).notes
    assert "said to be SI (data set 164), but with 3.28084 units of length a metre" in "\n".join(notes)


def at_nodes(path, shapes: np.ndarray, **more: Any):
    """Data at the nodes 3 and 5 by frequency from 100 Hz on; shapes (nf, directions, 2), in no order of the file."""
    width = shapes.shape[1]
    common = {"model_type": 1, "analysis_type": 5, "spec_data_type": 11, "n_data_per_node": width, "load_case": 1}
    sets = [
        pyuff.prepare_55(
            **common,
            **more,
            freq_step_n=k,
            freq=100.0 + k,
            node_nums=[3, 5],
            **{f"r{i + 1}": row for i, row in enumerate(shapes[k])},
        )
        for k in np.roll(np.arange(len(shapes)), 1).tolist()
    ]
    return write(path, sets)


def test_data_at_nodes_by_frequency(tmp_path):
    shapes = np.zeros((3, 3, 2), dtype=complex)
    shapes[:, 2] = [[1.0 + k, 2.0j] for k in range(3)]
    response = read_response(at_nodes(tmp_path / "ods.uff", shapes, data_ch=2), input_unit="V")
    assert [one.name for one in response.outputs] == ["3+Z", "5+Z"]
    assert response.frequency.tolist() == [100.0, 101.0, 102.0]
    assert response.values[0, 0] == pytest.approx([1.0, 2.0, 3.0])
    assert response.values[1, 0] == pytest.approx([2j, 2j, 2j])
    assert response.unit == (("m/s / V",), ("m/s / V",))


def test_rotations_and_the_input_of_data_at_nodes(tmp_path):
    shapes = np.zeros((2, 6, 2))
    shapes[:, 1], shapes[:, 4] = [1.0, 2.0], [[1.0, 2.0], [2.0, 4.0]]
    read = read_response(at_nodes(tmp_path / "ods.uff", shapes, data_ch=3, id5=f"{7:10d}{-3:10d}{11:10d}{13:10d}"))
    assert [one.name for one in read.outputs] == ["3+Y", "5+Y", "3+RY", "5+RY"]
    assert [one.quantity.unit for one in read.outputs] == ["m/s", "m/s", "rad/s", "rad/s"]
    assert [(one.name, one.quantity.unit) for one in read.inputs] == [("7-Z", "N")]
    assert read.values[3, 0] == pytest.approx([2.0, 4.0])


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_units_with_signs_beyond_ascii(tmp_path, encoding):
    lines = [
        "    -1",
        "    58",
        *["NONE"] * 5,
        "    4         0    0         0 NONE               2   3 NONE               1   3",
        "         5         4         1  0.00000E+00  5.00000E-01  0.00000E+00",
        "        18    0    0    0 NONE                 Hz",
        "         1    0    0    0 Frequency Function   (1/N)*(mm/s\N{SUPERSCRIPT TWO})",
        *["         0    0    0    0 NONE                 NONE"] * 2,
        "  1.00000E+00  0.00000E+00  2.00000E+00  1.00000E+00  3.00000E+00 -1.00000E+00",
        "  4.00000E+00  5.00000E-01",
        "    -1",
    ]
    path = tmp_path / "response.uff"
    path.write_bytes(("\n".join(line.ljust(80) for line in lines) + "\n").encode(encoding))
    read = read_response(path)
    assert read.outputs[0].quantity is Quantity.ACCELERATION and read.inputs[0].quantity is Quantity.FORCE
    assert read.values[0, 0] == pytest.approx(1e-3 * np.array([1.0, 2.0 + 1.0j, 3.0 - 1.0j, 4.0 + 0.5j]))
    assert read.frequency == pytest.approx([0.0, 0.5, 1.0, 1.5])


ROW = ["1.5", "-2.25", "3.0", "-4.5", "5.0", "6.0", "-7.0", "8.0"]


@pytest.mark.parametrize(
    "rows",
    [
        [
            "  1.50000D+00 -2.25000D+00  3.00000d+00 -4.50000D+00  5.00000D+00  6.00000D+00",
            " -7.00000D+00  8.00000D+00",
        ],
        [
            "-1.50000E+000-2.25000E+000 3.00000E+000-4.50000E+000 5.00000E+000 6.00000E+000",
            "-7.00000E+000 8.00000E+000",
        ],
        [" 1.5 -2.25 3 -4.5", "5 6 -7 8"],
        [
            "  1.50000E+00 -2.25000E+00  3.00000E+00 -4.50000E+00  5.00000E+00  6.00000-100",
            " -7.00000E+00  8.00000E+00",
        ],
    ],
    ids=["Fortran's D", "numbers that touch", "by words", "exponents of three digits"],
)
def test_numbers_as_fortran_and_others_write_them(tmp_path, rows):
    path = write(tmp_path / "time.uff", [function(np.zeros(8), TIMES[:8], 1, 1, ordinate_spec_data_type=11)])
    head = path.read_text().splitlines()[:13]
    head[8] = f"{2:10d}{8:10d}{1:10d}{0:13.5E}{1e-4:13.5E}{0:13.5E}"  # single precision
    path.write_text("\r\n".join([*head, *rows, "    -1"]) + "\r\n")
    right = np.array(ROW, dtype=float)
    right[0] *= -1.0 if rows[0][0] == "-" else 1.0
    right[5] = 6e-100 if "-100" in rows[0] else 6.0
    assert read_measurement(path)["1+Z"] == pytest.approx(right, rel=1e-12)


def responses_by(said: str, values: np.ndarray) -> AtNodes:
    return AtNodes(5, 8, ("", "", "", "", said), (1.0,), tuple(range(1, len(values) + 1)), values, None)


def test_data_at_nodes_of_one_number_have_no_direction_and_moments_have_no_newtons():
    (one,) = _nodal("x", [responses_by("3 -2 0 13", np.array([[2.0 + 0.0j]]))])
    assert (one.name, one.reference.name, one.reference.unit) == ("1", "3-Y", "N")
    assert _reference(responses_by("3 -5 0 13", np.zeros((1, 1))), SystemOfUnits()).unit == ""


def test_numbers_lie_where_their_heads_say():
    """Whole numbers of a head on two lines; columns of 13, 20 and 20 without blanks; abscissae of half the width."""
    lines = [*"abcde", "1 5 0 8 2 1", "8 1 1 1 1 1 1 1", "1 1", "12.5", "1 0.25"]
    found = _at_nodes(lines, None)
    assert (found.reals, found.nodes, found.values.tolist()) == ((12.5,), (1,), [[0.25]])
    text = f"{'1.00000E+00':>13}{'-1.50000000000-100':>20}{'-2.5000000000000-100':>20}"
    assert _floats(text, _columns(True, True, True)).tolist() == [1.0, -1.5e-100, -2.5e-100]
    mixed = np.array([(0.5, 1.25), (1.0, -2.0)], [("x", "<f4"), ("y", "<f8")]).tobytes()
    assert _binary("x", "1", b"58b 1 2", mixed, (True, True, 2, 2)).tolist() == [[0.5, 1.25], [1.0, -2.0]]
