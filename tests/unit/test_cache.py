"""The disk cache of machine code: asked without compiling, cleared of what older sources left."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numba
import pytest

from tarsus.core.cache import drop_stale, is_compiled

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="there is no machine code to keep")  # type: ignore[attr-defined]

SOURCE = """
from numba import njit

def make(key):
    def twice(x):
        if len(key) == 0:
            return 0.0
        return {factor} * x
    return njit(cache=True)(twice)
"""


@pytest.fixture
def module(tmp_path, monkeypatch):
    """`module(factor)`: a module in a file of its own, written anew with that factor."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    file = tmp_path / "doubling.py"

    def load(factor: float = 2.0, above: str = ""):
        file.write_text(above + SOURCE.format(factor=factor), encoding="utf-8")
        spec = importlib.util.spec_from_file_location("doubling", file)
        assert spec is not None and spec.loader is not None
        made = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "doubling", made)
        spec.loader.exec_module(made)
        return made

    return load


def machine_code(dispatcher) -> set[str]:
    return {file.name for file in Path(dispatcher._cache.cache_path).glob("doubling*.nbc")}


def test_known_before_and_after_compiling_and_in_a_fresh_start(module):
    first = module().make("one")
    assert not is_compiled(first)
    assert first(2.0) == 4.0
    assert is_compiled(first)
    again = module().make("one")
    assert is_compiled(again) and not again.signatures  # found on disk, nothing loaded


def test_another_key_or_text_is_not_taken_for_this_one(module):
    module().make("one")(2.0)
    assert not is_compiled(module().make("two"))
    assert not is_compiled(module(3.0).make("one"))


def test_code_that_vanished_is_missed(module):
    made = module().make("one")
    made(2.0)
    for name in machine_code(made):
        (Path(made._cache.cache_path) / name).unlink()
    assert not is_compiled(module().make("one"))


def test_stale_code_goes_and_current_code_stays(module):
    module().make("old")(2.0)
    current = module().make("new")
    current(2.0)
    assert len(machine_code(current)) == 2
    assert len(drop_stale(current)) == 1
    assert len(machine_code(current)) == 1
    again = module().make("new")
    assert is_compiled(again) and again(3.0) == 6.0 and again.stats.cache_hits
    assert not is_compiled(module().make("old"))


def test_code_of_a_text_with_the_function_elsewhere_goes(module):
    module().make("one")(2.0)
    moved = module(2.0, above="# a line more\n").make("one")
    assert not is_compiled(moved)
    assert len(drop_stale(moved)) == 2  # index and code of the old place
    assert machine_code(moved) == set()
    assert moved(2.0) == 4.0 and is_compiled(moved)


def test_a_broken_index_is_no_index(module):
    made = module().make("one")
    made(2.0)
    (index,) = Path(made._cache.cache_path).glob("doubling*.nbi")
    index.write_bytes(b"\x80nonsense")
    again = module().make("one")
    assert not is_compiled(again)
    drop_stale(again)
    assert not index.exists() and again(2.0) == 4.0


def test_a_plain_function_needs_no_compiling():
    assert is_compiled(abs)
    assert drop_stale(abs) == []
