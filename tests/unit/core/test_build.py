"""The native module imports, and says how it was built."""

import re

import tarsus.core
from tarsus.core import _native

# What a row is worked on with where the target names it; "native" may be any of them, but never single numbers.
ROWS = {"baseline": {"SSE", "NEON"}, "x86-64-v3": {"AVX2"}, "x86-64-v4": {"AVX-512"}}


def test_module_says_how_it_was_built():
    built = _native.built

    assert set(built) == {"compiler", "target", "rows", "checks"}
    assert re.fullmatch(r"(gcc|clang) \d+\.\d+\.\d+", built["compiler"])
    assert built["target"] != "unknown"
    assert built["rows"] in ROWS.get(built["target"], {"AVX-512", "AVX2", "AVX", "SSE", "NEON"})


def test_module_lies_beside_its_python_sources():
    assert _native.__file__.startswith(tarsus.core.__path__[0])
