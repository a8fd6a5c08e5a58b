"""A second simulator: scipy's integrators between events that are found by root finding.

Written from docs/conventions.md, docs/contact.md and docs/walking.md alone; it shares no formula with the library, of
which it takes the descriptions of a scene and nothing else. It is slow, and right where nothing is stiff.
"""

from independent.simulator import Found, simulate

__all__ = ["Found", "simulate"]
