"""Figures of what is on disk: series of a run, measures of a batch or a sweep."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.files.whole import written_whole
from tarsus.report.panel_grid import name_axes, whole_ticks
from tarsus.report.style import CYCLE, MOST_LINES, level_limits, scale_of
from tarsus.tables.numbers import amount, spaced

FORMATS = (".png", ".svg", ".pdf")
"""Endings of files that a figure is written as."""

DPI = 150
"""Of a PNG: lines of 1 pt are two pixels wide, and the figure is as wide as a page's column on a screen."""

DECADES = 50.0
"""Largest over smallest value from which an axis is logarithmic: a linear one would give the lower half of the decades
a seventh of its length."""

_NOT_MEASURES = ("code", "_spread", "_per_foot")
"""Names of a sweep, or their endings, that are no measures."""


def offered(data: xarray.Dataset) -> list[str]:
    """Names in a file of series or measures that a figure can be made of."""
    return [str(name) for name in data.data_vars if not str(name).endswith(_NOT_MEASURES)]


def blank() -> Axes:
    """Axes of a figure of its own, which no window shows."""
    return Figure(figsize=(7.0, 3.4), layout="constrained").subplots()


def figure_of(
    data: xarray.Dataset,
    name: str | None = None,
    *,
    over: str | None = None,
    only: Sequence[str] | None = None,
    on: Callable[[], Axes] = blank,
) -> Axes:
    """A series over time, or a measure over one number that varies, as a map over two where they are a grid.

    data: as Tarsus writes them; name: one of `offered`, the first unless given; over: path of the number on the
    horizontal axis, the first that varies unless given (of a grid of more numbers each line is one combination of the
    others); only: of series feet, points or drives by name, the first six unless given; on: makes the axes. Raises
    InputError for names that there are not, and for a grid of more combinations than there are colours.
    """
    known = offered(data)
    if not known:
        raise InputError("the file holds neither series nor measures")
    name = name or known[0]
    if name not in known:
        raise InputError(f"there is no '{name}' to draw{nearest(name, known)}")
    one = data[name]
    if "time" in one.dims:
        if over is not None:
            raise InputError(f"'{name}' is a series over time: over is for measures of a batch or a sweep")
        names = _names(one, only)
        axes = on()
        _series(axes, one, names)
        axes.set_title(str(data.attrs.get("title", "")))
        return axes
    if only is not None:
        raise InputError(f"'{name}' is a measure: only is for series of a run")
    paths = [str(path) for path in one.coords if one[path].dims]
    if not paths:
        raise InputError(f"'{name}' is one number: there is nothing to draw it over")
    if over is not None and over not in paths:
        raise InputError(f"nothing varies at '{over}'{nearest(over, paths)}")
    axes = on()
    draw_measure(axes, one, over)
    axes.set_title(str(data.attrs.get("title", "")))
    return axes


def draw_measure(axes: Axes, one: xarray.DataArray, over: str | None = None) -> None:
    """A measure over a number that varies, the first one unless another is named; of a grid of two a map of both.

    Raises InputError for a grid of more combinations than there are colours.
    """
    paths = [str(path) for path in one.coords if one[path].dims]
    if set(one.dims) <= set(paths) and len(one.dims) == 2 and over is None:
        _map(axes, one)
    else:
        _lines(axes, one, over or paths[0])


def write_figure(axes: Axes, file: str | Path) -> Path:
    """Write the figure of some axes as PNG, SVG or PDF, by the file's ending.

    Raises
    ------
    InputError
        For another ending, and for a place that cannot be written.
    """
    path = Path(file)
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"'{file}': a figure is a file that ends in {', '.join(FORMATS)}")
    figure = axes.get_figure(root=True)
    assert figure is not None
    with written_whole(path) as part:
        figure.savefig(part, dpi=DPI)
    return path


