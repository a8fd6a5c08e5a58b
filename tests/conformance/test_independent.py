"""The library against a second simulator that shares no formula with it, on scenes drawn from seeds."""

from __future__ import annotations

import math

import pytest

import tarsus as ts
from independent.compare import compare, nudged
from random_scenes import branched_scene, creeping_scene, falling_friction, moving_scene, plain_scene, sliding_scene
from sliding_scenes import biped, by_modes, cantilever
from tarsus.base.events import EventKind
from tarsus.base.spec import with_values
from tarsus.model.laws import ElectroAdhesion, Friction
from walking_bodies import BODIES, with_body
from walking_scenes import sticky, trotter

FAST = {"modal": (13,), "legged": (22,)}
BRANCHED = {"modal": (6,), "legged": ()}
TIGHT = ts.Accuracy(gap=1e-10, drive=1e-11)
"""A walker's steps err by 1e-8 of a length unless it is asked for less, which would hide a drive's error."""


def some(fast: dict[str, tuple[int, ...]], count: int) -> list:
    """So many seeds of each kind, all but a few in the slow lane."""
    every = [(kind, seed) for kind in fast for seed in range(count)]
    return [one if one[1] in fast[one[0]] else pytest.param(*one, marks=pytest.mark.slow) for one in every]


@pytest.mark.parametrize(("kind", "seed"), some(FAST, 50))
def test_whole_sequences_of_events_agree(kind: str, seed: int) -> None:
    """Feet, kinds and times of all events, and the state at the end, up to where an error of a step grows 1e5 times."""
    found = compare(plain_scene(seed, kind == "legged"))
    assert found.wrong is None, found


@pytest.mark.parametrize(("kind", "seed"), some(BRANCHED, 25))
def test_they_agree_under_laws_of_two_branches_and_repeating_plateaus(kind: str, seed: int) -> None:
    """To 2e-9 rad but in legged 15: where its first foot is captured the states are 2e-11 of the length apart, whatever
    the accuracy (why is open), and so its slip, whose force hardly passes the bound, begins and ends 5e-8 rad apart."""
    found = compare(branched_scene(seed, kind == "legged"), TIGHT, 1e-7)
    assert found.wrong is None, found


@pytest.mark.slow
def test_they_agree_on_bodies_that_bend_and_carry_and_land_softly() -> None:
    scene = with_body(trotter(3), **BODIES["all"])
    found = compare(scene.model_copy(update={"duration": 0.001}), TIGHT)
    assert found.wrong is None and found.compared > 3, found


@pytest.mark.slow
def test_they_agree_on_feet_that_adhere_as_volts_command() -> None:
    pads = {"electro_adhesion": ElectroAdhesion(initial=0.0, coefficient=5e-9)}
    scene = trotter(2, ground=sticky(adhesion=None, laws=pads))
    found = compare(scene.model_copy(update={"duration": 0.002}), TIGHT)
    assert found.wrong is None and found.compared > 3, found


