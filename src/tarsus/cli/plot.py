"""`tarsus plot`: a figure of what a verb wrote."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.cli.options import Folder, Json, LawFiles, Many, Overwrite

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RUN_FIGURES = ("motion", "impacts", "ledger")
"""Figures of a run that are made of more than one of its series."""


def plot(
    saved: Path,
    name: str | None = None,
    /,
    *,
    output: Folder,
    over: str | None = None,
    only: Many = None,
    law: LawFiles = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> int:
    """Draw a series or a measure of a saved run, batch or sweep as PNG, SVG or PDF.

    Parameters
    ----------
    saved
        a folder that `simulate` or `sweep` wrote, or a .nc file of a run, a batch or a sweep.
    name
        of a run: motion, impacts, ledger, or a series such as gap; of a batch or sweep: a measure. The motion, or the
        first measure, when left out.
    output
        the file, ending in .png, .svg or .pdf.
    over
        of a sweep: path of the number on the horizontal axis.
    only
        of a series: a foot, point or drive by name; may be repeated.
    """
    from tarsus.cli import console, options
    from tarsus.report.saved import FORMATS, write_figure

    options.check_new_file(output, FORMATS, overwrite)
    with console.spinner("drawing"):
        drawn, axes = _axes(saved, name, over, only, law)
        file = write_figure(axes, output)
    if json:
        console.print_json({"file": str(file), "name": drawn})
    else:
        console.wrote([file])
    return 0


def _axes(
    saved: Path, name: str | None, over: str | None, only: list[str] | None, law: list[Path] | None
) -> tuple[str, Axes]:
    """What was drawn, and the axes."""
    from tarsus.base.errors import InputError
    from tarsus.base.messages import nearest
    from tarsus.files.runstore import COLLECTED_FILE
    from tarsus.files.store import SERIES_FILE
    from tarsus.report.saved import figure_of, offered

    if saved.is_dir() and (saved / SERIES_FILE).is_file():
        if name is None or name in RUN_FIGURES:
            return name or RUN_FIGURES[0], _of_run(saved, name or RUN_FIGURES[0], over, only, law)
        file = saved / SERIES_FILE
    elif saved.is_dir():
        file = saved / COLLECTED_FILE
        if not file.is_file():
            raise InputError(
                f"'{saved}' holds no run and no finished sweep ({SERIES_FILE} or {COLLECTED_FILE})"
            )
    else:
        file = saved
    with _opened(file) as data:
        known = offered(data)
        if not known:
            raise InputError(f"'{file}' holds neither series nor measures")
        if name is not None and name not in known:
            figures = RUN_FIGURES if file.name == SERIES_FILE and saved.is_dir() else ()
            raise InputError(f"'{saved}' has no '{name}'{nearest(name, [*figures, *known])}")
        chosen = name or known[0]
        return chosen, figure_of(data, chosen, over=over, only=only)


def _of_run(
    folder: Path, name: str, over: str | None, only: list[str] | None, law: list[Path] | None
) -> Axes:
    from tarsus.base.errors import InputError
    from tarsus.cli.requests import laws_of
    from tarsus.files.store import read_run
    from tarsus.report import plot as figures
    from tarsus.report.saved import blank

    if over is not None:
        raise InputError("--over is for batches and sweeps: a run is drawn over time")
    run: Any = read_run(folder, laws_of(law or ()))
    if name == "motion":
        return figures.motion(run, only, axes=blank())
    if only is not None and (name == "ledger" or len(only) > 1):
        raise InputError("--only names points of the motion, or one foot of the impacts")
    if name == "ledger":
        return figures.ledger(run, axes=blank())
    return figures.impacts(run, only[0] if only else None, axes=blank())


def _opened(file: Path) -> Any:
    """A NetCDF file; `InputError` where it is none."""
    import xarray

    from tarsus.base.errors import InputError

    if not file.is_file():
        raise InputError(
            f"there is no '{file}': name a folder that `simulate` or `sweep` wrote, or a .nc file"
        )
    try:
        return xarray.open_dataset(file, engine="h5netcdf", phony_dims="access")  # dimensions of plain HDF5
    except (OSError, ValueError) as error:
        raise InputError(f"'{file}' is no NetCDF file of tarsus: {str(error).splitlines()[0]}") from error
