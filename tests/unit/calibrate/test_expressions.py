"""Arithmetic of a study: what it gives, and what it refuses."""

from __future__ import annotations

import math

import pytest

from tarsus.calibrate.expressions import Expression


def test_an_expression_has_the_value_of_its_arithmetic():
    names = {"static": 2.0, "ratio": -0.25}
    assert Expression("static / (1 + ratio) ** 2 - sqrt(4)").value(names) == pytest.approx(2.0 / 0.5625 - 2.0)
    assert Expression("max(static, 10) * sin(pi / 2)").value(names) == 10.0
    assert Expression("static / (1 + ratio)").names == {"static", "ratio"}


@pytest.mark.parametrize(
    "text", ["static / (ratio - ratio)", "sqrt(-static)", "exp(1e4)", "(-static) ** 0.5"]
)
def test_arithmetic_without_a_value_is_not_a_number(text):
    assert math.isnan(Expression(text).value({"static": 1.0, "ratio": 1.0}))


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os')",
        "static.real",
        "[1, 2]",
        "lambda: 1",
        "static if ratio else 1",
        "open('x')",
        "'a'",
        "True",
        "1 +",
    ],
)
def test_nothing_but_arithmetic_passes(text):
    assert Expression(text).check({"static", "ratio"})


def test_an_unknown_name_is_told_with_the_nearest():
    (said,) = Expression("statik * 2").check({"static"})
    assert "no 'statik'" in said and "'static'" in said
