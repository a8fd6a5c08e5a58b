"""What instruments see: charges and currents of drives, points of modal robots and of walkers, and their slopes."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from differences import AROUND, slope
from scene_files import scene as scene_of
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, with_values
from tarsus.model.drive.laws import PrandtlIshlinskii
from tarsus.plan.lowering import lower_scene
from tarsus.solve import channels
from tarsus.solve.channels import POINT, RunChannel
from tarsus.solve.engine import Accuracy
from tarsus.solve.explored import Explored
from tarsus.solve.outputs import Output, output_rows, output_slopes
from tarsus.solve.window import WindowGradients, WindowStart, simulate_windows
from walking_scenes import trotter

Q = Quantity
G, M, C, K, F = 3e-6, 1e-7, 2e-6, 4.0, 5e-10
"""Gain [N/V], mass [kg], damping [N s/m], stiffness [N/m] and capacitance [F] of an oscillator."""


def oscillator(signal, **changes) -> ts.Scene:
    drive = ts.Drive(load=ts.ModalLoad(participation=(1.0,)), law=ts.LinearForce(gain=G), capacitance=F)
    robot = ts.Robot(
        structure=ts.Lumped(coordinates=("tip",), mass=((M,),), damping=((C,),), stiffness=((K,),)),
        drives={"pzt": drive},
    )
    scene = ts.Scene(name="oscillator", robot=robot, ground=ts.Ground(), signals={"pzt": signal}, duration=0.1)
    return with_values(scene, changes) if changes else scene


def test_a_capacitor_alone_takes_c_v() -> None:
    """Nothing moves: q = C V and i = C dV/dt, in ramps of 8 V in 5 ms."""
    wave = ts.Sampled(times=(0.0, 0.005, 0.01), levels=(0.0, 8.0, 0.0))
    run = ts.simulate(oscillator(wave, **{"robot.drives.pzt.law.gain": 0.0}), 0.02)
    at = np.array([0.001, 0.004, 0.0075, 0.015])
    charge, current = run.outputs([Output(Q.CHARGE, "pzt"), Output(Q.CURRENT, "pzt")], at)
    np.testing.assert_allclose(charge, F * np.array([1.6, 6.4, 4.0, 0.0]), rtol=1e-12, atol=1e-24)
    np.testing.assert_allclose(current, F * 1600.0 * np.array([1.0, 1.0, -1.0, 0.0]), rtol=1e-12, atol=1e-24)
    series = run.series
    np.testing.assert_allclose(series["charge"], F * series["volts"], rtol=1e-12, atol=1e-24)
    assert "charge" in series and "chagre" not in list(series)


def test_motional_current_at_resonance_is_g_squared_v_over_c() -> None:
    rate = np.sqrt(K / M)
    wave = ts.Sine(amplitude=0.5, frequency=float(rate / (2.0 * np.pi)))
    run = ts.simulate(oscillator(wave), 60.0 * M / C)
    times = run.end_time - np.linspace(0.0, 2.0 * np.pi / rate, 400, endpoint=False)[::-1]
    motional, whole, volts = run.outputs(
        [Output(Q.CURRENT, "pzt", motional=True), Output(Q.CURRENT, "pzt"), Output(Q.VOLTAGE, "pzt")], times
    )
    np.testing.assert_allclose(motional, G * G / C * volts, atol=1e-9 * G * G / C * 0.5)
    np.testing.assert_allclose(whole - motional, F * 0.5 * rate * np.cos(rate * times), atol=1e-9 * F * rate)


def supplied(run: ts.Run, panels: int) -> float:
    """The integral of V dq over a run by Gauss's rule on volts and currents, all drives together [J]."""
    x, w = np.polynomial.legendre.leggauss(10)
    edges = np.linspace(0.0, run.end_time, panels + 1)
    half = 0.5 * np.diff(edges)
    times = (edges[:-1] + half)[:, None] + half[:, None] * x
    kinds = (Q.VOLTAGE, Q.CURRENT)
    outputs = [Output(kind, drive) for kind in kinds for drive in run.scene.robot.drives]
    volts, current = run.outputs(outputs, times.ravel()).reshape(2, -1, *times.shape)
    return float(np.sum(half[:, None] * w * volts * current))


