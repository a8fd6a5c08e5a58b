"""With a passive map motion stays bounded: random drives, gaps and restitutions, closed ledgers."""

from __future__ import annotations

import numpy as np

import tarsus as ts
from printed_robots import hexapod, printed_map


def test_the_printed_map_diverges():
    # The documented example: 10 V square, the printed R as it is. The foot is a kilometre up before the first second.
    scene = hexapod(
        signal=ts.Square(amplitude=10.0, frequency=30.0), impact=printed_map(passive=False), restitution=0.5
    )
    run = ts.simulate(scene, duration=0.5)
    heights = [np.abs(run.states(np.linspace(0.0, end, 2001)).x).max() for end in (0.1, 0.3, 0.5)]
    # how fast is chaos, which the last bit of its modes changes: 5e5 to 3e9 times within those 0.4 s
    assert heights[1] > 10.0 * heights[0] and heights[2] > 1e4 * heights[0]
    assert run.ledger.impacts < 0.0, "impacts have made energy"
    longer = ts.simulate(scene, duration=2.0)
    assert longer.code.name == "DIVERGED" and "creates energy" in longer.code.value
