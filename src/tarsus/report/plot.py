"""Figures for notebooks, ``tarsus.plot``: every function draws into matplotlib axes and returns them.

``axes`` are those to draw into; without them a figure of its own is made. Numbers are drawn in SI, the words at ticks
alone stand under a prefix, so that more can be drawn over them. Nothing of matplotlib's settings is changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from tarsus.base.errors import InputError
from tarsus.base.events import IMPACTS
from tarsus.base.messages import nearest
from tarsus.base.verb import callable_package
from tarsus.report.sheet import name_axes, named
from tarsus.report.style import CONTACT, CYCLE, INK, MOST_LINES
from tarsus.solve import Run
from tarsus.tables.numbers import spaced

if TYPE_CHECKING:
    from tarsus.design import Design, LandingDesign
    from tarsus.orbits import Branches, Orbit
    from tarsus.solve import Batch, Run

callable_package(__name__, "tarsus.report.plotted:plot")

__all__ = ["branch", "front", "impacts", "landing", "ledger", "measure", "motion", "multipliers", "series"]


def motion(run: Run, points: Sequence[str] | None = None, *, axes: Axes | None = None) -> Axes:
    """Displacement of points over time, contact of the first foot shaded.

    points: their names; without any the feet, then the others, six at most. Raises InputError for unknown names.
    """
    from tarsus.files.series import dataset_of
    from tarsus.report.saved import draw_series

    data = dataset_of(run.variables(), {})
    names = [str(one) for one in data["point"].values]
    feet = list(dict.fromkeys(foot.point for foot in run.scene.robot.feet.values()))
    asked = list(points) if points is not None else [*feet, *(n for n in names if n not in feet)][:MOST_LINES]
    if unknown := [f"points: there is no point '{one}'{nearest(one, names)}" for one in asked if one not in names]:
        raise InputError(unknown)
    axes = _on(axes)
    draw_series(axes, data["displacement"], asked)
    if feet:
        touching = data["gap"].values[0] <= 0.0
        look = {"transform": axes.get_xaxis_transform(), "color": CONTACT, "lw": 0}
        axes.fill_between(data["time"].values, 0.0, 1.0, where=touching, **look)
    axes.set_title(run.scene.name)
    return axes


def series(run: Run, name: str, only: Sequence[str] | None = None, *, axes: Axes | None = None) -> Axes:
    """A series of a run over time by its name in `Run.to_dataset`, such as ``"gap"``.

    only: feet, points or drives by name, the first six unless given. Raises InputError for names that the run does not
    have.
    """
    from tarsus.files.series import dataset_of
    from tarsus.report.saved import draw_series, offered

    data = dataset_of(run.variables(), {})
    known = offered(data)
    if name not in known:
        raise InputError(f"a run has no series '{name}'{nearest(name, [*Run.figures, *known])}")
    axes = _on(axes)
    draw_series(axes, data[name], only)
    axes.set_title(run.scene.name)
    return axes


def impacts(run: Run, foot: str | None = None, *, axes: Axes | None = None) -> Axes:
    """Approach speed of every impact over time; foot: of that one alone. Raises InputError for an unknown one."""
    names = list(run.scene.robot.feet)
    if foot is not None and foot not in names:
        raise InputError(f"foot: the robot has no foot '{foot}'{nearest(foot, names)}")
    axes = _on(axes)
    events = run.events[np.isin(run.events["kind"], IMPACTS)]
    for color, name in zip(CYCLE * len(names), names, strict=False):
        own = events[events["foot"] == names.index(name)]
        if foot in (None, name) and len(own):
            axes.plot(own["time"], own["speed_before"], ".", color=color, label=name)
    axes.set_title(run.scene.name)
    name_axes(axes, ("time", "s"), ("approach speed", "m/s"))
    axes.set_xlim(0.0, run.duration)
    axes.set_ylim(0.0, 1.1 * float(events["speed_before"].max(initial=1e-9)))
    return axes


def ledger(run: Run, *, axes: Axes | None = None) -> Axes:
    """Where the work of the drives went: a bar for each entry of the energy account."""
    account = run.ledger
    entries = {
        "work of the drives": account.work_in,
        "work of the ground": account.ground,
        "kinetic": -account.kinetic,
        "elastic": -account.elastic,
        "damping": -account.damping,
        "friction": -account.friction,
        "impacts": -account.impacts,
        "adhesion": -account.adhesion,
        **{spaced(name): work for name, work in account.laws.items()},
    }
    shown = {name: value for name, value in entries.items() if value != 0.0}
    axes = _on(axes)
    colors = [CYCLE[0] if value > 0.0 else CYCLE[1] for value in shown.values()]
    axes.barh(list(shown), list(shown.values()), color=colors)
    axes.axvline(0.0, color=INK, lw=0.7)
    axes.invert_yaxis()
    axes.set_title(f"closed to {account.closure:.1e}")
    name_axes(axes, ("into the motion", "J"))
    return axes


def measure(batch: Batch, name: str, *, axes: Axes | None = None) -> Axes:
    """A measure of a batch over what varies: points over one number, a map of a grid of two.

    Raises InputError for an unknown measure, and for more numbers that vary.
    """
    from tarsus.report.saved import draw_measure

    over = list(batch.axes or batch.vary)
    if len(over) not in (1, 2) or (len(over) == 2 and not batch.axes):
        raise InputError(f"a figure is of one number that varies, or of a grid of two; here vary {', '.join(over)}")
    data = batch.to_dataset([name])
    axes = _on(axes)
    axes.set_title(batch.scene.name)
    draw_measure(axes, data[name])
    return axes


def landing(design: LandingDesign, *, axes: Axes | None = None) -> Axes:
    """Gap of the foot over one period, with the plain step and with the design, from the landing edge on."""
    from tarsus.report.landing_figures import DesignPair, draw_gaps

    axes = _on(axes)
    draw_gaps(axes, DesignPair(design), design.train.step.period)
    axes.set_title(repr(design)[1:-1])
    axes.legend(frameon=False)
    return axes


def front(design: Design, *, axes: Axes | None = None) -> Axes:
    """First objective of a front of gaits over the second one; all candidates behind it.

    Raises InputError for a front of one objective.
    """
    if len(design.objectives) < 2:
        raise InputError("a front of one objective is one gait: there is nothing to draw")
    axes = _on(axes)
    along, up = design.objectives[1], design.objectives[0]
    all_ = [up.value(design.costs[:, 0]), along.value(design.costs[:, 1])]
    best = np.array([point.risk[:2] for point in design.members]).T
    axes.plot(all_[1], all_[0], ".", ms=2, color="0.75", label="candidates")
    axes.plot(best[1], best[0], "o", color=CYCLE[0], label="front")
    name_axes(axes, (along.name, along.unit), (up.name, up.unit))
    axes.legend(frameon=False)
    return axes


def branch(found: Branches, *, axes: Axes | None = None) -> Axes:
    """Hardest impact of each orbit along branches; what happens on them is marked by its name."""
    from tarsus.report.branch_page import draw_branches

    axes = _on(axes)
    draw_branches(axes, found, "hardest_impact", "m/s")
    axes.set_title(found.scene.name)
    labels, handles = named(axes)
    axes.legend(handles, labels, frameon=False)
    return axes


def multipliers(orbit: Orbit, *, axes: Axes | None = None) -> Axes:
    """Multipliers of an orbit in the complex plane, with the unit circle within which deviations die out."""
    from tarsus.report.branch_page import draw_multipliers

    axes = _on(axes)
    draw_multipliers(axes, orbit.multipliers, 5.0)
    axes.set_title(orbit.kind)
    return axes


def _on(axes: Axes | None) -> Axes:
    """Those given, or of a new figure, which is then matplotlib's current one: notebooks show it by themselves."""
    if axes is not None:
        return axes
    from matplotlib import pyplot

    return pyplot.subplots(figsize=(7.0, 3.2), layout="constrained")[1]
