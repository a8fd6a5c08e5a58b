"""Periodic motion of driven robots: orbits, their stability, and branches of them along a parameter."""

from tarsus.orbits.attractors import Attractor, Attractors, attractors
from tarsus.orbits.branching import Branch, BranchPoint, branch
from tarsus.orbits.orbit import Orbit, periodic

__all__ = ["Attractor", "Attractors", "Branch", "BranchPoint", "Orbit", "attractors", "branch", "periodic"]
