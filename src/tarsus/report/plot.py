"""Figures for notebooks and files: the verb ``tarsus.plot``, and functions that draw into matplotlib axes and return
them.

``axes`` are those to draw into; without them a figure of its own is made. Numbers are drawn in SI, the words at ticks
alone stand under a prefix, so that more can be drawn over them. Nothing of matplotlib's settings is changed.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray
from matplotlib.axes import Axes

from tarsus.base.errors import InputError
from tarsus.base.events import IMPACTS
from tarsus.base.messages import nearest
from tarsus.base.verb import callable_package
from tarsus.files.kinds import folder_sentence
from tarsus.files.runstore import COLLECTED_FILE
from tarsus.files.series import dataset_of
from tarsus.files.store import SERIES_FILE
from tarsus.model.laws.userfile import laws_of
from tarsus.report.panel_grid import name_axes, named
from tarsus.report.saved import blank, figure_of, write_figure
from tarsus.report.style import CONTACT, CYCLE, INK, MOST_LINES
from tarsus.solve import Batch, Run, load_run
from tarsus.tables.numbers import spaced

if TYPE_CHECKING:
    from tarsus.design import Design, LandingDesign
    from tarsus.orbits import Branches, Orbit

Saved = str | os.PathLike[str] | Run | Batch

callable_package(__name__, f"{__name__}:plot")

__all__ = ["branch", "front", "impacts", "landing", "ledger", "measure", "motion", "multipliers", "series"]


def plot(
    saved: Saved,
    name: str | None = None,
    output: str | os.PathLike[str] | None = None,
    *,
    over: str | None = None,
    only: Sequence[str] | None = None,
    law: Sequence[str | os.PathLike[str]] = (),
) -> Axes:
    """Draw a series or a measure of a run, batch or sweep, saved or not.

    Parameters
    ----------
    saved
        A folder that `simulate` or `sweep` wrote, or a .nc file of a run, a batch or a sweep; in Python
        also a `Run` or `Batch`.
    name
        Of a run: motion, impacts, ledger, or a series such as gap; of a batch or sweep: a measure. The motion, or the
        first measure, when left out.
    output
        A file to write, ending in .png, .svg or .pdf.
    over
        Of a sweep: path of the number on the horizontal axis.
    only
        Of a series: feet, points or drives by name.
    law
        Python files with laws of your own, where the run has them.

    Returns
    -------
    matplotlib.axes.Axes
        Of a figure of its own.

    Raises
    ------
    InputError
        Where nothing of that name can be drawn.
    """
    run = saved if isinstance(saved, Run) else None
    if name in (None, *Run.figures) and not isinstance(saved, (Run, Batch)) and (Path(saved) / SERIES_FILE).is_file():
        run = load_run(saved, laws_of(law))
    if run is not None and over is not None:
        raise InputError("--over is for batches and sweeps: a run is drawn over time")
    if run is None or name not in (None, *Run.figures):
        with _data(saved) as data:
            axes = figure_of(data, name, over=over, only=only)
    elif name in (None, "motion"):
        axes = motion(run, only, axes=blank())
    elif only is not None and (name == "ledger" or len(only) > 1):
        raise InputError("--only names points of the motion, or one foot of the impacts")
    else:
        axes = ledger(run, axes=blank()) if name == "ledger" else impacts(run, *(only or ()), axes=blank())
    if output is not None:
        write_figure(axes, Path(output))
    return axes


def _data(saved: Saved) -> xarray.Dataset:
    """Series or measures of what was saved or not; `InputError` where it holds neither."""
    if isinstance(saved, Run):
        return dataset_of(saved.variables(), {"title": saved.scene.name})
    if isinstance(saved, Batch):
        return saved.to_dataset()
    folder = file = Path(saved)
    if folder.is_dir():
        file = next((folder / one for one in (SERIES_FILE, COLLECTED_FILE) if (folder / one).is_file()), folder)
    if file.is_dir():
        held = f"({SERIES_FILE} or {COLLECTED_FILE}){folder_sentence(folder, ())}"
        raise InputError(f"'{saved}' holds no run and no finished sweep {held}")
    if not file.is_file():
        raise InputError(f"there is no '{file}': name a folder that `simulate` or `sweep` wrote, or a .nc file")
    try:
        return xarray.open_dataset(file, engine="h5netcdf", phony_dims="access")  # dimensions of plain HDF5
    except (OSError, ValueError) as error:
        wanted = "name a folder that `simulate` or `sweep` wrote, or a .nc file"
        raise InputError(f"'{file}' is no NetCDF file of tarsus: {wanted}") from error


def motion(run: Run, points: Sequence[str] | None = None, *, axes: Axes | None = None) -> Axes:
    """Displacement of points over time, contact of the first foot shaded.

    points: their names; without any the feet, then the others, six at most. Raises InputError for unknown names.
    """
    data = _data(run)
    feet = list(dict.fromkeys(foot.point for foot in run.scene.robot.feet.values()))
    shown = [*feet, *(name for name in data["point"].values.tolist() if name not in feet)][:MOST_LINES]
    axes = figure_of(data, "displacement", only=shown if points is None else points, on=partial(_on, axes))
    if feet:
        touching = data["gap"].values[0] <= 0.0
        look = {"transform": axes.get_xaxis_transform(), "color": CONTACT, "lw": 0}
        axes.fill_between(data["time"].values, 0.0, 1.0, where=touching, **look)
    return axes


def series(run: Run, name: str, only: Sequence[str] | None = None, *, axes: Axes | None = None) -> Axes:
    """A series of a run over time by its name in `Run.to_dataset`, such as ``"gap"``.

    only: feet, points or drives by name, the first six unless given. Raises InputError for names that the run does not
    have.
    """
    return figure_of(_data(run), name, only=only, on=partial(_on, axes))


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
    """A measure of a batch over the first number that varies, or a map of a grid of two.

    Raises InputError for an unknown measure, and for a grid of more combinations than there are colours.
    """
    return figure_of(batch.to_dataset([name]).assign_attrs(title=batch.scene.name), name, on=partial(_on, axes))


def landing(design: LandingDesign, *, axes: Axes | None = None) -> Axes:
    """Gap of the foot over one period, with the plain step and with the design, from the landing edge on."""
    from tarsus.report.landing_page import DesignPair, draw_gaps

    axes = _on(axes)
    draw_gaps(axes, DesignPair(design), design.train.step.period)
    axes.set_title(repr(design)[1:-1])
    axes.legend(frameon=False)
    return axes


def front(design: Design, *, axes: Axes | None = None) -> Axes:
    """First objective of a front of gaits over the second one, on the own ground and under the risk.

    Raises InputError for a front of one objective.
    """
    from tarsus.report.gait_page import draw_front

    if len(design.objectives) < 2:
        raise InputError("a front of one objective is one gait: there is nothing to draw")
    axes = _on(axes)
    draw_front(axes, design)
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
