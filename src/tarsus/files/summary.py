"""A run as tables: its measures and its energy account. Made of a run that was simulated and of one that was read."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from tarsus.files.ledger import LEDGER_WORDS, ledger_lines
from tarsus.files.settled import settled
from tarsus.tables.numbers import amount, number, spaced
from tarsus.tables.table import ROW, Column, Table

MOST_FEET_LISTED = 8
"""Feet of which each measure is listed; of more, the least and the largest: else the table is longer than a screen."""

UNSEEN, ATOM = 5e-5, 1e-12
"""A spread below this part of its value is none: half a unit of the last of the value's four digits. So is one of a
length below 1 pm [m], a hundredth of an atom."""

SHARE = 1e-5
"""Shares of the energy account are shown to this much, 0.001 %: what is less, no reader weighs."""

ALIKE = (
    ("contact_duration", "longest_contact", "contact duration adds up a period's contacts, longest contact is one."),
    ("bounces", "rebounds", "bounces are flights after short contacts, rebounds those that begin by restitution."),
)
"""Pairs of measures whose names sound alike, and what distinguishes them: said where the first is above
the second by more than the digits that are shown."""

LEAST = 1e-12
"""An entry of the account below this part of the largest is rounding: accounts close to about 1e-14."""


def run_summary(run: Any, *, ledger: bool = True) -> Table:
    """A run and its measures; with `ledger` its energy account, for which one of a batch is run again."""
    code = run.code if ledger else run.__dict__.get("code", run.ended)
    title = f"{run.scene.name}: {run.duration:g} s simulated, {len(run.events)} events. {code.value}"
    parts = [account(run)] if ledger else []
    motion = settled(run)
    notes = (*([] if motion is None else [str(motion)]), *run.remarks)
    return measures_summary(run.measures, title, notes, parts)


def measures_summary(
    measures: Any, title: str = "Measures", notes: Sequence[str] = (), parts: Sequence[Table] = ()
) -> Table:
    """All of `tarsus.measure.Measures` with the spread over their n values; of few feet each, of many the ends.
    Warnings are notes."""
    wide = any(_ends(one.per_foot) for one in measures.values())
    columns = ["measure", Column("value", ROW), Column("spread", ROW, 2), "n"]
    columns += ["least foot", "largest foot"] if wide else []
    rows: list[tuple[Any, ...]] = []
    units: list[str] = []
    for name, one in measures.items():
        ends = [f"{amount(value, one.unit)} {foot}" for foot, value in _ends(one.per_foot)] or ["", ""]
        rows.append((spaced(name), one.value, deviation(one), one.n, *(ends if wide else ()), about(one)))
        listed = one.per_foot if 2 <= len(one.per_foot) <= MOST_FEET_LISTED else {}
        blank = ("", "") if wide else ()
        rows += [(f"   foot {foot}", value, None, None, *blank, "") for foot, value in listed.items()]
        units += [one.unit] * (1 + len(listed))
    alike = (
        said
        for first, second, said in ALIKE
        if first in measures and second in measures and measures[first].value > (1.0 + UNSEEN) * measures[second].value
    )
    notes = (*notes, *(f"Note: {one}" for one in (*alike, *measures.warnings)))
    return Table(title, (*columns, "counted over"), rows, notes, parts, units=units)


def deviation(measure: Any) -> float:
    """The spread of a measure; 0 where it is less than the digits of its value show."""
    least = max(UNSEEN * abs(measure.value), ATOM if measure.unit == "m" else 0.0)
    return 0.0 if measure.spread <= least else float(measure.spread)


def about(measure: Any) -> str:
    """Whose number a measure is, and what it counts: "worst foot, flights above 100 nm"."""
    parts = [str(measure.scope)]
    parts += [] if measure.height is None else [f"flights above {amount(measure.height, 'm')}"]
    parts += [] if measure.dwell is None else [f"after contacts below {amount(measure.dwell, 's')}"]
    return ", ".join(filter(None, parts))


def _ends(values: Mapping[str, float]) -> list[tuple[str, float]]:
    """Of many feet, those of the least and of the largest value; of few, which are listed, none."""
    known = {foot: value for foot, value in values.items() if math.isfinite(value)}
    if len(values) <= MOST_FEET_LISTED or not known or min(known.values()) == max(known.values()):
        return []
    ends = (min(known, key=known.__getitem__), max(known, key=known.__getitem__))
    return [(foot, known[foot]) for foot in ends]


def account(run: Any) -> Table:
    """The energy account in words: every term [J], its share of the largest, and what is left over."""
    lines = [one for one in ledger_lines(run) if one[1] != 0.0 or one[0] != LEDGER_WORDS["friction"]]
    largest = max(abs(value) for _, value in lines) or 1.0
    rows = [(label, value if abs(value) > LEAST * largest else 0.0) for label, value in lines]
    rows.append(("residual (closes the ledger)", float(f"{float(run.ledger.residual):.2g}")))
    notes = [f"Work in, changes and losses agree to {number(run.ledger.closure, 2)} of the largest term."]
    taken = run.electrical_energy
    if taken and math.isfinite(taken):
        notes.append(f"Over the whole run the electrodes took {amount(taken, 'J')}, the integral of V dq.")
        bare = [name for name, drive in run.scene.robot.drives.items() if drive.capacitance is None]
        if bare:
            others = f" and {len(bare) - 1} more have" if len(bare) > 1 else " has"
            notes.append(
                f"That is by the motion alone: drive {bare[0]}{others} no capacitance, which the measure electrical "
                "energy, C dV^2 a rise, needs."
            )
    return Table(
        "Energy",
        ("term", Column("energy", "J"), Column("share of the largest", "%", 3)),
        [(label, value, round(value / largest / SHARE) * SHARE) for label, value in rows],
        notes,
    )
