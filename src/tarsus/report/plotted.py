"""The verb `tarsus.plot`: a figure of what a verb wrote. Figures themselves are drawn by `plot` and `saved`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import xarray
from matplotlib.axes import Axes

from tarsus.base.errors import InputError
from tarsus.files.runstore import COLLECTED_FILE
from tarsus.files.series import dataset_of
from tarsus.files.store import SERIES_FILE
from tarsus.model.laws.userfile import laws_of
from tarsus.report import plot as figures
from tarsus.report.saved import blank, figure_of, write_figure
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
    run = saved if isinstance(saved, Run) else None
    if name in (None, *Run.figures) and not isinstance(saved, (Run, Batch)) and (Path(saved) / SERIES_FILE).is_file():
        run = load_run(saved, laws_of(law))
    if run is not None and over is not None:
        raise InputError("--over is for batches and sweeps: a run is drawn over time")
    if run is not None and name in (None, *Run.figures):
        axes = _figure(run, name or Run.figures[0], only)
    else:
        with _data(saved) as data:
            axes = figure_of(data, name, over=over, only=only)
    if output is not None:
        write_figure(axes, Path(output))
    return axes


def _figure(run: Run, name: str, only: Sequence[str] | None) -> Axes:
    if name == "motion":
        return figures.motion(run, only, axes=blank())
    if only is not None and (name == "ledger" or len(only) > 1):
        raise InputError("--only names points of the motion, or one foot of the impacts")
    if name == "ledger":
        return figures.ledger(run, axes=blank())
    return figures.impacts(run, only[0] if only else None, axes=blank())


def _data(saved: Saved) -> xarray.Dataset:
    """Series or measures of what was saved or not; `InputError` where it holds neither."""
    if isinstance(saved, (Run, Batch)):
        return dataset_of(saved.variables(), {}) if isinstance(saved, Run) else saved.to_dataset()
    folder = file = Path(saved)
    if folder.is_dir():
        file = next((folder / one for one in (SERIES_FILE, COLLECTED_FILE) if (folder / one).is_file()), folder)
    if file.is_dir():
        raise InputError(f"'{saved}' holds no run and no finished sweep ({SERIES_FILE} or {COLLECTED_FILE})")
    if not file.is_file():
        raise InputError(f"there is no '{file}': name a folder that `simulate` or `sweep` wrote, or a .nc file")
    try:
        return xarray.open_dataset(file, engine="h5netcdf", phony_dims="access")  # dimensions of plain HDF5
    except (OSError, ValueError) as error:
        raise InputError(f"'{file}' is no NetCDF file of tarsus: {str(error).splitlines()[0]}") from error
