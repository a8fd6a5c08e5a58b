"""Normal modes of universal files as a structure, and as the modes of a walker's body."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyuff

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.formats.universal import AtNodes, data_sets
from tarsus.model.structure import Lumped, body_modes
from tarsus.modes import read_mode_table
from tarsus.modes.writing import write_shapes
from tarsus.records.measurement import Channel, FrequencyResponse, Quantity
from tarsus.records.readers import read_response

MASS = (3e-4, 6e-4, 3e-4)
BEAM = Lumped(
    coordinates=("front", "middle", "hind"),
    mass=("0.3 g", "0.6 g", "0.3 g"),
    stiffness=((400.0, -400.0, 0.0), (-400.0, 800.0, -400.0), (0.0, -400.0, 400.0)),
    damping_ratios=(0.0, 0.02, 0.02),
)
BENDING = (1.0, -1.0, 1.0)
"""Its highest mode: ends against the middle, omega^2 = 400/0.3e-3 + 400/0.3e-3."""


def shape_set(values: np.ndarray, analysis: int, number: int = 1, **more: Any) -> Any:
    """A data set 55 of a shape along Z at the nodes 1, 2 and 7."""
    return pyuff.prepare_55(
        model_type=1,
        **{f"id{k}": "NONE" for k in range(1, 6)},
        analysis_type=analysis,
        data_ch=2,
        spec_data_type=8,
        data_type=2 if analysis == 2 else 5,
        n_data_per_node=3,
        r1=0 * values,
        r2=0 * values,
        r3=values,
        load_case=1,
        mode_n=number,
        node_nums=[1, 2, 7],
        modal_b=0j,
        **more,
    )


def written(path: Path, *, masses: tuple[float, ...] = (1.2e-3,), analysis: int = 2, units: bool = False) -> Path:
    beam = {"freq": np.sqrt(800.0 / 3e-4) / (2.0 * np.pi), "modal_damp_vis": 0.02, "modal_damp_his": 0.0}
    sets = [
        shape_set(np.array(BENDING), analysis, number, modal_m=mass, eig=1j, modal_a=0j, **beam)
        for number, mass in enumerate(masses, 1)
    ]
    if units:  # millimetres and newton: masses in tonnes
        scale = {"length": 1e3, "force": 1.0, "temp": 1.0, "temp_offset": 0.0}
        sets.insert(0, pyuff.prepare_164(units_code=9, units_description="mm", temp_mode=1, **scale))
    for number, one in enumerate(sets):
        pyuff.UFF(str(path)).write_sets(one, "add" if number else "overwrite")
    return path


@pytest.mark.parametrize("units", [False, True])
def test_table_gives_the_body_its_matrices_give(tmp_path: Path, units: bool) -> None:
    mass = 1.2e-3 * (1e-3 if units else 1.0)
    structure = read_mode_table(written(tmp_path / "beam.unv", masses=(mass,), units=units))
    assert structure.points == ("1_Z", "2_Z", "7_Z")
    (mode,) = body_modes(structure, 10.0, {"LF": "1_Z", "LH": "7_Z", "bag": "2_Z"}).values()
    known = body_modes(BEAM, 10.0, {"LF": "front", "LH": "hind", "bag": "middle"})["mode2"]
    assert mode.frequency == pytest.approx(known.frequency, rel=1e-5)  # five digits in the file
    assert mode.mass == pytest.approx(known.mass, rel=1e-5)
    assert mode.damping_ratio == pytest.approx(known.damping_ratio)
    sign = np.sign(mode.upward["LF"] * known.upward["LF"])
    assert {name: sign * one for name, one in mode.upward.items()} == pytest.approx(known.upward)


def test_tables_that_say_too_little(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="mode 2 has no modal mass"):
        read_mode_table(written(tmp_path / "a.unv", masses=(1e-3, 0.0)))
    with pytest.raises(InputError, match=r"mode 1 is complex \(analysis type 3\) and has no modal mass"):
        read_mode_table(written(tmp_path / "b.unv", analysis=3))
    with pytest.raises(InputError, match="holds no normal modes and no complex ones"):
        read_mode_table(written(tmp_path / "d.unv", analysis=7))
    (tmp_path / "c.unv").write_text("f,m\n1,2\n")
    with pytest.raises(InputError, match="no universal file"):
        read_mode_table(tmp_path / "c.unv")
    with pytest.raises(InputError, match="cannot be read"):
        read_mode_table(tmp_path / "none.unv")


def beam() -> FrequencyResponse:
    """Exact responses to a force along -Z at node 1: accelerations of node 1 along Z, node 2 along -Z and node 1 along
    X, and the angle of node 2 about -X."""
    lines = np.arange(1.0, 400.0, 0.5)
    s = 2.0j * np.pi * lines
    values = np.zeros((4, 1, len(lines)), dtype=complex)
    for f, shape in zip(FREQUENCIES, SHAPES, strict=True):
        w = 2.0 * np.pi * f
        values[:, 0] -= (SIGNS * shape * shape[0])[:, None] * s**2 / (s**2 + 0.02 * w * s + w**2)
    values[3] /= s**2
    names = ("1+Z", "2-Z", "1+X", "2-RX")
    quantities = (Quantity.ACCELERATION,) * 3 + (Quantity.ANGLE,)
    channels = tuple(Channel(name, one, name) for name, one in zip(names, quantities, strict=True))
    return FrequencyResponse(channels, (Channel("1-Z", Quantity.FORCE),), lines, values)


FREQUENCIES = (80.0, 230.0)
SHAPES = np.array([[1.0, 2.0, 0.5, -3.0], [2.0, -1.0, 1.0, 4.0]])
"""Mass-normalised, along positive axes [1, 1, 1, rad a metre]."""
SIGNS = np.array([1.0, -1.0, 1.0, -1.0])


@pytest.mark.parametrize("count", [3, 4], ids=["translations", "with a rotation"])
def test_directions_of_measured_modes_reach_shapes_files_and_structure(tmp_path: Path, count: int) -> None:
    whole = beam()
    fit = ts.modes(replace(whole, outputs=whole.outputs[:count], values=whole.values[:count]), band=(20.0, 350.0))
    assert fit.frf.outputs == ("1+Z", "2+Z", "1+X", "2+RX")[:count] and fit.frf.inputs == ("1+Z",)
    assert fit.frf.quantity is Quantity.ACCELERATION
    shapes, right = fit.shapes()[0], SHAPES[:, :count]
    assert shapes * np.sign(shapes[:, :1]) == pytest.approx(right, rel=1e-3)
    structure = fit.structure()
    assert structure.points == ("1_Z", "2_Z", "1_X", "2_RX")[:count]
    written_sets = data_sets("", write_shapes(fit, tmp_path / "shapes.unv").read_bytes())
    for one, shape in zip(written_sets, right, strict=True):
        assert isinstance(one, AtNodes)
        scaled = shape / shape[np.argmax(np.abs(shape))]
        table = np.zeros((2, 3 if count == 3 else 6))
        table[[0, 1, 0, 1][:count], [2, 2, 0, 3][:count]] = scaled
        assert one.nodes == (1, 2) and one.values == pytest.approx(table, abs=2e-3)
    back = read_mode_table(tmp_path / "shapes.unv")
    assert set(back.points) == set(structure.points)
    assert back.frequencies == pytest.approx(structure.frequencies, rel=1e-5)
    assert back.damping_ratios == pytest.approx(structure.damping_ratios, rel=1e-4)
    for point in structure.points:  # the same displacement by the same force
        mine, theirs = (one.row(point) / np.sqrt(one.modal_masses) for one in (structure, back))
        assert np.abs(theirs) == pytest.approx(np.abs(mine), rel=1e-3)


def test_a_complex_shape_is_no_mode_of_a_structure(tmp_path: Path) -> None:
    path = tmp_path / "shapes.unv"
    turning = np.array([1.0, 1.0j, -1.0])
    pyuff.UFF(str(path)).write_sets(shape_set(turning, 3, eig=-1.0 + 100.0j, modal_a=200.0j), "overwrite")
    with pytest.raises(InputError, match="mode 1 is complex: its points do not move in one phase"):
        read_mode_table(path)
    with pytest.raises(InputError, match=r"1 complex modes \(tarsus\.modes\.read_mode_table reads them"):
        read_response(path)


@pytest.mark.parametrize("width", [3, 6])
def test_results_of_an_analysis_are_a_table_of_modes(tmp_path: Path, width: int) -> None:
    """Data sets 2414 at nodes, as finite elements programs write them, beside stresses and results on elements."""
    common = {
        "analysis_dataset_label": 1,
        "analysis_dataset_name": "modes",
        "id1": "NONE",
        "id2": "NONE",
        "id3": "NONE",
        "id4": "NONE",
        "id5": "NONE",
        "model_type": 1,
        "analysis_type": 2,
        "data_characteristic": 2,
        "data_type": 2,
        "number_of_data_values_for_the_data_component": width,
    }
    shapes = [np.eye(3, width) * k for k in (1.0, 2.0)]
    sets = []
    for number, (shape, frequency) in enumerate(zip(shapes, (100.0, 250.0), strict=True), 1):
        head = {"record10_field6": number, "record12_field2": frequency}
        head |= {"record12_field4": 0.5, "record12_field5": 0.01}
        nodes = {"node_nums": np.array([1, 2, 3]), "data_at_node": list(shape)}
        sets += [
            {"type": 2414, **common, **head, "dataset_location": 1, "result_type": kind, **nodes} for kind in (8, 2)
        ]
    elements = {"element_nums": np.array([1]), "data_at_element": [np.array([1.0])]}
    sets.append({"type": 2414, **common, "dataset_location": 2, "result_type": 8, **elements})
    path = tmp_path / "modes.unv"
    pyuff.UFF(str(path)).write_sets(sets, "add")
    table = read_mode_table(path)
    assert table.frequencies == (100.0, 250.0) and table.modal_masses == (0.5, 0.5)
    assert table.damping_ratios == (0.01, 0.01)
    assert table.shapes == {"1_X": (1.0, 2.0), "2_Y": (1.0, 2.0), "3_Z": (1.0, 2.0)}
    with pytest.raises(InputError, match=r"(?s)2 normal modes .*3 results of an analysis \(data set 2414\)"):
        read_response(path)
