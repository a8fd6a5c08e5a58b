"""What an identification leaves open, why, and what to record for it: purpose, drive and channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, isfinite, isnan, nan
from typing import TYPE_CHECKING

import numpy as np

from tarsus.fit.verdict import WIDTH
from tarsus.identify.assessment import law_slopes
from tarsus.identify.readiness import TOLD_BY, serves
from tarsus.identify.step import ASSUMED, PREFERRED, UNDECIDED, Check, failures
from tarsus.identify.verdict import Assessment, NumberVerdict
from tarsus.records.purpose import Purpose
from tarsus.tables.numbers import amount, number, path_end, percent

if TYPE_CHECKING:
    from tarsus.identify.campaign import RecordSet
    from tarsus.identify.result import Identification

MOST_REPEATS = 50
"""Times as many records of the same kind that are worth asking for; beyond, only other records help."""

_PURPOSES = {
    "ground.restitution": Purpose.BOUNCES,
    "ground.electrostatic": Purpose.CLOSE,
    "robot.structure": Purpose.MODAL,
    "robot.drives": Purpose.LOOPS,
}
"""By the beginning of a number's path: purpose of the records that determine it; of others ramps."""

_LANDINGS = "bounces and ramps in which the foot lands slowly: at low volts, and at frequencies between those recorded"
MOST_NAMED = 4
"""Numbers that a failed check leaves preferred and that are named; of more, how many."""

Question = tuple[str, str, str]
"""What is open, why, and what to record for it."""


def open_questions(
    found: Identification, judged: Assessment | None, words: Mapping[str, str], checks: Sequence[Check]
) -> list[Question]:
    """One row for each step that was not done, cause by which checks fail, number that is undecided or assumed,
    landing rule that is open, and purpose without records; words: verdicts by path."""
    rows: list[Question] = [
        (
            one.name,
            f"not from these data: {'; '.join(one.reasons)}",
            f"{'others than these: ' if any(found.opened.sets(one.purpose)) else ''}{_wanted(found, one.purpose)}",
        )
        for one in found.not_done
    ]
    rows += _doubts(found, words, [one for one in checks if not one.passed])
    rows += _numbers(found, judged, words)
    rule, verdict = found.model.scene.ground.landing_rule.kind, found.landing
    if verdict is None:
        rows.append(("landing rule", f"{rule} is {ASSUMED}: no records decide it", _LANDINGS))
    elif not verdict.decided:
        kinds = " and ".join(dict.fromkeys(one.kind for one in verdict.possible))
        rows.append(("landing rule", f"{UNDECIDED} between {kinds}; {rule} is used", _LANDINGS))
    used = {one.purpose for one in found.opened.campaign.records.values()}
    attracted = found.model.scene.ground.acting.electrostatic is not None
    rows += [
        (what, "no such records: as in the device file", _wanted(found, purpose))
        for purpose, what in TOLD_BY.items()
        if purpose not in used and serves(purpose, found.opened) and (purpose is not Purpose.CLOSE or attracted)
    ]
    return rows


def _numbers(found: Identification, judged: Assessment | None, words: Mapping[str, str]) -> list[Question]:
    """Numbers that are undecided or assumed, those of one reason that the same record decides together: what decides
    the widest of them decides all."""
    slopes, alike = law_slopes(found.known), dict[tuple[str, str], list[tuple[float, str]]]()
    for path in (path for step in found.steps.values() for path in step.paths):
        if words[path] == ASSUMED:
            half, why = nan, "no record shows it; its value goes with the others"
        elif words[path] == UNDECIDED and judged is not None:
            half, why = judged[path].range.half_width(slopes.get(path)), _why(judged[path])
        else:
            continue
        alike.setdefault((why, _record(found, path)), []).append((half, path))
    rows: list[Question] = []
    for (why, _), those in alike.items():
        half, path = max(those, key=lambda one: one[0])
        rows.append(
            (", ".join([those[0][1], *(path_end(one) for _, one in those[1:])]), why, _record(found, path, half))
        )
    return rows


