"""What a law may not contain: each is refused with a sentence that names the function and the line."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable

import pytest

from example_files import load_file
from tarsus.base.errors import InputError
from tarsus.model.laws.translate import translate

REFUSED = [
    (
        "while x > 1:\n    x = x / 2\nreturn x",
        r"'while' is not allowed: a law is arithmetic, comparisons, 'if', 'for' over range\(\)",
        1,
    ),
    ("for _ in range(x):\n    pass\nreturn x", "the bounds of 'range' must be known numbers", 1),
    (
        "for _ in range(5000):\n    x = x + 1\nreturn x",
        "a loop of 5000 turns: at most 1000 are written out",
        1,
    ),
    (
        "for _ in range(1000):\n    for _ in range(1000):\n        x = x * x + 1.0\nreturn x",
        "more than 4000 operations with all loops written out",
        3,
    ),
    ("if x > 0:\n    return 1.0", "it does not return a number on every path", 0),
    ("if x > 0:\n    y = 2.0\nreturn y * x", "'y' has no value on some path that leads here", 3),
    ('return x + "1"', "'1' is not a number", 1),
    ("return np.sqrt(x)", "'sqrt' is of type ufunc, not a number", 1),
    ("return law(x - 1.0)", "'law' calls itself", 1),
    ("return max([x * k for k in range(3)])", "a comprehension is not allowed", 1),
    (
        "return json.dumps(x)",
        "'json.dumps' is defined in another file; a law calls functions of its own file",
        1,
    ),
    ("import cmath\n\nreturn cmath.sqrt(x)", "'import' inside the function is not allowed", 1),
    ("return x.real", "'.real' of a number is not allowed", 1),
    ("if x < 0:\n    raise ValueError\nreturn x", "'raise' is not allowed", 2),
    ("return x + no_such_name", "'no_such_name' is not defined", 1),
    (
        "return 1.0 if x in (1.0, 2.0) else 0.0",
        r"'x in \(1.0, 2.0\)': only < <= > >= == != compare numbers",
        1,
    ),
    ("return x + (3 & 1)", "the operator 'BitAnd' is not allowed", 1),
    ("return 1.0", "it takes its arguments by position, each by its name", 0),
    ("return (x, x)", "expected a number, got a tuple", 0),
    ("return", "it returns no number here", 1),
    ("print(x)\nreturn x", r"'print\(x\)' does nothing here", 1),
    ("return math.sqrt(x, x)", "'math.sqrt' takes 1 numbers in a law, got 2", 1),
    ("for k in range(3):\n    if x > k:\n        break\nreturn x", "'break' is not allowed", 3),
    ("return x + 10**400", "an integer that is too large for a float", 1),
]
"""Bodies of a law of x, what is said of each, and in which line."""


@pytest.mark.parametrize(("body", "said", "below"), REFUSED, ids=[body for body, _, _ in REFUSED])
def test_what_a_law_may_not_contain_is_a_sentence(body, said, below, tmp_path):
    file = tmp_path / "refused.py"
    arguments = "*x" if "position" in said else "x"
    lines = body.replace("\n", "\n    ")
    file.write_text(
        f"import json\nimport math\n\nimport numpy as np\n\n\ndef law({arguments}):\n    {lines}\n"
    )
    with pytest.raises(InputError, match=rf"^law, line {7 + below}: .*{said}"):
        translate(load_file(file).law)


def test_a_law_has_a_source():
    with pytest.raises(InputError, match="a lambda is not a law"):
        translate(lambda x: x)
    with pytest.raises(InputError, match="plain function"):
        translate(math.sqrt)
    space: dict[str, Callable[..., float]] = {}
    exec("def unseen(x):\n    return x", space)
    with pytest.raises(InputError, match="unseen: its source cannot be read"):
        translate(space["unseen"])


def test_a_file_changed_since_it_was_loaded_is_not_read_as_the_law(tmp_path, monkeypatch):
    file = tmp_path / "springs.py"
    text = "def spring(gap):\n    return 2.0 * gap\n\n\ndef other(gap):\n    return 5.0 * gap\n"
    file.write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    springs = importlib.import_module("springs")
    before = translate(springs.spring)
    file.write_text(text.replace("2.0 * gap", "3.0 * gap").replace("5.0", "6.0"))
    with pytest.raises(InputError, match="its file has changed"):
        translate(springs.other)
    assert before.constants.tolist() == [2.0]
    assert translate(springs.spring) == before, "what was read once stays what it was"
