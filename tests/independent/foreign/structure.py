"""The cantilever's modes by finite elements, and its motion in the air and on the ground as sums of complex poles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, null_space
from scipy.optimize import brentq

from independent.foreign.world import Device, World

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
_ELEMENTS = 96
SIDEWAYS = 1.13
"""Frequency of a bending along the ground over that of the first mode."""


@dataclass(frozen=True)
class Modes:
    """mass [kg] of every mode; omega [rad/s], damping ratios and participations (n,); points (2, n): shapes at foot and
    centre; seen (2, n): where the lasers are; relaxing: share of the springs that relaxes, in a time [s]."""

    mass: float
    omega: Floats
    damping: Floats
    participation: Floats
    points: Floats
    seen: Floats
    relaxing: float
    relaxes: float

    @property
    def springs(self) -> tuple[Floats, Floats]:
        """Stiffness at rest and viscous damping (n,) that give the poles: of a spring that relaxes both are less."""
        zeta = np.minimum(self.damping, 1.0)
        pole = self.omega * (-zeta + 1j * np.sqrt(1.0 - zeta**2))
        held = 1.0 + self.relaxing * pole * self.relaxes / (1.0 + pole * self.relaxes)
        # m s^2 + c s + k held = 0, whose imaginary part gives c for a k
        k = -self.mass * (pole**2).imag / pole.imag + self.mass * (pole**2).real / pole.real
        k = k / (held.imag / pole.imag - held.real / pole.real)
        return k, -(self.mass * (pole**2).imag + k * held.imag) / pole.imag


def _beam(device: Device, mass_per_length: float) -> tuple[Floats, Floats, float]:
    """First two (omega^2 / EI), shapes (3, 2) at tip and centre and slopes at the tip, and the whole mass, for a beam
    of unit stiffness."""
    n, a = _ELEMENTS, device.length / _ELEMENTS
    long, wide, thick = device.tip
    tip = device.density * long * wide * thick
    k = np.array([[12, 6 * a, -12, 6 * a], [6 * a, 4 * a * a, -6 * a, 2 * a * a]]) / a**3
    k = np.vstack([k, -k[0], np.array([6 * a, 2 * a * a, -6 * a, 4 * a * a]) / a**3])
    m = np.array([[156, 22 * a, 54, -13 * a], [22 * a, 4 * a * a, 13 * a, -3 * a * a]], dtype=float)
    m = np.vstack([m, [54, 13 * a, 156, -22 * a], [-13 * a, -3 * a * a, -22 * a, 4 * a * a]]) * a / 420.0
    stiffness, mass = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros((2 * n + 2, 2 * n + 2))
    for e in range(n):
        at = slice(2 * e, 2 * e + 4)
        stiffness[at, at] += k
        mass[at, at] += mass_per_length * m
    beyond = 0.5 * long
    centre = np.array([1.0, beyond])
    mass[-2:, -2:] += tip * np.outer(centre, centre)
    mass[-1, -1] += tip * (long**2 + thick**2) / 12.0
    # the compliances of the lowest modes are the largest: rounding is a part of those
    last = [2 * n - 2, 2 * n - 1]
    compliance, shapes = eigh(mass[2:, 2:], stiffness[2:, 2:], subset_by_index=last)
    squares, shapes = 1.0 / compliance[::-1], shapes[:, ::-1] / np.sqrt(compliance[::-1])
    whole = mass_per_length * device.length + tip
    at_tip = shapes[-2] + beyond * shapes[-1]
    scale = np.sqrt(whole) * np.sign(at_tip)
    return squares, np.array([at_tip, shapes[n - 2], shapes[-1]]) * scale, whole


def modes_of(device: Device, world: World) -> Modes:
    """The modes of a device; a third one of its own shape, or of its foot alone, where its world has it."""
    ratio = (device.frequencies[1] / device.frequencies[0]) ** 2

    def excess(log: float) -> float:
        squares, _, _ = _beam(device, float(np.exp(log)))
        return float(squares[1] / squares[0]) - ratio

    # of two beams with this ratio the lighter one: from where the ratio falls with the beam's mass
    heavy = np.log(3.5e-7)
    while excess(heavy) > 0.0:
        heavy += 0.3
    light = heavy
    while excess(light) <= 0.0:
        light -= 0.3
    mass_per_length = float(np.exp(brentq(excess, light, min(light + 0.3, heavy + 1e-9), xtol=1e-14)))
    _, shapes, mass = _beam(device, mass_per_length)
    points = shapes[:2]
    seen = points - world.spot * np.array([shapes[2], np.zeros(2)])
    omega = 2.0 * np.pi * np.array(device.frequencies)
    damping, participation = np.array(device.damping), np.array(device.participation)
    if world.third:
        own = 2.0 * np.pi * 3100.0
        shape = np.array([0.4, -0.3]) * np.abs(points[:, 0]).max()
        static = points[0, 0] * participation[0] / omega[0] ** 2
        omega, damping = np.append(omega, own), np.append(damping, 0.02)
        participation = np.append(participation, world.third * static * own**2 / shape[0])
        points, seen = np.column_stack([points, shape]), np.column_stack([seen, shape])
    if world.rocks:
        shape = np.array([world.rocks * points[0, 0], 0.0])
        omega, damping = np.append(omega, 2.0 * np.pi * 9e3), np.append(damping, 0.02)
        participation = np.append(participation, 0.0)
        points, seen = np.column_stack([points, shape]), np.column_stack([seen, shape])
    if world.sideways:
        omega, damping = np.append(omega, SIDEWAYS * omega[0]), np.append(damping, damping[0])
        participation = np.append(participation, world.sideways * SIDEWAYS**2 * participation[0])
        points, seen = np.column_stack([points, [0.0, 0.0]]), np.column_stack([seen, points[:, 0]])
    return Modes(mass, omega, damping, participation, points, seen, world.relaxing, world.relaxes)


class Phase:
    """Linear motion of the modes, free or tied: displacements and velocities (2n,), and displacements to which springs
    have relaxed where they do (3n,) = still + Re(out z), z' = pole z + what forces add.

    Parameters
    ----------
    modes
        The structure.
    tie
        Basis (n, m) of what the coordinates may do.
    origin
        Coordinates (n,) about which.
    spring, damper
        Matrices (n, n) added to the structure's own.
    """

    def __init__(
        self,
        modes: Modes,
        tie: Floats | None = None,
        origin: Floats | None = None,
        spring: Floats | float = 0.0,
        damper: Floats | float = 0.0,
    ) -> None:
        n = len(modes.omega)
        tie = np.eye(n) if tie is None else tie
        origin = np.zeros(n) if origin is None else origin
        springs, dampers = modes.springs
        stiffness, damping = np.diag(springs) + spring, np.diag(dampers) + damper
        m, more = tie.shape[1], n if modes.relaxing else 0
        mass, fast = modes.mass * tie.T @ tie, np.diag(modes.relaxing * springs)
        system = np.zeros((2 * m + more, 2 * m + more))
        system[:m, m : 2 * m] = np.eye(m)
        system[m : 2 * m, :m] = -np.linalg.solve(mass, tie.T @ (stiffness + fast) @ tie)
        system[m : 2 * m, m : 2 * m] = -np.linalg.solve(mass, tie.T @ damping @ tie)
        if more:
            system[m : 2 * m, 2 * m :] = np.linalg.solve(mass, tie.T @ fast)
            system[2 * m :, :m], system[2 * m :, 2 * m :] = tie / modes.relaxes, -np.eye(n) / modes.relaxes
        poles, right = np.linalg.eig(system)
        left = np.linalg.inv(right)
        kept = np.flatnonzero(poles.imag >= 0.0)  # the others are their conjugates
        weight = np.where(poles[kept].imag > 0.0, 2.0, 1.0)
        self.poles = poles[kept].astype(complex)
        back = np.linalg.pinv(tie)
        spread, gather = np.zeros((2 * n + more, 2 * m + more)), np.zeros((2 * m + more, 2 * n + more))
        spread[:n, :m] = spread[n : 2 * n, m : 2 * m] = tie
        gather[:m, :n] = gather[m : 2 * m, n : 2 * n] = back
        spread[2 * n :, 2 * m :] = gather[2 * m :, 2 * n :] = np.eye(more)
        self.out = (spread @ right)[:, kept] * weight
        self.enter = (left @ gather)[kept]
        inputs = np.zeros((2 * m + more, n))
        inputs[m : 2 * m] = np.linalg.solve(mass, tie.T)
        self.inputs = (left @ inputs)[kept]
        self.still = resting(modes, origin)
        self.constant = self.inputs @ (-stiffness @ origin)

    def begin(self, state: Floats) -> list[complex]:
        """z for displacements and velocities (2n,)."""
        return (self.enter @ (state - self.still)).tolist()

    def state(self, z: list[complex] | Complexes) -> Floats:
        """Displacements and velocities (2n,), or (2n, nt) of z (m, nt)."""
        moved = (self.out @ np.asarray(z)).real
        return moved + (self.still if moved.ndim == 1 else self.still[:, None])


def resting(modes: Modes, places: Floats) -> Floats:
    """State of a structure at rest at some coordinates (n,)."""
    return np.concatenate([places, np.zeros(len(places)), places if modes.relaxing else ()])


def held(modes: Modes, gap: float, ground: float) -> Phase:
    """The foot on the ground: tied to it, or on its spring and a damper that leaves it 0.7 of critical."""
    row = modes.points[0]
    grounded = -gap * row / float(row @ row)
    if np.isinf(ground):
        return Phase(modes, null_space(row[None]), grounded)
    across = np.outer(row, row)
    damper = 1.4 * np.sqrt(ground * modes.mass / float(row @ row))
    phase = Phase(modes, None, None, ground * across, damper * across)
    phase.constant = phase.constant + phase.inputs @ (-ground * gap * row)
    return phase
