import math
import sys
from pathlib import Path

import pytest

from tarsus.base import pythonfile
from tarsus.base.errors import InputError
from tarsus.model.laws import Film, ImpactLaw, SmoothLaw, load_laws

GOOD = '''
"""A magnet under the ground."""

from __future__ import annotations

import math

from tarsus.model.laws import ImpactLaw, SmoothLaw
from tarsus.base.spec import quantity


class MagnetPull(SmoothLaw):
    """Pull that decays over a reach."""

    uses_rate = False
    strength: float = quantity("N", "pull in contact", ge=0)
    reach: float = quantity("m", "decay length", default=1e-6, gt=0)

    def force(gap, gap_rate, volts, time, strength, reach):
        return -strength * math.exp(-gap / reach)


class SoftImpact(ImpactLaw):
    loss: float = quantity("1", "share of the speed lost", ge=0, le=1)

    @staticmethod
    def rebound(speed, loss):
        return speed * (1.0 - loss)
'''


def law_file(folder: Path, text: str) -> Path:
    file = folder / "law.py"
    file.write_text(text)
    return file


def test_names_are_snake_case() -> None:
    assert Film.name() == "film"

    class JKRContact(SmoothLaw):
        @staticmethod
        def force(gap: float, gap_rate: float, volts: float, time: float) -> float:
            return 0.0

    assert JKRContact.name() == "jkr_contact"


def test_user_file(tmp_path: Path) -> None:
    laws = load_laws(law_file(tmp_path, GOOD))
    assert list(laws) == ["magnet_pull", "soft_impact"]
    pull = laws["magnet_pull"](strength="3 uN")  # type: ignore[call-arg]
    assert isinstance(pull, SmoothLaw)
    assert pull.parameters() == (3e-6, 1e-6)
    function = type(pull).function()
    assert function is not None
    assert function(1e-6, 0.0, 0.0, 0.0, *pull.parameters()) == -3e-6 * math.exp(-1.0)
    assert issubclass(laws["soft_impact"], ImpactLaw)


def test_an_edited_file_gives_the_new_law(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the second in which it was loaded, too, where Python keeps byte code."""
    monkeypatch.setattr("sys.dont_write_bytecode", False)
    before = load_laws(law_file(tmp_path, GOOD))["soft_impact"].function()
    after = load_laws(law_file(tmp_path, GOOD.replace("1.0 - loss", "0.5 - loss")))["soft_impact"].function()
    assert before is not None and after is not None
    assert (before(1.0, 0.0), after(1.0, 0.0)) == (1.0, 0.5)


HEAD = "from tarsus.model.laws import SmoothLaw\nfrom tarsus.base.spec import quantity\n"


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
