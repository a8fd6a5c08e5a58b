"""Oracle 8: the energy ledger closes to 1e-8 of its largest term, with drives and users' laws of every kind."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts

TIMES = np.linspace(0.0, 0.1, 101)
WAVES = {
    "sine": ts.Sine(amplitude=8.0, frequency=50.0),
    "square": ts.Square(amplitude=8.0, frequency=50.0),
    "ramped square": ts.waveforms.RampedSquare(amplitude=8.0, frequency=50.0, duty=0.25),
    "swept sine": ts.waveforms.SweptSine(amplitude=8.0, start_frequency=20.0, stop_frequency=900.0, duration=0.1),
    "ramp": ts.waveforms.Ramp(stop=9.0, duration=0.05),
    "on-off": ts.OnOff(levels=(8.0, -8.0, 3.0, -6.0), durations=(0.004, 0.006, 0.003, 0.005), repeat=True),
    "poling": ts.waveforms.Poling(level=10.0, hold=0.02, fall=0.01),
    "sampled": ts.Sampled(times=tuple(TIMES), levels=tuple(8.0 * np.sin(400.0 * TIMES))),
}


def check(run: ts.Run) -> None:
    ledger = run.ledger
    assert run.ok
    assert ledger.closure < 1e-8
    for loss in (ledger.damping, -ledger.laws.get("film", 0.0), ledger.impacts, ledger.adhesion):
        assert loss >= -1e-12 * max(abs(ledger.work_in), ledger.damping, ledger.impacts, abs(ledger.kinetic))
    assert np.all(run.events["energy"] >= 0.0) and np.all(run.events["adhesion_energy"] >= 0.0)
    assert ledger.impacts + ledger.adhesion == pytest.approx(run.events["energy"].sum(), rel=1e-12)


@pytest.mark.parametrize("device", ["cantilever", "cantilever-1"])
@pytest.mark.parametrize("wave", WAVES)
def test_cantilever_through_its_hysteresis(device, wave):
    """Prandtl-Ishlinskii (cantilever) and two branches (cantilever-1) under every waveform."""
    run = ts.simulate(ts.with_values(ts.load_scene(device), {"signals.pzt": WAVES[wave]}), duration=0.06)
    check(run)
    assert np.any(run.events["kind"] == 2)
