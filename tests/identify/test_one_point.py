"""A device that is measured at one point alone, where all of its modes have the same shape."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.campaigns import grounded
from tarsus.base.errors import InputError
from tarsus.files.library import load_scene
from tarsus.identify.bounce import Bounces, find_bounces
from tarsus.identify.campaign import Opened, read_campaign
from tarsus.identify.chain import StepRunner
from tarsus.identify.estimates import Estimates
from tarsus.identify.flight import WORST
from tarsus.identify.readiness import readiness_of
from tarsus.identify.restitution import identify_restitution
from tarsus.identify.steps import GROUND_STEPS, SWEEP_STEPS
from tarsus.model.drive.waveforms import RampedSquare, Square
from tarsus.records.excluded import evenly
from tarsus.records.purpose import Purpose
from tarsus.synthesis.campaign_folder import write_campaign
from tarsus.synthesis.plan import RAMPS, in_air
from tarsus.synthesis.recordings import Instrument, Recording

DEVICE = """
name = "unimorph"
duration = "0.3 s"
[robot.structure]
kind = "modal"
frequencies = {frequencies}
damping_ratios = {damping_ratios}
modal_masses = ["0.59 mg", "0.59 mg"]
upward = [1.566, -0.868]
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
[ground.gravity]
[ground.restitution]
coefficient = 0.4
[ground.adhesion]
initial = "200 nN"
rate = "1 uN/s"
"""
FILM = """
[ground.film]
coefficient = "1.1e-22 N m^2 s"
thickness = "1 um"
"""
MODES = (1081.0, 0.04), (8287.0, 0.03)
"""Frequency [Hz] and damping ratio."""
ON_THE_GROUND = (
    *(
        Recording(f"ramps-{k}", Purpose.RAMPS, RampedSquare(amplitude=8.0, frequency=hz, duty=duty), count / hz)
        for k, (hz, duty, count) in enumerate(RAMPS)
    ),
    *(
        Recording(f"bounces-{volts:g}v", Purpose.BOUNCES, Square(amplitude=volts, frequency=300.0), 0.2)
        for volts in (2.0, 3.0, 4.0)
    ),
)
OMITTED = "sweep-3", "sweep-4", "sweep-5", "sweep-6"


def campaign(target: Path, modes: Sequence[tuple[float, float]], *purposes: Purpose, further: str = "") -> Opened:
    """Records of some purposes on the device, each once; two sweeps."""
    frequencies, ratios = ([*one] for one in zip(*modes, strict=True))
    source = target / "device-as-it-is.toml"
    target.mkdir()
    source.write_text(DEVICE.format(frequencies=[f"{f} Hz" for f in frequencies], damping_ratios=ratios) + further)
    device = load_scene(source)
    takes = [one for one in (*in_air(device, 20e3, "pzt"), *ON_THE_GROUND) if one.purpose in purposes]
    takes = [replace(one, repeats=1) for one in takes if one.name not in OMITTED]
    write_campaign(device, target, Instrument(), 1, recordings=takes)
    return read_campaign(target)


def known(opened: Opened) -> Opened:
    """The campaign with the true device as known beforehand."""
    return replace(opened, model=replace(opened.model, scene=load_scene(opened.folder / "truth" / "device.toml")))


def test_modes_of_one_shape_have_the_order_of_frequencies_of_the_device(tmp_path):
    """Descending, which the sweeps alone do not tell."""
    modes = MODES[::-1]
    chain = StepRunner.of(campaign(tmp_path / "campaign", modes, Purpose.MODAL))
    chain.read()
    chain.take(SWEEP_STEPS)
    found = chain.steps["resonances"]
    np.testing.assert_allclose(found.values, [f for f, _ in modes] + [ratio for _, ratio in modes], rtol=5e-3)


def test_a_ground_without_a_film_has_no_number_of_one(tmp_path):
    """The flights after detachments are followed without one, and their pulls tell the adhesion; what the device has
    not, `check` says."""
    opened = known(campaign(tmp_path / "campaign", MODES, Purpose.RAMPS))
    chain = grounded(opened)
    chain.take(GROUND_STEPS)
    assert not chain.not_done and "adhesion" in chain.steps and not chain.steps["film"].paths
    assert chain.known.model().scene.ground.film is None
    low, high = chain.steps["adhesion"].interval("ground.adhesion.rate")
    assert low < 1e-6 < high < 2e-6
    (said,) = [one for one in readiness_of(opened).remarks if "ground." in one]
    assert said.startswith("the device has no ground.film, which will not be identified: add [ground.film]")


@pytest.mark.parametrize("law", ["restitution", "adhesion"])
def test_of_a_law_that_the_ground_has_not_no_number_is_sought(law, tmp_path):
    """The steps that would find it are not tried, whatever is recorded."""
    opened = campaign(tmp_path / "campaign", MODES, Purpose.LOOPS)
    chain = StepRunner.of(replace(opened, model=opened.model.changed({f"ground.{law}": None})))
    tried = [step.name for step in GROUND_STEPS if step.when(chain)]
    assert law not in tried and ("impact map" in tried) == (law == "adhesion")


def test_impacts_are_fitted_through_a_film_thinner_than_the_way_between_two_samples(tmp_path):
    """A first guess of a flight dips below the ground by more than the film is thick, and overflows there: of all
    impacts none was a single one. Under gravity records begin at rest. Of another structure none is, and it is said at
    which rate one would be."""
    rings = [(f, 0.01) for f, _ in MODES]
    chain = grounded(known(campaign(tmp_path / "campaign", rings, Purpose.BOUNCES, further=FILM)))
    level, traces = chain.ground()[0], chain.traces(Purpose.BOUNCES)
    found = evenly(find_bounces(traces, "tip", level)[0], 60)
    share = {}
    for film in (True, False):
        model = chain.opened.model if film else chain.opened.model.changed({"ground.film": None})
        share[film] = np.mean(Bounces(traces, found, level, model).fit().chi < WORST)
    assert share[True] >= share[False] > 0.15
    other = chain.opened.model.changed({"robot.structure.modal_masses.0": 4e-6})
    with pytest.raises(InputError) as error:
        identify_restitution(other, Estimates.nothing(other), traces, (level, 1e-9), 1)
    assert str(error.value).startswith("3 records of bounces: channel 'tip': ")
    assert "20 kHz is 2.4 samples a period of the fastest mode, 8.29 kHz; sample at 82.9 kHz" in str(error.value)
