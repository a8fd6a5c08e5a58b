"""The verb `tarsus.report`: the page of a folder that a verb wrote, made again from what is stored."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.cluster.status import status_of
from tarsus.files.runstore import COLLECTED_FILE, PLAN_FILE
from tarsus.files.store import REPORT_FILE, SUMMARY_FILE
from tarsus.model.laws.userfile import laws_of

PAGES = ("report.html", "reproduction.html", "index.html")
"""The page of a folder, by the verbs that write one."""


def report(
    folder: str | os.PathLike[str],
    *,
    law: Sequence[str | os.PathLike[str]] = (),
    draw: Sequence[str | os.PathLike[str]] = (),
    branch: int | None = None,
) -> Path:
    """Find the page of a folder; that of a run or sweep is made again from its files, nothing simulated.

    Parameters
    ----------
    folder
        A folder that a verb wrote with `-o`.
    law
        Python files with laws of your own, where the run has them.
    draw
        Over the map of an atlas: a packaged study or study file, the lines along which it ran; a .csv with two columns
        of numbers, a curve.
    branch
        Over the map of an atlas: what happens to the periodic motion along so many lines of it.

    Returns
    -------
    Path
        The page, one file that works offline.

    Raises
    ------
    InputError
        Where the folder holds no page and nothing to make one of; for overlays of what is no atlas.
    """
    folder, laws = Path(folder), laws_of(law)
    if not folder.is_dir():
        raise InputError(f"{folder}: is no folder; name one that a verb wrote with -o")
    if draw or branch is not None:
        return _map_page(folder, laws, draw, branch)
    if (folder / SUMMARY_FILE).is_file():
        from tarsus.report.run_page import write_report
        from tarsus.solve import load_run

        return write_report(load_run(folder, laws), folder / REPORT_FILE)
    if (folder / PLAN_FILE).is_file() and not (folder / REPORT_FILE).is_file():
        return _sweep_page(folder)
    for name in PAGES:
        if (folder / name).is_file():
            return folder / name
    raise InputError(f"{folder}: holds no run and no page of tarsus ({', '.join(PAGES)})")


def _map_page(
    folder: Path, laws: Mapping[str, Any], draw: Sequence[str | os.PathLike[str]], branch: int | None
) -> Path:
    """The page of an atlas with something drawn over it; its runs are those that the folder holds."""
    from tarsus.atlas.verb import REQUEST, read_atlas
    from tarsus.report.atlas_page import atlas_html
    from tarsus.report.pages import write_page

    if not (folder / REQUEST).is_file():
        raise InputError(f"{folder}: holds no atlas; draw and branch draw over its map")
    return write_page(atlas_html(read_atlas(folder, laws).overlaid(*draw, branch=branch)), folder / REPORT_FILE)


def _sweep_page(folder: Path) -> Path:
    """The page of a sweep whose array collected it without one; how to go on where it is not collected."""
    from tarsus.report.pages import write_page
    from tarsus.report.sweep_page import sweep_html
    from tarsus.study.studyfile import frozen_sweep

    file = folder / COLLECTED_FILE
    if not file.is_file():
        try:
            found = status_of(folder)
        except ValueError as error:
            raise InputError(str(error)) from None
        raise InputError(
            f"{folder}: holds a sweep with {found.units_done} of {found.units} units done and no page yet: "
            f"`tarsus sweep {shlex.quote(str(folder))}` makes what is missing, collects it and writes the page"
        )
    return write_page(sweep_html(frozen_sweep(folder), file), folder / REPORT_FILE)


def write_sweep_page(_: object, folder: Path) -> list[Path]:
    """The page of a collected sweep, from its files."""
    return [_sweep_page(folder)]
