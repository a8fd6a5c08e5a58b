"""An identification as a table: every number with its interval and verdict, and what the data were used for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.spec import float_paths
from tarsus.fit.verdict import Verdict
from tarsus.identify.assessment import assessed, law_slopes
from tarsus.tables.numbers import percent
from tarsus.tables.table import ROW, Column, Table

if TYPE_CHECKING:
    from tarsus.identify.chain import Identification

TAKEN = Verdict.ASSUMED.value
"""The word for a number that no record determines, whose value goes with the others."""


def identification_table(found: Identification) -> Table:
    """Parameters and their combinations, half an interval as a part of the number or, of a play's weight, of the slope
    of the drive's law; below them what is not determined, the landing rule, the files, the errors of held-out records.
    """
    units = float_paths(found.model.scene)
    judged, slopes = assessed(found), law_slopes(found.known)
    rows, of = [], []
    for step in found.steps.values():
        for path, value in zip(step.paths, step.values.tolist(), strict=True):
            word = "" if judged is None or path not in judged.names else judged[path].word
            half = _half(slopes.get(path, value), *step.interval(path))
            shown = f"{percent(half, 2)} of slope" if path in slopes else half
            rows.append(
                (path, value, tuple(step.interval(path)), shown, TAKEN if path in step.taken else word)
            )
            of.append(units[path].unit)
        for name, (value, draws, unit) in step.combinations.items():
            ends = np.quantile(draws, [0.025, 0.975]).tolist()
            rows.append((name, float(value), tuple(ends), _half(float(value), *ends), "combination"))
            of.append(unit)
    verdicts = () if judged is None else judged.verdicts
    open_ones = [one.sentence(units[one.name].unit) for one in verdicts if not one.determined]
    left = f"; not done: {', '.join(one.name for one in found.not_done)}" if found.not_done else ""
    return Table(
        f"Identified from '{found.opened.campaign.name}', {found.files_used} files{left}",
        (
            "parameter",
            Column("value", ROW, 5),
            Column("95 % interval", ROW, 5),
            Column("half-width", "%", 2),
            "verdict",
        ),
        rows,
        [*open_ones, "; ".join(_landing(found))],
        [_data(found)],
        units=of,
    )


def _half(size: float | None, low: float, high: float) -> float | None:
    """Half an interval as a part of a size."""
    return 0.5 * (high - low) / abs(size) if size and np.isfinite(high - low) else None


def _landing(found: Identification) -> list[str]:
    """What is known of the landing rule."""
    if found.landing is not None:
        return found.landing.sentences()
    return [f"landing rule: {found.model.scene.ground.landing_rule.kind} is assumed, no records decide it"]


def _data(found: Identification) -> Table:
    """What each step used, and how well held-out records are predicted."""
    rows = [
        (step.name, "; ".join(str(one) for one in step.used), step.unused if step.left_out else None)
        for step in found.steps.values()
    ]
    notes = []
    if found.comparisons:
        peak, contact = (_errors(found, which) for which in ("peak", "contact"))
        errors = f"absolute error of peaks {peak}, of contact durations {contact}"
        notes = [f"held-out signals: {len(found.comparisons)}; {errors}"]
    title = f"{found.files_used} of {len(found.readings)} files used"
    return Table(title, ("step", "used", "excluded"), rows, notes)


def _errors(found: Identification, which: str) -> str:
    """Median and mean of the absolute errors of the held-out records that show any."""
    errors = np.abs([one.error(which) for one in found.comparisons])
    known = errors[np.isfinite(errors)]
    return f"{percent(np.median(known), 2)} (mean {percent(known.mean(), 2)})" if len(known) else "unknown"
