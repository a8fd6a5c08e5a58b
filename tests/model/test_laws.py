"""Laws of the ground: the library's, a user's from a file, and what their functions may contain."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from example_files import load_file
from tarsus.base import pythonfile
from tarsus.base.errors import InputError
from tarsus.core import _native
from tarsus.model.laws import load_laws
from tarsus.model.laws.program import Op
from tarsus.model.laws.translate import translate

HEAD = "from tarsus.model.laws import ImpactLaw, SmoothLaw\nfrom tarsus.base.spec import quantity\n"
SOFT = """class SoftImpact(ImpactLaw):
    loss: float = quantity("1", "share of the speed lost", ge=0, le=1)

    @staticmethod
    def rebound(speed, loss):
        return speed * (1.0 - loss)
"""


def law_file(folder: Path, text: str) -> Path:
    file = folder / "law.py"
    file.write_text(text)
    return file


def test_an_edited_file_gives_the_new_law(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the second in which it was loaded, too, where Python keeps byte code."""
    monkeypatch.setattr("sys.dont_write_bytecode", False)
    before = load_laws(law_file(tmp_path, HEAD + SOFT))["soft_impact"].function()
    after = load_laws(law_file(tmp_path, HEAD + SOFT.replace("1.0 -", "0.5 -")))["soft_impact"].function()
    assert before is not None and after is not None
    assert (before(1.0, 0.0), after(1.0, 0.0)) == (1.0, 0.5)


@pytest.mark.parametrize(
    "loop",
    [
        "while True:\n    pass\n",
        "while True:\n    try:\n        x = [0 for _ in range(9)]\n    except Exception:\n        pass\n",
        "def turn():\n    for i in range(10**12):\n        pass\nturn()\n",
    ],
)
def test_a_file_that_never_ends_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, loop: str) -> None:
    monkeypatch.setattr(pythonfile, "PATIENCE", 0.1)
    before = sys.gettrace()
    with pytest.raises(InputError, match=r"law\.py, line \d+: it takes longer than 0\.1 s to be read"):
        load_laws(law_file(tmp_path, HEAD + loop))
    assert sys.gettrace() is before


@pytest.mark.parametrize(
    ("turn", "said"), [("gap += 1", "more than 4000 operations"), ("pass", "it takes longer than 0.1 s to be read")]
)
def test_a_law_that_never_ends_is_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, turn: str, said: str
) -> None:
    monkeypatch.setattr(pythonfile, "PATIENCE", 0.1 if turn == "pass" else 10.0)
    text = f"class A(SmoothLaw):\n    def force(gap, gap_rate, volts, time):\n        while True:\n            {turn}"
    with pytest.raises(InputError, match=rf"line \d: {said}"):
        load_laws(law_file(tmp_path, HEAD + text))


REFUSED = [
    ("while x > 1:\n    x = x / 2\nreturn x", "more than 256 comparisons in a row: does a loop end by", 1),
    ("for _ in range(x):\n    pass\nreturn x", "a number that changes is used where a known one is needed", 1),
    ("for _ in range(5000):\n    x = x + 1\nreturn x", "more than 4000 operations with all loops written out", 2),
    ("for k in range(9):\n    x = x + (1 if x > k else 0)\nreturn x", "more than 256 outcomes of its comparisons", 0),
    ("if x > 0:\n    return 1.0", "it returns nothing on some path, not a number", 0),
    ("if x > 0:\n    y = 2.0\nreturn y * x", "local variable 'y'", 3),
    ('return x + "1"', "unsupported operand type.* 'number' and 'str'", 1),
    ("return np.sqrt(x)", "'number' does not support ufuncs", 1),
    ("return law(x - 1.0)", "it raises RecursionError", 1),
    ("return json.dumps(x)", "number is not JSON serializable", 1),
    ("import cmath\n\nreturn cmath.sqrt(x)", "a number that changes is used where a known one is needed", 3),
    ("return x.real", "'number' object has no attribute 'real'", 1),
    ("return x + 1.0 / 0.0", "it raises ZeroDivisionError", 1),
    ("return x + no_such_name", "name 'no_such_name' is not defined", 1),
    ("return 1.0", "it takes its arguments by position, each by its name", 0),
    ("return (x, x)", "it returns a tuple, not a number", 0),
    ("print(x)\nreturn x", "it only computes", 1),
    ("return math.sqrt(x, x)", "'sqrt' takes 1 numbers in a law, got 2", 1),
    ("return x + 10**400", "int too large to convert to float", 1),
    ("seen.append(x)\nreturn x if x > len(seen) else 0.0", "it does something else when it is run again", 2),
]
"""Bodies of a law of x, what is said of each, and in which line."""


@pytest.mark.parametrize(("body", "said", "below"), REFUSED, ids=[body for body, _, _ in REFUSED])
def test_what_a_law_may_not_contain_is_a_sentence(body, said, below, tmp_path):
    file = tmp_path / "refused.py"
    arguments = "*x" if "position" in said else "x"
    lines = body.replace("\n", "\n    ")
    file.write_text(
        f"import json\nimport math\n\nimport numpy as np\n\nseen = []\n\n\ndef law({arguments}):\n    {lines}\n"
    )
    with pytest.raises(InputError, match=rf"^law, line {9 + below}: .*{said}"):
        translate(load_file(file).law)


ALLOWED = [
    ("return max([x * k for k in range(3)])", lambda x: max(0.0, x, 2.0 * x)),
    ("return 1.0 if x in (1.0, 2.0) else 0.0", lambda x: float(x in (1.0, 2.0))),
    ("for k in range(3):\n    if x > k:\n        break\nreturn x * k", lambda x: x * (0 if x > 0 else 2)),
    ("def inner(y):\n    return y + (3 & 1)\n\nreturn inner(x)", lambda x: x + 1),
    ("k = 0\nwhile k < 3:\n    k += 1\nreturn x * k", lambda x: 3.0 * x),
    ("table = {'a': 2.0}\nreturn table['a'] * (lambda y: -y)(x)", lambda x: -2.0 * x),
    ("try:\n    return math.exp(x) if not x else helper(x)\nfinally:\n    pass", lambda x: x + 1.0),
    ("return Shared.twice(x)", lambda x: 2.0 * math.fabs(x)),
]
"""Bodies of a law of x that Python has and a list of what is allowed need not, and what they are."""


@pytest.mark.parametrize(("body", "plain"), ALLOWED, ids=[body for body, _ in ALLOWED])
def test_a_law_is_what_python_makes_of_it(body, plain, tmp_path):
    file = tmp_path / "plain.py"
    lines = body.replace("\n", "\n    ")
    file.write_text(
        "import math\n\n\ndef helper(x):\n    return x + 1.0\n\n\nclass Shared:\n    @staticmethod\n    def twice(x):\n"
        f"        return 2.0 * math.fabs(x)\n\n\ndef law(x):\n    {lines}\n"
    )
    program = translate(load_file(file).law)
    points = np.array([[-1.5, 0.0, 0.5, 1.0, 1.5, 2.0, 7.0]])
    found = _native.evaluate(program.code, program.constants, points, np.zeros(0))
    assert found.tolist() == [plain(x) for x in points[0].tolist()]


def test_a_law_is_a_function_of_python():
    with pytest.raises(InputError, match="plain function"):
        translate(math.sqrt)


def test_a_comparison_that_is_asked_twice_has_one_outcome():
    def law(x, y):
        total = 0.0
        for _ in range(20):
            total += x if x > y else y
        return total

    program = translate(law)
    assert [Op(number) for number in program.code[:, 0]].count(Op.SELECT) == 1
