"""The three landing rules: closed forms, the same decisions in both engines, and runs that always end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tarsus as ts
from tarsus.measure.history import PERIOD_MARK
from tarsus.model.drive.laws import LinearForce
from tarsus.plan.lowering import lower_scene
from tarsus.plan.rows import rows_of
from tarsus.solve.codes import structured_events
from tarsus.solve.engine import SINGLE_RUN, Engine
from tarsus_reproduce.forces import point_matrices
from walking_scenes import sticky, trotter

BOUNCE, CAPTURE, RELEASE, AVERAGED = 1, 2, 3, 9
MASS, STIFFNESS, GAP = 2e-9, 1.5, 1e-6
PULL = STIFFNESS * GAP


def ground(rule, e=0.5, adhesion=None, **laws) -> ts.Ground:
    """Restitution, adhesion [N] at first contact if any, and the rule."""
    held = None if adhesion is None else ts.Adhesion(initial=adhesion, rate=1e-5)
    return ts.Ground(restitution=ts.Restitution(coefficient=e), adhesion=held, landing=rule, **laws)


def hung(structure: str, rules: ts.Ground, damping=2e-6, speed=0.0, force=None, duration=2e-3) -> ts.Scene:
    """One mass on a spring above the ground, as a lumped coordinate or as a leg of a body too heavy to feel it.

    speed [m/s]: downward at the start, from the spring's rest; force: waveform [N] upward on the mass.
    """
    if structure == "lumped":
        body = ts.Lumped(coordinates=("foot",), mass=(MASS,), stiffness=(STIFFNESS,), damping=(damping,))
    else:
        leg = ts.structures.WalkerLeg(
            mass=MASS, stiffness_v=STIFFNESS, damping_v=damping, stiffness_l=STIFFNESS, damping_l=damping
        )
        body = ts.Walker(body=ts.structures.WalkerBody(mass=1e4), legs={"foot": leg})
    return ts.Scene(
        name="hung",
        robot=ts.Robot(
            structure=body,
            drives={"up": ts.Drive(load=ts.PointLoad(weights={"foot": 1.0}), law=LinearForce(gain=1.0))},
            feet={"foot": ts.Foot(point="foot", gap=GAP, electrode="up")},
        ),
        ground=rules,
        signals={} if force is None else {"up": force},
        initial=ts.Initial(velocity=tuple(-speed * body.row("foot"))),
        duration=duration,
    )


def landed(structure, rules, **how):
    """The first event, and the run: 0.1 ms."""
    run = ts.simulate(hung(structure, rules, **{"duration": 1e-4, **how}))
    assert run.ok and run.ledger.closure < 1e-8
    return run.events[0], run


@pytest.mark.parametrize("structure", ["lumped", "walker"])
@pytest.mark.parametrize(("adhesion", "kind"), [(1.001 * PULL, CAPTURE), (0.999 * PULL, BOUNCE), (None, BOUNCE)])
def test_held_unless_the_spring_pulls_harder_than_the_adhesion(structure, adhesion, kind):
    event, _ = landed(structure, ground(None, adhesion=adhesion), speed=0.05)
    assert event["kind"] == kind
    assert event["pull"] == pytest.approx(PULL, rel=1e-9)


@pytest.mark.parametrize("structure", ["lumped", "walker"])
@pytest.mark.parametrize(
    ("adhesion", "slow", "kind"),
    [
        (2.0 * PULL, 0.999, BOUNCE),  # faster than the speed: it departs whatever the adhesion
        (2.0 * PULL, 1.001, CAPTURE),
        (0.5 * PULL, 1.001, BOUNCE),  # slower, but the spring pulls it off: free at once
        (None, 1.001, BOUNCE),
    ],
)
def test_restitution_first_holds_what_departs_slowly(structure, adhesion, slow, kind):
    # without damping energy tells the speed at the ground: v^2 = v0^2 - k g^2 / m
    start, e = 0.05, 0.5
    arrives = np.sqrt(start**2 - STIFFNESS * GAP**2 / MASS)
    rule = ts.laws.RestituteFirst(speed=slow * e * arrives)
    event, run = landed(structure, ground(rule, e, adhesion), speed=start, damping=0.0)
    assert event["kind"] == kind
    assert event["speed_before"] == pytest.approx(arrives, rel=1e-9)
    assert event["speed_after"] == pytest.approx(e * arrives if kind == BOUNCE else 0.0, rel=1e-9)
    if kind == CAPTURE:  # what restitution would have kept is what adhesion took
        assert run.ledger.adhesion == pytest.approx(0.5 * MASS * (e * arrives) ** 2, rel=1e-9)


@pytest.mark.parametrize("structure", ["lumped", "walker"])
def test_the_ground_that_attracts_is_no_part_of_the_pull_as_printed(structure):
    """An attraction that outweighs spring and damper is in the true pull, but does not decide as printed."""
    e, damping, volts, offset = 0.5, 2e-4, 1e-9, 1e-3
    drawn = ts.Electrostatic(coefficient=100.0 * PULL * offset**2 / volts**2, offset=offset)

    def first(adhesion):
        rules = ground(ts.laws.PullAsPrinted(), e, adhesion, electrostatic=drawn)
        return landed(structure, rules, damping=damping, speed=0.5, force=ts.Constant(level=volts))[0]

    printed = -PULL + volts + damping * e * first(None)["speed_before"]
    assert 0.0 < printed < 100.0 * PULL
    for factor, kind in ((0.999, BOUNCE), (1.001, CAPTURE)):
        event = first(factor * printed)
        assert event["kind"] == kind
        assert event["pull"] == pytest.approx(-99.0 * PULL + volts, rel=1e-3)


@pytest.mark.parametrize("structure", ["lumped", "walker"])
@pytest.mark.parametrize(("adhesion", "kinds"), [(None, [2, 3]), (0.3 * PULL, [2, 3]), (2.0 * PULL, [2])])
def test_what_the_printed_pull_holds_leaves_by_the_true_one(structure, adhesion, kinds):
    """Where the printed pull is negative the foot is stopped, and let go at once if the spring really pulls it off."""
    rules = ground(ts.laws.PullAsPrinted(), 0.5, adhesion)
    _, run = landed(structure, rules, speed=0.05, damping=0.0, duration=2e-4)
    assert run.events["kind"][:2].tolist() == kinds
    assert np.ptp(run.events["time"][:2]) < 1e-15
    if RELEASE in kinds:  # it swings about the spring's rest from there
        assert (run.scene.robot.structure.row("foot") @ run.series.state.x).max() == pytest.approx(GAP, rel=1e-3)


@pytest.mark.parametrize(("normal", "phase"), [(1, 0.0), (-1, np.pi)])
def test_the_printed_pull_of_a_beam_is_that_of_its_two_points(normal, phase):
    """(2.13) from the matrices in the displacements of tip and centre; what happens at every landing is its sign."""
    beam = ts.with_values(
        ts.load_scene("cantilever"),
        {
            "robot.feet.tip": ts.Foot(point="tip", gap=1e-6, normal=normal),
            "signals.pzt.phase": phase,
            "ground.adhesion": None,
            "ground.gravity": ts.Gravity(),
            "ground.landing": ts.laws.PullAsPrinted(),
        },
    )
    run = ts.simulate(beam, duration=2e-3)
    landings = run.events[np.isin(run.events["kind"], (BOUNCE, CAPTURE))]
    assert {BOUNCE, CAPTURE} == set(landings["kind"].tolist())
    series = run.at(landings["time"] * (1.0 - 1e-13))
    structure, system = beam.robot.structure, run.plan.system
    e, m = beam.ground.restitution.coefficient, point_matrices(structure, ["tip", "center"])
    rows = normal * np.array([structure.row("tip"), structure.row("center")])
    x, v = rows @ series.state.x, rows @ series.state.v
    own = np.linalg.solve(rows.T, system.loads @ series.force + system.constant[:, None])[0]
    k, c = m.stiffness[0], m.damping[0]
    printed = -k[1] * x[1] - c[1] * v[1] + k[0] * x[0] + c[0] * -e * v[0] + own
    np.testing.assert_array_equal(landings["kind"] == BOUNCE, printed > 0.0)


def test_a_robot_on_three_legs_lands_as_printed_in_both_engines():
    """Feet that land one after the other, under electrostatics, on legs that press and pull each other."""
    electrostatic = ts.Electrostatic(coefficient=1e-19, offset=1e-6)
    walking = trotter(ground=sticky(friction=None, landing=ts.laws.PullAsPrinted(), electrostatic=electrostatic))
    run = ts.simulate(walking)
    plan = replace(lower_scene(walking), legs=None)
    other = structured_events(Engine(plan, walking.duration).run(rows_of(plan), SINGLE_RUN).events)
    other = other[other["kind"] != PERIOD_MARK]
    assert run.ok and run.ledger.closure < 1e-8
    assert run.events[["kind", "foot"]].tolist() == other[["kind", "foot"]].tolist()
    np.testing.assert_allclose(run.events["time"], other["time"], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("structure", ["lumped", "walker"])
def test_an_elastic_foot_that_is_pressed_is_in_averaged_contact_below_the_height_of_a_flight(structure):
    """It lands at v under a = (F - k gap) / m and would rise v^2 / 2a: no flight where that counts as none. All of its
    energy is then in the impacts, the ground carries the press, and it leaves when the force turns round."""
    push = ts.Square(amplitude=4.0 * PULL, frequency=50.0, phase=np.pi)
    pressed = hung(structure, ground(ts.laws.CaptureUnlessPulled(), 1.0), damping=0.0, force=push, duration=0.0101)
    found = ts.simulate(pressed, accuracy=ts.Accuracy(gap=1e-10, flight=1e-18)).events[:1]
    height = 0.5 * MASS * found["speed_before"][0] ** 2 / -found["pull"][0]
    run = ts.simulate(pressed, accuracy=ts.Accuracy(gap=1e-10, flight=1.001 * height))
    assert run.ok and run.ledger.closure < 1e-10
    assert run.events["kind"].tolist() == [AVERAGED, RELEASE]
    assert run.events["energy"][0] == pytest.approx(0.5 * MASS * found["speed_before"][0] ** 2, rel=1e-12)
    assert run.events["time"][1] == pytest.approx(0.01, rel=1e-9)
    assert run.at(np.array([5e-3])).state.pull[0, 0] == pytest.approx(-3.0 * PULL, rel=1e-9)
    assert "Foot 'foot' is in averaged contact (1 times" in run.remarks[0]
    short = pressed.model_copy(update={"duration": 1e-3})
    bouncing = ts.simulate(short, accuracy=ts.Accuracy(gap=1e-10, flight=0.999 * height)).events
    assert len(bouncing) > 10 and set(bouncing["kind"].tolist()) == {BOUNCE}


@pytest.mark.parametrize("structure", ["lumped", "walker"])
def test_derivatives_pass_through_averaged_contact(structure):
    """Of the energy that is counted as lost, and of the moment: by central differences of runs."""
    push = ts.Square(amplitude=4.0 * PULL, frequency=50.0, phase=np.pi)
    scene = hung(structure, ground(ts.laws.CaptureUnlessPulled(), 1.0), damping=0.0, force=push)
    path = "robot.feet.foot.gap"
    accuracy = ts.Accuracy(gap=1e-11, drive=1e-11, flight=2e-6)
    step = 1e-3 * GAP

    def first(gap):
        return ts.simulate(ts.with_values(scene, {path: gap}), accuracy=accuracy).events[0]

    run = ts.simulate(scene, accuracy=accuracy, gradients=[path])
    assert run.events["kind"].tolist() == [AVERAGED] and not run.flags
    low, high = first(GAP - step), first(GAP + step)
    for field in ("time", "energy"):
        wanted = (high[field] - low[field]) / (2.0 * step)
        assert run.event_gradients[path][field][0] == pytest.approx(wanted, rel=1e-5)
