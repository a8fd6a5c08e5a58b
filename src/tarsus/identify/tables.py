"""An identification as tables. Console and notebook show every number with its interval and verdict, what is open, what
to record for it, and the checks that fail; the page shows all checks and the account of the data too."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.spec import float_paths
from tarsus.fit.verdict import verdict_of
from tarsus.identify.assessment import assessed, law_slopes
from tarsus.identify.questions import open_questions
from tarsus.identify.step import ASSUMED, PREFERRED, Check, StepResult
from tarsus.records.excluded import Excluded
from tarsus.tables.numbers import amount, percent
from tarsus.tables.table import ROW, Column, Table

if TYPE_CHECKING:
    from tarsus.identify.result import Identification


def identification_table(found: Identification) -> Table:
    """Every number, and below it what is open and the checks that fail."""
    numbers, checks = numbers_table(found), checks_of(found)
    failed = [one for one in checks if not one.passed]
    parts = (open_table(found), checks_table(failed, "Checks that fail"))
    passed = f"{len(checks) - len(failed)} of {len(checks)} checks of the model passed; the report has all"
    return Table(
        numbers.title,
        numbers.columns,
        numbers.rows,
        [*numbers.notes, *_held_out(found), *([passed] if checks else [])],
        [one for one in parts if one.rows],
        units=numbers.units,
        flagged=numbers.flagged,
    )


def numbers_table(found: Identification) -> Table:
    """Numbers and their combinations, those of the last step first: what a campaign is made for.

    Half an interval is a part of the number or, of a play's weight, which may be of either sign, of the slope of the
    drive's law; weights with one verdict stand in one row, but those that are undecided.
    """
    units, words, slopes = float_paths(found.model.scene), words_of(found), law_slopes(found.known)
    rows: list[tuple[Any, ...]] = []
    of: list[str] = []
    for step in reversed(found.steps.values()):
        alike: dict[tuple[str, str], list[float]] = {}
        for path, value in zip(step.paths, step.values.tolist(), strict=True):
            ends = step.interval(path)
            half = _half(slopes.get(path, value), *ends)
            if path in slopes and words[path] in ("determined", PREFERRED) and half is not None:
                alike.setdefault((path.rpartition(".")[0], words[path]), []).append(half)
                continue
            rows.append((path, value, ends, half, words[path]))
            of.append(units[path].unit)
        for (law, word), halves in alike.items():
            rows.append((f"{law} ({len(halves)})", None, None, max(halves), word))
            of.append("1")
        doubted = any(words[path] == PREFERRED for path in step.paths)
        for name, (value, draws, unit) in step.combinations.items():
            ends = tuple(np.quantile(draws, [0.025, 0.975]).tolist())
            rows.append((name, float(value), ends, _half(float(value), *ends), str(verdict_of(ends, doubted=doubted))))
            of.append(unit)
    columns = ("number", Column("value", ROW, 5), Column("95 % interval", ROW, 5), Column("half-width", "%", 2))
    flagged = [(i, 4) for i, row in enumerate(rows) if row[4] != "determined"]
    notes = ["half-widths of weights are parts of the slope of the whole law"] if slopes else []
    return Table(summary_line(found), (*columns, "verdict"), rows, notes, units=of, flagged=flagged)


def summary_line(found: Identification) -> str:
    """How many numbers have which verdict, and how many files were used."""
    words = Counter(words_of(found).values())
    total = sum(words.values())
    said = [f"{words.pop('determined', 0)} of {total} numbers determined"]
    said += [f"{count} {word}" for word, count in words.most_common()]
    left = f"; not done: {', '.join(one.name for one in found.not_done)}" if found.not_done else ""
    files = f"{found.files_used} of {len(found.readings)} files used"
    return f"{found.opened.campaign.name}: {', '.join(said)}; {files}{left}"


def words_of(found: Identification) -> dict[str, str]:
    """What the data say of every number, in a word; one without an interval goes with the others: it is assumed."""
    judged = assessed(found)
    known = () if judged is None else judged.names
    words: dict[str, str] = {}
    for step in found.steps.values():
        for path in step.paths:
            if judged is None or path in step.taken or path not in known:
                words[path] = ASSUMED
            else:
                words[path] = judged[path].word
    return words


def _half(size: float | None, low: float, high: float) -> float | None:
    """Half an interval as a part of a size."""
    return 0.5 * (high - low) / abs(size) if size and np.isfinite(high - low) else None


def open_table(found: Identification) -> Table:
    """What is not determined, why, and what to record for it."""
    rows = open_questions(found, assessed(found), words_of(found), checks_of(found))
    open_ones = (path for path, word in words_of(found).items() if word != "determined")
    path = next((path for path in open_ones if path.startswith("ground.")), None)
    known = f"tarsus recommend identified.toml --parameter {path} --budget '2 s' ranks records by what they say of it."
    return Table("Open, and what to record for it", ("open", "why", "record"), rows, [known] if path else [])


def checks_of(found: Identification) -> list[Check]:
    """Whether what was found predicts what it was not fitted to, of all steps."""
    return [one for step in found.steps.values() for one in step.checks]


def checks_table(checks: Sequence[Check], title: str = "Checks") -> Table:
    """Checks, those that fail flagged."""
    rows = [
        (one.name, one.value, f"at {'least' if one.least else 'most'} {amount(one.limit, one.unit, 3)}", one.passed)
        for one in checks
    ]
    failed = [(i, 3) for i, one in enumerate(checks) if not one.passed]
    columns = ("check", Column("value", ROW, 3), "limit", "passed")
    return Table(title, columns, rows, units=[one.unit for one in checks], flagged=failed)


def account_table(found: Identification) -> Table:
    """What each step found, used and excluded, with reasons."""
    rows = []
    for step in found.steps.values():
        left = "; ".join(f"{count}: {why}" for count, why in by_reason(step.left_out))
        rows.append((step.name, "; ".join(str(one) for one in step.used), left or None))
    return Table("Data", ("step", "used", "excluded"), rows)


def _held_out(found: Identification) -> list[str]:
    """How well records that no step has seen are predicted."""
    if not found.comparisons:
        return []
    error = percent(float(np.median([one.off for one in found.comparisons])), 2)
    return [f"held-out signals: {len(found.comparisons)}; {error} of the motion of the foot is missed (median)"]


_NUMBER = re.compile(r"(?<![\w'-])-?\d[\d.]*(e[+-]?\d+)?\b")


def by_reason(left: Sequence[Excluded]) -> list[tuple[int, str]]:
    """How much was excluded for each reason, the most frequent first; reasons that differ in a number are one."""
    counts: Counter[str] = Counter()
    for one in left:
        counts[_NUMBER.sub("…", one.reason) if one.count == 1 else one.reason] += one.count
    return [(count, reason) for reason, count in counts.most_common()]


def residual_line(step: StepResult) -> str:
    """What a step leaves unexplained over what noise alone would leave, in a sentence, or nothing."""
    over = {one.label: one.rms / one.noise for one in step.residuals if one.noise > 0.0}
    if not over:
        return ""
    worst = max(over, key=over.__getitem__)
    of = f"; the most of {len(over)} is {over[worst]:.3g}, of {worst.partition(', over')[0]}" if len(over) > 1 else ""
    return f"The fit leaves {float(np.median(list(over.values()))):.3g} times the noise{of}."
