"""The verb `tarsus.plot`: a figure of what a verb wrote. Figures themselves are drawn by `plot` and `saved`."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import xarray
from matplotlib.axes import Axes

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.files.runstore import COLLECTED_FILE
from tarsus.files.store import SERIES_FILE
from tarsus.model.laws.userfile import laws_of
from tarsus.report import plot as figures
from tarsus.report.saved import blank, figure_of, offered, write_figure
from tarsus.solve import Batch, Run, load_run

Saved = str | os.PathLike[str] | Run | Batch


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
        A folder that `simulate` or `sweep` wrote, or a .nc file of a run, a batch or a sweep; or a `Run` or `Batch`.
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
    if isinstance(saved, (Run, Batch)):
        axes = _of_result(saved, name, over, only)
    else:
        _, axes = drawn(Path(saved), name, over, only, laws_of(law))
    if output is not None:
        write_figure(axes, Path(output))
    return axes


def _of_result(result: Run | Batch, name: str | None, over: str | None, only: Sequence[str] | None) -> Axes:
    """The figure of a run or batch in memory."""
    if isinstance(result, Batch):
        return figure_of(result.to_dataset(), name or next(iter(result.measured())), over=over, only=only)
    if over is not None:
        raise InputError("over is for batches and sweeps: a run is drawn over time")
    if name is not None and name not in Run.figures:
        return figures.series(result, name, only, axes=blank())
    return _figure(result, name or Run.figures[0], only)


def drawn(
    saved: Path, name: str | None, over: str | None, only: Sequence[str] | None, laws: Mapping[str, Any]
) -> tuple[str, Axes]:
    """What was drawn, and the axes."""
    whole_run = saved.is_dir() and (saved / SERIES_FILE).is_file()
    if whole_run and (name is None or name in Run.figures):
        return name or Run.figures[0], _of_run(saved, name or Run.figures[0], over, only, laws)
    file = saved / (SERIES_FILE if whole_run else COLLECTED_FILE) if saved.is_dir() else saved
    if saved.is_dir() and not file.is_file():
        raise InputError(f"'{saved}' holds no run and no finished sweep ({SERIES_FILE} or {COLLECTED_FILE})")
    with _opened(file) as data:
        known = offered(data)
        if not known:
            raise InputError(f"'{file}' holds neither series nor measures")
        if name is not None and name not in known:
            raise InputError(f"'{saved}' has no '{name}'{nearest(name, [*Run.figures * whole_run, *known])}")
        return name or known[0], figure_of(data, name or known[0], over=over, only=only)


def _of_run(folder: Path, name: str, over: str | None, only: Sequence[str] | None, laws: Mapping[str, Any]) -> Axes:
    if over is not None:
        raise InputError("--over is for batches and sweeps: a run is drawn over time")
    return _figure(load_run(folder, laws), name, only)


def _figure(run: Run, name: str, only: Sequence[str] | None) -> Axes:
    if name == "motion":
        return figures.motion(run, only, axes=blank())
    if only is not None and (name == "ledger" or len(only) > 1):
        raise InputError("--only names points of the motion, or one foot of the impacts")
    if name == "ledger":
        return figures.ledger(run, axes=blank())
    return figures.impacts(run, only[0] if only else None, axes=blank())


def _opened(file: Path) -> xarray.Dataset:
    """A NetCDF file; `InputError` where it is none."""
    if not file.is_file():
        raise InputError(f"there is no '{file}': name a folder that `simulate` or `sweep` wrote, or a .nc file")
    try:
        return xarray.open_dataset(file, engine="h5netcdf", phony_dims="access")  # dimensions of plain HDF5
    except (OSError, ValueError) as error:
        raise InputError(f"'{file}' is no NetCDF file of tarsus: {str(error).splitlines()[0]}") from error
