"""What a law may not contain: each is refused with a sentence that names the function and the line."""

from __future__ import annotations

import importlib
import json
import math
from collections.abc import Callable

import numpy as np
import pytest

from tarsus.base.errors import InputError
from tarsus.model.laws.translate import translate


def _while(x):
    while x > 1:
        x = x / 2
    return x


def _for_unknown(x):
    for _ in range(x):
        pass
    return x


def _for_long(x):
    for _ in range(5000):
        x = x + 1
    return x


def _grows(x):
    for _ in range(1000):
        for _ in range(1000):
            x = x * x + 1.0
    return x


def _no_return(x):
    if x > 0:
        return 1.0


def _unset(x):
    if x > 0:
        y = 2.0
    return y * x


def _text(x):
    return x + "1"


def _array(x):
    return np.sqrt(x)


def _itself(x):
    return _itself(x - 1.0)


def _comprehension(x):
    return max([x * k for k in range(3)])


def _elsewhere(x):
    return json.dumps(x)


def _imports(x):
    import cmath

    return cmath.sqrt(x)


def _attribute(x):
    return x.real


def _raises(x):
    if x < 0:
        raise ValueError
    return x


def _undefined(x):
    return x + no_such_name  # noqa: F821  # type: ignore[reportUndefinedVariable]


def _membership(x):
    return 1.0 if x in (1.0, 2.0) else 0.0


def _bits(x):
    return x + (3 & 1)


def _any_number(*x):
    return 1.0


def _pair(x):
    return (x, x)


def _nothing(x):
    return


def _prints(x):
    print(x)
    return x


def _two_many(x):
    return math.sqrt(x, x)


def _stops(x):
    for k in range(3):
        if x > k:
            break
    return x


def _large(x):
    return x + 10**400


REFUSED = [
    (_while, r"'while' is not allowed: a law is arithmetic, comparisons, 'if', 'for' over range\(\)", 1),
    (_for_unknown, "the bounds of 'range' must be known numbers", 1),
    (_for_long, "a loop of 5000 turns: at most 1000 are written out", 1),
    (_grows, "more than 4000 operations with all loops written out", 3),
    (_no_return, "it does not return a number on every path", 0),
    (_unset, "'y' has no value on some path that leads here", 3),
    (_text, "'1' is not a number", 1),
    (_array, "'sqrt' is of type ufunc, not a number", 1),
    (_itself, "'_itself' calls itself", 1),
    (_comprehension, "a comprehension is not allowed", 1),
    (_elsewhere, "'json.dumps' is defined in another file; a law calls functions of its own file", 1),
    (_imports, "'import' inside the function is not allowed", 1),
    (_attribute, "'.real' of a number is not allowed", 1),
    (_raises, "'raise' is not allowed", 2),
    (_undefined, "'no_such_name' is not defined", 1),
    (_membership, r"'x in \(1.0, 2.0\)': only < <= > >= == != compare numbers", 1),
    (_bits, "the operator 'BitAnd' is not allowed", 1),
    (_any_number, "it takes its arguments by position, each by its name", 0),
    (_pair, "expected a number, got a tuple", 0),
    (_nothing, "it returns no number here", 1),
    (_prints, r"'print\(x\)' does nothing here", 1),
    (_two_many, "'math.sqrt' takes 1 numbers in a law, got 2", 1),
    (_stops, "'break' is not allowed", 3),
    (_large, "an integer that is too large for a float", 1),
]


@pytest.mark.parametrize(("function", "said", "below"), REFUSED, ids=[f.__name__ for f, _, _ in REFUSED])
def test_what_a_law_may_not_contain_is_a_sentence(function, said, below):
    line = function.__code__.co_firstlineno + below
    with pytest.raises(InputError, match=rf"^{function.__name__}, line {line}: .*{said}"):
        translate(function)


def test_a_law_has_a_source():
    with pytest.raises(InputError, match="a lambda is not a law; write the function with 'def'"):
        translate(lambda x: x)
    with pytest.raises(InputError, match="a law is a plain function written with 'def'"):
        translate(math.sqrt)
    space: dict[str, Callable[..., float]] = {}
    exec("def unseen(x):\n    return x", space)
    with pytest.raises(InputError, match="unseen: its source cannot be read; write the law in a file"):
        translate(space["unseen"])


def test_a_file_changed_since_it_was_loaded_is_not_read_as_the_law(tmp_path, monkeypatch):
    file = tmp_path / "springs.py"
    text = "def spring(gap):\n    return 2.0 * gap\n\n\ndef other(gap):\n    return 5.0 * gap\n"
    file.write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    springs = importlib.import_module("springs")
    before = translate(springs.spring)
    file.write_text(text.replace("2.0 * gap", "3.0 * gap").replace("5.0", "6.0"))
    with pytest.raises(InputError, match="its file has changed since it was loaded; load it again"):
        translate(springs.other)
    assert before.constants.tolist() == [2.0]
    assert translate(springs.spring) == before, "what was read once stays what it was"
