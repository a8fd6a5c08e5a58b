"""A run as one object of plain data."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.base.events import EVENT_WORDS
from tarsus.files.ledger import ledger_table
from tarsus.files.settled import settled
from tarsus.files.store import measures_table

if TYPE_CHECKING:
    from tarsus.orbits.attractors import Attractors


def run_data(run: Any, written: Sequence[Path] = (), others: Attractors | None = None) -> dict[str, Any]:
    """How a run ended, its measures [SI] and its energy account [J], and the files that were written of it; others:
    what other starts lead to, under `attractors`."""
    kinds = run.events["kind"].tolist()
    return {
        "scene": run.scene.name,
        "ok": run.ok,
        "code": run.code.name,
        "sentence": str(run.code.value),
        "settled": _settled(run),
        "remarks": list(getattr(run, "remarks", ())),
        "duration_s": run.duration,
        "wall_s": run.wall_s,
        "feet": list(run.foot_names),
        "events": {word: kinds.count(number) for number, word in EVENT_WORDS.items()},
        "measures": measures_table(run),
        "warnings": [_warning(one) for one in getattr(run.measures, "warnings", ())],
        "ledger_J": {name: value for name, value in ledger_table(run).items() if name != "closure"},
        "ledger_closure": run.ledger.closure,
        "files": [str(path) for path in written],
        **({} if others is None else {"attractors": others.to_dict()}),
    }


def _settled(run: Any) -> dict[str, int | str | None] | None:
    """Whether its contacts repeat at the end, as `Settled`; nothing without a periodic drive."""
    found = settled(run)
    return None if found is None else {**vars(found), "sentence": str(found)}


def _warning(one: Any) -> dict[str, str | None]:
    """A warning on the measures; of a stored run it is a sentence alone."""
    kind = getattr(one, "kind", None)
    return {"kind": None if kind is None else kind.name, "sentence": str(one)}
