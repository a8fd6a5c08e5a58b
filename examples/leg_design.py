"""Lengths of the millipede's links (4.1)-(4.2), as corrected in E12, and the landscape around them.

python examples/leg_design.py [FIGURE.svg]
"""

from __future__ import annotations

import sys

import numpy as np
from matplotlib.figure import Figure

from tarsus.base.spec import get_value, with_values
from tarsus.design import LinkDesign
from tarsus.design import leg as design_leg
from tarsus.model.structure.leg import Leg
from tarsus.model.structure.leg_step import step_lift
from tarsus_reproduce.legs import millipede_leg

SHORTEST, LONGEST = 100e-6, 500e-6
"""Bounds of every length [m]: the source prints none; 2.5 times shorter and twice as long as its own."""


def designed(leg: Leg) -> LinkDesign:
    """The fastest leg that lifts its own load, within the bounds."""
    return design_leg(leg, SHORTEST, LONGEST)


ACROSS, UP = "hip.length", "shin.length"


def figure(leg: Leg, found: LinkDesign, points: int = 25) -> Figure:
    """Mean speed over the lengths of hip link and shin, the thigh as designed, where the leg does not carry its load,
    and where leg and design stand."""
    lengths = np.linspace(SHORTEST, LONGEST, points)
    lifts = [[step_lift(with_values(found.leg, {ACROSS: x, UP: y})) for x in lengths] for y in lengths]
    speed = np.array([[one.mean_speed for one in row] for row in lifts])
    capacity = np.array([[one.capacity for one in row] for row in lifts])
    drawn = Figure(figsize=(5.4, 4.2), layout="constrained")
    axes, side = drawn.subplots(), lengths * 1e6
    shown = axes.contourf(side, side, speed * 1e3, levels=14, cmap="Blues")
    drawn.colorbar(shown, ax=axes, label="mean speed to the first peak (mm/s)")
    axes.contourf(side, side, capacity / found.load, levels=[0.0, 1.0], colors=["0.5"], alpha=0.4)
    for name, one, mark in (("as given", leg, "ko"), ("design", found.leg, "r*")):
        axes.plot(get_value(one, ACROSS) * 1e6, get_value(one, UP) * 1e6, mark, label=name)
    weight = f"grey: does not carry {found.load * 1e6:.3g} µN"
    axes.set(xlabel=f"{ACROSS} (µm)", ylabel=f"{UP} (µm)", title=weight)
    axes.legend()
    return drawn


def report(leg: Leg, loads_mg: tuple[float, ...] = (1.0, 1.3, 1.6, 2.0, 2.2)) -> None:
    """Print the design for several loads of a leg."""
    print("load a leg    hip  thigh   shin     speed   printed lengths")
    for load in loads_mg:
        one = with_values(leg, {"body_mass": load * 1e-6})
        found = designed(one)
        hip, thigh, shin = found.lengths * 1e6
        print(
            f"{load:7.1f} mg {hip:6.0f} {thigh:6.0f} {shin:6.0f} um {found.lift.mean_speed * 1e3:6.2f} mm/s "
            f"{step_lift(one).mean_speed * 1e3:6.2f} mm/s"
        )


if __name__ == "__main__":
    leg = millipede_leg().leg
    report(leg)
    if len(sys.argv) > 1:
        found = designed(leg)
        figure(leg, found).savefig(sys.argv[1])
