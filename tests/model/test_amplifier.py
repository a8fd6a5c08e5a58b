"""Amplifiers: closed forms of the output, and what the rest of a run sees of it."""

from __future__ import annotations

import math
from dataclasses import fields
from itertools import cycle

import numpy as np
import pytest
from numpy.typing import NDArray

import tarsus as ts
from drive_cases import FALLING, RISING, WAVEFORMS
from model.test_drive_lower import check_shape
from tarsus.base.errors import InputError
from tarsus.measure.switching import rise_squares
from tarsus.model.drive.amplifier import Amplifier
from tarsus.model.drive.lower import evaluate, lower
from tarsus.model.drive.output import Stage, amplified
from tarsus.model.drive.parts import IDENTITY, to_pieces, whole_parts
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.waveforms import OnOff, RampedSquare, Square

Floats = NDArray[np.float64]
VOLTS = ts.LinearForce(gain=1.0)


def given(signal: Signal, t: Floats) -> Floats:
    """The output through the engine's pieces."""
    pieces, _ = lower(signal, VOLTS)
    check_shape(pieces)
    return evaluate(pieces, t)


def test_a_square_at_the_slew_rate_is_a_trapezoid() -> None:
    """8 V at 50 Hz and 4 V/ms: up from 0 V in 2 ms, then 4 ms a ramp, for ever."""
    signal = Amplifier(slew_rate=4e3).output(Square(amplitude=8.0, frequency=50.0))
    corners = [0.0, 2e-3, 10e-3, 14e-3, 20e-3, 24e-3, 30e-3, 34e-3, 40e-3]
    t = np.linspace(0.0, 0.04, 4001)
    wanted = np.interp(t, corners, [0.0, 8.0, 8.0, -8.0, -8.0, 8.0, 8.0, -8.0, -8.0])
    np.testing.assert_allclose(given(signal, t), wanted, rtol=0, atol=1e-12)
    np.testing.assert_allclose(given(signal, t[2500:] + 20.0), wanted[2500:], rtol=0, atol=1e-10)
    assert signal.period == 0.02
    np.testing.assert_allclose(signal.volts(t), wanted, rtol=0, atol=1e-12)


def test_energy_is_counted_on_the_actuators_volts() -> None:
    """A square of 8 V clipped at 5 V rises by 10 V; one that slews never gets higher than the rate lets it."""
    edges = np.arange(4) * 0.02
    square = Square(amplitude=8.0, frequency=50.0)
    assert rise_squares(Amplifier(clip=5.0).output(square), edges).tolist() == pytest.approx([100.0] * 3)
    # 10 V/s for 10 ms: up to 0.1 V and down again, from 0 V
    slow = Amplifier(slew_rate=10.0).output(square)
    assert rise_squares(slow, edges).tolist() == pytest.approx([0.01] * 3)
    # with 2.4 V/ms the first rise is one from 0 V to 8 V, the others of the whole 16 V
    slewed = Amplifier(slew_rate=2.4e3).output(square)
    assert rise_squares(slewed, edges).tolist() == pytest.approx([64.0, 256.0, 256.0])


@pytest.mark.parametrize(("kind", "share"), list(zip(WAVEFORMS, cycle([3e-4, 0.02, 0.3, 4.0]), strict=False)))
def test_runs_that_a_pole_follows_together_are_those_followed_one_by_one(kind: str, share: float) -> None:
    """A slew rate that nothing reaches makes the same equation be followed stretch by stretch; and two runs have the
    bits that each has alone."""
    track = WAVEFORMS[kind].track()
    lag, start = share * float(track.end[-1]) * np.array([0.7, 1.0]), np.array([-2.0, 1.5])
    both = amplified(track.picked(np.zeros(2, dtype=int)), Stage(lag, math.inf, -math.inf, math.inf), start)
    together = both.picked(np.array([1]))
    alone = amplified(track, Stage(lag[1], math.inf, -math.inf, math.inf), start[1])
    for one in fields(alone):
        np.testing.assert_array_equal(getattr(together, one.name), getattr(alone, one.name))
    assert (alone.first[1:] == alone.last[:-1]).all()
    one_by_one = amplified(track, Stage(lag[1], 1e30, -math.inf, math.inf), start[1])
    pieces, other = (to_pieces(one, whole_parts(one, IDENTITY))[0] for one in (alone, one_by_one))
    t = np.linspace(0.0, 1.2 * max(pieces.start[-1], other.start[-1]), 5001)
    miss = np.abs(evaluate(pieces, t) - evaluate(other, t))
    assert miss.max() <= 5e-12 * pieces.span  # the one by one sums what its stretches miss, up to 3e-12


def test_an_amplifier_that_never_settles_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("output", "pole"):
        monkeypatch.setattr(f"tarsus.model.drive.{module}.MOST_SETTLING", 100)
    slow = Amplifier(bandwidth=0.01).output(RampedSquare(amplitude=1.0, frequency=100.0, duty=0.5, offset=1.0))
    with pytest.raises(InputError, match="too slow against the signal"):
        slow.track()


def test_a_run_shows_command_and_output_and_closes_its_ledger() -> None:
    """The packaged cantilever at 30 V behind 10 V/ms and 20 V; the slew rate varies in a batch."""
    path = "robot.drives.pzt.amplifier."
    scene = ts.load_scene("cantilever", volts=30, **{path + "slew_rate": "10 V/ms", path + "clip": "20 V"})
    run = ts.simulate(scene, 0.06)
    assert run.ok and len(run.events) > 5
    assert run.ledger.closure < 1e-8
    variables = run.variables()
    volts, command = variables["volts"].values[0], variables["command"].values[0]
    assert np.abs(command).max() == 30.0 and np.abs(volts).max() == 20.0
    rate = np.abs(np.diff(volts)) / np.diff(variables["time"].values)
    assert rate.max() == pytest.approx(1e4, rel=1e-6)
    assert run.period == 1.0 / scene.signals["pzt"].frequency
    batch = ts.simulate_batch(scene, {path + "slew_rate": [1e4, 1e5]}, 0.06)
    np.testing.assert_allclose(batch.events(0)["time"], run.events["time"], rtol=0, atol=1e-12)
    assert len(batch.events(1)) != len(batch.events(0))


def test_an_output_that_has_settled_keeps_its_branch() -> None:
    """After 31 lags it ends on its command within rounding, from either side, which is no change of the voltage."""
    lag = 3.1420875e-06
    square = OnOff(levels=(7.957256413493036, -6.6461928594664155), durations=(2.9468803e-4, 3.4747338e-4), repeat=True)
    law = ts.drives.TwoBranch(rising=RISING, falling=FALLING)
    output = Amplifier(rise_time=lag * math.log(9.0)).output(square)
    t = np.linspace(0.0, 2.9e-4, 20001)[1:]
    np.testing.assert_allclose(evaluate(lower(output, law)[0], t), RISING(output.volts(t)), rtol=1e-9)
    np.testing.assert_allclose(law.force(output.volts(t)), RISING(output.volts(t)), rtol=1e-9)
