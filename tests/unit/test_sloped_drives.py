"""Closed forms of drives of straight lines against differences of lowered drives and of runs."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from differences import AROUND, runs_around, slope
from scene_files import scene as scene_of
from tarsus.base.spec import float_paths, get_value, with_values
from tarsus.design import standing
from tarsus.model.drive.law import Cubic
from tarsus.model.drive.laws import LinearForce, TwoBranch
from tarsus.model.drive.lower import lower
from tarsus.model.drive.pieces import evaluate
from tarsus.plan.channels import sloped_drives
from tarsus.plan.lowering import lower_scene
from tarsus.solve import tangents

LEVELS = (6.0, -3.5, 7.5, 2.0, -7.0, -1.5)
TIMES = (0.011, 0.007, 0.013, 0.009, 0.006, 0.012)
LAWS = {
    "linear": LinearForce(gain=-1e-4, offset=2e-5),
    "plays": ts.drives.PrandtlIshlinskii(
        linear=-1e-4, quadratic=2e-6, cubic=1e-7, thresholds=(0.5, 1.5, 3.0, 5.0), weights=(-1e-4, -2e-4, -1e-4, -5e-5)
    ),
    "branches": TwoBranch(
        rising=Cubic(constant=1e-5, linear=-8e-4, quadratic=2e-6, cubic=1e-7),
        falling=Cubic(constant=-1e-5, linear=-9e-4, quadratic=-2e-6, cubic=2e-7),
    ),
}  # fmt: skip
WAVES = {
    "once": ts.OnOff(levels=LEVELS, durations=TIMES),
    "repeated": ts.OnOff(levels=LEVELS, durations=TIMES, repeat=True),
    "sampled": ts.Sampled(times=tuple(np.cumsum(TIMES)), levels=LEVELS),
}

OTHERS = {
    "sine": ts.Sine(amplitude=6.5, frequency=37.0, phase=0.7, offset=0.4),
    "square": ts.Square(amplitude=6.5, frequency=37.0, phase=0.7, offset=0.4, duty=0.3),
    "ramped": ts.waveforms.RampedSquare(amplitude=6.5, frequency=37.0, phase=0.7, offset=0.4, duty=0.4),
    "swept": ts.waveforms.SweptSine(
        amplitude=6.5, start_frequency=20.0, stop_frequency=60.0, duration=0.08, offset=0.3
    ),
    "spline": ts.Sampled(
        times=(0.001, 0.02, 0.04, 0.06), levels=(0.4, 7.0, -6.0, 1.0), interpolation="cubic"
    ),
    "poling": ts.waveforms.Poling(level=6.2, hold=0.03, fall=0.02),
    "ramp": ts.waveforms.Ramp(start=-3.0, stop=6.0, duration=0.05),
    "constant": ts.Constant(level=4.0),
}


def driven(law: object, wave: object) -> ts.Scene:
    return with_values(scene_of("p1_n2"), {"robot.drives.pull.law": law, "signals": {"pull": wave}})


def paths_of(scene: ts.Scene) -> list[str]:
    wave = scene.signals["pull"]
    last = "durations" if isinstance(wave, ts.OnOff) else "times"
    return [f"signals.pull.{field}.{k}" for field in ("levels", last) for k in range(len(wave.levels))]


def perturbed(scene: ts.Scene, path: str, step: float, when: np.ndarray) -> np.ndarray:
    """A drive's force and volts at times (2, nt) with a number moved."""
    moved = with_values(scene, {path: float(get_value(scene, path)) + step})
    drive = moved.robot.drives["pull"]
    return np.array([evaluate(one, when) for one in lower(moved.signals["pull"], drive.law, drive.history)])


