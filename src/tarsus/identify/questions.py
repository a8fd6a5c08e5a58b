"""What an identification leaves open, why, and what to record for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, isfinite
from typing import TYPE_CHECKING

from tarsus.fit.verdict import WIDTH
from tarsus.identify.assessment import law_slopes
from tarsus.identify.readiness import TOLD_BY, serves
from tarsus.identify.step import ASSUMED, PREFERRED, UNDECIDED, Alternative, Check, StepResult, failures
from tarsus.identify.verdict import Assessment, NumberVerdict
from tarsus.records.purpose import Purpose
from tarsus.tables.numbers import number, path_end, percent

if TYPE_CHECKING:
    from tarsus.identify.result import Identification

MOST_REPEATS = 50
"""Times as many records of the same kind that are worth asking for; beyond, only other records help."""

MOST_NAMED = 4
"""Numbers that a failed check leaves preferred and that are named; of more, how many."""

Question = tuple[str, str, str | None]
"""What is open, why, and what to record for it, where that can be said."""


def open_questions(
    found: Identification,
    judged: Assessment | None,
    words: Mapping[str, str],
    alternatives: Sequence[Alternative],
    checks: Sequence[Check],
) -> list[Question]:
    """One row for each step that was not done, cause by which checks fail, number that is undecided or assumed,
    question with several answers, and purpose without records; words: verdicts by path."""
    rows: list[Question] = [(one.name, f"not done: {'; '.join(one.reasons)}", None) for one in found.not_done]
    rows += _doubts(words, [one for one in checks if not one.passed])
    slopes = law_slopes(found.known)
    for step in found.steps.values():
        for path in step.paths:
            if words[path] == ASSUMED:
                why = "no record shows it; its value goes with the others"
                rows.append((path, why, f"{_purposes(found, step)} that show it"))
            elif words[path] == UNDECIDED and judged is not None:
                half = judged[path].range.half_width(slopes.get(path))
                rows.append((path, _why(judged[path]), _more(found, step, half)))
    for question in dict.fromkeys(one.question for one in alternatives):
        left = [one for one in alternatives if one.question == question and one.word in (ASSUMED, UNDECIDED)]
        names = ", ".join(f"{one.name}{' (used)' if one.used and len(left) > 1 else ''}" for one in left)
        if left:
            several = len(left) > 1
            said = f"undecided between {names}" if several else f"{names} is {left[0].word}: {left[0].figure}"
            rows.append((question, said, next((one.record for one in left if one.record), None)))
    used = {one.purpose for one in found.opened.campaign.records.values()}
    attracted = found.model.scene.ground.acting.electrostatic is not None
    rows += [
        (what, "no such records: as in the device file", f"'{purpose.value}'")
        for purpose, what in TOLD_BY.items()
        if purpose not in used
        and serves(purpose, found.opened)
        and (purpose is not Purpose.CLOSE or attracted)
    ]
    return rows


def _doubts(words: Mapping[str, str], failed: Sequence[Check]) -> list[Question]:
    """Checks that fail, those of one cause together, with the numbers that are preferred only because of them."""
    rows: list[Question] = []
    for cause in dict.fromkeys(one.cause for one in failed):
        those = [one for one in failed if one.cause == cause]
        paths = dict.fromkeys(path for one in those for path in one.paths if words.get(path) == PREFERRED)
        names = f"{len(paths)} numbers" if len(paths) > MOST_NAMED else ", ".join(map(path_end, paths))
        rests = f"; preferred only: {names}" if paths else ""
        rows.append((those[0].name, f"{failures(those)[0]}{rests}", None))
    return rows


def _why(one: NumberVerdict) -> str:
    """Why a number is undecided."""
    if (tie := one.combination) is not None:
        words = str(tie)
        for name in tie.names:
            words = words.replace(name, path_end(name))
        half = tie.interval.half_width(None if tie.product else abs(tie.interval.value))
        return f"the data fix {words} within {percent(half, 2)}, not each alone"
    if one.related:
        related = ", ".join(f"{path_end(name)} ({value:+.2f})" for name, value in one.related)
        return f"correlated with {related}"
    half = one.range.half_width()
    return f"half-width {percent(half, 2)}, {percent(WIDTH)} at most" if isfinite(half) else "an end is open"


def _more(found: Identification, step: StepResult, half: float) -> str | None:
    """How many more records of the same kind bring a half-width down to a determined number's: intervals shrink as the
    root of their count."""
    times = ceil((half / WIDTH) ** 2) if isfinite(half) else MOST_REPEATS + 1
    if times <= 1:
        return None
    if times > MOST_REPEATS:
        return f"others than these of {_purposes(found, step)}"
    return f"{number(times)} times as many of {_purposes(found, step)}"


def _purposes(found: Identification, step: StepResult) -> str:
    """Purposes of the records that a step used."""
    sets = dict.fromkeys(one.set for one in found.readings if one.file in step.files)
    records = found.opened.campaign.records
    return ", ".join(dict.fromkeys(f"'{records[name].purpose.value}'" for name in sets))