def _doubts(found: Identification, words: Mapping[str, str], failed: Sequence[Check]) -> list[Question]:
    """Checks that fail, those of one cause together, with the numbers that are preferred only because of them."""
    rows: list[Question] = []
    for cause in dict.fromkeys(one.cause for one in failed):
        those = [one for one in failed if one.cause == cause]
        paths = dict.fromkeys(path for one in those for path in one.paths if words.get(path) == PREFERRED)
        names = f"{len(paths)} numbers" if len(paths) > MOST_NAMED else ", ".join(map(path_end, paths))
        rests = f"; preferred only: {names}" if paths else ""
        touched = next((path for one in those for path in one.paths), "")
        record = next((one.record for one in those if one.record), "") or _record(found, touched)
        rows.append((those[0].name, f"{failures(those)[0]}{rests}", record))
    return rows


def _why(one: NumberVerdict) -> str:
    """Why a number is undecided."""
    if (tie := one.combination) is not None:
        words = str(tie)
        for name in tie.names:
            words = words.replace(name, path_end(name))
        return f"the data fix {words} within {percent(tie.interval.half_width(), 2)}, not each alone"
    if one.related:
        related = ", ".join(f"{path_end(name)} ({value:+.2f})" for name, value in one.related)
        return f"correlated with {related}"
    half = one.range.half_width()
    return f"half-width {percent(half, 2)}, {percent(WIDTH)} at most" if isfinite(half) else "an end is open"


def _record(found: Identification, path: str, half: float = nan) -> str:
    """Records that determine a number, and how many times as many as there are bring a half-width down to a determined
    number's: intervals shrink as the root of their count."""
    purpose = next((one for start, one in _PURPOSES.items() if path.startswith(start)), Purpose.RAMPS)
    wanted = _wanted(found, purpose) if serves(purpose, found.opened) else _GAITS
    times = nan if isnan(half) else ceil((half / WIDTH) ** 2) if isfinite(half) else MOST_REPEATS + 1
    if not times > 1 or not any(found.opened.sets(purpose)):
        return wanted
    return f"others than these: {wanted}" if times > MOST_REPEATS else f"{number(times)} times as many: {wanted}"


def _wanted(found: Identification, purpose: Purpose) -> str:
    """Records of a purpose that the campaign lacks: purpose, drive and channels."""
    if purpose not in _KINDS:
        return _GAITS
    stated = [_volts(one) for one in found.opened.campaign.records.values()]
    recorded = [
        float(np.abs(one.record[one.record.drive]).max())
        for one in found.readings
        if one.record is not None and one.record.drive and found.opened.campaign.records[one.set].signal is None
    ]
    volts = max(stated + recorded, default=0.0)
    most = f" up to {amount(volts, 'V', 2)}" if volts else ""
    kind = f"{_KINDS[purpose].format(most)} on drive {found.model.drive}"
    return f"'{purpose.value}': {kind}, {_channels(found, purpose)}"


_GAITS = "other gaits, or single legs: `tarsus recommend` ranks them"
_KINDS = {
    Purpose.MODAL: "weak swept sines in the air",
    Purpose.LOOPS: "slow voltage that turns at several levels{}",
    Purpose.RAMPS: "ramped squares of several frequencies{}",
    Purpose.BOUNCES: "squares{} that make the foot bounce",
    Purpose.CLOSE: "sines at several gaps that keep the foot clear",
}
"""Drive of the records of a purpose, in words."""


def _channels(found: Identification, purpose: Purpose) -> str:
    """Channels that a purpose needs."""
    kinds = "velocity" if purpose is Purpose.MODAL else "displacement and velocity"
    return f"{kinds} of {' and '.join(found.model.points)}"


def _volts(one: RecordSet) -> float:
    levels = getattr(one.signal, "levels", ())
    return float(max(map(abs, levels), default=0.0) or getattr(one.signal, "amplitude", 0.0))
