"""Feet that land, leave or rest at one moment: all of them by one rule, in no order; in closed form, at random."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.spec import validate
from tarsus.model.scene import Scene

BOUNCE, CAPTURE, RELEASE, REST, CONTACT_AT_START, STICK = 1, 2, 3, 4, 5, 8
G, GAP = 9.81, 1e-3
SPEED = float(np.sqrt(2.0 * G * GAP))


def rigid(places: dict[str, float], ground: dict[str, Any], order=None, duration=0.05) -> Scene:
    """A rod of 1 g, and 0.5 g by square length about its centre, that falls level on feet at these places."""
    names = list(order or places)
    structure = ts.Lumped(
        coordinates=("z", "p"),
        mass=(1e-3, 0.5e-3),
        stiffness=(0.0, 0.0),
        damping=(0.0, 0.0),
        weights={name: (1.0, places[name]) for name in names},
        upward=(1.0, 0.0),
    )
    feet = {name: ts.Foot(point=name, gap=GAP) for name in names}
    falls = {"gravity": {"acceleration": G}, **ground}
    return Scene(name="rod", duration=duration, robot=ts.Robot(structure=structure, feet=feet), ground=falls)


def of_feet(run: ts.Run) -> dict[str, np.ndarray]:
    """The events of each foot, but for the last mark."""
    events = run.events[run.events["time"] < run.scene.duration]
    return {name: events[events["foot"] == i] for i, name in enumerate(run.scene.robot.feet)}


@pytest.mark.parametrize("order", [("a", "b"), ("b", "a")], ids="".join)
@pytest.mark.parametrize("e", [0.0, 0.3, 0.5, 1.0])
def test_a_level_rod_stays_level(e: float, order: tuple[str, str]) -> None:
    """Both ends depart with e v, every time, for as long as flights last."""
    run = ts.simulate(rigid({"a": -1.0, "b": 1.0}, {"restitution": {"coefficient": e}}, order))
    assert run.ok and run.ledger.closure < 1e-12
    a, b = of_feet(run).values()
    assert a["kind"].tolist() == b["kind"].tolist()
    np.testing.assert_allclose(a["time"], b["time"], rtol=1e-14)
    flights = np.arange(len(a))
    np.testing.assert_allclose(a["speed_before"], SPEED * e**flights, rtol=1e-9)
    np.testing.assert_allclose(b["speed_before"], SPEED * e**flights, rtol=1e-9)
    if e == 0.0:
        assert a["kind"].tolist() == [CAPTURE] and a["pull"][0] == pytest.approx(-0.5e-3 * G, rel=1e-12)
        return
    bounces = a["kind"] == BOUNCE
    np.testing.assert_allclose(a["speed_after"][bounces], SPEED * e ** (flights[bounces] + 1), rtol=1e-9)
    starts = SPEED / G + 2.0 * SPEED / G * np.array([sum(e**k for k in range(1, n + 1)) for n in flights])
    np.testing.assert_allclose(a["time"][bounces], starts[bounces], rtol=1e-9)
    np.testing.assert_allclose(
        a["energy"][bounces], 0.25e-3 * (1.0 - e * e) * (SPEED * e ** flights[bounces]) ** 2, rtol=1e-8, atol=1e-25
    )
    if e < 1.0 and starts[-1] < 0.05 and not bounces[-1]:
        assert a["kind"][-1] == REST and a["time"][-1] == pytest.approx(SPEED / G * (1.0 + e) / (1.0 - e), rel=1e-7)


@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
def test_a_rod_on_feet_at_unlike_distances(e: float) -> None:
    """Both depart with e v; their impulses are as one over their distances, and so are the energies."""
    events = of_feet(ts.simulate(rigid({"near": -0.25, "far": 1.0}, {"restitution": {"coefficient": e}})))
    near, far = events["near"][0], events["far"][0]
    impulse = 1e-3 * (1.0 + e) * SPEED
    for one, share in ((near, 0.8), (far, 0.2)):
        assert one["time"] == pytest.approx(SPEED / G, rel=1e-12)
        assert one["energy"] == pytest.approx(0.5 * share * impulse * (1.0 - e) * SPEED, rel=1e-9, abs=1e-22)
        assert one["speed_after"] == pytest.approx(e * SPEED, rel=1e-12)


def test_a_foot_that_the_blow_on_another_throws_off_has_no_impact() -> None:
    """Two feet on one side of the centre: the nearer is struck, the farther turns up faster than it would bounce."""
    e, near, far = 0.4, 0.25, 1.0
    run = ts.simulate(rigid({"far": far, "near": near}, {"restitution": {"coefficient": e}}), "15 ms")
    events = of_feet(run)
    assert events["near"]["kind"].tolist() == [BOUNCE] and not len(events["far"])
    impulse = (1.0 + e) * SPEED / (1e3 + near**2 / 0.5e-3)
    after = run.at(np.array([events["near"]["time"][0] * (1.0 + 1e-9)])).state
    turn = impulse * near / 0.5e-3
    np.testing.assert_allclose(after.v[:, 0], [impulse * 1e3 - SPEED, turn], rtol=1e-6)
    assert run.ledger.closure < 1e-12


# ---- friction in closed form


A, HEIGHT, INERTIA = 0.5, 0.4, 0.3  # of a rod of 1 kg: its feet beside its centre and below it, its inertia


def sliding(mu: float, e: float, x: float, order: tuple[str, str]) -> ts.Run:
    """It comes down level at 1 m/s, half a second from the ground, and moves along it at x."""
    structure = ts.Lumped(
        coordinates=("x", "z", "p"),
        mass=(1.0, 1.0, INERTIA),
        stiffness=(0.0,) * 3,
        damping=(0.0,) * 3,
        weights={"back": (0.0, 1.0, -A), "front": (0.0, 1.0, A), "below": (1.0, 0.0, HEIGHT)},
    )
    feet = {name: ts.Foot(point=name, gap=0.5, along="below") for name in order}
    ground = {"restitution": {"coefficient": e}, "friction": {"coefficient": mu}}
    initial = ts.Initial(velocity=(x, -1.0, 0.0))
    robot = ts.Robot(structure=structure, feet=feet)
    return ts.simulate(Scene(name="rod", duration=0.6, robot=robot, ground=ground, initial=initial))


@pytest.mark.parametrize("order", [("back", "front"), ("front", "back")], ids=lambda order: order[0])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_a_level_rod_that_slides_stays_level(e: float, order: tuple[str, str]) -> None:
    """Both feet push, and are braked as one block is, by mu (1 + e) v; friction shifts the push to the front."""
    mu, x = 0.3, 2.0
    run = sliding(mu, e, x, order)
    after = run.at(np.array([0.5 + 1e-9])).state.v[:, 0]
    np.testing.assert_allclose(after, [x - mu * (1.0 + e), e, 0.0], atol=1e-12 if e else 1e-8)
    pushes = {"back": -1.0, "front": 1.0}
    for name, events in of_feet(run).items():
        push = 0.5 * (1.0 + e) * (1.0 + pushes[name] * mu * HEIGHT / A)
        assert events["kind"][0] == (BOUNCE if e else CAPTURE)
        # of the impulse along the ground at the rate halfway
        along = mu * push * (x - 0.5 * mu * (1.0 + e))
        assert events["energy"][0] == pytest.approx(0.5 * push * (1.0 - e) + along, rel=1e-12)


@pytest.mark.parametrize("order", [("back", "front"), ("front", "back")], ids=lambda order: order[0])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_a_rod_that_friction_would_topple_lands_on_its_front(e: float, order: tuple[str, str]) -> None:
    """Friction takes the push from the back, which the blow on the front throws off: as if that landed alone."""
    mu, x = 2.0, 50.0
    normal, across = 1.0 + A * A / INERTIA, A * HEIGHT / INERTIA
    push = (1.0 + e) / (normal - mu * across)
    run = sliding(mu, e, x, order)
    after = run.at(np.array([0.5 + 1e-9])).state.v[:, 0]
    turn = (A - mu * HEIGHT) * push / INERTIA
    want = [x - mu * push, push - 1.0, turn]
    assert want[1] - A * turn > e  # the back rises
    events = of_feet(run)
    assert not len(events["back"]) and events["front"]["kind"][0] == (BOUNCE if e else CAPTURE)
    np.testing.assert_allclose(after, want, rtol=1e-6, atol=1e-6)


# ---- random scenes


def drawn(seed: int) -> dict[str, Any]:
    """A structure that flies freely, its feet to the ground at half a second; maps and adhesion by chance."""
    rng = np.random.default_rng(seed)
    n, feet = int(rng.integers(2, 6)), int(rng.integers(2, 7))
    root = rng.normal(size=(n, n))
    mass = root @ root.T / n + 0.3 * np.eye(n)
    velocity = rng.normal(size=n)
    rows: list[np.ndarray] = []
    while len(rows) < feet:
        row = rng.normal(size=n)
        if row @ velocity < -0.2:
            rows.append(row)
    weights = {f"f{i}": row.tolist() for i, row in enumerate(rows)}
    standing = {
        name: {"point": name, "gap": float(-0.5 * (row @ velocity))} for name, row in zip(weights, rows, strict=True)
    }
    ground: dict[str, Any] = {"restitution": {"coefficient": float(rng.choice([0.0, 0.5, 1.0, rng.uniform()]))}}
    if rng.random() < 0.4:
        ground["adhesion"] = {"initial": float(10.0 ** rng.uniform(-3.0, 1.0)), "rate": 0.0}
        if rng.random() < 0.5:
            ground["landing"] = {"kind": "restitute_first", "speed": float(rng.uniform(0.0, 2.0))}
    kind = rng.choice(["plain", "friction", "map"])
    if kind == "friction":
        for name, row in list(weights.items()):
            weights[f"t{name}"] = (0.7 * rng.normal(size=n) + 0.3 * np.array(row)).tolist()
            standing[name]["along"] = f"t{name}"
        ground["friction"] = {"kind": "coulomb", "coefficient": float(rng.uniform(0.1, 0.8))}
    if kind == "map":
        columns = {}
        for name, row in zip(weights, rows, strict=True):
            way = np.linalg.solve(mass, row) + 0.3 * rng.normal(size=n)
            columns[name] = {f"q{k}": float(one) for k, one in enumerate(way / (row @ way))}
        ground["impact"] = {"kind": "given", "columns": columns}
    structure = {
        "kind": "lumped",
        "coordinates": [f"q{k}" for k in range(n)],
        "mass": (0.5 * (mass + mass.T)).tolist(),
        "stiffness": [0.0] * n,
        "damping": [0.0] * n,
        "weights": weights,
    }
    return {
        "name": "drawn",
        "duration": 0.6,
        "robot": {"structure": structure, "feet": standing},
        "ground": ground,
        "initial": {"velocity": velocity.tolist()},
    }


def mirrored(seed: int) -> dict[str, Any]:
    """The same with feet in pairs left and right of a plane of symmetry, and the motion in it."""
    data = drawn(seed)
    structure, feet = data["robot"]["structure"], data["robot"]["feet"]
    rng = np.random.default_rng(seed + 1)
    n = len(structure["coordinates"])
    other = rng.uniform(0.2, 2.0, size=2)
    structure["coordinates"] += ["a", "b"]
    wide = np.diag([*np.zeros(n), *other])
    wide[:n, :n] = structure["mass"]
    structure |= {"mass": wide.tolist(), "stiffness": [0.0] * (n + 2), "damping": [0.0] * (n + 2)}
    data["initial"]["velocity"] += [0.0, 0.0]
    columns = data["ground"].get("impact", {}).get("columns", {})
    for name, row in list(structure["weights"].items()):
        sway = rng.normal(size=2)
        del structure["weights"][name]
        for side, sign in (("l", 1.0), ("r", -1.0)):
            structure["weights"][side + name] = [*row, *(sign * sway)]
            if name not in feet:
                continue
            along = {"along": side + feet[name]["along"]} if "along" in feet[name] else {}
            feet[side + name] = {"point": side + name, "gap": feet[name]["gap"], **along}
            if name in columns:
                columns[side + name] = columns[name] | {"a": 0.0, "b": 0.0}
        feet.pop(name, None)
        columns.pop(name, None)
    return data


def reordered(data: dict[str, Any], order: np.ndarray) -> dict[str, Any]:
    """The same scene with its tables of feet in another order."""
    feet = list(data["robot"]["feet"].items())
    return data | {"robot": data["robot"] | {"feet": dict(feet[i] for i in order)}}


def outcome(run: ts.Run) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Events by foot, and the velocities at the end."""
    return of_feet(run), run.at(np.array([run.scene.duration])).state.v[:, 0]


