"""A structure from a table of modes that other programs computed or measured: data at nodes of a universal file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tarsus.base.arrays import Complexes, Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import scene_name
from tarsus.formats.freedoms import freedom_name
from tarsus.formats.uff import SystemOfUnits, is_uff
from tarsus.formats.universal import AtNodes, data_sets
from tarsus.model.structure.modal import Modal

_NORMAL = 2
"""Analysis type of normal modes."""
_COMPLEX = 3
"""Analysis type of complex modes, of displacements."""
_TURNED = 0.5
"""Imaginary part of a shape, over its real one, above which it is no real mode: the real part alone then misses a tenth
of its size."""


@dataclass(frozen=True)
class _TableMode:
    """A real mode: frequency [Hz], damping ratio, modal mass in the file's units, shape (nodes, components)."""

    frequency: float
    damping: float
    mass: float
    shape: Floats


def read_mode_table(path: str | Path) -> Modal:
    """The structure whose modes a universal file holds (data sets 55 or 2414), by frequency; its points are the degrees
    of freedom that move, such as ``12_Z`` and ``12_RX`` [m and rad a metre of the mode].

    Normal modes (analysis type 2) have frequencies [Hz], viscous damping ratios and modal masses. Complex ones (type
    3), as ``tarsus.modes`` writes them, have eigenvalues [rad/s] and modal A; they are read where there are no normal
    ones, and where their shapes are real up to a common phase. Masses are brought to kg by the file's system of
    units (data set 164; SI where there is none), shapes are as they stand.

    Raises
    ------
    InputError
        If the file cannot be read, has no such modes, modes at unlike nodes, one without a modal mass, with
        structural (hysteretic) damping or of a complex shape, or units that contradict each other.
    """
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from None
    if not is_uff(content[:400]):
        raise InputError(f"{path.name} is no universal file: it does not begin with a line that holds -1")
    nodal = [one for one in data_sets(path.name, content) if isinstance(one, AtNodes)]
    found = [one for one in nodal if one.analysis == _NORMAL]
    found = found or _one_of_pairs([one for one in nodal if one.analysis == _COMPLEX])
    if not found:
        others = sorted({one.analysis for one in nodal})
        held = f"; its data at nodes are of analysis type {', '.join(map(str, others))}" if others else ""
        raise InputError(
            f"{path.name} holds no normal modes and no complex ones (data sets 55 or 2414 of analysis type "
            f"{_NORMAL} or {_COMPLEX}){held}"
        )
    nodes = found[0].nodes
    system = SystemOfUnits.of(found[0].units)
    problems = []
    if not system.trusted:
        problems.append(f"{path.name}: its units (data set 164) contradict each other, so that masses are not known")
    modes = []
    for number, one in enumerate(found, 1):
        try:
            if one.nodes != nodes or one.values.shape != found[0].values.shape:
                raise InputError(f"mode {number} is not of the same nodes as mode 1")
            modes.append(_normal(number, one) if one.analysis == _NORMAL else _real(number, one))
        except InputError as error:
            problems += [f"{path.name}: {said}" for said in error.problems]
    if problems:
        raise InputError(problems)
    modes.sort(key=lambda one: one.frequency)
    return Modal(
        frequencies=tuple(one.frequency for one in modes),
        damping_ratios=tuple(one.damping for one in modes),
        modal_masses=tuple(one.mass * system.length / system.force for one in modes),
        shapes=_points(nodes, np.array([one.shape for one in modes])),
    )


def _points(nodes: Sequence[int], shapes: Floats) -> dict[str, tuple[float, ...]]:
    """Shapes (modes, nodes, components) by the names of the degrees of freedom that move."""
    out = {}
    for axis in range(shapes.shape[2]):
        direction = axis + 1 if shapes.shape[2] in (3, 6) else 0  # vectors of 3 or 6, else scalars
        for node, column in zip(nodes, shapes[:, :, axis].T, strict=True):
            if np.any(column != 0.0):
                out[scene_name(freedom_name("", node, direction))] = tuple(map(float, column))
    return out


def _normal(number: int, one: AtNodes) -> _TableMode:
    """A normal mode. Its parameters are frequency, modal mass, viscous and hysteretic damping ratio."""
    frequency, mass, viscous, hysteretic = [*one.reals, 0.0, 0.0, 0.0, 0.0][:4]
    if not mass > 0.0:
        raise InputError(f"mode {number} has no modal mass (record 8 says {mass:g})")
    if hysteretic != 0.0:
        raise InputError(f"mode {number} has structural damping; give it as a viscous ratio")
    if np.any(np.imag(one.values)):
        raise InputError(f"mode {number} is called normal and has a complex shape")
    return _TableMode(frequency, viscous, mass, np.real(one.values))


def _eigenvalue(one: AtNodes) -> complex:
    return complex(*[*one.reals, 0.0, 0.0][:2])


def _one_of_pairs(modes: Sequence[AtNodes]) -> list[AtNodes]:
    """Complex modes above 0 Hz, without their conjugates, which a file may list too."""
    return [one for one in modes if _eigenvalue(one).imag > 0.0]


def _real(number: int, one: AtNodes) -> _TableMode:
    """A complex mode of a real shape times a phase, whose modal A is 2i times damped frequency and modal mass."""
    eigenvalue, modal_a = _eigenvalue(one), complex(*[*one.reals, 0.0, 0.0, 0.0, 0.0][2:4])
    shape: Complexes = np.asarray(one.values, dtype=complex)
    turn = np.exp(-0.5j * np.angle(np.sum(shape**2)))
    if np.vdot(shape, shape).real > 0.0 and (shape * turn).flat[np.argmax(np.abs(shape))].real < 0.0:
        turn = -turn
    shape = shape * turn
    if np.linalg.norm(shape.imag) > _TURNED * np.linalg.norm(shape.real):
        raise InputError(f"mode {number} is complex: its points do not move in one phase, as real modes do")
    mass = (modal_a * turn**2 / (2.0j * eigenvalue.imag)).real
    if not mass > 0.0:
        raise InputError(
            f"mode {number} is complex (analysis type 3) and has no modal mass (record 8 says modal A {modal_a:g})"
        )
    return _TableMode(abs(eigenvalue) / (2.0 * np.pi), -eigenvalue.real / abs(eigenvalue), mass, shape.real)
