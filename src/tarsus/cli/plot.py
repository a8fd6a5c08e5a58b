"""`tarsus plot`: a figure of what a verb wrote."""

from __future__ import annotations

from pathlib import Path

from tarsus.cli.options import Folder, Json, LawFiles, Many, Overwrite


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
    from tarsus.model.laws.userfile import laws_of
    from tarsus.report.plotted import drawn
    from tarsus.report.saved import FORMATS, write_figure

    options.check_new_file(output, FORMATS, overwrite)
    with console.spinner("drawing"):
        chosen, axes = drawn(saved, name, over, only, laws_of(law or ()))
        file = write_figure(axes, output)
    return console.files([file], {"file": str(file), "name": chosen} if json else None)
