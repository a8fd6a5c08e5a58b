"""The native module imports, and says how it was built."""

import re

import pytest

import tarsus.core
from tarsus.core import _native

pytestmark = pytest.mark.native


def test_module_says_how_it_was_built():
    built = _native.built

    assert re.fullmatch(r"(gcc|clang) \d+\.\d+\.\d+", built["compiler"])
    assert re.fullmatch(r"native|baseline|[\w.-]+", built["target"]) and built["target"] != "unknown"
    assert built["rows"] in {"AVX-512", "AVX2", "AVX", "SSE", "NEON"}  # none of our targets works on rows by single numbers
    assert set(built) == {"compiler", "target", "rows", "checks"}


def test_baseline_uses_no_instructions_of_newer_machines():
    if _native.built["target"] == "baseline":
        assert _native.built["rows"] in {"SSE", "NEON"}


def test_module_lies_beside_its_python_sources():
    assert _native.__file__.startswith(tarsus.core.__path__[0])
