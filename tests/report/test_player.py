"""The animation of a walk: what it is made of, and that it stands alone."""

from __future__ import annotations

import dataclasses
import json
import re
from typing import Any

import numpy as np
import pytest

from packed_series import unpacked
from tarsus.report.drawing import Drawing, FootMark, Shape, drawing_of, round_below
from tarsus.report.motion import MOST_FRAMES, SLIPPING, STUCK, Motion, frame_limit
from tarsus.report.packing import packed
from tarsus.report.player import walk_figure
from walking_devices import walk


@pytest.fixture(scope="module")
def motion() -> Motion:
    return walk(6)


@pytest.fixture(scope="module")
def section(motion: Motion) -> str:
    return walk_figure(motion).picture


def data_of(section: str) -> dict[str, Any]:
    (text,) = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', section, re.DOTALL)
    return json.loads(text)


@pytest.mark.parametrize("bits", [8, 16])
def test_packing_is_within_half_a_step_and_keeps_zero(bits: int) -> None:
    random = np.random.default_rng(4)
    values = random.normal(1e-6, 3e-6, (5, 400))
    values[:, ::7] = 0.0
    channel = packed(values, bits)
    back = unpacked(channel, 5)
    assert channel["step"] <= np.ptp(values) / (2**bits - 2) * (1.0 + 1e-12)
    assert np.abs(back - values).max() <= 0.5 * channel["step"] * (1.0 + 1e-9)
    assert np.all(back[:, ::7] == 0.0)
    for size in range(2, 40):
        held = np.append(random.normal(1e-6, 3e-6, (1, size)), [[np.nan]], axis=1)
        assert np.isnan(unpacked(packed(held, bits, gaps=True), 1, gaps=True)).tolist() == np.isnan(held).tolist()


def test_constants_are_packed_as_they_are_what_is_not_finite_as_zero_and_times_keep_their_resolution() -> None:
    for value in (0.0, 3e-9, -2.0):
        np.testing.assert_allclose(unpacked(packed(np.full((1, 9), value), 8), 1), value, rtol=1e-12)
    back = unpacked(packed(np.array([[1.0, np.nan, np.inf, -1.0]]), 16), 1)
    np.testing.assert_allclose(back, [[1.0, 0.0, 0.0, -1.0]], atol=2e-5)
    time = np.linspace(5.0, 5.1, 2000)[None, :]
    assert np.abs(unpacked(packed(time, 16), 1) - time).max() < 0.1 / 2000 / 10


def test_thinning_keeps_the_ends_and_takes_the_nearest_times() -> None:
    motion = walk(2)
    thin = motion.thinned(100)
    assert len(thin.time) == 100
    assert (thin.time[0], thin.time[-1]) == (motion.time[0], motion.time[-1])
    assert np.abs(thin.time - np.linspace(0.0, motion.time[-1], 100)).max() <= 0.51 * np.diff(motion.time).max()
    at = np.searchsorted(motion.time, thin.time)
    np.testing.assert_array_equal(thin.state, motion.state[:, at])
    np.testing.assert_array_equal(thin.body["surge"], motion.body["surge"][at])
    assert motion.thinned(10_000) is motion
    assert frame_limit(2, 400_000) == MOST_FRAMES and frame_limit(30, 400_000) == 1363  # of 220 bytes each


def test_the_page_holds_the_walk(motion: Motion, section: str) -> None:
    data = data_of(section)
    frames = data["frames"]
    thin = motion.thinned(frames)
    assert data["legs"] == list(motion.legs)
    np.testing.assert_allclose(unpacked(data["time"], 1)[0], thin.time, atol=thin.time[-1] / 60_000)
    np.testing.assert_allclose(
        unpacked(data["swing"], 6), thin.foot_x - thin.hips[:, :1], atol=np.ptp(thin.foot_x) / 120_000
    )
    np.testing.assert_allclose(unpacked(data["foot_z"], 6), thin.foot_z, atol=np.ptp(thin.foot_z) / 120_000)
    np.testing.assert_allclose(
        unpacked(data["body"]["surge"], 1)[0], thin.body["surge"], atol=np.ptp(thin.body["surge"]) / 120_000
    )
    assert data["period"] == motion.period
    nasty = dataclasses.replace(motion, legs=("</script><b>x</b>", *motion.legs[1:]))
    section = walk_figure(nasty).picture
    assert "<b>x" not in section and data_of(section)["legs"][0] == "</script><b>x</b>"


def feet_of(drawing: Drawing) -> dict[int, int]:
    """Points of the side by leg."""
    return {part.leg: part.point for part in drawing.side.parts if isinstance(part, FootMark)}


def hips_of(drawing: Drawing) -> dict[int, int]:
    """The other ends of the legs."""
    feet = {point: leg for leg, point in feet_of(drawing).items()}
    legs = [part.points for part in drawing.side.parts if isinstance(part, Shape) and not part.fill]
    return {feet[foot]: hip for hip, foot in legs}


