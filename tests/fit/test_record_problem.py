"""Records by windows: slopes against differences."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene as scene_of
from tarsus.base.errors import InputError
from tarsus.base.events import EventKind
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, with_values
from tarsus.fit.record_problem import RecordProblem, Seen, SeenRecord, Segment
from tarsus.fit.unknowns import Prior
from tarsus.model.scene import Scene
from tarsus.plan.lowering import lower_scene
from tarsus.solve.contacts import Contacts
from tarsus.solve.outputs import Output, output_rows

FILM, BOUNCE = "ground.film.coefficient", "ground.restitution.coefficient"
TIP = Seen(Output(Quantity.DISPLACEMENT, "x0"), 2e-8, zero="zero")
SPEED = Seen(Output(Quantity.VELOCITY, "x0"), 1e-4, gain="gain")
OTHER = Seen(Output(Quantity.DISPLACEMENT, "x1"), 2e-8)
PRIORS = {
    FILM: Prior(2.5e-19, factor=1.5),
    BOUNCE: Prior(0.4, factor=1.2),
    "gain": Prior(1.0, sd=0.05),
    "zero": Prior(0.0, sd=1e-7),
}
TRUE = {"gain": 1.02, "zero": 5e-8}


def shown(scene: Scene, run: ts.Run, channels: tuple[Seen, ...], times: np.ndarray, seed: int) -> SeenRecord:
    """What instruments whose numbers are `TRUE` record of a run."""
    rng, rows = np.random.default_rng(seed), []
    for one in channels:
        gain, zero = (TRUE[v] if isinstance(v, str) else v for v in (one.gain, one.zero))
        clean = output_rows(scene, [one.output], times).values(run.states(times))[0]
        rows.append(gain * clean + zero + one.noise * rng.standard_normal(len(times)))
    return SeenRecord(channels, times, np.array(rows))


def at(run: ts.Run, when: float) -> np.ndarray:
    """State of a run."""
    there = run.states(np.array([when]))
    return np.concatenate([there.x[:, 0], there.v[:, 0]])


def chain() -> tuple[RecordProblem, list[Segment]]:
    """Two records of a chain of masses that bounces: flights, an impact, and a detachment."""
    spread, scenes, records, segments = np.array([2e-7, 2e-7, 1e-3, 1e-3]), [], [], []
    for r, volts in enumerate((8.0, 6.0)):
        scene = scene_of("p1_n2", {"signals.pull.amplitude": volts})
        run = ts.simulate(scene, 0.018)
        channels = (TIP, SPEED, OTHER) if r else (TIP, SPEED)
        scenes.append(scene)
        records.append(shown(scene, run, channels, np.arange(10, 1400) / 100e3, r))
        kinds, times = run.events["kind"], run.events["time"]
        hit, let_go = float(times[kinds == EventKind.BOUNCE][0]), float(times[kinds == EventKind.RELEASE][-1])
        for begin in (hit - 2.5e-4, hit - 2e-4):
            span = begin + 3e-5, hit + 2e-4
            segments.append(Segment(r, begin, span, at(run, begin) + 0.3 * spread, spread))
        span = let_go + 3e-5, let_go + 3e-3
        segments.append(Segment(r, let_go, span, at(run, let_go), spread, Contacts(leaving=[0])))
    return RecordProblem(tuple(scenes), tuple(records), PRIORS), segments


def gradient_off(problem: RecordProblem, segments: list[Segment], seed: int) -> float:
    """Largest difference between slopes of the costs and their central differences, of the largest of its kind."""
    rng, count = np.random.default_rng(seed), len(segments)
    q = len(segments[0].state)
    own, moved = 0.2 * rng.standard_normal((count, q)), 0.2 * rng.standard_normal(len(problem.priors))
    system, step = problem.equations(segments, own, moved), 1e-4

    def costs(starts: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        left = problem.residuals(segments, starts, numbers)
        return np.array([np.sum(one**2) for one in left]) + np.sum(starts**2, axis=1)

    worst = 0.0
    for k in range(q + len(moved)):
        by_own, by_moved = np.eye(q + len(moved))[k][:q] * step, np.eye(q + len(moved))[k][q:] * step
        up, down = (costs(own + s * by_own, moved + s * by_moved) for s in (1.0, -1.0))
        right = system.right_own[:, k] if k < q else system.right_shared[:, k - q]
        off = np.max(np.abs((down - up) / (4.0 * step) - right))
        assert np.isfinite(off)
        worst = max(worst, float(off / max(np.max(np.abs(right)), 1e-3)))  # a number may bear on nothing
    return worst


def test_slopes_by_every_number_are_those_of_the_costs() -> None:
    assert gradient_off(*chain(), seed=0) < 1e-4


def test_what_a_held_foot_leaves_no_choice_stays() -> None:
    problem, segments = chain()
    own = np.random.default_rng(1).standard_normal((1, 4))
    row = lower_scene(problem.scenes[0]).system.normals[:, 0]
    moved = problem.flown(segments[2:3], own, np.zeros(len(PRIORS))).batch.starts[0]
    off = np.asarray(moved.state) - segments[2].state
    assert np.abs(off).max() > 0.0
    assert abs(row @ off[:2]) < 1e-18 and abs(row @ off[2:]) < 1e-15


def test_slopes_of_a_walker_are_those_of_the_costs() -> None:
    scene = with_values(ts.load_scene("millipede", hz=50, volts=14), {FILM: 8e-24})
    run = ts.simulate(scene, 0.03)
    drive = next(iter(scene.robot.drives))
    channels = (
        Seen(Output(Quantity.DISPLACEMENT, "heave"), 1e-7, zero="zero"),
        Seen(Output(Quantity.VELOCITY, "surge"), 5e-5, gain="gain"),
        Seen(Output(Quantity.CURRENT, drive, motional=True), 1e-9),
    )
    record = shown(scene, run, channels, np.arange(1, 500) / 20e3, 2)
    leg = "robot.structure.legs.L1.stiffness_v"
    priors = PRIORS | {leg: Prior(float(get_value(scene, leg)), factor=1.1), FILM: Prior(8e-24, factor=1.5)}
    spread = np.repeat([1e-7, 1e-4], 6)
    segments = []
    for begin in (5e-3, 12.1e-3, 23.2e-3):
        held = [int(i) for i in np.flatnonzero(run.states(np.array([begin])).held[:, 0])]
        contacts = Contacts(held, [begin - 2e-4] * len(held))
        segments.append(Segment(0, begin, (begin + 1e-4, begin + 2e-3), at(run, begin), spread, contacts))
    assert any(one.contacts.held for one in segments)
    assert gradient_off(RecordProblem((scene,), (record,), priors), segments, seed=3) < 1e-4


def test_records_that_do_not_fit_are_refused() -> None:
    voltage = Seen(Output(Quantity.VOLTAGE, "pull"), 0.0)
    with pytest.raises(InputError) as refused:
        SeenRecord((voltage,), np.zeros(3), np.zeros((1, 2)))
    assert [word in str(refused.value) for word in ("shape (1, 3)", "noise above 0")] == [True] * 2