def test_the_energy_that_electrodes_take_is_that_of_capacitance_springs_and_dampers() -> None:
    run = ts.simulate(oscillator(ts.Sine(amplitude=0.5, frequency=900.0)), 0.0207)
    volts, ledger = run.series["volts"][0, [0, -1]], run.ledger
    stored = 0.5 * F * (volts[1] ** 2 - volts[0] ** 2)
    balance = stored + ledger.kinetic + ledger.elastic + ledger.damping
    assert abs(stored) > 0.01 * abs(balance)
    assert run.electrical_energy == pytest.approx(balance, rel=1e-8)
    assert supplied(run, 400) == pytest.approx(balance, rel=1e-8)


def test_a_voltage_that_jumps_leaves_half_c_v_squared_and_the_work_of_the_drive() -> None:
    wave = ts.Square(amplitude=4.0, offset=4.0, frequency=500.0)  # from 8 V to 0 at 1 ms
    run = ts.simulate(oscillator(wave, **{"robot.drives.pzt.law.offset": 1e-6}), 0.0017)
    pushed = 1e-6 * run.states(np.array([0.0, run.end_time])).x[0]
    work = run.ledger.work_in - (pushed[1] - pushed[0])  # but that of the force without volts
    assert run.electrical_energy == pytest.approx(work - 0.5 * F * 64.0, rel=1e-8)


def test_drives_of_a_walker_take_what_volts_and_currents_say() -> None:
    scene = trotter()
    run = ts.simulate(with_values(scene, {"robot.drives.leg0.capacitance": 1e-9}), 0.0063)
    assert len(run.events) > 4
    assert run.electrical_energy == pytest.approx(supplied(run, 1500), rel=1e-6)


def test_energy_of_a_gain_that_goes_with_the_volts() -> None:
    law = PrandtlIshlinskii(constant=1e-5, linear=2e-5, quadratic=3e-6, cubic=-1e-7)
    run = ts.simulate(with_values(scene_of("p1_n2"), {"robot.drives.pull.law": law}), 0.02)
    swept = with_values(run.scene, {"signals.pull": ts.Sine(amplitude=6.0, frequency=130.0)})
    run = ts.simulate(swept, 0.0123)
    assert run.electrical_energy == pytest.approx(supplied(run, 1500), rel=1e-6)
    assert np.isnan(ts.simulate(cubic_with_plays(scene_of("p1_n2")), 0.001).electrical_energy)


def cubic_with_plays(scene: ts.Scene) -> ts.Scene:
    law = PrandtlIshlinskii(
        constant=1e-5, linear=2e-5, quadratic=3e-6, cubic=-1e-7, thresholds=(0.0, 1.0), weights=(4e-6, 8e-6)
    )
    return with_values(scene, {"robot.drives.pull.law": law})


def test_the_gain_of_charge_is_that_of_small_signals() -> None:
    """After a turn plays rest: the force by a small step of the voltage is the charge by motion."""
    scene = cubic_with_plays(scene_of("p1_n2"))
    drive = scene.robot.drives["pull"]
    law, step = drive.law, 1e-6
    for volts in (-3.0, 0.5, 4.0):
        there, back = law.force([volts + 5.0, volts + step, volts, volts + step])[-2:]
        rows = output_rows(
            with_values(scene, {"signals.pull": ts.Constant(level=volts)}), [Output(Q.CHARGE, "pull")], [0.1]
        )
        load = drive.load.vector(scene.robot.structure)
        np.testing.assert_allclose(rows.x_gain[0] * rows.x[0], (back - there) / step * load, rtol=1e-5)


@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(lambda: cubic_with_plays(scene_of("p1_n2")), id="modal"),
        pytest.param(lambda: scene_of("sticky_feet"), id="sliding"),
        pytest.param(trotter, id="walker"),
    ],
)
def test_currents_and_accelerations_are_the_rates_of_charges_and_velocities(scene) -> None:
    scene, step = scene(), 1e-8
    run = ts.simulate(scene, min(scene.duration, 0.02))
    structure = scene.robot.structure
    turning = [name for name in structure.body_coordinates if name in ("roll", "pitch")]
    pairs = (
        [(Output(Q.CHARGE, d), Output(Q.CURRENT, d)) for d in scene.robot.drives]
        + [(Output(Q.DISPLACEMENT, p), Output(Q.VELOCITY, p)) for p in structure.points]
        + [(Output(Q.ANGLE, p), Output(Q.ANGULAR_VELOCITY, p)) for p in turning]
        + [(Output(Q.VELOCITY, p), Output(Q.ACCELERATION, p)) for p in structure.points]
    )
    times = np.linspace(0.1, 0.93, 60) * run.end_time
    rates = run.outputs([rate for _, rate in pairs], times)
    ends = (run.outputs([one for one, _ in pairs], times + sign * step) for sign in (1.0, -1.0))
    off = np.abs((next(ends) - next(ends)) / (2.0 * step) - rates) / np.abs(rates).max(axis=1, keepdims=True)
    assert np.median(off) < 1e-6 and np.mean(off > 1e-3) < 0.03  # but where an event lies between


