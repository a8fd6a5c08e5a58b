"""A run in a few lines, or as one JSON object."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROUNDING = 1e-9
"""A spread smaller than this part of its value, as of a periodic motion, is shown as 0."""


def run_object(run: Any, written: Sequence[Path]) -> dict[str, Any]:
    """What `simulate --json` prints: plain data, SI units."""
    from tarsus.base.events import EVENT_WORDS
    from tarsus.files.ledger import ledger_table
    from tarsus.files.store import measures_table, warnings_table

    kinds = run.events["kind"].tolist()
    return {
        "scene": run.scene.name,
        "ok": run.ok,
        "code": run.code.name,
        "sentence": str(run.code.value),
        "remarks": list(run.remarks),
        "duration_s": run.duration,
        "wall_s": run.wall_s,
        "feet": list(run.foot_names),
        "events": {word: kinds.count(number) for number, word in EVENT_WORDS.items()},
        "measures": measures_table(run),
        "warnings": warnings_table(run),
        "ledger_J": {name: value for name, value in ledger_table(run).items() if name != "closure"},
        "ledger_closure": run.ledger.closure,
        "files": [str(path) for path in written],
    }


def print_run(run: Any, written: Sequence[Path]) -> None:
    """The summary `simulate` prints: how it ended, the measures, the energy account, the files."""
    from tarsus.cli import console
    from tarsus.files.ledger import ledger_lines
    from tarsus.files.summary import about

    print(f"{run.scene.name}: {run.duration:g} s simulated in {run.wall_s:.2g} s, {len(run.events)} events")
    print(str(run.code.value))
    for remark in run.remarks:
        print(remark)
    print()
    rows = []
    for name, measure in run.measures.items():
        rows.append(
            (
                name.replace("_", " "),
                about(measure),
                short(measure.value, measure.unit),
                short(
                    0.0 if measure.spread <= ROUNDING * abs(measure.value) else measure.spread, measure.unit
                ),
                str(measure.n),
            )
        )
    if rows:
        console.table(("measure", "of", "value", "spread", "n"), rows, numbers_from=2)
        print()
    for warning in getattr(run.measures, "warnings", ()):
        print(f"Note: {warning}")
    if getattr(run.measures, "warnings", ()):
        print()
    shown = [f"{label} {short(value, 'J')}" for label, value in ledger_lines(run) if value]
    print(f"energy: {', '.join(shown) if shown else 'nothing moved'}; closes to {run.ledger.closure:.1e}")
    console.wrote(written)


_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M"}
_PREFIXED = ("m", "m/s", "s", "N", "J", "V", "W", "Hz")


def short(value: float, unit: str) -> str:
    """A value for reading, four digits: `264.1 µm`; `-` where there is none."""
    if value is None or value != value:
        return "-"
    if unit == "1":
        return f"{value:.4g}"
    if unit not in _PREFIXED or value == 0.0:
        return f"{value:.4g} {unit}"
    exponent = 0
    magnitude = abs(value)
    for candidate in sorted(_PREFIXES, reverse=True):
        exponent = candidate
        if magnitude >= 0.9999999 * 10.0**candidate:
            break
    return f"{value / 10.0**exponent:.4g} {_PREFIXES[exponent]}{unit}"
