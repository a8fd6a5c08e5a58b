"""Gaits: which drive has its high volts when, and what a gait refuses."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.model.drive.gait import Alternating, CustomGait, Gait, Layout, MetachronalGait, Reach, Ripple, Tripod
from tarsus.model.drive.waveforms import Square

PERIOD = 0.02
COMMON = {"frequency": 1.0 / PERIOD, "high": "14 V"}
MIDDLES = (np.arange(240) + 0.5) / 240
"""Instants of a period [periods], none on an edge."""


def rows(left: int, right: int, *, dead: tuple[str, ...] = ()) -> Layout:
    """Legs L1, L2 ... and R1, R2 ... from the front, listed from the rear, each with a drive but the dead."""
    hips = {f"L{i + 1}": (-1e-3 * i, 1e-3) for i in reversed(range(left))}
    hips |= {f"R{i + 1}": (-1e-3 * i, -1e-3) for i in reversed(range(right))}
    return Layout(hips, {leg: Reach((leg,)) for leg in hips if leg not in dead})


def high(gait: Gait, layout: Layout) -> dict[str, np.ndarray]:
    """Whether each drive has its high volts, at every one of `MIDDLES`."""
    assert gait.faults(layout) == []
    return {drive: wave.volts(MIDDLES * PERIOD) > 7.0 for drive, wave in gait.waveforms(layout).items()}


def test_a_leg_with_phase_p_is_p_periods_late() -> None:
    layout = rows(1, 1)
    gait = CustomGait(**COMMON, low="-2 V", duty=0.3, phases={"L1": 0.0, "R1": 0.125})
    first, second = (gait.waveforms(layout)[leg] for leg in ("L1", "R1"))
    times = np.linspace(0.0, 3.0, 1000) * PERIOD
    np.testing.assert_array_equal(second.volts(times + 0.125 * PERIOD), first.volts(times))
    assert first == Square(amplitude=8.0, offset=6.0, frequency=1.0 / PERIOD, duty=0.3)
    assert first.volts(np.array([0.0, 0.299 * PERIOD, 0.301 * PERIOD])).tolist() == [14.0, 14.0, -2.0]


DELAYS = [
    (Alternating(**COMMON), rows(4, 4), 2, "L1 L3 R2 R4 | L2 L4 R1 R3"),
    (Tripod(**COMMON), rows(3, 3), 2, "L1 L3 R2 | L2 R1 R3"),
    (MetachronalGait(**COMMON), rows(3, 3), 6, "L3 | L2 | L1 | R3 | R2 | R1"),
    (MetachronalGait(**COMMON), rows(4, 0), 4, "L4 | L3 | L2 | L1"),
    (Ripple(**COMMON), rows(3, 3), 6, "L3 | R1 | L2 | R3 | L1 | R2"),
    (Ripple(**COMMON), rows(4, 4), 4, "L4 R2 | L3 R1 | L2 R4 | L1 R3"),
    (Ripple(**COMMON), rows(4, 0), 4, "L4 | L3 | L2 | L1"),
]
"""Gaits, and the legs that rise together, group after group a share of a period later."""


@pytest.mark.parametrize(("gait", "layout", "parts", "groups"), DELAYS, ids=lambda one: getattr(one, "kind", ""))
def test_legs_rise_in_the_order_of_their_gait(gait: Gait, layout: Layout, parts: int, groups: str) -> None:
    """Waves run from back to front, on one side after the other or, in a ripple, half a period apart."""
    wanted = {leg: k / parts for k, group in enumerate(groups.split("|")) for leg in group.split()}
    assert gait.delays(layout) == pytest.approx(wanted)
    for leg, on in high(gait, layout).items():
        late = round(wanted[leg] * len(MIDDLES))
        np.testing.assert_array_equal(on, np.roll(gait.duty > MIDDLES, late), err_msg=leg)


def test_alternating_groups_of_legs_that_share_a_drive() -> None:
    hips = {leg: (0.0, 0.0) for leg in ("a", "b", "c", "d")}
    layout = Layout(
        hips, {"up": Reach(("a", "b")), "along": Reach(("a", "b"), lateral=True), "rest": Reach(("c", "d"))}
    )
    gait = Alternating(**COMMON)
    assert gait.delays(layout) == {"a": 0.0, "b": 0.0, "c": 0.5, "d": 0.5}
    on = high(gait, layout)
    assert np.all(on["up"] != on["rest"])
    assert np.all(np.roll(on["up"], 60) == on["along"])


def test_dead_legs_keep_their_place() -> None:
    for gait in (Alternating(**COMMON), Tripod(**COMMON), MetachronalGait(**COMMON), Ripple(**COMMON)):
        whole, hurt = rows(3, 3), rows(3, 3, dead=("L2", "R3"))
        left = gait.waveforms(hurt)
        assert set(left) == {"L1", "L3", "R1", "R2"}
        assert left == {leg: wave for leg, wave in gait.waveforms(whole).items() if leg in left}


def test_a_drive_that_moves_no_leg_gets_no_volts() -> None:
    layout = Layout({"a": (0.0, 0.0)}, {"leg": Reach(("a",)), "tail": Reach(())})
    assert set(Alternating(**COMMON).waveforms(layout)) == {"leg"}


def test_a_group_must_share_one_phase() -> None:
    hips = rows(2, 2).hips
    pairs = Layout(hips, {"front": Reach(("L1", "R1")), "hind": Reach(("L2", "R2"))})
    assert Alternating(**COMMON).faults(pairs) == []
    said = [said for _, said in MetachronalGait(**COMMON).faults(pairs)]
    assert "'front'" in said[0] and "'hind'" in said[1] and len(said) == 2
    whole = {"L1": 0.25, "R1": -0.75, "L2": 1.0, "R2": 0.0}
    assert CustomGait(**COMMON, phases=whole).faults(pairs) == []