def same(one: np.ndarray, other: np.ndarray) -> None:
    assert one["kind"].tolist() == other["kind"].tolist()
    for field in ("time", "speed_before", "speed_after"):
        np.testing.assert_allclose(one[field], other[field], rtol=1e-7, atol=1e-9)
    # shares of feet that hardly move but together are known to less; feet that stop at one moment stick in turn
    np.testing.assert_allclose(one["energy"], other["energy"], rtol=1e-6, atol=1e-9)
    landed = one["kind"] <= CAPTURE
    np.testing.assert_allclose(one["pull"][landed], other["pull"][landed], rtol=1e-7, atol=1e-9)


def complies(data: dict[str, Any], seed: int) -> None:
    """No order of the tables matters, no energy is made, and feet that only bounce depart with e v at least."""
    run = ts.simulate(validate(Scene, data))
    assert run.ok and run.ledger.closure < 1e-10
    assert np.all(run.events["energy"] >= -1e-12)
    feet, end = outcome(run)
    assert sum(events["time"][0] == pytest.approx(0.5, rel=1e-9) for events in feet.values() if len(events)) >= 1
    count = len(feet)
    for order in (np.arange(count)[::-1], np.random.default_rng(seed).permutation(count)):
        again, later = outcome(ts.simulate(validate(Scene, reordered(data, order))))
        np.testing.assert_allclose(later, end, rtol=1e-7, atol=1e-9)
        for name, events in feet.items():
            same(again[name], events)
    bounced = all(len(events) <= 1 and set(events["kind"]) <= {BOUNCE} for events in feet.values())
    if bounced and not {"impact", "adhesion"} & set(data["ground"]):  # a map moves others too; adhesion stops
        weights, e = data["robot"]["structure"]["weights"], data["ground"]["restitution"]["coefficient"]
        for name, events in feet.items():
            before, after = (float(np.dot(weights[name], v)) for v in (data["initial"]["velocity"], end))
            assert after >= -e * before - 1e-9
            if len(events) and events["energy"][0] > 1e-9:
                assert after == pytest.approx(-e * before, abs=1e-9)


