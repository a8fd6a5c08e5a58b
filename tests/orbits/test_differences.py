"""Derivatives of returns by differences."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from tarsus.orbits.differences import return_slopes


@dataclass(frozen=True)
class Return:
    """A return whose events are told by a number."""

    state: np.ndarray
    events: int

    def same_events(self, other: Return) -> bool:
        return self.events == other.events


def slope_of(function: Callable[[float], float], events: Callable[[float], int], *, fine: bool = False) -> float:
    """Derivative at zero of a function of one number, which has events by that."""

    def at(place: float) -> Return:
        return Return(np.array([function(place)]), events(place))

    def copies(steps: Sequence[tuple[int, float]]) -> list[Return]:
        return [at(step) for _, step in steps]

    return float(return_slopes(at(0.0), copies, 1, np.ones(1), fine=fine)[0, 0])  # type: ignore[arg-type]


@pytest.mark.parametrize("fine", [False, True], ids=["pairs", "two pairs"])
@pytest.mark.parametrize(
    ("function", "events", "slope", "close"),
    [
        (lambda x: np.exp(0.3 * x), lambda x: 0, 0.3, 1e-9),
        # a root that begins 1e-7 away, as beside a grazing
        (lambda x: np.sqrt(max(1e-7 + x, 0.0)), lambda x: int(x > -1e-7), 0.5 / np.sqrt(1e-7), 1e-3),
        # a kink 1e-6 away, with other events beyond
        (lambda x: x if x < 1e-6 else 5.0 * x, lambda x: int(x >= 1e-6), 1.0, 1e-9),
        # at the very change of events, whose other side is another motion
        (lambda x: np.sin(x) if x <= 0.0 else 3.0, lambda x: int(x > 0.0), 1.0, 1e-6),
        # no copy has the events: the mean of both sides is all that is known
        (abs, lambda x: int(np.sign(x)), 0.0, 1e-9),
        # and that over the longest step where a side jumps
        (lambda x: 2.0 * x + 1e-7 * (x > 0.0), lambda x: int(np.sign(x)), 2.0, 2e-3),
    ],
    ids=["smooth", "root", "kink", "change", "neither", "neither, a jump"],
)
def test_a_return_is_differenced_where_its_events_are_the_same(
    function: Callable[[float], float], events: Callable[[float], int], slope: float, close: float, fine: bool
) -> None:
    assert slope_of(function, events, fine=fine) == pytest.approx(slope, rel=close, abs=close)
