"""The two compile recipes of the house: inner functions are small and wrapper-free, entries release the GIL."""

from __future__ import annotations

from numba import njit

# Contracting and reordering of sums is allowed; NaN and infinity keep their meaning (they end a run in a sentence).
_MATH = {"contract", "reassoc", "nsz", "arcp"}

_INNER = {"fastmath": _MATH, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "_nrt": False, "error_model": "numpy"}

# Called now and then (at events): compiled on its own.
inner = njit(**_INNER)
# On the path of every step, called from one place: melted into its caller, so that no argument is copied.
fused = njit(forceinline=True, **_INNER)

def entry(function):  # noqa: ANN001, ANN201 - numba dispatcher
    """Compile an entry point: cached on disk, without the GIL. The cache notices a changed closure."""
    return njit(fastmath=_MATH, cache=True, nogil=True, error_model="numpy", _nrt=False)(function)
