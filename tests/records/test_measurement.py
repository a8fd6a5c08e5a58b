"""Measurements: what they hold, and a sentence for each thing that is wrong with one."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from hexapod_records import measurement
from tarsus.formats.axes import sampling_step
from tarsus.records.excluded import evenly
from tarsus.records.measurement import Channel, FrequencyResponse, Measurement, Quantity, check_sampled_together

FOOT = Channel("foot", Quantity.VELOCITY, noise=1e-4, full_scale=0.5)
LEG = Channel("leg volts", Quantity.VOLTAGE)


def test_a_measurement_knows_its_times_and_channels():
    record = Measurement((FOOT, LEG), [[0.0, 1e-3, 2e-3], [1.0, 2.0, 3.0]], 1e-3, start=0.5)
    assert record.names == ("foot", "leg volts")
    assert record.time == pytest.approx([0.5, 0.501, 0.502])
    assert record.rate == pytest.approx(1000.0) and record.count == 3
    assert record["leg volts"].tolist() == [1.0, 2.0, 3.0]
    assert record.of(Quantity.VELOCITY) == ("foot",)
    assert record.channel("foot").quantity.unit == "m/s"
    assert record.channel("foot").at == "foot"
    assert record.select(["leg volts"]).names == ("leg volts",)
    late = record.between(0.5005, 0.6)
    assert late.start == pytest.approx(0.501) and late.count == 2


def test_its_values_cannot_be_changed():
    given = np.zeros((1, 4))
    record = Measurement((FOOT,), given, 1e-3)
    given[0, 0] = 1.0
    assert record["foot"][0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        record["foot"][0] = 1.0


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (
            [[0.0, np.nan, np.inf], [1.0, 2.0, 3.0]],
            "channel 'foot' has 2 samples that are no finite number, the first at",
        ),
        ([[0.0, 1.0], [1.0, 2.0, 3.0]], "different numbers of samples: 'foot' 2, 'leg volts' 3"),
        ([[0.0, 1.0], [1.0, 2.0], [3.0, 4.0]], "they look transposed"),
        ([[0.0], [1.0]], "at least 2 samples, got 1"),
        ([0.0, 1.0], "shape"),
    ],
)
def test_bad_values_name_the_channel_and_the_cause(values, said):
    with pytest.raises(ts.InputError, match=said):
        Measurement((FOOT, LEG), values, 1e-3)


def test_every_problem_is_said_at_once():
    with pytest.raises(ts.InputError) as caught:
        Measurement((FOOT, FOOT), [[0.0, np.nan], [0.0, 1.0]], -1.0, start=np.inf)
    assert len(caught.value.problems) == 4
    with pytest.raises(ts.InputError, match="expected a noise above 0"):
        Measurement((Channel("foot", Quantity.VELOCITY, noise=0.0),), [[0.0, 1.0]], 1.0)


def test_an_unknown_channel_is_reported_with_the_nearest():
    with pytest.raises(ts.InputError, match="no channel 'food'; did you mean 'foot'"):
        _ = Measurement((FOOT,), [[0.0, 1.0]], 1.0)["food"]
    with pytest.raises(ts.InputError, match="no sample lies between"):
        Measurement((FOOT,), [[0.0, 1.0]], 1.0).between(3.0, 4.0)


def test_some_of_many_are_taken_evenly_with_both_ends():
    assert evenly(range(10), 4) == [0, 3, 6, 9]


def test_clipped_channels_are_reported():
    record = Measurement((FOOT,), [[0.0, 0.5, -0.5, 0.1]], 1e-3)
    assert record.clipped() == ("channel 'foot' is clipped: 2 of 4 samples reach the full scale of 0.5 m/s",)
    assert Measurement((LEG,), [[0.0, 0.5]], 1e-3).clipped() == ()


def test_times_give_their_step_or_say_why_not():
    assert sampling_step([0.0, 0.1, 0.2]) == pytest.approx(0.1)
    rounded = np.round(np.arange(50) * 0.3333, 2)
    assert sampling_step(rounded, resolution=0.01) == pytest.approx(0.3333, rel=1e-2)
    with pytest.raises(ts.InputError, match=r"not even: .* 0\.3 s after sample 2"):
        sampling_step([0.0, 0.1, 0.2, 0.5])
    with pytest.raises(ts.InputError, match=r"not even: .* 4e-05 s after sample 5999"):  # in five digits: a lost sample
        sampling_step(np.delete(np.round(np.arange(40501) * 2e-5, 5), 6000), resolution=1e-5)
    with pytest.raises(ts.InputError, match="do not increase at sample 2"):
        sampling_step([0.0, 0.1, 0.1, 0.4])
    assert sampling_step(1.78e9 + np.arange(2000) / 50e3) == pytest.approx(2e-5, rel=1e-5)
    assert sampling_step(np.round(np.arange(400) * 1e-7, 6), resolution=1e-6) == pytest.approx(1e-7, rel=1e-2)
    with pytest.raises(ts.InputError, match="no finite number at sample 1"):
        sampling_step([0.0, np.nan, 0.2])
    with pytest.raises(ts.InputError, match="at least 2 times"):
        sampling_step([0.0])


def test_records_that_do_not_belong_together():
    one = measurement(np.zeros(3))
    with pytest.raises(ts.InputError, match="every 1e-05 s and every 2e-05 s"):
        check_sampled_together(one, measurement(np.zeros(3), step=2e-5), ["a"])
    with pytest.raises(ts.InputError, match="the second record has no channel 'b'"):
        check_sampled_together(measurement(np.zeros(3), np.zeros(3)), one, ["a", "b"])
    volts = Measurement((Channel("a", Quantity.VOLTAGE),), np.zeros((1, 3)), 1e-5)
    with pytest.raises(ts.InputError, match=r"in m/s .* in V"):
        check_sampled_together(one, volts, ["a"])


def test_a_drive_is_one_of_the_channels():
    record = Measurement((FOOT, LEG), np.zeros((2, 3)), 1e-3, drive="leg volts")
    assert record.select(["leg volts"]).drive == "leg volts"
    assert record.select(["foot"]).drive is None
    with pytest.raises(ts.InputError, match="'leg volt'; did you mean 'leg volts'"):
        Measurement((FOOT, LEG), np.zeros((2, 3)), 1e-3, drive="leg volt")


FORCE = Channel("shaker", Quantity.FORCE)
LINES = np.array([0.0, 1.0, 2.5])


def test_a_response_knows_its_unit_and_its_scatter():
    values = np.array([[[1.0, 2.0j, -4.0]]])
    response = FrequencyResponse((FOOT,), (FORCE,), LINES, values, coherence=[[[1.0, 0.5, np.nan]]])
    assert response.unit == (("m/s / N",),)
    assert response.deviation(averages=8)[0, 0] == pytest.approx([0.0, 0.5, np.nan], nan_ok=True)
    part = response.between(0.5, 3.0)
    assert part.frequency.tolist() == [1.0, 2.5] and part.values[0, 0, 0] == 2.0j
    assert part.coherence is not None and part.coherence[0, 0, 0] == 0.5
    with pytest.raises(ValueError, match="read-only"):
        response.values[0, 0, 0] = 0.0
    with pytest.raises(ts.InputError, match="between 5 Hz and 9 Hz"):
        response.between(5.0, 9.0)
    with pytest.raises(ts.InputError, match="coherence of the response is not known"):
        FrequencyResponse((FOOT,), (FORCE,), LINES, values).deviation(averages=8)


@pytest.mark.parametrize(
    ("lines", "values", "coherence", "said"),
    [
        (
            LINES,
            [[[1.0, np.nan, 1.0]]],
            None,
            "response of 'foot' has 1 lines that are no finite number, the first at 1 Hz",
        ),
        ([0.0, 2.0, 1.0], np.ones((1, 1, 3)), None, "expected frequencies that increase"),
        ([0.0, np.nan, 1.0], np.ones((1, 1, 3)), None, "the frequency at line 1 is no finite number"),
        (LINES, np.ones((1, 3)), None, r"expected values of shape .* = \(1, 1, 3\), got \(1, 3\)"),
        (LINES, np.ones((1, 1, 3)), np.full((1, 1, 3), 1.2), "the coherence is not between 0 and 1"),
        (LINES, np.ones((1, 1, 3)), np.ones(3), "expected a coherence of the shape of the values"),
        ([1.0], np.ones((1, 1, 1)), None, "at least 2 frequencies"),
    ],
)
def test_bad_responses_name_the_cause(lines, values, coherence, said):
    with pytest.raises(ts.InputError, match=said):
        FrequencyResponse((FOOT,), (FORCE,), lines, values, coherence)