def stays_symmetric(data: dict[str, Any]) -> ts.Run:
    """Feet left and right have the same events, whatever the order of the tables."""
    run = ts.simulate(validate(Scene, data))
    assert run.ok or run.code.name == "JAMMED"  # by friction on feet that slide once they have landed
    feet, end = outcome(run)
    np.testing.assert_allclose(end[-2:], 0.0, atol=1e-9)
    for name, events in feet.items():
        if name.startswith("l"):
            same(feet["r" + name[1:]], events)
    again = ts.simulate(validate(Scene, reordered(data, np.arange(len(feet))[::-1])))
    assert again.code == run.code
    for name, events in outcome(again)[0].items():
        same(loaded(feet[name]), loaded(events))
    return run


def loaded(events: np.ndarray) -> np.ndarray:
    """Without rests under no pull: whether a foot that carries nothing lies on the ground is rounding."""
    return events[(events["kind"] != CONTACT_AT_START) | (np.abs(events["pull"]) > 1e-12)]


@pytest.mark.parametrize("seed", [*range(8), *(pytest.param(seed, marks=pytest.mark.full) for seed in range(8, 208))])
def test_random_feet_that_land_together(seed: int) -> None:
    complies(drawn(seed), seed)
    stays_symmetric(mirrored(seed))