def test_slopes_of_outputs_are_those_of_windows_of_other_scenes() -> None:
    scene = trotter()
    paths = (
        "robot.drives.leg0.law.gain",
        "robot.structure.legs.leg0.stiffness_v",
        "robot.structure.body.mass",
        "ground.restitution.coefficient",
    )
    outputs = [
        Output(Q.CURRENT, "leg0", motional=True),
        Output(Q.CHARGE, "leg1"),
        Output(Q.ACCELERATION, "body"),
        Output(Q.ANGULAR_VELOCITY, "pitch"),
        Output(Q.DISPLACEMENT, "leg2_hip_x"),
    ]
    run, fine = ts.simulate(scene, 0.006), Accuracy(gap=1e-13, drive=1e-13)
    at = run.states(np.array([0.004]))
    times = np.linspace(0.0041, 0.006, 12)
    assert not at.held.any()
    start = [WindowStart(np.concatenate([at.x[:, 0], at.v[:, 0]]), 0.004, times)]

    def values(scene: ts.Scene) -> np.ndarray:
        found = simulate_windows(lower_scene(scene), start, accuracy=fine)
        return output_rows(scene, outputs, times).values(found.states)

    plan = lower_scene(scene)
    found = simulate_windows(plan, start, gradients=WindowGradients.of(scene, plan, paths), accuracy=fine)
    assert found.slopes is not None
    slopes = output_slopes(scene, outputs, times, found.states, found.slopes, paths, plan)
    for p, path in enumerate(paths):
        value = float(get_value(scene, path))
        beside = [values(with_values(scene, {path: value * (1.0 + k * 1e-5)})) for k in AROUND]
        size = np.abs(values(scene)).max(axis=1, keepdims=True) / value
        assert np.all(np.abs(slopes[..., p] - slope(beside, 1e-5 * value)) < 1e-5 * size), path
    assert np.abs(slopes[..., 0]).max() > 0.0


def test_another_output_is_one_row_of_the_table(monkeypatch, tmp_path) -> None:
    """All users of the table have it: series, datasets, folders, figures, instruments, stepped robots, pages."""
    double = RunChannel(
        "double",
        "m",
        "2x",
        POINT,
        "displacement of a point, twice",
        None,
        Q.DISPLACEMENT,
        lambda r, at: r.place(at)._replace(x_gain=2.0),
        motional=True,
    )
    monkeypatch.setattr(channels, "CHANNELS", (*channels.CHANNELS, double))
    scene = scene_of("p1_n2")
    run, times = ts.simulate(scene, 0.002), np.array([0.0005, 0.001])
    points = list(scene.robot.structure.points)
    seen = run.outputs([Output(Q.DISPLACEMENT, name, motional=True) for name in points], times)
    expected = 2.0 * run.at(times)["displacement"]
    assert np.abs(expected).max() > 0.0
    np.testing.assert_array_equal(seen, expected)
    np.testing.assert_array_equal(run.at(times)["double"], expected)
    kept = run.to_dataset(times)["double"]
    assert (kept.attrs["units"], kept.attrs["long_name"]) == ("m", "displacement of a point, twice")
    np.testing.assert_array_equal(kept.sel(time=times), expected)
    assert "double" in ts.load_run(run.write(tmp_path / "run")).variables()
    assert len(run.plot("double").lines) == len(points)
    stepped = ts.Session(scene)
    stepped.reset()
    state = stepped.step(dt=0.001)
    found = state.seen([Output(Q.DISPLACEMENT, points[0], motional=True)])
    np.testing.assert_allclose(found, 2.0 * state.displacement(points[0]), rtol=1e-15)
    assert Explored.of(scene, 0.002).unit("double") == "m"
