"""`tarsus plot`: a figure of what a verb wrote."""

from __future__ import annotations

from pathlib import Path

from tarsus.cli.front import worded
from tarsus.cli.options import Folder, Json, LawFiles, Many, Overwrite


@worded
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
    from tarsus.cli import console, options
    from tarsus.model.laws.userfile import laws_of
    from tarsus.report.plotted import drawn
    from tarsus.report.saved import FORMATS, write_figure

    options.check_new_file(output, FORMATS, overwrite)
    with console.spinner("drawing"):
        chosen, axes = drawn(saved, name, over, only, laws_of(law or ()))
        file = write_figure(axes, output)
    return console.files([file], {"file": str(file), "name": chosen} if json else None)