SLIDERS = {
    "cantilever": lambda: cantilever(),
    "cantilever that bounces": lambda: cantilever(adhesion=None),
    "cantilever over a film": lambda: cantilever(film=ts.Film(coefficient=1e-23, thickness=1e-6)),
    "cantilever on much friction": lambda: cantilever(friction=Friction(coefficient=1.5)),
    "biped": lambda: biped(),
    "biped that leans": lambda: biped(lean=0.9, friction=Friction(coefficient=0.7)),
    "biped that bounces": lambda: biped(adhesion=None, friction=Friction(coefficient=1.0)),
    "biped on rate-weakening friction": lambda: biped(
        friction={"kind": "rate_weakening", "static": 0.5, "dynamic": 0.2, "speed": 0.05}
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("scene", SLIDERS)
def test_feet_by_contact_modes_slip_and_stick_as_there(scene: str) -> None:
    """Whole sequences: friction bears on the push that bears it, and impacts couple both ways."""
    found = compare(SLIDERS[scene](), TIGHT)
    assert found.wrong is None and found.compared == found.events > 9, found


@pytest.mark.parametrize("seed", [24, *(pytest.param(s, marks=pytest.mark.slow) for s in range(40) if s != 24)])
def test_feet_that_nobody_chose_slip_and_stick_as_there(seed: int) -> None:
    found = compare(sliding_scene(seed), TIGHT)
    assert found.wrong is None, found


@pytest.mark.parametrize("seed", [s if s in (2, 10) else pytest.param(s, marks=pytest.mark.slow) for s in range(30)])
def test_ground_that_moves_is_felt_as_there(seed: int) -> None:
    """Modal, legged and sliding scenes on ground that is told its displacement, velocity or acceleration; bases move
    with it or stay, and starts are in the laboratory or on it."""
    found = compare(moving_scene(seed), TIGHT, 1e-7, 1e-6)
    assert found.wrong is None, found


def on_falling_friction(seed: int, legged: bool = False) -> ts.Scene:
    scene = plain_scene(seed, True) if legged else sliding_scene(seed)
    return ts.with_values(scene, {"ground.friction": falling_friction(seed)})


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("legged", [False, True])
def test_feet_slip_as_there_on_friction_that_falls_with_the_speed(seed: int, legged: bool) -> None:
    found = compare(on_falling_friction(seed, legged), TIGHT, 1e-7, 1e-6)
    assert found.wrong is None, found


def test_slides_of_rounding_and_impacts_that_follow_at_once_are_as_there() -> None:
    """Of 259 a slide on friction that falls within 50 nm/s begins slower than rounding; of 291 a foot that bounces is
    sent down again at once by the capture of the other."""
    for seed, least in ((259, 20), (291, 18)):
        found = compare(on_falling_friction(seed), TIGHT, 1e-7, 1e-6)
        assert found.wrong is None and found.compared > least, found


@pytest.mark.slow
def test_masses_that_fly_free_are_undamped_as_there() -> None:
    """289 ended 2e-8 of its length apart."""
    found = compare(on_falling_friction(289), TIGHT, 1e-7, 1e-6)
    assert found.wrong is None and found.compared == found.events == 2, found


@pytest.mark.parametrize("seed", [*(pytest.param(seed, marks=pytest.mark.slow) for seed in (45, 46)), 64, 117])
def test_feet_that_nothing_pulls_along_leave_and_friction_jams_as_there(seed: int) -> None:
    """Of 45 and 46 friction ends with the margin of a foot that sticks, and nothing pulls it along: it leaves and slips
    not. Of 64 one foot that begins to slide is pressed down by its friction 1.6 times as hard as friction bears on; of
    117 one is as its slide slows down, which ended as too stiff, or by rounding with the foot pulled off."""
    scene = on_falling_friction(seed)
    found = compare(scene, TIGHT, 1e-7, 1e-6)
    assert found.wrong is None and found.compared == found.events > 1, found
    code = ts.simulate(scene).code.name
    assert code == ("JAMMED" if seed in (64, 117) else "DONE")
    assert by_last_bits(scene) == {found.events}


def by_last_bits(scene: ts.Scene) -> set[int]:
    """Numbers of events of gaps that differ by rounding."""
    length = 1e-15 * max(foot.gap for foot in scene.robot.feet.values())
    return {len(ts.simulate(nudged(scene, k * length), accuracy=TIGHT).events) for k in range(-4, 5)}


def test_rounding_brakes_no_foot_and_makes_none_slide() -> None:
    """Of 108 an impact hits a foot whose only way is along its normal; of 191 feet stop at the bound of their friction;
    of 291 one stops on which friction bears nothing."""
    for seed, events in ((108, 55), (191, 96), (291, 23)):
        assert by_last_bits(on_falling_friction(seed)) == {events}


@pytest.mark.parametrize("seed", [108, pytest.param(191, marks=pytest.mark.slow)])
def test_feet_that_rounding_braked_or_let_slide_go_as_there(seed: int) -> None:
    found = compare(on_falling_friction(seed), TIGHT, 1e-7, 1e-6)
    assert found.wrong is None and found.compared == found.events > 50, found


def test_feet_that_share_one_way_come_to_rest_together() -> None:
    """Of three modes two feet on the ground leave one way along it: either may bear the load, friction bears it, and
    they rest. Held against the second simulator, which tries every choice, until it matters which of them bears it."""
    found = compare(ts.with_values(on_falling_friction(87), {"duration": 1.5e-4}), TIGHT, 1e-7, 1e-6)
    assert found.wrong is None and found.compared >= 22, found


def test_a_lightly_pressed_foot_beside_a_film_needs_no_tiny_steps() -> None:
    """The film pulls on a held foot by the change of its momentum, whose rounding is a force the larger the shorter a
    step is: steps grew ever shorter as the foot's friction ended, until it left too early or memory was full. It leaves
    where the independent simulator says."""
    run = ts.simulate(nudged(on_falling_friction(21), 1e-15), accuracy=ts.Accuracy(gap=1e-10, drive=1e-11, steps=2000))
    assert run.ok and run.events["kind"][-1] == EventKind.RELEASE
    assert run.events["time"][-1] == pytest.approx(1.1653564801e-4, rel=1e-9)


@pytest.mark.parametrize(
    ("seed", "legged"),
    [
        (6, False),
        *(pytest.param(s, k, marks=pytest.mark.slow) for s, k in ((10, True), (10, False), (11, True), (12, False))),
    ],
)
def test_they_agree_under_drives_that_creep(seed: int, legged: bool) -> None:
    scene = creeping_scene(seed, legged)
    found = compare(with_values(scene, {"duration": scene.duration * (0.25 if seed == 6 else 1.0)}), TIGHT)
    assert found.wrong is None and found.compared > 1, found


def bar_over_a_film() -> ts.Scene:
    """A bar whose left foot lands on a film while its right one is moving away from it: the impact turns that."""
    return ts.Scene(
        name="bar over a film",
        robot=ts.Robot(
            structure=ts.Lumped(
                coordinates=("z", "q"),
                mass=(1e-6, 0.3e-6),
                stiffness=(1.0, 1.0),
                damping=(0.0, 0.0),
                weights={"left": (1.0, -1.0), "right": (1.0, 1.0)},
            ),
            feet={"left": ts.Foot(point="left", gap=1e-6), "right": ts.Foot(point="right", gap=2e-5)},
        ),
        ground=ts.Ground(
            restitution=ts.Restitution(coefficient=0.5),
            film=ts.Film(coefficient=1e-19, thickness=5e-6),
            adhesion=ts.Adhesion(initial=3.1102102341243336e-07, rate=0.0),
        ),
        initial=ts.Initial(velocity=(-0.1, 0.1)),
        duration=2e-3,
    )


def test_the_film_on_other_feet_pulls_with_their_rates_after_the_impact() -> None:
    """With those before it the first pull is 4.94e-7 N, and the foot that is to be captured bounces."""
    scene = bar_over_a_film()
    assert ts.simulate(scene).events["kind"][0] == EventKind.CAPTURE
    found = compare(scene, TIGHT)
    assert found.wrong is None and found.compared == found.events > 1, found


@pytest.mark.parametrize(
    ("degrees", "legged"),
    [(20.0, True), *(pytest.param(d, k, marks=pytest.mark.slow) for d in (-35.0, 90.0, 180.0) for k in (True, False))],
)
def test_feet_slip_and_hold_on_slopes_walls_and_ceilings_as_there(degrees: float, legged: bool) -> None:
    short = degrees == 20.0
    scene = trotter(2 if short else 3, ground=sticky(adhesion=ts.Adhesion(initial=3e-6, rate=1e-3)))
    scene = with_values(scene if legged else by_modes(scene), {"ground.incline": math.radians(degrees)})
    found = compare(with_values(scene, {"duration": 0.001 if short else 0.01}), TIGHT)
    assert found.wrong is None and found.compared > (3 if short else 9), found


@pytest.mark.slow
def test_they_agree_on_a_line_of_ground_for_each_side() -> None:
    """Teeth under the left feet, a polyline under the right ones, which fly and slide over corners."""
    teeth = {"kind": "sawtooth", "length": 6e-6, "height": 1e-7, "rising": 0.3, "start": -3e-6}
    points = [[4.985e-4, 0.0], [5.003e-4, 2e-7], [5.043e-4, -5e-8], [5.2e-4, 0.0]]
    line = {"kind": "polyline", "given": points}
    ground = {"kind": "feet", "feet": {"left": teeth, "right": line}}
    scene = with_values(trotter(2, ground=sticky(), turning=False), {"ground.profile": ground, "duration": 0.0015})
    found = compare(scene, TIGHT)
    assert found.wrong is None and found.compared > 3, found
