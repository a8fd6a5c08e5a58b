"""A device that is measured at one point alone, where all of its modes have the same shape."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tarsus.files.library import load_scene
from tarsus.identify.campaign import Opened, read_campaign
from tarsus.identify.chain import StepRunner
from tarsus.identify.steps import SWEEP_STEPS
from tarsus.records.purpose import Purpose
from tarsus.synthesis.campaign_folder import write_campaign
from tarsus.synthesis.plan import in_air, planned
from tarsus.synthesis.recordings import Instrument

DEVICE = """
name = "unimorph"
duration = "0.3 s"
[robot.structure]
kind = "modal"
frequencies = {frequencies}
damping_ratios = {damping_ratios}
modal_masses = ["0.59 mg", "0.59 mg"]
[robot.structure.shapes]
tip = [1.0, 1.0]
[robot.drives.pzt]
law = {{ kind = "linear", gain = "-30 uN/V" }}
load = {{ kind = "point", weights = {{ tip = 1.0 }} }}
[robot.feet.tip]
point = "tip"
gap = "5 um"
[signals.pzt]
kind = "sine"
amplitude = "10 V"
frequency = "200 Hz"
[ground.restitution]
coefficient = 0.4
[ground.adhesion]
initial = "200 nN"
rate = "1 uN/s"
"""
MODES = (1081.0, 0.04), (8287.0, 0.03)
"""Frequency [Hz] and damping ratio."""
OMITTED = "sweep-3", "sweep-4", "sweep-5", "sweep-6"


def campaign(folder: Path, modes: tuple[tuple[float, float], ...], *purposes: Purpose) -> Opened:
    """Records of some purposes on the device; two sweeps."""
    frequencies, ratios = ([*one] for one in zip(*modes, strict=True))
    source = folder / "device-as-it-is.toml"
    folder.mkdir()
    source.write_text(DEVICE.format(frequencies=[f"{f} Hz" for f in frequencies], damping_ratios=ratios))
    device = load_scene(source)
    plan = in_air(device, 20e3, "pzt") if purposes == (Purpose.MODAL,) else planned(device, 20e3, "pzt")
    takes = [one for one in plan if one.purpose in purposes and one.name not in OMITTED]
    write_campaign(device, folder, Instrument(), 1, recordings=takes)
    return read_campaign(folder)


# Slow: the other order; by chance it was right before.
@pytest.mark.parametrize(
    "modes", [MODES[::-1], pytest.param(MODES, marks=pytest.mark.slow)], ids=["descending", "ascending"]
)
def test_modes_of_one_shape_have_the_order_of_frequencies_of_the_device(tmp_path, modes):
    chain = StepRunner.of(campaign(tmp_path / "campaign", modes, Purpose.MODAL))
    chain.read()
    chain.take(SWEEP_STEPS)
    found = chain.steps["resonances"]
    np.testing.assert_allclose(found.values, [f for f, _ in modes] + [ratio for _, ratio in modes], rtol=5e-3)