def test_edges_move_by_what_lies_before_them():
    found, _ = sloped_drives(
        driven(LAWS["plays"], WAVES["repeated"]), [{"signals.pull.durations.1": 1.0}], []
    )
    one = found["pull"]
    assert one.force.begin[:8, 0] == pytest.approx([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    assert one.force.begin[8:, 0] == pytest.approx(
        [2.0] * 4
    )  # the first period comes once, and the second repeats
    assert one.force.loop[0] == one.by_period[0] == 1.0 and one.volts is None


@pytest.mark.parametrize(
    ("wave", "law"),
    [*((wave, "plays") for wave in (WAVES | OTHERS)), ("sine", "linear"), ("once", "linear"), ("swept", "branches"),
     ("square", "branches"), ("repeated", "branches"), ("spline", "branches")],
)  # fmt: skip
def test_every_number_of_every_wave_and_law(wave, law):
    """Away from jumps a drive's derivative is that of its lowered pieces, to what differences are good for: by the
    numbers of the signal, of the law and of the history."""
    scene = with_values(
        driven(LAWS[law], (WAVES | OTHERS)[wave]), {"robot.drives.pull.history": (9.31, -2.17)}
    )
    paths = [path for path in float_paths(scene) if path.startswith(("signals.", "robot.drives.pull.law"))]
    found, rest = sloped_drives(scene, [{path: 1.0} for path in paths], ["pull"])
    assert not any(rest)
    times = np.sort(np.random.default_rng(3).uniform(0.0, 0.09, 60))
    for p, path in enumerate(paths):
        value = float(get_value(scene, path))
        step = 1e-4 * (abs(value) or 1.0)
        both = slope([perturbed(scene, path, k * step, times) for k in AROUND], step)
        for wanted, one in zip(both, (found["pull"].force, found["pull"].volts), strict=True):
            got, smooth = at(one, times, p)
            scale = np.abs(one.pieces.coef).max() / (abs(value) or 1.0)
            scale = max(scale, np.abs(wanted[smooth]).max(initial=0.0))
            np.testing.assert_allclose(got[smooth], wanted[smooth], rtol=0.0, atol=2e-7 * scale, err_msg=path)
            assert smooth.sum() > 40


def at(one, times: np.ndarray, p: int) -> tuple[np.ndarray, np.ndarray]:
    """Derivative of a channel at times, and where no edge is near."""
    pieces, start = one.pieces, one.pieces.start
    turns = np.zeros(len(times))
    if pieces.loop >= 0:
        period = start[-1] - start[pieces.loop]
        turns = np.maximum(np.floor((times - start[pieces.loop]) / period), 0.0)
        times = times - turns * period
    piece = np.minimum(np.searchsorted(start, times, side="right") - 1, pieces.count - 1)
    a, b = start[piece], start[piece + 1]
    x = np.minimum(2.0 * (times - a) / (b - a) - 1.0, 1.0)
    powers = x[:, None] ** np.arange(12)
    rate = (pieces.coef[piece, 1:] * powers[:, :-1] * np.arange(1, 12)).sum(axis=1)
    held = times >= start[-1]
    da, db = (end[piece, p] + turns * one.loop[p] for end in (one.begin, one.end))
    got = (one.coef[piece, :, p] * powers[:, : one.coef.shape[1]]).sum(axis=1)
    got += np.where(held, 0.0, rate * -2.0 / (b - a) * (da + 0.5 * (x + 1.0) * (db - da)))
    # two steps of a difference beside, an edge may be on the other side
    room = 5e-5
    return got, held | ((times - a > room) & (b - times > room))


def test_what_is_behind_an_amplifier_is_left():
    scene = driven(LAWS["linear"], WAVES["once"])
    path = "signals.pull.levels.1"
    slow = with_values(scene, {"robot.drives.pull.amplifier": {"bandwidth": "2 kHz"}})
    assert sloped_drives(slow, [{path: 1.0}], []) == ({}, [{path: 1.0}])
    assert sloped_drives(scene, [{"ground.film.coefficient": 1.0}], []) == (
        {},
        [{"ground.film.coefficient": 1.0}],
    )


def test_an_edge_that_may_appear_has_no_derivative():
    never = with_values(
        scene_of("p1_n2"), {"signals": {"pull": ts.Square(amplitude=8.0, frequency=50.0, duty=0.0)}}
    )
    with pytest.raises(ts.InputError, match=r"signals\.pull\.duty: .*changes its pieces"):
        sloped_drives(never, [{"signals.pull.amplitude": 1.0}, {"signals.pull.duty": 1.0}], [])


def test_many_levels_cost_no_lowering(monkeypatch):
    def none(*_, **__):
        raise AssertionError("lowered beside the run's")

    monkeypatch.setattr(tangents.Stencil, "of", none)
    levels = tuple(np.where(np.arange(40) % 2, -8.0, 7.0) * (1.0 + 0.01 * np.arange(40)))
    scene = driven(LAWS["linear"], ts.OnOff(levels=levels, durations=(0.01,) * 40))
    paths = [*paths_of(scene), "robot.drives.pull.law.gain", "robot.drives.pull.law.offset"]
    found = ts.gradient("impact_speed", scene, paths, 0.4)
    assert not found.flags and all(np.isfinite(found[path]) for path in paths)
    # the gain times the levels is the force
    levelled = sum(found[f"signals.pull.levels.{k}"] * level for k, level in enumerate(levels))
    assert found[paths[-2]] * scene.robot.drives["pull"].law.gain == pytest.approx(levelled, rel=1e-9)


def test_samples_in_one_line_can_be_moved():
    """A sample on a straight line with its neighbours has a derivative as any other: it may make a kink."""
    wave = ts.Sampled(times=(0.0, 0.01, 0.02, 0.03, 0.04), levels=(0.0, 0.0, 0.0, -7.0, 8.0))
    scene, path = (
        with_values(driven(LAWS["linear"], wave), {"robot.feet.tip.gap": 1e-5}),
        "signals.pull.levels.1",
    )
    tight = ts.Accuracy(gap=1e-12, drive=1e-12)
    run = ts.simulate(scene, 0.06, tight, gradients=[path])
    wanted = slope([one.events["time"][0] for one in runs_around(scene, path, 0.02, 0.06, tight)], 0.02)
    assert run.event_gradients[path]["time"][0] == pytest.approx(wanted, rel=1e-6)
    backwards = ts.gradient(lambda events: events["time"][0], scene, [path], 0.06, tight)
    assert backwards[path] == pytest.approx(wanted, rel=1e-6)


def test_a_walker_that_stands_otherwise_starts_otherwise():
    """What a drive exerts at rest moves the start of a walker that stands; what its volts are to be does not."""
    scene = ts.with_values(ts.load_scene("millipede"), {"robot.drives.L1.law.offset": -1e-7})
    assert scene.initial.standing is not None and not scene.initial.standing.driven
    plan, paths = (
        lower_scene(scene),
        ["robot.drives.L1.law.offset", "gait.high", "ground.gravity.acceleration"],
    )
    moved = tangents.entering(scene, plan, paths, 0.01).data.initial
    for p, path in enumerate(paths):
        value = ts.get_value(scene, path)
        step = 1e-3 * abs(value)
        places = [ts.with_values(scene, {path: value + k * step, "initial.standing": None}) for k in AROUND]
        wanted = slope([np.array(standing(one).initial.displacement) for one in places], step)
        assert moved[: len(wanted), p] == pytest.approx(
            wanted, rel=1e-9, abs=1e-9 * np.abs(wanted).max() + 1e-18
        )
    assert moved[:, 0].any() and not moved[:, 1].any()


@pytest.mark.parametrize("law", ["linear", "plays"])
def test_an_edge_at_the_very_start_is_reported(law):
    """A phase that moves the edge at t = 0: on one side alone it acts there, with and without memory."""
    wave = ts.Square(amplitude=6.0, frequency=40.0, phase=0.0)
    run = ts.simulate(driven(LAWS[law], wave), 0.1, gradients=["signals.pull.phase"])
    found = run.gradient("impact_speed").flags["signals.pull.phase"]
    assert any("at the very start" in text for text in np.atleast_1d(found).tolist())
