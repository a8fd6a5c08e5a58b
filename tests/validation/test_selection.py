"""Conditions on rows."""

from __future__ import annotations

import pytest

from tarsus.base.errors import InputError
from tarsus.validation.selection import Selection

ROW = {"event": "pull_in", "volts": 40.0}


@pytest.mark.parametrize(
    ("text", "met"),
    [
        ("", True),
        ('event == "pull_in"', True),
        ('event != "pull_in"', False),
        ("30 < volts <= 40", True),
        ("volts > -1 and not volts < 40", True),
        ('event == "release" or volts >= 40', True),
        ("(volts < 40 or volts > 50) and volts != 41", False),
        ("load == 0", False),  # an empty cell
        ("load != 0", False),
        ('volts != "40"', False),  # a word is no number
    ],
)
def test_condition(text, met):
    assert Selection(text)(ROW) is met


@pytest.mark.parametrize("text", ["v", "v +", "f(v) == 1", "v == True", "v in [1]", "v + 1 == 2"])
def test_what_is_no_condition(text):
    with pytest.raises(InputError, match="expected comparisons such as"):
        Selection(text)


def test_columns_that_a_table_lacks():
    (said,) = Selection('volts < 3 and evnt == "release"').check(["event", "volts"])
    assert "no column 'evnt'" in said and "event" in said
