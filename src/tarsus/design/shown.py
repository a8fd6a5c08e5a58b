"""Designs where they are printed: a line in a terminal, a table in a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tarsus.base.spec import float_paths
from tarsus.tables.numbers import amount
from tarsus.tables.table import Table

if TYPE_CHECKING:
    from tarsus.design.adaptive import AdaptiveGait
    from tarsus.design.gait_fronts import GaitFront
    from tarsus.design.soft_landing import LandingDesign

__all__ = ["adapt_html", "adapt_line", "front_html", "front_line", "landing_html", "landing_line"]


def landing_line(design: LandingDesign) -> str:
    """A soft landing in a line."""
    plain, softer = (amount(float(one.speed[0, 0]), "m/s") for one in (design.before, design.after))
    name, pairs = design.request.scene.name, f"{design.pairs} pair{'s' * (design.pairs != 1)}"
    return f"<LandingDesign of '{name}': {softer} instead of {plain}, {pairs}>"


def landing_html(design: LandingDesign) -> str:
    """The plateaus of a soft landing under what they are for."""
    worst = "" if design.worst != design.worst else f", {amount(design.worst, 'm/s')} on the worst ground"
    title = f"{landing_line(design)[1:-1]}; {design.touchdowns:g} touchdowns a step{worst}"
    signal = zip(design.switching_times, design.signal.levels, design.signal.durations, strict=True)
    rows = [(amount(at, "s"), amount(volts, "V"), amount(long, "s")) for at, volts, long in signal]
    return Table(title, ("from", "voltage", "for"), rows).html()


def front_line(design: GaitFront) -> str:
    """A front of gaits in a line."""
    names = " against ".join(one.name for one in design.objectives)
    return f"<GaitFront of '{design.request.scene.name}': {len(design.members)} gaits, {names}>"


def front_html(design: GaitFront) -> str:
    """The gaits of a front: what they reach, and the numbers that make them."""
    units = float_paths(design.request.scene)
    changed = list(design.members[0].values) if design.members else []
    rows = [
        (
            *(amount(value, one.unit) for one, value in zip(design.objectives, point.risk, strict=True)),
            *(amount(point.values[path], units[path].unit if path in units else "1") for path in changed),
        )
        for point in design.members
    ]
    return Table(front_line(design)[1:-1], (*(one.name for one in design.objectives), *changed), rows).html()


def adapt_line(design: AdaptiveGait) -> str:
    """Adaptive gaits in a line."""
    name = design.request.scene.name
    return f"<AdaptiveGait of '{name}': {len(design.gaits)} gaits, regret {100.0 * design.regret:.3g} %>"


def adapt_html(design: AdaptiveGait) -> str:
    """The few gaits, and how often each is taken on the hidden grounds."""
    units = float_paths(design.request.scene)
    changed = list(design.gaits[0])
    rows = [
        (
            f"{number}{' (probe)' * (number in design.probes)}",
            f"{int((design.chosen == number).sum())} of {len(design.chosen)}",
            *(amount(gait[path], units[path].unit if path in units else "1") for path in changed),
        )
        for number, gait in enumerate(design.gaits)
    ]
    return Table(adapt_line(design)[1:-1], ("gait", "taken", *changed), rows).html()