@pytest.mark.parametrize("seed", [232, 327])
def test_pairs_of_feet_rest_slide_and_leave_together(seed: int) -> None:
    """Of 232 those that rest there were held in turn, and those that let go were released in turn, one of them only."""
    stays_symmetric(mirrored(seed))


# ---- feet that leave at one moment


@pytest.mark.parametrize("order", [("a", "b"), ("b", "a")], ids="".join)
def test_both_ends_of_a_rod_leave_at_once_and_it_stays_level(order: tuple[str, str]) -> None:
    """Each carries half of what pulls at the middle, and one that stayed alone would carry a third."""
    strength, reached, duration = 1e-3, 0.02, 0.05
    ground = {"restitution": {"coefficient": 0.0}, "adhesion": {"initial": strength, "rate": 0.0}, "gravity": None}
    drive = {"load": {"kind": "point", "weights": {"z": 1.0}}, "law": {"kind": "linear", "gain": 1.0}}
    pull = {"kind": "ramp", "start": 0.0, "stop": 2.0 * strength * duration / reached, "duration": duration}
    rod = rigid({"a": -1.0, "b": 1.0}, ground, order, duration)
    gaps = {f"robot.feet.{name}.gap": 0.0 for name in order}
    run = ts.simulate(ts.with_values(rod, {"robot.drives": {"d": drive}, "signals": {"d": pull}} | gaps))
    assert run.ok and run.ledger.closure < 1e-11
    for events in of_feet(run).values():
        left = events[events["kind"] == RELEASE]
        assert len(left) == 1 and left["time"][0] == pytest.approx(reached, rel=1e-12)
    state = run.at(np.array([duration])).state
    rise = 2.0 * strength / (1e-3 * reached)  # of its acceleration
    np.testing.assert_allclose(state.v[:, 0], [rise * (duration**2 - reached**2) / 2.0, 0.0], atol=1e-12)


