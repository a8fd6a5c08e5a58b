"""The reference lists what is public, and what is public says what it is."""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
from functools import cache
from pathlib import Path

import pytest

import tarsus
from example_files import load_file

DOCS = Path(__file__).parents[2] / "docs"
LISTED = load_file(DOCS / "names.py").listed((DOCS / "api.md").read_text(encoding="utf-8"))

ARRAYS = re.compile(r"ArrayLike|NDArray|Floats|ndarray")
SHAPE = re.compile(r"\((\.\.\., ?)?[a-z0-9_]+( ?[+*-] ?[a-z0-9_]+)*(, ?[a-z0-9_]+( ?[+*-] ?[a-z0-9_]+)*)*,?\)")
UNIT = re.compile(r"\[[^\]]+\]|\bunit|\bSI\b|\bshares?\b|\bdimensionless\b|\bsame\b")


REFERENCE = load_file(DOCS / "reference.py")
found = cache(REFERENCE.object_of)
EXAMPLES = REFERENCE.examples()


def test_every_name_on_the_page_exists_once():
    assert len(LISTED) == len(set(LISTED)) > 150
    assert [name for name in LISTED if found(name) is None] == []


def test_all_that_is_offered_is_there():
    for name in tarsus.__all__:
        getattr(tarsus, name)
    assert set(tarsus.__all__) <= set(dir(tarsus))


@pytest.mark.parametrize("name", LISTED)
def test_what_is_listed_says_what_it_is(name):
    one = found(name)
    if isinstance(one, (int, float, str, tuple)) or not callable(one):
        return
    own = one.__doc__ or ""
    assert len(own) > 20 and not own.startswith(f"{name.rsplit('.', 1)[-1]}("), name
    if not inspect.isfunction(one):
        return
    taken = " ".join(str(said) for said in one.__annotations__.values())
    if ARRAYS.search(taken):
        assert SHAPE.search(own), f"{name} takes or gives arrays, and says no shape"
        assert UNIT.search(own), f"{name} takes or gives arrays, and says no unit"
    if "raise InputError" in inspect.getsource(one):
        assert "InputError" in own, f"{name} refuses input, and does not say so"


OWN = [name for name in LISTED if ">>>" in (inspect.getdoc(found(name)) or "")]
"""Names whose docstring has an example."""
ONCE = list({id(found(name)): name for name in OWN}.values())
"""Of the names of one object, one."""


def ran(examples: doctest.DocTest) -> None:
    result = doctest.DocTestRunner().run(examples)
    assert result.failed == 0 and result.attempted >= 1


@pytest.mark.parametrize("name", ONCE)
def test_examples_of_docstrings_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (examples,) = doctest.DocTestFinder(recurse=False).find(found(name), name)
    ran(examples)


@pytest.mark.parametrize(
    "example",
    [
        pytest.param(one, id=one.names[0], marks=[getattr(pytest.mark, one.lane)] if one.lane else [])
        for one in EXAMPLES
    ],
)
def test_examples_of_the_reference_run(example, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ran(doctest.DocTestParser().get_doctest(example.text, {}, example.names[0], str(example.file), example.line))


def test_every_page_of_the_reference_has_an_example():
    shown = [name for one in EXAMPLES for name in one.names]
    those = {id(found(name)) for name in (*shown, *OWN)}
    assert [name for name in LISTED if id(found(name)) not in those] == []
    assert [name for name in shown if id(found(name)) not in {id(found(one)) for one in LISTED}] == []


def test_verbs_that_are_packages_too_can_be_called():
    importlib.import_module("tarsus.calibrate.weighted_ensemble")
    with pytest.raises(tarsus.InputError, match="no calibration is called 'nope'"):
        tarsus.calibrate("nope")
    with pytest.raises(tarsus.InputError, match=r"nowhere\.toml"):
        tarsus.identify("nowhere.toml")
    assert tarsus.modes.ModalFit is found("tarsus.modes.modal.ModalFit")
