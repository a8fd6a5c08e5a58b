"""A cantilever beam with a rigid tip, identified from two frequencies."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import model_validator

from tarsus.base.errors import InputError
from tarsus.base.messages import PathErrors
from tarsus.base.spec import Amount, Amounts, quantity
from tarsus.model.structure.base import Array, Matrices, Structure
from tarsus.model.structure.cantilever import CantileverModes, RigidTip, cantilever_modes, section_from_frequencies


class Beam(Structure):
    """Uniform Euler-Bernoulli cantilever with a rigid rectangular tip (Fig. 2.1 of the source).

    Bending stiffness ``EI`` and mass per length ``rhoA`` are solved so that the first two natural frequencies
    are the given ones.  As many modes are kept as there are damping ratios; the coordinates are modal, scaled
    so that every modal mass is the mass of beam and tip.  Points: ``tip``, the centre of the rigid tip
    (x_p of the source), and ``center``, the middle of the beam (x_c).
    """

    kind: Literal["beam"] = "beam"
    frequencies: tuple[float, float] = quantity("Hz", "first two natural frequencies", gt=0)
    damping_ratios: Amounts = quantity("1", "damping ratio of each mode that is kept", ge=0)
    length: Amount = quantity("m", "length of the beam up to the tip", gt=0)
    tip_length: Amount = quantity("m", "length of the rigid tip, along the beam", gt=0)
    tip_width: Amount = quantity("m", "width of the rigid tip", gt=0)
    tip_thickness: Amount = quantity("m", "thickness of the rigid tip", gt=0)
    tip_density: Amount = quantity("kg/m^3", "density of the rigid tip", gt=0)

    @model_validator(mode="after")
    def _check(self) -> Beam:
        if not self.damping_ratios:
            raise PathErrors([("damping_ratios", "expected at least one, as each keeps a mode, got none")])
        if len(self.damping_ratios) > 12:
            raise PathErrors([("damping_ratios", f"at most 12 modes are kept, got {len(self.damping_ratios)}")])
        if self.frequencies[1] <= self.frequencies[0]:
            raise PathErrors([("frequencies", "the second frequency must be above the first")])
        try:
            self.section()
        except InputError as error:
            raise PathErrors([("frequencies", str(error))]) from None
        return self

    @property
    def tip(self) -> RigidTip:
        """Mass, inertia about its centre, and offset of the rigid tip."""
        mass = self.tip_density * self.tip_length * self.tip_width * self.tip_thickness
        return RigidTip(mass, mass * (self.tip_length**2 + self.tip_thickness**2) / 12.0, 0.5 * self.tip_length)

    def section(self) -> tuple[float, float]:
        """Bending stiffness ``EI`` [N m^2] and mass per length ``rhoA`` [kg/m]."""
        return section_from_frequencies(self.length, self.tip, *self.frequencies)

    def modes(self) -> CantileverModes:
        """The modes that are kept."""
        return cantilever_modes(self.length, self.tip, *self.section(), len(self.damping_ratios))

    @property
    def size(self) -> int:
        """Number of modes kept."""
        return len(self.damping_ratios)

    @property
    def points(self) -> tuple[str, ...]:
        """``tip`` and ``center``."""
        return ("tip", "center")

    def matrices(self) -> Matrices:
        """Diagonal mass, damping and stiffness, each (modes, modes)."""
        modes = self.modes()
        mass = np.full(self.size, modes.mass)
        damping = 2.0 * np.array(self.damping_ratios) * modes.omega * mass
        return Matrices(np.diag(mass), np.diag(damping), np.diag(mass * modes.omega**2))

    def row(self, point: str) -> Array:
        """Mode shapes (modes,) at ``tip`` or ``center``."""
        if point == "tip":
            return self.modes().tip
        if point == "center":
            return self.modes().center
        raise KeyError(point)

    def vertical(self) -> Array:
        """Projection (modes,) of a unit upward translation onto the modes."""
        return self.modes().upward

    def moment_participation(self) -> Array:
        """Generalised force (modes,) [1/m] of a unit bending moment, uniform along the beam.

        This is what an active film over the whole beam exerts; its work is moment times the slope at the end.
        """
        return self.modes().slope

    def static_compliance(self) -> float:
        """Deflection of the tip's centre per force there [m/N], of the whole beam (all modes)."""
        stiffness, offset = self.section()[0], self.tip.offset
        length = self.length
        return (length**3 / 3.0 + length**2 * offset + length * offset**2) / stiffness
