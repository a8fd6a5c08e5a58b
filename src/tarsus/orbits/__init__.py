"""Periodic motion of driven robots: orbits, their stability, and branches of them along a parameter."""

from tarsus.orbits.attractors import Attractor, Attractors, attractors
from tarsus.orbits.branches import Branch, Branches, BranchPoint, Coexistence
from tarsus.orbits.branching import branch
from tarsus.orbits.orbit import Orbit, periodic

__all__ = [
    "Attractor",
    "Attractors",
    "Branch",
    "BranchPoint",
    "Branches",
    "Coexistence",
    "Orbit",
    "attractors",
    "branch",
    "periodic",
]
