"""A whole millipede of 30 legs: what scattered stiffness and three dead legs do to its walk.

python examples/thirty_legs.py [REPORT.html]
"""

from __future__ import annotations

import sys

import tarsus as ts
from tarsus.solve import Run
from tarsus_reproduce.walkers import many_legs

DEAD = ("L4", "R9", "L12")


def walk(*, scatter: float = 0.0, dead: tuple[str, ...] = (), seed: int = 1, duration: float = 0.1) -> Run:
    """A run of the 30 legs: spread of the logarithm of stiffness, and names of dead legs."""
    return ts.simulate(many_legs(30, scatter=scatter, dead=dead, seed=seed), duration)


if __name__ == "__main__":
    cases = {
        "all alike": walk(),
        "scattered by 10 %": walk(scatter=0.1),
        "and three dead": walk(scatter=0.1, dead=DEAD),
    }
    for name, run in cases.items():
        found, (surge, heave, roll, pitch) = run.measures, run.marks["body"][-1]
        print(
            f"{name:>18}: stride {found.stride.value * 1e6:.3f} um, feet slide {found.foot_slip.value * 1e9:.0f} nm a "
            f"period, roll {roll * 1e3:+.2f} mrad, pitch {pitch * 1e3:+.2f} mrad, {len(run.events)} events"
        )
    if len(sys.argv) > 1:
        from tarsus.report import write_report

        print(f"wrote {write_report(cases['and three dead'], sys.argv[1])}")
