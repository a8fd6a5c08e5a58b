"""Figures for notebooks, ``tarsus.plot``: every function draws into matplotlib axes and returns them.

``axes`` are those to draw into; without them a figure of its own is made. Nothing of matplotlib's settings is changed.
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
from tarsus.report.style import CONTACT, CYCLE, INK, Scale, level_limits, scale_of

if TYPE_CHECKING:
    from tarsus.design import GaitFront, LandingDesign
    from tarsus.orbits import Branch, Orbit
    from tarsus.solve import Batch, Run

callable_package(__name__, "tarsus.report.plotted:plot")

__all__ = ["branch", "front", "impacts", "landing", "ledger", "measure", "motion", "multipliers"]

MOST_LINES = 6
"""Points that are drawn unless others are asked for: as many as there are colours told apart."""


def motion(run: Run, points: Sequence[str] | None = None, *, axes: Axes | None = None) -> Axes:
    """Displacement of points over time, contact of the first foot shaded.

    points: their names; without any the feet, then the others, six at most. Raises InputError for unknown names.
    """
    found = run.variables()
    names = list(found["point"].values)
    feet = [foot.point for foot in run.scene.robot.feet.values()]
    asked = list(points) if points is not None else [*feet, *(n for n in names if n not in feet)][:MOST_LINES]
    if unknown := [
        f"points: there is no point '{one}'{nearest(one, names)}" for one in asked if one not in names
    ]:
        raise InputError(unknown)
    axes = _on(axes)
    time, shift = found["time"].values, found["displacement"].values
    rows = [names.index(one) for one in dict.fromkeys(asked)]
    clock, scale = scale_of("s", time), scale_of("m", shift[rows])
    for color, row in zip(CYCLE, rows, strict=False):
        axes.plot(time / clock.step, shift[row] / scale.step, lw=1.1, color=color, label=names[row])
    for row, color in zip(rows[len(CYCLE) :], CYCLE * len(rows), strict=False):
        axes.plot(time / clock.step, shift[row] / scale.step, lw=1.1, ls="--", color=color, label=names[row])
    if feet:
        touching = found["gap"].values[0] <= 0.0
        axes.fill_between(
            time / clock.step,
            0.0,
            1.0,
            where=touching,
            transform=axes.get_xaxis_transform(),
            color=CONTACT,
            lw=0,
        )
    axes.set(xlabel=f"time ({clock.label})", ylabel=f"displacement ({scale.label})", title=run.scene.name)
    axes.legend(frameon=False)
    return axes


def impacts(run: Run, foot: str | None = None, *, axes: Axes | None = None) -> Axes:
    """Approach speed of every impact over time; foot: of that one alone. Raises InputError for an unknown one."""
    names = list(run.scene.robot.feet)
    if foot is not None and foot not in names:
        raise InputError(f"foot: the robot has no foot '{foot}'{nearest(foot, names)}")
    axes = _on(axes)
    events = run.events[np.isin(run.events["kind"], IMPACTS)]
    clock = scale_of("s", np.array([run.duration]))
    for color, name in zip(CYCLE * len(names), names, strict=False):
        own = events[events["foot"] == names.index(name)]
        if foot in (None, name) and len(own):
            axes.plot(own["time"] / clock.step, own["speed_before"], ".", color=color, label=name)
    axes.set(xlabel=f"time ({clock.label})", ylabel="approach speed (m/s)", title=run.scene.name)
    axes.set_xlim(0.0, run.duration / clock.step)
    axes.set_ylim(0.0, 1.1 * float(events["speed_before"].max(initial=1e-9)))
    return axes


def ledger(run: Run, *, axes: Axes | None = None) -> Axes:
    """Where the work of the drives went: a bar for each entry of the energy account."""
    account = run.ledger
    entries = {
        "work of the drives": account.work_in, "kinetic": -account.kinetic, "elastic": -account.elastic,
        "damping": -account.damping, "friction": -account.friction, "impacts": -account.impacts,
        "adhesion": -account.adhesion, **{name.replace("_", " "): work for name, work in account.laws.items()},
    }  # fmt: skip
    shown = {name: value for name, value in entries.items() if value != 0.0}
    axes = _on(axes)
    scale = scale_of("J", np.array(list(shown.values()) or [1.0]))
    colors = [CYCLE[0] if value > 0.0 else CYCLE[1] for value in shown.values()]
    axes.barh(list(shown), [value / scale.step for value in shown.values()], color=colors)
    axes.axvline(0.0, color=INK, lw=0.7)
    axes.invert_yaxis()
    axes.set(xlabel=f"into the motion ({scale.label})", title=f"closed to {account.closure:.1e}")
    return axes


def measure(batch: Batch, name: str, *, axes: Axes | None = None) -> Axes:
    """A measure of a batch over what varies: points over one number, a map of a grid of two.

    Raises InputError for an unknown measure, and for more numbers that vary.
    """
    from tarsus.base.spec import float_paths

    values = np.asarray(batch.measure(name))
    unit = batch.measured((name,))[name].unit
    known = float_paths(batch.scene)
    over = {path: np.asarray(one) for path, one in (batch.axes or batch.vary).items()}
    if len(over) not in (1, 2) or (len(over) == 2 and not batch.axes):
        raise InputError(
            f"a figure is of one number that varies, or of a grid of two; here vary {', '.join(over)}"
        )
    axes = _on(axes)
    scales = {path: _scale(known[path].unit, one) for path, one in over.items()}
    size = _scale(unit, values)
    labels = [f"{path} ({scales[path].label})" for path in over]
    if len(over) == 1:
        (path,) = over
        order = np.argsort(over[path])
        axes.plot(over[path][order] / scales[path].step, values.ravel()[order] / size.step, ".-", lw=0.9)
        axes.set(xlabel=labels[0], ylabel=f"{name.replace('_', ' ')} ({size.label})", title=batch.scene.name)
        _level(axes, values / size.step)
        return axes
    (rows, ups), (columns, alongs) = over.items()
    order = np.ix_(np.argsort(ups), np.argsort(alongs))
    shown = axes.pcolormesh(
        np.sort(alongs) / scales[columns].step,
        np.sort(ups) / scales[rows].step,
        values[order] / size.step,
        shading="nearest",
    )
    axes.figure.colorbar(shown, ax=axes, label=f"{name.replace('_', ' ')} ({size.label})")
    axes.set(xlabel=labels[1], ylabel=labels[0], title=batch.scene.name)
    return axes


def landing(design: LandingDesign, *, axes: Axes | None = None) -> Axes:
    """Gap of the foot over one period, with the plain step and with the design, from the landing edge on."""
    from tarsus.model.scene import override
    from tarsus.solve import simulate

    request = design.request
    period, foot = request.step.period, list(request.scene.robot.feet).index(request.foot)
    start = (design.settle - 1) * period
    axes = _on(axes)
    clock = scale_of("s", np.array([period]))
    times = np.linspace(start, start + period, 2001)
    traces = {}
    for label, signal in (("step", design.plain_signal), ("design", design.signal)):
        scene = override(request.scene, {"signals": {**request.scene.signals, request.drive: signal}})
        traces[label] = simulate(scene, start + period).variables(times)["gap"].values[foot]
    scale = scale_of("m", np.array(list(traces.values())))
    for color, (label, gap) in zip((CYCLE[1], CYCLE[0]), traces.items(), strict=True):
        axes.plot((times - start) / clock.step, gap / scale.step, lw=1.1, color=color, label=label)
    axes.set(xlabel=f"time ({clock.label})", ylabel=f"gap ({scale.label})", title=repr(design)[1:-1])
    axes.legend(frameon=False)
    return axes


def front(design: GaitFront, *, axes: Axes | None = None) -> Axes:
    """First objective of a front of gaits over the second one; all candidates behind it.

    Raises InputError for a front of one objective.
    """
    if len(design.objectives) < 2:
        raise InputError("a front of one objective is one gait: there is nothing to draw")
    axes = _on(axes)
    along, up = design.objectives[1], design.objectives[0]
    all_ = [up.value(design.costs[:, 0]), along.value(design.costs[:, 1])]
    best = np.array([point.risk[:2] for point in design.members]).T
    scales = [_scale(one.unit, values) for one, values in zip((up, along), best, strict=True)]
    axes.plot(all_[1] / scales[1].step, all_[0] / scales[0].step, ".", ms=2, color="0.75", label="candidates")
    axes.plot(best[1] / scales[1].step, best[0] / scales[0].step, "o", color=CYCLE[0], label="front")
    axes.set(xlabel=f"{along.name} ({scales[1].label})", ylabel=f"{up.name} ({scales[0].label})")
    axes.legend(frameon=False)
    return axes


def branch(found: Branch, *, axes: Axes | None = None) -> Axes:
    """Hardest impact of each orbit along a branch; what happens on it is marked by its name."""
    axes = _on(axes)
    at = np.array([point.at for point in found.points])
    hardest = np.array([_hardest(point.orbit) for point in found.points])
    scale = _scale(found.unit, at)
    stable = np.array([point.orbit.stable for point in found.points])
    axes.plot(at / scale.step, hardest, "-", lw=0.8, color=INK)
    axes.plot(at[stable] / scale.step, hardest[stable], ".", color=CYCLE[0], label="stable")
    axes.plot(at[~stable] / scale.step, hardest[~stable], ".", color=CYCLE[1], label="unstable")
    for point, speed in zip(found.points, hardest, strict=True):
        if point.kind != "orbit":
            axes.annotate(
                point.kind, (point.at / scale.step, speed), textcoords="offset points", xytext=(4, 4)
            )
    axes.set(xlabel=f"{found.path} ({scale.label})", ylabel="hardest impact (m/s)", title=found.scene.name)
    _level(axes, hardest)
    axes.legend(frameon=False)
    return axes


def multipliers(orbit: Orbit, *, axes: Axes | None = None) -> Axes:
    """Multipliers of an orbit in the complex plane, with the unit circle within which deviations die out."""
    axes = _on(axes)
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    axes.plot(np.cos(turn), np.sin(turn), color=INK, lw=0.7)
    axes.plot(orbit.multipliers.real, orbit.multipliers.imag, "o", color=CYCLE[0])
    axes.set(xlabel="real part", ylabel="imaginary part", title=orbit.kind)
    axes.set_aspect("equal")
    return axes


def _scale(unit: str, values: np.ndarray) -> Scale:
    """A prefix for a unit that bears one; counts and shares, and units that begin with a prefix, stay as they are."""
    return Scale(1.0, unit) if unit == "1" or unit.startswith("kg") else scale_of(unit, values)


def _level(axes: Axes, values: np.ndarray) -> None:
    """Values that are one to rounding as a level line."""
    if limits := level_limits(values):
        axes.set_ylim(*limits)


def _hardest(orbit: Orbit) -> float:
    events = orbit.events
    speeds = events["speed_before"][np.isin(events["kind"], IMPACTS)]
    return float(speeds.max()) if len(speeds) else 0.0


def _on(axes: Axes | None) -> Axes:
    """Those given, or of a new figure, which is then matplotlib's current one: notebooks show it by themselves."""
    if axes is not None:
        return axes
    from matplotlib import pyplot

    return pyplot.subplots(figsize=(7.0, 3.2), layout="constrained")[1]
