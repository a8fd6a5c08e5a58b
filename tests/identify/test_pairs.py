"""Records in the air beside those near the ground: the map where the pair tells it, the reason where it does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hexapod_records import POINTS, RESTITUTION, records, runs, true_column
from laboratory import LABORATORY
from tarsus.files.library import load_scene
from tarsus.identify.airborne import air_records
from tarsus.identify.campaign import read_campaign, read_records
from tarsus.identify.draws import DRAWS
from tarsus.identify.estimates import Estimates
from tarsus.identify.foot import FootModel
from tarsus.identify.impact_column import Pair, from_pairs, map_from_pairs
from tarsus.identify.traces import trace_of
from tarsus.model.drive.waveforms import Square
from tarsus.records.purpose import Purpose
from tarsus.synthesis.campaign_folder import write_campaign
from tarsus.synthesis.recordings import Instrument, Recording


@pytest.fixture(scope="module")
def model():
    scene = runs()[0].scene
    return FootModel(scene, "foot1", next(iter(scene.robot.drives)), tuple(POINTS))


def test_a_pair_tells_restitution_and_column(model):
    close, in_air = records()
    found, left = map_from_pairs(model, [Pair("near", "far", (close,), (in_air,))])
    assert not left
    told = from_pairs(found, seed=3)
    value, draws, _ = told["restitution, from near less the air"]
    assert value == pytest.approx(RESTITUTION, rel=0.02)
    low, high = np.quantile(draws, [0.025, 0.975])
    assert low <= RESTITUTION <= high
    for number, name in enumerate(POINTS[1:], start=1):
        jump = told[f"jump of {name} over the foot's, from near less the air"][0]
        assert jump == pytest.approx(true_column()[number], rel=0.02)


def test_a_pair_that_does_not_belong_together_is_refused_with_the_reason(model):
    close, in_air = records()
    weak = replace(in_air, values=0.5 * in_air.values)
    found, left = map_from_pairs(model, [Pair("near", "far", (close,), (weak,))])
    assert not found and len(left) == 1
    assert left[0].file == "near less far" and "is left after subtraction" in left[0].reason


def test_a_record_in_the_air_is_met_within_its_noise(tmp_path):
    scene = load_scene(LABORATORY)
    wave = Square(amplitude=6.75, frequency=300.0)
    take = Recording("air", Purpose.AIR, wave, 0.05, gap=0.03, repeats=1)
    write_campaign(scene, tmp_path, Instrument(), 5, recordings=[take])
    record = read_records(read_campaign(tmp_path), "air")[0].record
    model = FootModel(scene, "tip", "pzt", tuple(scene.robot.structure.points))
    trace = trace_of(record, model.points, "air", record.drive, 0.01, 0.03)
    path, first = "robot.structure.frequencies.0", scene.robot.structure.frequencies[0]
    for factor in (1.0, 1.1):
        draws = factor * first * (1.0 + 1e-3 * np.random.default_rng(5).standard_normal((DRAWS, 1)))
        known = Estimates(model, (path,), np.array([factor * first]), draws)
        (found,), said = air_records(known, [trace], {"air": wave}, -model.gap)
        assert not said
        left = found.left.mean(axis=0)[: len(model.points)]
        off = np.sqrt(np.mean(left**2, axis=1) / np.mean((found.predicted[: len(left)] + left) ** 2, axis=1))
        assert off == pytest.approx(0.01, rel=0.1) if factor == 1.0 else off.min() > 0.1  # 40 dB
