"""What to record next: what a walk cannot tell of the ground, and the exercise of one leg that tells it.

    python examples/next_measurement.py

The pull-off force of a foot is C_a0 + C_a t after a contact of t seconds. In a walk all contacts are short, and a tenth
of a microgram of robot shows little of them: the growth C_a cannot be told from it, however well it is recorded. That
is known before anything is recorded: derivatives of a simulated record by the unknown numbers give the least spread
that any estimate can have. One leg that steps slowly while the other stands has long contacts.
"""

from __future__ import annotations

import tarsus as ts
from tarsus.synthesis.recommend import Recommendation

GROWTH = "ground.adhesion.rate"


def asked(device: str = "millipede") -> tuple[Recommendation, Recommendation]:
    """What to record for all numbers at the pace of the gait, and for the growth of adhesion at any pace."""
    pace = {"hz": "102", "volts": "14"}
    return (
        ts.recommend(device, budget="0.3 s", vary=pace),
        ts.recommend(device, parameter=GROWTH, budget="1 s", vary={"hz": "10.2, 102", "volts": "7"}),
    )


if __name__ == "__main__":
    for one in asked():
        print(one, end="\n\n")
