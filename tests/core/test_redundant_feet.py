"""More feet on the ground than a structure has ways to move: what they carry is shared, and none makes energy."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.events import EventKind
from tarsus.base.spec import validate, with_values
from tarsus.model.scene import Scene


def bar(places: tuple[float, ...], ground: dict, gap: float) -> Scene:
    """A rigid bar that heaves and rocks under its weight, lifted at its first foot by a square wave."""
    structure = {
        "kind": "lumped",
        "coordinates": ["z", "q"],
        "mass": [1e-6, 0.3e-6],
        "stiffness": [0.0, 0.0],
        "damping": [1e-5, 1e-5],
        "weights": {f"p{i}": [1.0, p] for i, p in enumerate(places)},
        "upward": [1.0, 0.0],
    }
    drive = {"load": {"kind": "point", "weights": {"p0": 1.0}}, "law": {"kind": "linear", "gain": 1.0}}
    feet = {f"f{i}": {"point": f"p{i}", "gap": gap} for i in range(len(places))}
    return validate(
        Scene,
        {
            "name": "bar",
            "duration": 0.05,
            "robot": {"structure": structure, "drives": {"d": drive}, "feet": feet},
            "signals": {"d": {"kind": "square", "amplitude": 1.5e-5, "frequency": 100.0}},
            "ground": {"gravity": {"acceleration": 9.81}, **ground},
        },
    )


@pytest.mark.parametrize("places", [(-1.0, -0.3, 0.3, 1.0), (-1.0, -1.0, 1.0, 1.0)], ids=["four", "in pairs"])
@pytest.mark.parametrize("sticky", [False, True])
@pytest.mark.parametrize("e", [0.0, 0.4])
@pytest.mark.parametrize("gap", [0.0, 1e-6])
def test_a_bar_on_four_feet(places: tuple[float, ...], sticky: bool, e: float, gap: float) -> None:
    ground: dict = {"restitution": {"coefficient": e}}
    if sticky:
        ground["adhesion"] = {"initial": 1e-6, "rate": 1e-4}
    run = ts.simulate(bar(places, ground, gap))
    assert run.ok and run.ledger.closure < 1e-12
    assert run.series.state.gap.min() > -1e-15
    assert np.all(run.events["energy"] >= -1e-20)


@pytest.mark.parametrize("below", [1, 3])
@pytest.mark.parametrize("above", [1, 2])
def test_a_mass_without_clearance_between_floor_and_ceiling_stays(below: int, above: int) -> None:
    """Pressed down and up in turn, by forces that pass through zero; it cannot move, whoever carries it."""
    rows = np.linspace(0.5, 1.5, below + above)
    structure = {
        "kind": "modal",
        "frequencies": [2e4],
        "damping_ratios": [0.0],
        "modal_masses": [4e-8],
        "shapes": {f"p{i}": [row] for i, row in enumerate(rows)},
    }
    feet = {f"f{i}": {"point": f"p{i}", "gap": 0.0, "normal": 1 if i < below else -1} for i in range(below + above)}
    drive = {"load": {"kind": "point", "weights": {"p0": 1.0}}, "law": {"kind": "linear", "gain": 1e-3}}
    scene = validate(
        Scene,
        {
            "name": "wedged",
            "duration": 2e-4,
            "robot": {"structure": structure, "drives": {"d": drive}, "feet": feet},
            "signals": {"d": {"kind": "sine", "amplitude": 8.0, "frequency": 2e4, "phase": 0.3}},
            "ground": {"restitution": {"coefficient": 0.0}},
        },
    )
    run = ts.simulate(scene)
    assert run.ok, run.code
    assert len(run.events) < 100
    np.testing.assert_allclose(run.series.state.gap, 0.0, atol=1e-18)
    carried = run.series.contact
    assert carried.min() > -1e-6 * carried.max()


def test_a_bar_on_pairs_of_feet_anywhere_stops_on_them_once() -> None:
    """What rounding left of a stopped foot's rate, 1e-17 m/s, was an approach: it was stopped 4,000 times."""
    random = np.random.default_rng(7)
    places = [(-left, -left, right, right) for left, right in random.uniform(0.2, 1.5, (25, 2))]
    for at, inertia in [*((at, 0.3e-6) for at in places), ((-1.0, -1.0, 1.0, 1.0), 0.7e-6), ((-1.0, 1.0, 1.0), 0.3e-6)]:
        scene = bar(at, {"restitution": {"coefficient": 0.0}}, 0.0)
        run = ts.simulate(with_values(scene, {"robot.structure.mass": (1e-6, inertia)}))
        assert run.ok and len(run.events) < 100, (at, inertia)


def test_a_foot_at_a_point_that_does_not_move_hears_of_nothing() -> None:
    """One divided by its mobility; numpy warned."""
    scene = bar((-1.0, 1.0), {"restitution": {"coefficient": 0.0}}, 1e-6)
    still = with_values(scene, {"robot.structure.weights": {"p0": [1.0, -1.0], "p1": [0.0, 0.0]}})
    with np.errstate(all="raise"):
        run = ts.simulate(still)
    assert run.ok and set(run.events["foot"][run.events["kind"] != EventKind.PERIOD_MARK]) == {0}