def by_margins(run: ts.Run) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations away from the ground (k, k) of rigid feet that have landed where a run of `mirrored` ends, by their
    pushes, and by their margins under friction against their slips after the impact."""
    structure, ground = run.scene.robot.structure, run.scene.ground
    on = [name for name, events in of_feet(run).items() if len(events) and events["kind"][-1] != RELEASE]
    normal = np.array([structure.weights[name] for name in on])
    way = np.array([structure.weights[run.scene.robot.feet[name].along] for name in on])
    _, velocity = np.split(run.motion.last, 2)  # `at` shows those before the impact
    np.testing.assert_allclose(normal @ velocity, 0.0, atol=1e-14)
    slip = way @ velocity
    assert np.all(np.abs(slip) > 1e-4)
    pushed, rubbed = (normal @ np.linalg.solve(np.array(structure.mass), rows.T) for rows in (normal, way))
    return pushed, pushed - rubbed * (np.sign(slip) * ground.friction.coefficient)


def motions(run: ts.Run) -> int:
    """How many motions these feet have: which of them stay on the ground, pressed by N + f_a >= 0, while the others
    rise."""
    pushed, by_margin = by_margins(run)
    found = 0
    for stays in itertools.product([False, True], repeat=len(pushed)):
        held = np.array(stays)
        down = pushed[:, held].sum(axis=1) * run.scene.ground.adhesion.initial  # adhesion is no push
        margin = np.linalg.solve(by_margin[np.ix_(held, held)], down[held])
        rises = by_margin[:, held] @ margin - down
        found += bool(np.all(margin >= 0.0) and np.all(rises[~held] > 0.0))
    return found


@pytest.mark.parametrize("seed", [44, 94, 233, 263, 265, 280, 315, 454])
def test_a_run_ends_as_jammed_where_friction_leaves_several_motions(seed: int) -> None:
    """Beside the symmetric one there are others, in which feet of a pair part."""
    run = stays_symmetric(mirrored(seed))
    assert run.code.name == "JAMMED" and motions(run) > 1


# ---- slides that stop at one moment


def swaying(seed: int) -> dict[str, Any]:
    """A robot of `mirrored` that has friction, on springs: its feet are captured, slide and stop again and again."""
    data = mirrored(seed)
    rng = np.random.default_rng([seed, 5])
    structure = data["robot"]["structure"]
    n = len(structure["coordinates"])
    data["ground"] |= {
        "adhesion": {"initial": float(10.0 ** rng.uniform(-1.0, 1.0)), "rate": 0.0},
        "restitution": {"coefficient": 0.0},
    }
    data["ground"].pop("landing", None)
    structure |= {"stiffness": (10.0 ** rng.uniform(-1.0, 2.0, n)).tolist(), "damping": [0.0] * n}
    return data | {"duration": 6.0}


@pytest.mark.parametrize("seed, until", [(43, 6.0), (169, 6.0), (459, 2.5)])
def test_pairs_of_feet_whose_slides_stop_at_one_moment(seed: int, until: float) -> None:
    """Where the foot of the lower number was asked first, it stuck and its twin slid on; of 169 both begin to slide,
    and cannot, beside others that do. Of 459 both left, each asked without its own friction alone, and pressed down as
    they would be then; at 2.86 s they lift off, the one that rounding picks first, and the other takes its load."""
    data = swaying(seed) | {"duration": until}
    run = ts.simulate(validate(Scene, data))
    feet = of_feet(run)
    again = ts.simulate(validate(Scene, reordered(data, np.arange(len(feet))[::-1])))
    assert again.code == run.code and (run.code.name == "JAMMED" or run.ledger.closure < 1e-8)
    for name, events in feet.items():
        twin = {"l": "r", "r": "l"}[name[0]] + name[1:]
        for other in (of_feet(again)[name], feet[twin]):
            assert events["kind"].tolist() == other["kind"].tolist()
            np.testing.assert_allclose(events["time"], other["time"], atol=1e-6)
    if seed != 459:
        stops = run.events["time"][run.events["kind"] == STICK]
        assert len(np.unique(stops)) < len(stops)
