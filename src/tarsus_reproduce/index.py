"""Several experiments, with an index of their pages: what each compares, and what cannot be matched."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tarsus.files.whole import write_text
from tarsus.tables.table import Table, Tabled
from tarsus_reproduce.packaged import experiments
from tarsus_reproduce.reproduction import Reproduction


@dataclass(frozen=True)
class Reproductions(Tabled):
    """Several experiments, by name."""

    found: Mapping[str, Reproduction]

    @property
    def problems(self) -> tuple[str, ...]:
        """Sentences of runs that did not reach their end."""
        return tuple(f"{name}: {said}" for name, one in self.found.items() for said in one.problems)

    def to_dict(self) -> dict[str, Any]:
        """Plain data of each."""
        return {"experiments": {name: one.to_dict() for name, one in self.found.items()}}

    def table(self) -> Table:
        """What each is of."""
        return Table("", ("experiment", "of"), [(name, one.about) for name, one in self.found.items()])

    def write_index(self, folder: Path) -> None:
        """Write the index of the pages that are in folders of their names."""
        write_text(folder / "index.html", index_html({name: one.about for name, one in self.found.items()}))


def index_html(about: Mapping[str, str]) -> str:
    """The page over those of experiments, by name, with what each is about."""
    from tarsus.report.pages import Markup, Section, bullets, sections_page

    chosen = [one for name, one in experiments().items() if name in about]
    link = Markup('<a href="{}/reproduction.html">{}</a>')
    pages = Table("", ("page", "of"), [(link.format(one.name, one.title), about[one.name]) for one in chosen])
    words = (
        "“Foot Impact and Dynamic Analyses of Piezoelectrically-Actuated Walking Micro-Robots”, chapters 2 to 4, "
        "computed anew with Tarsus."
    )
    sections = [Section("What cannot be matched", *(Section(one.title, bullets(one.unmatched)) for one in chosen))]
    footer = Markup(
        "All of them: <code>tarsus reproduce --all</code>. E1 to E16 are entries of the errata in its documentation."
    )
    return sections_page("The dissertation, reproduced", [words, pages], sections, footer)
