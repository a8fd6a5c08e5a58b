"""A comparison with the dissertation: rows of three kinds, shown as console text, page, JSON and CSV by one class.

A row is a number that the device was *calibrated on*, a number that is *predicted* (never fitted, or excluded from the
fit), or a *trend* that is printed in words. Numbers have the median and the 80 % interval of ours with what is
printed (`tarsus.calibrate.compared`); trends the verdict of `tarsus_reproduce.trends` for each device.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.files.jsontext import json_text
from tarsus.files.whole import write_text
from tarsus.tables.section import Section
from tarsus.tables.table import Table, Tabled
from tarsus_reproduce.packaged import PAGE_FILES

if TYPE_CHECKING:
    from tarsus.report.pages import PageFigure


Progress = Callable[[int, int, str], None]
"""Called as `progress(done, total, what)` by long work."""

CALIBRATED, PREDICTED = "calibrated on", "predicted"
"""Roles of a row: the device was fitted to it, or never saw it."""


class FigureCall:
    """A figure that is drawn when a page is written: the name of a function with its module, and its arguments.
    matplotlib is loaded by then and not before."""

    def __init__(self, function: str, *arguments: Any) -> None:
        self.function, self.arguments = function, arguments

    def __call__(self) -> PageFigure:
        """The figure."""
        module, _, name = self.function.rpartition(".")
        return getattr(import_module(module), name)(*self.arguments)


def drawn(part: Any) -> Any:
    """A part of a page, its figures drawn, those inside of it too."""
    if isinstance(part, Section):
        return type(part)(part.heading, *map(drawn, part.parts))
    if isinstance(part, list | tuple):
        return type(part)(map(drawn, part))
    return part() if isinstance(part, FigureCall) else part


@dataclass(frozen=True)
class Reproduction(Tabled):
    """What an experiment of the dissertation shows, with what Tarsus computes of it.

    name: of the experiment; title, about: what is compared, with which device; rows: the CSV file; problems: sentences
    of runs that did not reach their end; cautions: sentences about the device; footer: definitions, below the page.
    """

    name: str
    title: str
    about: str
    rows: Table
    sections: tuple[Section, ...]
    problems: tuple[str, ...] = ()
    cautions: tuple[str, ...] = ()
    footer: str = ""

    @property
    def ok(self) -> bool:
        """True when every run reached its end; a contradiction is a result and no failure."""
        return not self.problems

    def to_dict(self) -> dict[str, Any]:
        """Plain data, as `reproduction.json` holds it: every table by its title, with the rows of the CSV file in
        place of those that a page shows of them; numbers are SI."""
        shown = {part.title: part for part in (*self.table().parts, self.rows) if part.rows}
        said = {"about": self.about, "ok": self.ok, "problems": [*self.problems], "cautions": [*self.cautions]}
        return {"experiment": self.name, **said, **{title: _records(part) for title, part in shown.items()}}

    def table(self) -> Table:
        """All rows and summaries: one table, the parts of which are those of the sections."""
        parts = [part for section in self.sections for part in section.parts if isinstance(part, Table)]
        return Table(f"{self.title}: {self.about}", (), (), self.cautions, parts)

    def csv(self) -> str:
        """The rows as comma-separated values."""
        return self.rows.csv()

    def html(self) -> str:
        """The page, one self-contained HTML file: every section with its figures and tables."""
        from tarsus.report.pages import said, sections_page

        faults = [said(one, failed=True) for one in (*self.cautions, *self.problems)]
        about = [f"{self.about}.", *faults]
        return sections_page(self.title, about, drawn(self.sections), self.footer)

    def write(self, folder: str | Path) -> Path:
        """Write `PAGE_FILES` into a folder, which is returned. Raises InputError where they cannot be written."""
        texts = (self.csv(), json_text(self.to_dict()) + "\n", self.html())
        paths = [Path(folder) / name for name in PAGE_FILES]
        for path, text in zip(paths, texts, strict=True):
            write_text(path, text)
        return Path(folder)


def _records(table: Table) -> list[dict[str, Any]]:
    """Rows of a table by column."""
    plain = table.json()
    names = [one["name"] for one in plain["columns"]]
    return [dict(zip(names, row, strict=True)) for row in plain["rows"]]