def _names(one: xarray.DataArray, only: Sequence[str] | None) -> list[str]:
    """Which feet, points or drives of a series are drawn; none of a series of the whole."""
    rest = [dim for dim in one.dims if dim != "time"]
    if not rest and only is not None:
        raise InputError(f"'{one.name}' is of the whole: it has no names to choose from")
    names = [str(label) for label in one[rest[0]].values] if rest else []
    if unknown := [label for label in only or () if label not in names]:
        raise InputError(f"'{one.name}' has no '{label}'{nearest(label, names)}" for label in unknown)
    return names[:MOST_LINES] if only is None else list(dict.fromkeys(only))


def _series(axes: Axes, one: xarray.DataArray, names: Sequence[str]) -> None:
    """A series over time: a line for each name, or one."""
    time = one["time"].values
    for number, label in enumerate(names):
        row = one.sel({str(next(dim for dim in one.dims if dim != "time")): label}).values
        style = ("-", "--", ":", "-.")[number // len(CYCLE) % 4]
        axes.plot(time, row, lw=1.1, ls=style, color=CYCLE[number % len(CYCLE)], label=label)
    if names:
        axes.legend(frameon=False)
    else:
        axes.plot(time, one.values, lw=1.1, color=CYCLE[0])
    name_axes(axes, ("time", "s"), (spaced(str(one.name)), _unit(one)))


def _lines(axes: Axes, one: xarray.DataArray, over: str) -> None:
    """Points over a number that varies; a line for each combination of the other numbers of a grid."""
    along = one[over].values
    order = np.argsort(along)
    if one.dims == one[over].dims and over not in one.dims:  # scattered: every run has a value of each
        alone = len([path for path in one.coords if one[path].dims]) == 1
        axes.plot(along[order], one.values[order], ".-" if alone else ".", lw=0.9, color=CYCLE[0])
    else:
        others = [str(dim) for dim in one.dims if dim != over]
        stacked = one.transpose(*others, over).values.reshape(-1, len(along))
        if len(stacked) > len(CYCLE):
            raise InputError(
                f"the grid has {len(stacked)} combinations of {', '.join(others)}, and {len(CYCLE)} lines can be "
                "distinguished"
            )
        values = np.meshgrid(*(one[other].values for other in others), indexing="ij") if others else []
        for number, row in enumerate(stacked):
            label = ", ".join(
                f"{other.rsplit('.', 1)[-1]} {amount(grid.ravel()[number], _unit(one[other]))}"
                for other, grid in zip(others, values, strict=True)
            )
            axes.plot(along[order], row[order], ".-", lw=0.9, color=CYCLE[number], label=label or None)
        if others:
            axes.legend(frameon=False)
    axes.set_xscale(_spread(along))
    name_axes(axes, (over, _unit(one[over])), (spaced(str(one.name)), _unit(one)))
    if limits := level_limits(one.values):
        axes.set_ylim(*limits)
    whole_ticks(axes.yaxis, one.values)


def _map(axes: Axes, one: xarray.DataArray) -> None:
    rows, columns = (str(dim) for dim in one.dims)
    size, scales = scale_of(_unit(one), one.values), (_spread(one[columns].values), _spread(one[rows].values))
    look = {"xscale": scales[0], "yscale": scales[1], "cbar_kwargs": {"label": size.axis(spaced(str(one.name)))}}
    drawn = (one.sortby([rows, columns]) / size.step).plot.pcolormesh(ax=axes, x=columns, y=rows, **look)
    whole_ticks(drawn.colorbar.ax.yaxis, one.values)
    name_axes(axes, (columns, _unit(one[columns])), (rows, _unit(one[rows])))


def _spread(values: np.ndarray) -> str:
    """A logarithmic axis for values that were spread over decades."""
    low, high = float(np.min(values)), float(np.max(values))
    return "log" if low > 0.0 and high >= DECADES * low else "linear"


def _unit(one: xarray.DataArray) -> str:
    return str(one.attrs.get("units", "1"))
