"""A plan that is moved in its arrays is the one that is lowered anew, to the last bit."""

from __future__ import annotations

import numpy as np

import tarsus as ts
from tarsus.plan.lowering import lower_scene, of_leg, renumbered
from tarsus.solve import WindowStart, simulate_windows

LEG = "robot.structure.legs.L1."
SPRUNG = {f"{LEG}stiffness_v": 1.1, f"{LEG}damping_v": 0.9, f"{LEG}stiffness_l": 1.2, f"{LEG}damping_l": 0.7}
LAWS = {"ground.film.coefficient": 0.8, "ground.restitution.coefficient": 0.95, "ground.friction.coefficient": 1.3}


def moved(changes: dict[str, float]) -> tuple[ts.Scene, ts.Scene]:
    scene = ts.load_scene("millipede", hz=50, volts=14)
    own = {path: float(ts.get_value(scene, path)) * by for path, by in changes.items()}
    return scene, ts.with_values(scene, own)


def test_its_arrays_are_those_of_a_plan_that_is_lowered_anew() -> None:
    changes = {**SPRUNG, **LAWS}
    scene, other = moved(changes)
    found, wanted = renumbered(lower_scene(scene), other, list(changes)), lower_scene(other)
    assert found is not None
    assert wanted.legs is not None
    assert found.legs is not None
    pairs = [(found.system.arrays, wanted.system.arrays), (found.legs.body._asdict(), wanted.legs.body._asdict())]
    named = ("parameters", "flags", "volts")
    pairs.append(tuple({name: getattr(one.laws, name) for name in named} for one in (found, wanted)))
    for mine, theirs in pairs:
        for name, array in theirs.items():
            assert np.array_equal(mine[name], array), name
    for name in ("initial", "length", "force", "rate"):
        assert np.array_equal(getattr(found, name), getattr(wanted, name)), name
    assert np.array_equal(found.legs.blocks, wanted.legs.blocks)


def test_a_number_of_another_kind_is_lowered_anew() -> None:
    scene, other = moved({f"{LEG}mass": 1.1})
    assert renumbered(lower_scene(scene), other, [f"{LEG}mass"]) is None
    assert not of_leg(scene, f"{LEG}mass")


def test_states_without_forces_move_as_those_with_them() -> None:
    plan = lower_scene(moved({})[0])
    start = [WindowStart(plan.initial, 0.0, np.linspace(1e-3, 2e-2, 20))]
    whole, bare = (simulate_windows(plan, start, forces=forces).states for forces in (True, False))
    assert np.array_equal(whole.x, bare.x)
    assert np.array_equal(whole.v, bare.v)
    assert np.array_equal(whole.held, bare.held)
    assert len(bare.gap) == 0 < len(whole.gap)
