"""E11 and E14: numbers that a table or a line of arithmetic contradicts."""

from __future__ import annotations

import pytest

from tarsus_reproduce.rows import CANTILEVER, packaged_rows

HIP_STIFFNESS, PRINTED_TORQUE = 7.74e-8, 0.0057  # k_op,v [N m/rad] and tau_op [N m] of Table 4.1


def test_e11_the_printed_torque_would_wind_the_hip_up():
    assert pytest.approx(7.4e4, rel=0.01) == PRINTED_TORQUE / HIP_STIFFNESS  # rad
    assert pytest.approx(0.0736, rel=0.01) == PRINTED_TORQUE * 1e-6 / HIP_STIFFNESS


def test_e14_the_table_counts_more_right_than_the_text_says():
    wrong = [
        abs(row.source["bounces"] - row.measured["bounces"])
        for row in packaged_rows(CANTILEVER)
        if row.source["bounces"] != row.measured["bounces"]
    ]
    # Table 2.3: 12 of 16 right with a mean error of 0.28 bounces: the packaged rows hold all four.
    assert len(wrong) == 16 - 12
    assert sum(wrong) / 16 == pytest.approx(0.28, abs=0.005)
    assert 12 / 16 > 0.6
