"""The native module imports, and says how it was built."""

import re
from pathlib import Path

import pytest

import tarsus.core
from tarsus.base._linear import X86_64
from tarsus.base.errors import InputError
from tarsus.core import _native
from tarsus.core.processor import VARIABLE, engines

# What a row is worked on with where the target names it; "native" may be any of them, but never single numbers.
ROWS = {"baseline": {"NEON", "SSE"}, "x86-64-v2": {"SSE"}, "x86-64-v3": {"AVX2"}, "x86-64-v4": {"AVX-512"}}


def test_module_says_how_it_was_built():
    built = _native.built

    assert set(built) == {"compiler", "target", "rows", "checks"}
    assert re.fullmatch(r"(gcc|clang) \d+\.\d+\.\d+", built["compiler"])
    assert built["target"] != "unknown"
    assert built["rows"] in ROWS.get(built["target"], {"AVX-512", "AVX2", "AVX", "SSE", "NEON"})


def test_module_lies_in_the_last_folder_of_the_core():
    assert Path(_native.__file__).parent == Path(tarsus.core.__path__[-1])


@pytest.mark.parametrize(
    ("level", "asked", "taken"), [(2, None, "v2"), (3, None, "v3"), (4, None, "v4"), (9, None, "v4"), (4, "v2", "v2")]
)
def test_wheel_runs_the_highest_level_of_the_processor(tmp_path, level, asked, taken):
    for name in ("v2", "v3", "v4"):
        (tmp_path / f"x86-64-{name}").mkdir()
    environment = {} if asked is None else {VARIABLE: f"x86-64-{asked}"}

    assert engines(tmp_path, level, environment) == [str(tmp_path / f"x86-64-{taken}")]


@pytest.mark.parametrize(
    ("level", "asked", "said"),
    [(1, None, "needs a processor of x86-64-v2"), (2, "x86-64-v3", "runs x86-64-v2"), (3, "avx", "'avx'")],
)
def test_processor_that_cannot_run_the_engine_gets_a_sentence(tmp_path, level, asked, said):
    for name in ("v2", "v3", "v4"):
        (tmp_path / f"x86-64-{name}").mkdir()

    with pytest.raises(InputError, match=said):
        engines(tmp_path, level, {} if asked is None else {VARIABLE: asked})


def test_engine_built_here_is_the_only_one(tmp_path):
    assert engines(tmp_path, 4, {VARIABLE: "x86-64-v2"}) == []


@pytest.mark.skipif(not Path("/proc/cpuinfo").is_file(), reason="Linux says what the processor has")
def test_level_is_that_of_the_flags_of_linux():
    known = Path("/proc/cpuinfo").read_text().partition("flags")[2].partition("\n")[0].split()
    if "sse2" not in known:
        assert X86_64 == 0
        return
    needs = {
        2: "cx16 lahf_lm popcnt pni sse4_1 sse4_2 ssse3",
        3: "abm avx avx2 bmi1 bmi2 f16c fma movbe",
        4: "avx512f avx512bw avx512cd avx512dq avx512vl",
    }
    level = 1
    while level < 4 and set(needs[level + 1].split()) <= set(known):
        level += 1
    assert level == X86_64
