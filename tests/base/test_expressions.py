"""Arithmetic of a study: what it gives, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.base.expressions import Expression


def test_an_expression_has_the_value_of_its_arithmetic():
    names = {"static": np.array([2.0, 12.0]), "ratio": -0.25}
    found = Expression("static / (1 + ratio) ** 2 - sqrt(4)").values(names)
    assert found == pytest.approx(np.array([2.0, 12.0]) / 0.5625 - 2.0)
    assert Expression("max(static, 10) * sin(pi / 2)").values(names).tolist() == [10.0, 12.0]
    assert Expression("static / (1 + ratio)").names == {"static", "ratio"}


@pytest.mark.parametrize("text", ["static / (ratio - ratio)", "sqrt(-static)", "exp(1e4)", "(-static) ** 0.5", "1 / 0"])
def test_arithmetic_without_a_value_is_not_a_number(text):
    assert np.isnan(Expression(text).values({"static": 1.0, "ratio": 1.0}))


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
