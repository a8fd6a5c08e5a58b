"""The report of an identification: every number with its interval and verdict, every fit with its residuals, the
account of the data, held-out signals and the shifted zero."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from tarsus.base.spec import float_paths
from tarsus.identify.assessment import assessed, law_slopes
from tarsus.identify.chain import Identification
from tarsus.identify.heldout import Comparison
from tarsus.identify.step import StepResult
from tarsus.records.excluded import Excluded
from tarsus.report import identify_figures, modal_figures
from tarsus.report.pages import page, rendered
from tarsus.tables.numbers import interval
from tarsus.tables.table import ROW, Column, Table

NOTABLE = 0.30
"""Relative error below which a held-out case counts, as in Table 2.3 of the source."""

NO_ERROR, NO_CHANGE = 1e-6, 1e-5
"""Relative error, and change by another zero position, below which there is none: fits stop at some 1e-7."""

MOST_LISTED = 60
"""Left-out data listed one by one; of more, the first ones and how many there are."""

_WHAT = {
    "resonances": "Sweeps in the air: natural frequencies and damping ratios, by poly-reference least squares and a "
    "local maximum-likelihood finish.",
    "hysteresis": "Static loops: K x = load F(V), equation (2.8), with a Prandtl-Ishlinskii operator F; on the ground "
    "the combination of points that its force does not move.",
    "film": "Ring-down after detachment: F = −C g′ / (g + g₀)³, equation (2.10) with the sign of E2, fitted to all "
    "flights at once; the moment of each release, the state at it and a drift of the drive are free.",
    "adhesion": "Pull-off force (2.13) at the moment of release over contact time: f_a = C_a0 + C_a (t − t_c), "
    "equation (2.14).",
    "restitution": "Velocities before and after impacts (2.12), from the flights on both sides; a ratio with errors in "
    "both.",
    "electrostatics": "Records close to the ground, (3.25) and (3.26).",
    "impact map": "Changes of the points' velocities at impacts per change of the foot's: a column of the map (3.22), "
    "with the velocities of all coordinates free to jump.",
}


def identify_html(found: Identification) -> str:
    """The page of a result, as text."""
    name = found.opened.campaign.name
    judged = assessed(found)
    left = found.all_left_out
    body = rendered(
        "identify.html", found=found, name=name, parameters=found.table(), of_slope=bool(law_slopes(found.known)),
        correlations=identify_figures.correlations(judged) if judged and len(judged.names) > 1 else None,
        steps=[_step(found, step) for step in found.steps.values()], held_out=_held_out(found.comparisons),
        landing=_landing(found), in_air=_in_air(found), zero=_zero(found), sets=_sets(found),
        left_out=_left_out(left), unlisted=max(0, len(left) - MOST_LISTED), notes=_notes(found),
    )  # fmt: skip
    return page(f"{name} – identification", body)


def _step(found: Identification, step: StepResult) -> dict[str, Any]:
    """What the page shows of a step."""
    plates = []
    if step.name == "resonances" and found.resonances is not None:
        fit = found.resonances.fit
        plates = [
            [modal_figures.stabilisation(fit), modal_figures.synthesis(fit)],
            [modal_figures.nyquist(fit)],
        ]
    if step.panels:
        caption = f"{step.name.capitalize()}: measured (points) and fitted (lines)."
        plates.append([identify_figures.panels(step.panels, caption)])
    return {
        "name": step.name, "what": _WHAT.get(step.name, ""), "used": step.used, "left_out": _by_reason(step.left_out),
        "notes": step.notes, "plates": plates, "residuals": _residuals(step), "count": len(step.residuals),
    }  # fmt: skip


_NUMBER = re.compile(r"(?<![\w'-])-?\d[\d.]*(e[+-]?\d+)?\b")


def _by_reason(left: Sequence[Excluded]) -> list[tuple[int, str]]:
    """How much was left out for each reason, the most frequent first; reasons that differ in a number are one."""
    counts: Counter[str] = Counter()
    for one in left:
        counts[_NUMBER.sub("…", one.reason) if one.count == 1 else one.reason] += one.count
    return [(count, reason) for reason, count in counts.most_common()]


def _residuals(step: StepResult) -> Table | None:
    rows = [(one.label, one.rms, one.noise, one.count) for one in step.residuals]
    columns = ("residual", Column("rms", ROW, 3), Column("of noise alone", ROW, 3), "values")
    return Table("", columns, rows, units=[one.unit for one in step.residuals]) if rows else None


def _held_out(comparisons: Sequence[Comparison]) -> dict[str, Any]:
    """Records that no step has seen beside their simulations."""
    if not comparisons:
        return {}
    rows, flagged = [], []
    for i, one in enumerate(comparisons):
        a, b = one.measured, one.simulated
        errors = {column: one.error(which) for which, column in (("peak", 5), ("contact", 8))}
        flagged += [(i, column) for column, error in errors.items() if abs(error) >= NOTABLE]
        peak, contact = (0.0 if abs(error) < NO_ERROR else error for error in errors.values())
        rows.append(
            (one.name, a.bounces, b.bounces, a.peak, b.peak, peak, a.contact, b.contact, contact, one.off)
        )
    columns = [
        "held-out record",
        *(Column(title, digits=3, over="bounces") for title in ("measured", "simulated")),
    ]
    for name, unit in (("peak", "m"), ("contact", "s")):
        columns += [Column(title, unit, over=name, shared=True) for title in ("measured", "simulated")]
        columns += [Column("error", "%", 2, over=name, shared=True)]
    columns += [Column("off", "%", 2, over="motion", shared=True)]
    counted = [one.measured.counting for one in comparisons]
    heights, dwells = ([float(getattr(one, name)) for one in counted] for name in ("height", "dwell"))
    return {
        "height": interval(min(heights), max(heights), "m", 3), "dwell": interval(min(dwells), max(dwells), "s", 3),
        "records": Table("", columns, rows, flagged=flagged), "summary": _summary(comparisons),
        "plate": identify_figures.held_out(comparisons),
    }  # fmt: skip


def _summary(comparisons: Sequence[Comparison]) -> Table:
    total = len(comparisons)
    exists = sum((one.measured.bounces > 0) == (one.simulated.bounces > 0) for one in comparisons)
    right = sum(abs(one.measured.bounces - one.simulated.bounces) < 0.5 for one in comparisons)
    rows: list[tuple[Any, ...]] = [
        ("presence of bounces right", f"{exists} of {total}", None, None),
        ("number of bounces right, within 0.5", f"{right} of {total}", None, None),
    ]
    for which in ("peak", "contact"):
        errors = np.array([one.error(which) for one in comparisons])
        known = errors[np.isfinite(errors)]
        below = int(np.count_nonzero(np.abs(known) < NOTABLE))
        means = [float(of.mean()) if len(of) else None for of in (known, np.abs(known))]
        rows.append((f"{which}: error below 30 %", f"{below} of {total}", *means))
    columns = (
        "summary, as Table 2.3",
        "cases",
        Column("mean error", "%", 2),
        Column("mean absolute", "%", 2),
    )
    return Table("", columns, rows)


def _in_air(found: Identification) -> Table | None:
    if not found.in_air:
        return None
    points = list(found.in_air[0].off)
    rows = [(one.file, *(one.off[point] for point in points)) for one in found.in_air]
    return Table("", ("record", *(Column(point, "%", 2) for point in points)), rows)


def _landing(found: Identification) -> Table | None:
    """Every landing rule that was tried, against one record of each set."""
    verdict = found.landing
    if verdict is None:
        return None
    rows = [
        (one.rule.kind, getattr(one.rule, "speed", None), wrong, float(np.median(one.off)))
        for one, wrong in zip(verdict.fits, verdict.contradicted, strict=True)
    ]
    return Table("", ("rule", Column("speed", "m/s", 3), "contradicted by", Column("off", "%", 3)), rows)


def _zero(found: Identification) -> Table | None:
    """The ground's numbers again, with the zero position elsewhere."""
    if not found.shifts:
        return None
    known = float_paths(found.model.scene)
    rows: list[list[Any]] = []
    for path, value in zip(found.known.paths, found.known.values.tolist(), strict=True):
        if not path.startswith("ground."):
            continue
        rows.append([path, value])
        for shift in found.shifts:
            other = shift.values.get(path)
            change = other / value - 1.0 if value and other is not None else None
            rows[-1] += [other, 0.0 if change is not None and abs(change) < NO_CHANGE else change]
    columns = ["parameter", Column("as stated", ROW)]
    for shift in found.shifts:
        columns += [Column("value", ROW, over=shift.title), Column("change", "%", 2, over=shift.title)]
    return Table("", columns, rows, units=[known[row[0]].unit for row in rows])


def _sets(found: Identification) -> Table:
    rows = []
    for name, one in found.opened.campaign.records.items():
        mine = [reading for reading in found.readings if reading.set == name]
        good = [reading.record for reading in mine if reading.record is not None]
        rows.append((name, one.purpose.value, f"{len(good)} of {len(mine)}", sum(one.count for one in good)))
    return Table("", ("set", "serves", "files read", "samples"), rows)


def _notes(found: Identification) -> Table | None:
    notes = sorted({note for r in found.readings if r.record is not None for note in r.record.notes})
    return Table("", ("note",), [(note,) for note in notes]) if notes else None


def _left_out(left: Sequence[Excluded]) -> Table | None:
    rows = [(one.file, one.channel or None, one.count, one.reason) for one in left[:MOST_LISTED]]
    return Table("", ("file", "channel", "how many", "reason"), rows) if rows else None
