"""A run as one object of plain data."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.base.events import EVENT_WORDS
from tarsus.files.settled import settled

if TYPE_CHECKING:
    from tarsus.orbits.attractors import Attractors
    from tarsus.solve import Run


def run_data(run: Run, written: Sequence[Path] = (), others: Attractors | None = None) -> dict[str, Any]:
    """How a run ended, its measures [SI] and its energy account [J], and the files that were written of it; others:
    what other starts lead to, under `attractors`."""
    kinds = run.events["kind"].tolist()
    return {
        "scene": run.scene.name,
        "ok": run.ok,
        "code": run.code.name,
        "sentence": str(run.code.value),
        "settled": _settled(run),
        "remarks": list(run.remarks),
        "duration_s": run.duration,
        "wall_s": run.wall_s,
        "feet": list(run.foot_names),
        "events": {word: kinds.count(number) for number, word in EVENT_WORDS.items()},
        "measures": run.measures.to_dict(),
        "warnings": run.measures.warned,
        "ledger_J": {name: value for name, value in run.ledger.to_dict().items() if name != "closure"},
        "ledger_closure": run.ledger.closure,
        "files": [str(path) for path in written],
        **({} if others is None else {"attractors": others.to_dict()}),
    }


def _settled(run: Run) -> dict[str, int | str | None] | None:
    """Whether its contacts repeat at the end, as `Settled`; nothing without a periodic drive."""
    found = settled(run)
    return None if found is None else {**vars(found), "sentence": str(found)}
