"""A structure from a table of modes that other programs computed or measured: data sets 55 of a universal file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import scene_name
from tarsus.formats.uff import SystemOfUnits, data_sets, freedom_name, is_uff
from tarsus.model.structure.modal import Modal

_NORMAL = 2
"""Analysis type of normal modes."""


def read_mode_table(path: str | Path) -> Modal:
    """The structure whose normal modes a universal file holds (data sets 55), by frequency; its points are the degrees
    of freedom that move, such as ``12_Z`` and ``12_RX`` [m and rad a metre of the mode].

    Frequencies [Hz], viscous damping ratios and modal masses are those of the data sets; masses are brought to kg by
    the file's system of units (data set 164; SI where there is none), shapes are as they stand.

    Raises
    ------
    InputError
        If the file cannot be read, has no normal modes, modes at unlike nodes, one without a modal mass, with
        structural (hysteretic) damping, or units that contradict each other.
    """
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from None
    if not is_uff(content[:400]):
        raise InputError(f"{path.name} is no universal file: it does not begin with a line that holds -1")
    sets = data_sets(path, content)
    system = SystemOfUnits.of(sets)
    modes = sorted(
        (one for one in sets if one["type"] == 55 and one["analysis_type"] == _NORMAL),
        key=lambda one: float(one["freq"]),
    )
    if not modes:
        raise InputError(f"{path.name} holds no normal modes (data sets 55 of analysis type {_NORMAL})")
    if not system.trusted:
        raise InputError(
            f"{path.name}: its units (data set 164) contradict each other, so that masses are not known"
        )
    nodes = [int(node) for node in modes[0]["node_nums"]]
    for number, one in enumerate(modes, 1):
        if [int(node) for node in one["node_nums"]] != nodes:
            raise InputError(f"{path.name}: mode {number} is not of the same nodes as mode 1")
        if not float(one["modal_m"]) > 0.0:
            raise InputError(
                f"{path.name}: mode {number} has no modal mass (record 8 says {one['modal_m']:g})"
            )
        if float(one["modal_damp_his"]) != 0.0:
            raise InputError(f"{path.name}: mode {number} has structural damping; give it as a viscous ratio")
    shapes = {}
    for direction in range(1, 7):
        if f"r{direction}" not in modes[0]:
            continue
        table = np.array([np.asarray(one[f"r{direction}"], dtype=float) for one in modes])
        for node, column in zip(nodes, table.T, strict=True):
            if np.any(column != 0.0):
                shapes[scene_name(freedom_name("", node, direction))] = tuple(column.tolist())
    return Modal(
        frequencies=tuple(float(one["freq"]) for one in modes),
        damping_ratios=tuple(float(one["modal_damp_vis"]) for one in modes),
        modal_masses=tuple(float(one["modal_m"]) * system.length / system.force for one in modes),
        shapes=shapes,
    )
