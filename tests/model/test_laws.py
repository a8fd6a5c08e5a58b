import math
import sys
from pathlib import Path
from typing import ClassVar

import pytest

from tarsus.base import pythonfile
from tarsus.base.errors import InputError
from tarsus.base.spec import quantity
from tarsus.model.laws import (
    Adhesion,
    DampingLaw,
    Electrostatic,
    Film,
    Friction,
    Gravity,
    ImpactLaw,
    Law,
    Restitution,
    SmoothLaw,
    load_laws,
)

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


def test_friction_is_borne_by_push_and_adhesion_and_never_pulls() -> None:
    law = Friction(coefficient="30 %")
    assert law.parameters() == (0.3,)
    assert law.function() is Friction.bound
    assert Friction.bound(2e-6, 1e-6, *law.parameters()) == pytest.approx(0.6e-6)
    assert Friction.bound(0.0, 1e-6, 0.3) == 0.0 == Friction.bound(2e-6, 1e-6, 0.0)


def test_electrostatics_attract() -> None:
    law = Electrostatic(coefficient=2e-20, offset="1 um")
    assert Electrostatic.force(1e-6, 0.3, -10.0, 0.0, *law.parameters()) == pytest.approx(-2e-20 * 100 / 4e-12)
    assert not Electrostatic.uses_rate


def test_adhesion_grows_with_contact_time() -> None:
    law = Adhesion(initial="0.2743 uN", rate="1.700 uN/s")
    assert Adhesion.strength(0.0, *law.parameters()) == 0.2743e-6
    assert Adhesion.strength(0.1, *law.parameters()) == pytest.approx(0.4443e-6, rel=1e-14)


def test_restitution_keeps_a_share_of_the_speed() -> None:
    assert Restitution.rebound(2.0, *Restitution(coefficient=0.378).parameters()) == 0.756


def test_gravity_is_only_a_parameter() -> None:
    assert Gravity().parameters() == (9.81,)
    assert Gravity.function() is None


@pytest.mark.parametrize("law", [Film, Electrostatic, Adhesion, Restitution, Gravity])
def test_every_law_says_what_it_is(law: type[Law]) -> None:
    assert law.__doc__
    for field in law.model_fields.values():
        assert field.description
    function = law.function()
    assert function is None or function.__doc__


def test_names_are_snake_case() -> None:
    assert Film.name() == "film"

    class JKRContact(SmoothLaw):
        @staticmethod
        def force(gap: float, gap_rate: float, volts: float, time: float) -> float:
            return 0.0

    assert JKRContact.name() == "jkr_contact"


def test_a_law_field_needs_a_unit() -> None:
    with pytest.raises(TypeError, match=r"strength: .*a unit"):

        class Bad(SmoothLaw):
            strength: float = 1.0


def test_a_law_function_takes_what_the_protocol_says() -> None:
    with pytest.raises(TypeError, match=r"must take \(gap, stiffness\)"):

        class Bad(DampingLaw):
            stiffness: float = quantity("N s/m^2", "k")

            @staticmethod
            def momentum(gap: float) -> float:
                return gap


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


def test_class_variables_are_not_parameters() -> None:
    class Plain(SmoothLaw):
        uses_rate: ClassVar[bool] = False
        a: float = quantity("N", "a force")

        @staticmethod
        def force(gap: float, gap_rate: float, volts: float, time: float, a: float) -> float:
            return a

    assert Plain(a=2.0).parameters() == (2.0,)


def test_a_law_that_breaks_its_promise_is_refused(tmp_path):
    """Friction that drives, and a memory that is no flow of time, would close their accounts for the wrong reason."""
    path = tmp_path / "broken.py"
    path.write_text(
        '"""Broken laws."""\n'
        "from tarsus import quantity\n"
        "from tarsus.model.laws import AdhesionLaw, FrictionLaw\n\n\n"
        "class Driving(FrictionLaw):\n"
        '    """Friction that drives."""\n'
        '    share: float = quantity("1", "share", default=0.3)\n'
        '    leading = ("margin", "strength")\n'
        "    @staticmethod\n"
        "    def bound(margin, strength, share):\n        return -share * margin\n\n\n"
        "class Jumping(AdhesionLaw):\n"
        '    """A memory that jumps."""\n'
        '    rate: float = quantity("N/s", "rate", default=1e-3)\n'
        "    @staticmethod\n"
        "    def strength(age, rate):\n        return rate * age\n"
        "    @staticmethod\n"
        "    def remaining(age, away, rate):\n        return age / (1 + 1e6 * away * away)\n"
    )
    laws = load_laws(path)
    with pytest.raises(InputError, match="bound is negative at margin 1e-06"):
        laws["driving"]()
    with pytest.raises(InputError, match="remaining is no flow of time: of an age"):
        laws["jumping"]()
