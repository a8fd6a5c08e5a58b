"""`tarsus open`: the page of a folder that a verb wrote, made again from what is stored."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tarsus.cli.options import Json, LawFiles

PAGES = ("report.html", "reproduction.html", "index.html")
"""The page of a folder, by the verbs that write one."""


def open(
    folder: Path,
    /,
    *,
    law: LawFiles = None,
    browser: bool = True,
    json: Json = False,
) -> int:
    """Open the page of a folder in the browser; that of a run or sweep is made again from its files, nothing simulated.

    Parameters
    ----------
    folder
        what `simulate`, `sweep`, `identify`, `calibrate`, `design`, `branch` or `reproduce` wrote.
    browser
        open the page; without it its path is printed only.
    """
    from tarsus.cli import console

    page, again = _page(folder, law or ())
    if json:
        console.print_json({"page": str(page), "made_again": again})
    else:
        print(page)
    if browser:
        import webbrowser

        if not webbrowser.open(page.resolve().as_uri()):
            console.complain([f"no browser could be started; open {page} yourself"])
    return 0


def _page(folder: Path, law_files: Sequence[Path]) -> tuple[Path, bool]:
    """The page, and whether it was made just now."""
    from tarsus.base.errors import InputError
    from tarsus.files.runstore import PLAN_FILE
    from tarsus.files.store import REPORT_FILE, SUMMARY_FILE, read_run

    if not folder.is_dir():
        raise InputError(f"{folder}: is no folder; name one that a verb wrote with -o")
    if (folder / SUMMARY_FILE).is_file():
        from tarsus.cli.console import spinner
        from tarsus.cli.requests import laws_of
        from tarsus.report import write_report

        with spinner("writing the report"):
            return write_report(read_run(folder, laws_of(law_files)), folder / REPORT_FILE), True
    if (folder / PLAN_FILE).is_file() and not (folder / REPORT_FILE).is_file():
        return _sweep_page(folder), True
    for name in PAGES:
        if (folder / name).is_file():
            return folder / name, False
    raise InputError(f"{folder}: holds no run and no page of tarsus ({', '.join(PAGES)})")


def _sweep_page(folder: Path) -> Path:
    """The page of a sweep whose array collected it without one; how to go on where it is not collected."""
    from tarsus.base.errors import InputError
    from tarsus.cli.console import spinner
    from tarsus.cluster.status import status_of
    from tarsus.files.runstore import COLLECTED_FILE
    from tarsus.files.store import REPORT_FILE
    from tarsus.report.sweep_page import write_sweep_report
    from tarsus.study.studyfile import frozen_sweep

    file = folder / COLLECTED_FILE
    if not file.is_file():
        try:
            found = status_of(folder)
        except ValueError as error:
            raise InputError(str(error)) from None
        raise InputError(
            f"{folder}: holds a sweep with {found.units_done} of {found.units} units done and no page yet: "
            f"`tarsus sweep {folder}` makes what is missing, collects it and writes the page"
        )
    with spinner("writing the report"):
        return write_sweep_report(frozen_sweep(folder), file, folder / REPORT_FILE)
