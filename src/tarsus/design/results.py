"""What the results of designs share: four ways to show them, and files."""

from __future__ import annotations

import csv
import io
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from tarsus.base.spec import float_paths
from tarsus.files.whole import write_text
from tarsus.model.scene import Scene
from tarsus.orbits.starts import UNITS
from tarsus.tables.table import Table


class DesignResult(ABC):
    """What a verb of `tarsus.design` gives back."""

    @abstractmethod
    def table(self) -> Table:
        """The result as people read it."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI units, NaN where there is none: what ``--json`` prints."""

    @abstractmethod
    def texts(self) -> dict[str, str]:
        """Texts of all files but the report, by name."""

    def write(self, folder: str | Path) -> Path:
        """Write all files but the report into a folder, which is made where it does not exist; returns the folder.

        Raises InputError where it cannot be written.
        """
        target = Path(folder)
        for name, text in self.texts().items():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            write_text(target / name, text)
        return target

    def __repr__(self) -> str:
        return f"<{self.table().title}>"

    def __str__(self) -> str:
        return str(self.table())

    def _repr_html_(self) -> str:
        return self.table().html()


def csv_text(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Rows below a line of names, numbers with nine digits: more than any run is accurate to."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([one if isinstance(one, (str, int)) else f"{one:.9g}" for one in row] for row in rows)
    return out.getvalue()


def units_of(scene: Scene, paths: Iterable[str]) -> dict[str, str]:
    """Unit of every number by path; of a height and a speed of starts too."""
    known = float_paths(scene)
    return {path: known[path].unit if path in known else UNITS.get(path, "1") for path in paths}
