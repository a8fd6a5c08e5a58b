"""Strides that are compared with MuJoCo's are of steady motion, or there are none."""

import pytest

import tarsus as ts
from tarsus.export.mujoco_run import steady_periods


def test_a_stride_is_of_whole_periods_of_steady_motion_or_not_told():
    short, settled = ts.simulate("millipede", 0.1), ts.simulate("millipede", 0.6)
    assert steady_periods((short,), 0.1) is None  # a transient, which made 2.4 times the steady stride
    begin, end, turns = steady_periods((settled,), 0.6)
    first, last, *_ = settled.states([begin, end]).x[0]
    whole = settled.states([0.6 - 10 * settled.period, 0.6]).x[0]
    assert (last - first) / turns == pytest.approx((whole[1] - whole[0]) / 10, rel=1e-5)
    assert steady_periods((settled, short), 0.6) is None and steady_periods((settled,), 0.5 * begin) is None
