"""What acts between a foot and the ground, as the engine numbers it: hooks of users' laws, and flags of a foot."""

from __future__ import annotations

# Hooks that a user's law can serve, as in ``_native.HOOKS``.
MOMENTUM, FORCE, REBOUND, STRENGTH = 0, 1, 2, 3
# Flags of a foot: which laws act on it.
HAS_MOMENTUM, HAS_FORCE, USES_RATE, HAS_LATCH = 1, 2, 4, 8
# An impact map that acts as it is, not through its passive projection.
MAP_AS_IS = 16
# The rule by which a foot lands, see core/native/rules.hpp; without one of these it is captured unless pulled.
RESTITUTES_FIRST, PULL_AS_PRINTED = 32, 64