def hips_at_rest(drawing: Drawing) -> np.ndarray:
    return np.array([drawing.side.points[hip].x for _, hip in sorted(hips_of(drawing).items())])


def test_hips_are_where_the_model_has_them(motion: Motion) -> None:
    drawing = drawing_of(motion)
    assert drawing.true and drawing.length == pytest.approx(2e-3), "the larger one of length and width"
    far = motion.hips[:, 1] > 0
    np.testing.assert_allclose(hips_at_rest(drawing), motion.hips[:, 0] + 0.05 * drawing.length * far)
    legs = [part.leg for part in drawing.side.parts if isinstance(part, FootMark)]
    assert set(legs[:3]) == set(np.flatnonzero(far).tolist()), "the far side is painted first"
    assert drawing.above is not None and drawing.back == pytest.approx(0.03 * drawing.length)


def test_legs_at_one_place_are_drawn_apart_and_stay_near_it(motion: Motion) -> None:
    drawing = drawing_of(dataclasses.replace(walk(2), hips=np.zeros((2, 3))))
    x = hips_at_rest(drawing)
    assert not drawing.true and drawing.above is None and np.ptp(x) > 0.0 and x.sum() == pytest.approx(0.0)
    hips = motion.hips.copy()
    hips[2] = hips[0]
    drawing = drawing_of(dataclasses.replace(motion, hips=hips))
    x = hips_at_rest(drawing) - 0.05 * drawing.length * (hips[:, 1] > 0)
    assert not drawing.true and 0.0 < abs(x[0] - x[2]) < 1.8e-3
    np.testing.assert_allclose(x[[1, 3, 4, 5]], hips[[1, 3, 4, 5], 0])


def test_motion_is_drawn_as_large_as_there_is_room(motion: Motion) -> None:
    drawing = drawing_of(motion)
    assert 0.1 * drawing.leg < drawing.up * motion.foot_z.max() < 0.6 * drawing.leg
    swing = motion.foot_x - motion.hips[:, :1] - motion.hip_shift_x
    assert 0.0 < drawing.along * np.ptp(swing, axis=1).max() < 10e-3 / 15, "less than the way to the next leg"
    huge = dataclasses.replace(motion, foot_z=motion.foot_z * 1e3)
    assert drawing_of(huge).up == 1.0
    still = dataclasses.replace(
        motion, foot_x=motion.foot_x * 0.0, foot_z=motion.foot_z * 0.0, body={}, hips=motion.hips
    )
    assert drawing_of(still).up == 1.0
    below = [round_below(value) for value in (1.0, 4.99, 5.0, 0.03, 987.0)]
    assert below == pytest.approx([1.0, 2.0, 5.0, 0.02, 500.0])


def test_feet_in_contact_are_drawn_on_the_ground_and_all_in_its_box(motion: Motion) -> None:
    drawing = drawing_of(motion)
    points = [point for _, point in sorted(feet_of(drawing).items())]
    far = motion.hips[:, 1] > 0
    for frame in (0, 333, 1999):
        height = drawing.seen(motion)[1, points, frame]
        down = np.isin(motion.state[:, frame], (STUCK, SLIPPING))
        none = 1e-9 * drawing.leg
        assert np.abs(height[~far & down]).max(initial=0.0) < none
        assert np.all(height > -none)
        np.testing.assert_allclose(height[far & down], 0.03 * drawing.length)
    x, z = drawing.seen(motion)
    left, right, low, high = drawing.box
    assert (x.min(), x.max(), z.max()) == pytest.approx((left, right, high)) and low == min(z.min(), 0.0)


def test_the_drawn_body_turns_as_its_hips_do(motion: Motion) -> None:
    drawing = drawing_of(motion)
    at = drawing.seen(motion)[..., 1234]
    slope = -drawing.up * motion.body["pitch"][1234]
    near = [part for part in drawing.side.parts if isinstance(part, Shape) and part.fill][-1].points
    edge = at[:, near[1]] - at[:, near[0]]
    assert edge[1] / edge[0] == pytest.approx(slope)
    hips = [hip for leg, hip in hips_of(drawing).items() if motion.hips[leg, 1] < 0]
    rest = [drawing.side.points[hip].x for hip in hips]
    across = np.polyfit(rest, at[1, hips], 1)
    assert across[0] == pytest.approx(slope)


def test_the_page_is_told_what_is_drawn_on_paper(motion: Motion) -> None:
    """A point as the script places it: at rest, and by weights of channels."""
    drawing = drawing_of(motion)
    told, channels = drawing.to_dict()["side"], motion.channels[:, 777]
    for (x, z, along, up), place in zip(told["points"], drawing.side.placed(channels, 3.0, 5.0).T, strict=True):
        moved = [sum(weight * channels[at] for at, weight in one) for one in (along, up)]
        np.testing.assert_allclose(
            [x + 3.0 * moved[0], z + 5.0 * moved[1]], place, rtol=1e-5, atol=1e-6 * drawing.length
        )
