"""How results are shown where they are printed, and what of them is pickled."""

from __future__ import annotations

import sys
from dataclasses import fields
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.tables.table import ROW, Column, Table

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.solve.results import Batch
    from tarsus.solve.run import Run


RUN_FIGURES = ("motion", "impacts", "ledger")
"""Figures of a run that are made of more than one of its series."""


def run_line(run: Run) -> str:
    """A run in a line; its energy account is not asked for."""
    code = run.__dict__.get("code", run.ended)
    return f"<Run '{run.scene.name}': {run.duration:g} s, {code.name}, {len(run.events)} events>"


def drawn(result: Run | Batch, how: str, *args: Any, **options: Any) -> Any:
    """A result drawn by `tarsus.plot`, which stands floors above and is found by its name when it is asked for."""
    return getattr(import_module("tarsus.report.plot"), how)(result, *args, **options)


def runs_of(batch: Batch) -> str:
    """How many runs a batch has, by axis of a grid, and how long each is."""
    return f"{' x '.join(map(str, batch.shape))} run{'' if len(batch) == 1 else 's'} of {batch.duration:g} s"


def batch_table(batch: Batch) -> Table:
    """A batch, and what varies in it."""
    from tarsus.base.spec import float_paths

    known = float_paths(batch.scene)
    rows = [(path, len(np.unique(v)), v.min(), v.max()) for path, v in batch.vary.items()]
    ended = ", ".join(f"{count} {code}" for code, count in batch.outcomes.items())
    columns = ("varied", "values", Column("least", ROW), Column("greatest", ROW))
    units = [known[path].unit for path in batch.vary]
    return Table(f"{batch.scene.name}: {runs_of(batch)}; {ended}", columns, rows, units=units)


def state_of(result: Any, scene: Scene) -> dict[str, Any]:
    """What is pickled of a run or batch: its fields, without what is found from them when asked.

    Raises InputError where the scene has a law whose class another process could not import.
    """
    lost = [
        f"ground.laws.{name}: the class {type(law).__name__} is in no module that another process can import, so that "
        "this cannot be pickled; put its file where Python finds modules, and import it"
        for name, law in scene.ground.laws.items()
        if not _importable(type(law))
    ]
    if lost:
        raise InputError(lost)
    return {one.name: result.__dict__[one.name] for one in fields(result)}


def _importable(kind: type) -> bool:
    """Whether another process finds a class by its name: not so one of a law file that was loaded by its path."""
    if "<locals>" in kind.__qualname__:
        return False
    # a script is run again by a process that it starts; what was typed is lost
    if kind.__module__ == "__main__":
        return hasattr(sys.modules["__main__"], "__file__")
    top = kind.__module__.partition(".")[0]
    return any(finder.find_spec(top, None) is not None for finder in sys.meta_path)
