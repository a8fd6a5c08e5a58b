"""Every registered law: finite, passive where it says so; a user's law is as good."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from example_laws import EXAMPLES
from tarsus.model.laws import AdhesionLaw, DampingLaw, FrictionLaw, ImpactLaw, Law, SmoothLaw
from tarsus.solve.motion import law_value as value

GAPS = np.concatenate([[0.0], np.geomspace(1e-12, 1e-2, 60)])
SPEEDS = np.geomspace(1e-9, 10.0, 40)


def arguments(law: Law) -> list[tuple[float, ...]]:
    if isinstance(law, DampingLaw):
        return [(g,) for g in GAPS]
    if isinstance(law, SmoothLaw):
        return [(g, v, 3.0, 0.1) for g in GAPS[::6] for v in (-0.1, 0.0, 0.1)]
    if isinstance(law, FrictionLaw):
        every = [(m, s, v) for m in (0.0, 1e-9, 1e-3) for s in (0.0, 1e-6) for v in (0.0, *SPEEDS)]
        return [point[: len(law.leading)] for point in every]
    return [(s,) for s in (0.0, *SPEEDS)]


@pytest.mark.parametrize("law", EXAMPLES, ids=lambda law: law.name())
def test_finite_and_passive_where_its_protocol_says_so(law):
    values = np.array([law.function()(*point, *law.parameters()) for point in arguments(law)])
    assert np.isfinite(values).all()
    if isinstance(law, DampingLaw):
        assert np.all(np.diff(values) <= 0.0), "the momentum never grows with the gap: D >= 0"
    elif isinstance(law, ImpactLaw):
        assert np.all(values >= 0.0) and np.all(values <= np.concatenate([[0.0], SPEEDS]))
    elif isinstance(law, (AdhesionLaw, FrictionLaw)):
        assert np.all(values >= 0.0)
    elif isinstance(law, SmoothLaw) and law.uses_rate:
        rates = np.array([point[1] for point in arguments(law)])
        assert np.all(values * rates <= 0.0)


MEMORIES = [law for law in EXAMPLES if isinstance(law, AdhesionLaw) and law.remaining is not None]


@pytest.mark.parametrize("law", MEMORIES, ids=lambda law: law.name())
def test_what_remains_does_not_depend_on_how_the_time_is_cut(law):
    """A flow of time: of no age nothing is left, of any the more the shorter the time; so says the engine's program."""
    ages, times = np.geomspace(1e-6, 10.0, 15), np.geomspace(1e-6, 10.0, 15)

    def left(age, away):
        return law.evaluate(age, away, hook="remaining")

    for age in ages:
        assert left(age, 0.0) == pytest.approx(age, rel=1e-12) and left(0.0, age) == 0.0
        rows = [left(age, away) for away in times]
        assert np.all(np.diff(rows) <= 0.0) and rows[-1] >= 0.0
        assert [left(left(age, 2e-3), away) for away in times] == pytest.approx(
            [left(age, 2e-3 + away) for away in times], rel=1e-9, abs=1e-300
        )
        assert value(law, age, times, hook="remaining") == pytest.approx(rows, rel=1e-13, abs=1e-300)


OWN_FRICTION = """
from tarsus import quantity
from tarsus.model.laws import FrictionLaw

class Rough(FrictionLaw):
    leading = ("margin", "strength")
    mu: float = quantity("1", "coefficient of friction", ge=0)

    @staticmethod
    def bound(margin, strength, mu):
        return mu * margin

class Sluggish(FrictionLaw):
    mu: float = quantity("1", "coefficient of friction", ge=0)

    @staticmethod
    def bound(margin, strength, speed, mu):
        return mu * margin + 0.0 * speed
"""


@pytest.mark.parametrize("name", ["rough", "sluggish"])
def test_a_users_friction_from_a_file_is_coulombs(name, tmp_path):
    """With and without the slip speed among its arguments."""
    (tmp_path / "own.py").write_text(OWN_FRICTION)
    own = ts.load_laws(tmp_path / "own.py")[name]
    base = ts.load_scene("millipede")
    mu = base.ground.friction.coefficient
    mine = ts.with_values(base, {"ground.friction": None, "ground.laws": {name: own(mu=mu)}})
    one, other = (ts.simulate(scene, duration=0.03) for scene in (base, mine))
    assert one.ok and other.ok and len(one.events) > 5
    for field in ("kind", "foot"):
        assert one.events[field].tolist() == other.events[field].tolist()
    np.testing.assert_allclose(other.events["time"], one.events["time"], rtol=1e-9)
    np.testing.assert_allclose(other.events["speed_before"], one.events["speed_before"], rtol=1e-7, atol=1e-12)
    assert other.ledger.friction == pytest.approx(one.ledger.friction, rel=1e-9)
