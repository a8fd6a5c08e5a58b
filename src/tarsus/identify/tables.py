"""An identification as tables. Console and notebook show every number with its interval and verdict, what is open, what
to record for it, and the checks that fail; the page shows alternatives, all checks and the account of the data too."""

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
from tarsus.identify.step import ASSUMED, PREFERRED, UNDECIDED, Alternative, Check, StepResult
from tarsus.model.laws.landing import RestituteFirst
from tarsus.records.excluded import Excluded
from tarsus.tables.numbers import amount, interval, percent
from tarsus.tables.table import ROW, Column, Table

if TYPE_CHECKING:
    from tarsus.identify.landing import LandingFit
    from tarsus.identify.result import Identification

_LANDINGS = "bounces and ramps in which the foot lands slowly: at low volts, and at frequencies between those recorded"
MOST_CHANGES = 3
"""Numbers that an alternative is said to change, the most changed first."""


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
            rows.append(
                (name, float(value), ends, _half(float(value), *ends), str(verdict_of(ends, doubted=doubted)))
            )
            of.append(unit)
    columns = (
        "number",
        Column("value", ROW, 5),
        Column("95 % interval", ROW, 5),
        Column("half-width", "%", 2),
    )
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
    rows = open_questions(found, assessed(found), words_of(found), alternatives_of(found), checks_of(found))
    open_ones = (path for path, word in words_of(found).items() if word != "determined")
    path = next((path for path in open_ones if path.startswith("ground.")), None)
    known = f"tarsus recommend identified.toml --parameter {path} --budget '2 s' ranks records by what they say of it."
    return Table("Open, and what to record for it", ("open", "why", "record"), rows, [known] if path else [])


def alternatives_of(found: Identification) -> list[Alternative]:
    """What else was tried than what the numbers rest on, with that itself: of all steps, and the landing rules."""
    return [*_landing(found), *(one for step in found.steps.values() for one in step.alternatives)]


def _landing(found: Identification) -> list[Alternative]:
    """The landing rules, or the one that is assumed where no records were compared with any."""
    question, verdict = "landing rule", found.landing
    if verdict is None:
        rule = found.model.scene.ground.landing_rule
        figure = "no records decide it"
        return [Alternative(question, rule.kind, figure=figure, used=True, word=ASSUMED, record=_LANDINGS)]
    kinds: dict[str, list[tuple[LandingFit, int]]] = {}
    for one, count in zip(verdict.fits, verdict.contradicted, strict=True):
        kinds.setdefault(one.rule.kind, []).append((one, count))
    out = []
    for kind, tried in kinds.items():
        used, left = kind == verdict.chosen.kind, [one for one, _ in tried if one.rule in verdict.possible]
        best, count = min(tried, key=lambda one: (one[0].rule != verdict.chosen, one[1]))
        speeds = [one.rule.speed for one in left or [best] if isinstance(one.rule, RestituteFirst)]
        name = f"{kind} at {interval(min(speeds), max(speeds), 'm/s', 3)}" if speeds else kind
        off = percent(float(np.median(best.off)), 3)
        figure = f"contradicted by {count} of {len(verdict.sets)} sets, wrong by {off}"
        word = "contradicted" if not left else PREFERRED if verdict.decided else UNDECIDED
        out.append(Alternative(question, name, figure=figure, used=used, word=word, record=_LANDINGS))
    return out


def alternatives_table(found: Identification) -> Table:
    """What was tried, the weight of each among the answers to its question, and what it would change."""
    values = dict(zip(found.known.paths, found.known.values.tolist(), strict=True))
    columns = ["question", "answer", Column("weight", "%", 3), "judged by", "verdict", "would change"]
    rows = [
        (
            one.question, one.name, one.weight, one.figure or None,
            f"{one.word}{', used' if one.used else ''}", _changes(one, values) or None,
        )
        for one in alternatives_of(found)
    ]  # fmt: skip
    used = [
        j for j in range(len(columns)) if any(row[j] not in (None, "") and row[j] == row[j] for row in rows)
    ]
    return Table("Alternatives", [columns[j] for j in used], [[row[j] for j in used] for row in rows])


def _changes(one: Alternative, values: dict[str, float]) -> str:
    """What an alternative changes most, as parts of the numbers."""
    parts = {path: other / values[path] - 1.0 for path, other in one.changes.items() if values.get(path)}
    most = sorted(parts, key=lambda path: -abs(parts[path]))[:MOST_CHANGES]
    return ", ".join(f"{path} {'+' * (parts[path] > 0.0)}{percent(parts[path], 2)}" for path in most)


def checks_of(found: Identification) -> list[Check]:
    """Whether what was found predicts what it was not fitted to, of all steps."""
    return [one for step in found.steps.values() for one in step.checks]


def checks_table(checks: Sequence[Check], title: str = "Checks") -> Table:
    """Checks, those that fail flagged."""
    rows = [
        (
            one.name,
            one.value,
            f"at {'least' if one.least else 'most'} {amount(one.limit, one.unit, 3)}",
            one.passed,
        )
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
    peak, contact = (_errors(found, which) for which in ("peak", "contact"))
    errors = f"absolute error of peaks {peak}, of contact durations {contact}"
    return [f"held-out signals: {len(found.comparisons)}; {errors}"]


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


def _errors(found: Identification, which: str) -> str:
    """Median and mean of the absolute errors of the held-out records that show any."""
    errors = np.abs([one.error(which) for one in found.comparisons])
    known = errors[np.isfinite(errors)]
    return f"{percent(np.median(known), 2)} (mean {percent(known.mean(), 2)})" if len(known) else "unknown"
