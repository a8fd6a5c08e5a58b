"""Modes as files: JSON, CSV, and a universal file of their shapes (data sets 55) that other programs draw."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.files.jsontext import json_text
from tarsus.files.whole import write_text
from tarsus.measure.mac import mac
from tarsus.modes.modal import ModalFit
from tarsus.tables.table import Column, Table

MODES_FILES = ("modes.json", "modes.csv", "shapes.unv", "report.html")
"""Everything that `tarsus modes` leaves in its folder, with its report."""

_DIRECTION = re.compile(r"^(\d+)([+-]?)([XYZ]?)$")
"""A degree of freedom of a universal file, such as 12+Z: node and direction."""


def summary_of(fit: ModalFit, sources: tuple[str, ...] = ()) -> dict[str, Any]:
    """Everything found as plain data; shapes real and imaginary, as `ModalFit.complex_shapes` scales them."""
    shapes = fit.complex_shapes()
    return {
        "sources": list(sources),
        "points": list(fit.frf.outputs),
        "drives": list(fit.frf.inputs),
        "band_hz": [float(fit.frf.frequency[0]), float(fit.frf.frequency[-1])],
        "delay_s": fit.delay,
        "misfit": fit.misfit,
        "modes": [
            {
                "frequency_hz": mode.frequency.value,
                "frequency_interval_hz": [mode.frequency.low, mode.frequency.high],
                "damping_ratio": mode.damping.value,
                "damping_interval": [mode.damping.low, mode.damping.high],
                "basis": mode.basis.value,
                "tilt_deg": float(np.degrees(mode.tilt)),
                "collinearity": mode.collinearity,
                "orders": mode.orders,
                "verdict": mode.verdict.value,
                "reason": mode.reason,
                "shape_real": shape.real.tolist(),
                "shape_imaginary": shape.imag.tolist(),
            }
            for mode, shape in zip(fit.modes, shapes, strict=True)
        ],
        "auto_mac": fit.mac().tolist(),
        "remarks": list(fit.remarks),
    }


def write_modes(fit: ModalFit, folder: Path, sources: tuple[str, ...] = ()) -> list[Path]:
    """Write modes.json, modes.csv and shapes.unv into a folder, and return their paths.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    numbers, table, shapes = (folder / name for name in MODES_FILES[:3])
    write_text(numbers, json_text(summary_of(fit, sources)) + "\n")
    write_text(table, fit.table().csv())
    write_shapes(fit, shapes)
    return [numbers, table, shapes]


def write_shapes(fit: ModalFit, path: Path) -> Path:
    """Write the complex shapes of all modes as data sets 55 (complex eigenvalues of first order), by pyuff.

    Points named as degrees of freedom of universal files, such as ``12+Z``, keep node and direction; the others are
    numbered from 1 along x.
    """
    import pyuff

    places = [_DIRECTION.match(name) for name in fit.frf.outputs]
    known = all(places)
    nodes, axes, signs = [], [], []
    for k, place in enumerate(places):
        nodes.append(int(place[1]) if known and place else k + 1)
        axes.append("XYZ".index(place[3] or "X") if known and place else 0)
        signs.append(-1.0 if known and place and place[2] == "-" else 1.0)
    numbers = sorted(set(nodes))
    path.unlink(missing_ok=True)
    file = pyuff.UFF(str(path))
    for number, (mode, shape) in enumerate(zip(fit.modes, fit.complex_shapes(), strict=True), start=1):
        table = np.zeros((3, len(numbers)), dtype=complex)
        for node, axis, sign, value in zip(nodes, axes, signs, shape, strict=True):
            table[axis, numbers.index(node)] = sign * value
        file.write_sets(
            pyuff.prepare_55(
                model_type=1, id1=f"mode {number}", id2=mode.verdict.value, id3="NONE", id4="NONE", id5="NONE",
                analysis_type=3, data_ch=2, spec_data_type=8, data_type=5, n_data_per_node=3,
                r1=table[0], r2=table[1], r3=table[2], load_case=1, mode_n=number,
                eig=complex(mode.pole), modal_a=0.0j, modal_b=0.0j, node_nums=numbers,
            ),
            "add",
        )  # fmt: skip
    return path


def compared(fit: ModalFit, other: Mapping[str, Any]) -> Table:
    """Modes beside those of an earlier set (`summary_of`), paired by MAC at the points that both have.

    Raises
    ------
    InputError
        Where the sets share no point, or the other is no file of `tarsus modes`.
    """
    try:
        names, earlier = list(other["points"]), list(other["modes"])
        shapes = np.array([np.add(m["shape_real"], 1.0j * np.array(m["shape_imaginary"])) for m in earlier])
    except (KeyError, TypeError, ValueError, IndexError):
        raise InputError("the set to compare with is no modes.json of `tarsus modes`") from None
    shared = [name for name in fit.frf.outputs if name in names]
    if not shared or not len(shapes):
        raise InputError(f"the sets share no point: {', '.join(fit.frf.outputs)} and {', '.join(names)}")
    own = fit.complex_shapes()[:, [fit.frf.outputs.index(name) for name in shared]]
    likeness = np.atleast_2d(mac(own.T, shapes[:, [names.index(name) for name in shared]].T))
    rows = []
    for mode, row in zip(fit.modes, likeness, strict=True):
        f = mode.frequency.value
        near = [abs(one["frequency_hz"] / f - 1.0) for one in earlier]
        k = int(np.argmax(row - np.array(near)))  # one point has the same shape in all modes
        there = earlier[k]
        rows.append(
            (f, there["frequency_hz"], 100.0 * (f / there["frequency_hz"] - 1.0), mode.damping.value,
             there["damping_ratio"], float(row[k]))
        )  # fmt: skip
    columns = (
        Column("here", "Hz", 6, over="frequency"), Column("there", "Hz", 6, over="frequency"),
        Column("change (%)", digits=3), Column("here", "%", 3, over="damping ratio"),
        Column("there", "%", 3, over="damping ratio"), Column("MAC", digits=3),
    )  # fmt: skip
    return Table("", columns, rows, (f"shapes compared at {len(shared)} points",))
