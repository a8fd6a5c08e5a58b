"""`tarsus modes`: modes of measured files, compared with those of an earlier set."""

from __future__ import annotations

from pathlib import Path

from tarsus.cli import console
from tarsus.cli.asked import Asked


def modes(asked: Asked, *, against: Path | None = None) -> int:
    """The modes are written by -o.

    Parameters
    ----------
    against
        modes.json of an earlier set: its modes with these, and the MAC of their shapes.
    """
    from tarsus.base.errors import Fault, InputError
    from tarsus.files.jsontext import read_json
    from tarsus.modes.writing import compared, summary_of, write_modes
    from tarsus.report.modes_page import modes_html
    from tarsus.report.pages import write_page

    folder, names = asked.folder(), tuple(str(one) for one in asked.words["sources"])
    asked.check(folder)
    earlier = None if against is None else read_json(against)
    if earlier is not None and not {"points", "modes"} <= earlier.keys():
        raise InputError(f"--against: {against} is no modes.json of `tarsus modes`")
    try:
        with asked.calling() as function:
            fit = function()
    except InputError as error:
        cure = "give it with --read NAME=UNIT"
        raise InputError([one.cured(Fault.NO_UNIT, cure) for one in error.problems]) from None
    written: list[Path] = []
    with asked.writing(folder):
        if folder is not None:
            written = write_modes(fit, folder, names)
            if asked.flag("report"):
                written.append(write_page(modes_html(fit, names), folder / "report.html"))
    table = None if earlier is None else compared(fit, earlier)
    if asked.flag("json"):
        console.print_json(summary_of(fit, names) | ({} if table is None else {"compared": table.json()}))
        return 0
    console.table(fit.table(), *([] if table is None else [table]))
    console.wrote(written)
    return 0
