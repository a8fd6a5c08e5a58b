"""Modes as files: JSON, CSV, and a universal file of their shapes (data sets 55) that other programs draw."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.arrays import Complexes
from tarsus.base.errors import InputError
from tarsus.files.jsontext import json_text
from tarsus.files.whole import write_text
from tarsus.formats.freedoms import component
from tarsus.measure.mac import mac
from tarsus.tables.table import Column, Table

if TYPE_CHECKING:
    from tarsus.modes.modal import ModalFit

MODES_FILES = ("modes.json", "modes.csv", "shapes.unv", "report.html")
"""Everything that `tarsus modes` leaves in its folder, with its report."""

_COMPLEX_MODES = 3
"""Code of an analysis of complex eigenvalues of first order, by the format (data set 55)."""


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
    """Write the complex shapes of all modes as data sets 55 (complex eigenvalues of first order).

    Points named as degrees of freedom of universal files, such as ``12+Z`` or ``12-RX``, keep node and component, along
    the positive axis; the others are numbered from 1 along x. Modal A, 2i times damped frequency and modal mass, says
    the mass of the shape as it stands, in the scale of `ModalFit.shapes`.
    """
    places = [component(name) for name in fit.frf.outputs]
    known = [one for one in places if one is not None]
    if len(known) < len(places):
        known = [(k, 0, 1.0) for k in range(1, len(places) + 1)]
    nodes = sorted({node for node, _, _ in known})
    width = 6 if any(axis > 2 for _, axis, _ in known) else 3
    lines: list[str] = []
    scaled = fit.shapes()[0]
    for number, (mode, shape, real) in enumerate(zip(fit.modes, fit.complex_shapes(), scaled, strict=True), start=1):
        table = np.zeros((len(nodes), width), dtype=complex)
        for (node, axis, sign), value in zip(known, shape, strict=True):
            table[nodes.index(node), axis] = sign * value
        mass = 1.0 / np.max(np.abs(real)) ** 2
        modal_a = 2.0j * mode.pole.imag * mass
        lines += ["    -1", "    55"]
        lines += [one.ljust(80) for one in (f"mode {number}", mode.verdict.value, "NONE", "NONE", "NONE")]
        lines.append("".join(f"{one:10d}" for one in (1, _COMPLEX_MODES, 3 if width == 6 else 2, 8, 5, width)))
        lines.append("".join(f"{one:10d}" for one in (2, 6, 1, number)))
        lines += _rows(np.array([mode.pole, modal_a, -mode.pole * modal_a]))
        for node, row in zip(nodes, table, strict=True):
            lines += [f"{node:10d}", *_rows(row)]
        lines.append("    -1")
    write_text(path, "\n".join(lines) + "\n")
    return path


def _rows(values: Complexes) -> list[str]:
    """Complex numbers in six columns of thirteen characters, real before imaginary parts."""
    words = [f"{one:13.5E}" for one in np.column_stack([values.real, values.imag]).ravel()]
    return ["".join(words[k : k + 6]) for k in range(0, len(words), 6)]


def compared(fit: ModalFit, other: Mapping[str, Any]) -> Table:
    """Modes compared with those of an earlier set (`summary_of`), paired by MAC at the points that both have.

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
            (
                f,
                there["frequency_hz"],
                100.0 * (f / there["frequency_hz"] - 1.0),
                mode.damping.value,
                there["damping_ratio"],
                float(row[k]),
            )
        )
    columns = (
        Column("here", "Hz", 6, over="frequency"),
        Column("there", "Hz", 6, over="frequency"),
        Column("change (%)", digits=3),
        Column("here", "%", 3, over="damping ratio"),
        Column("there", "%", 3, over="damping ratio"),
        Column("MAC", digits=3),
    )
    return Table("", columns, rows, (f"shapes compared at {len(shared)} points",))
