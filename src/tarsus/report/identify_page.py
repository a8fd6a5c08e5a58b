"""The report of an identification: what was found, what is open and what to record; then every step as its data say:
numbers, figures, residuals, checks; held-out signals, the shifted zero and the account of the data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tarsus.base.spec import float_paths
from tarsus.identify import tables
from tarsus.identify.assessment import assessed
from tarsus.identify.heldout import Comparison
from tarsus.identify.result import Identification
from tarsus.identify.step import StepResult, failures
from tarsus.report import identify_figures, modal_figures
from tarsus.report.pages import Fold, Foldable, Markup, Section, bullets, said, sections_page, whole
from tarsus.tables.numbers import amount, interval
from tarsus.tables.table import ROW, Column, Table

NOTABLE = 0.30
"""Relative error below which a held-out case counts, as in Table 2.3 of the source."""

NO_ERROR, NO_CHANGE = 1e-6, 1e-5
"""Relative error, and change by another zero position, below which there is none: fits stop at some 1e-7."""

_BESIDE = "Measured (points, bars two standard errors to either side) and fitted (lines)."


def identify_html(found: Identification) -> str:
    """The page of a result, as text."""
    name = found.opened.campaign.name
    open_ones, failed = tables.open_table(found), failures(tables.checks_of(found))
    about = [
        f"{tables.summary_line(found).removeprefix(f'{name}: ')}; made in {_took(found)}.",
        *(said(one, failed=True) for one in found.remarks if one not in failed),
        whole(tables.numbers_table(found).bare()),
        open_ones if open_ones.rows else Markup("<p>Every number is determined.</p>"),
    ]
    sections = [
        *(_step(found, step) for step in found.steps.values()),
        _held_out(found.comparisons) if found.comparisons else None,
        Section("Account of the data", *_account(found)),
    ]
    footer = "Intervals are 95 %, from draws over repeats with the uncertainty of earlier steps."
    return sections_page(name, about, sections, footer, head=f"{name} – identification")


def _took(found: Identification) -> str:
    return amount(found.seconds, "s", 2) if found.seconds < 100.0 else f"{found.seconds / 60.0:.0f} min"


def _step(found: Identification, step: StepResult) -> Foldable:
    """What the page shows of a step: one or two panels beside the words, more below them."""
    below, few = [], len(step.panels) in (1, 2)
    shown = identify_figures.panels(step.panels, _BESIDE) if step.panels else None
    if step.name == "resonances" and found.resonances is not None:
        fit = found.resonances.fit
        shown, few, below = modal_figures.synthesis(fit), True, [modal_figures.nyquist(fit)]
    words = (
        f"{step.about} Used: {'; '.join(map(str, step.used))}. {tables.residual_line(step)}",
        *step.notes,
    )
    return Foldable(step.name.capitalize(), *([[words, shown]] if few else [*words, shown]), *below)


def _account(found: Identification) -> list[Any]:
    """What was checked and tried, and what became of every file and event, to be opened."""
    judged, checks = assessed(found), tables.checks_table(tables.checks_of(found)).bare()
    zero = _zero(found)
    notes = sorted({note for one in found.readings if one.record is not None for note in one.record.notes})
    passed, files = (
        len(checks.rows) - len(checks.flagged),
        f"{found.files_used} of {len(found.readings)} files used",
    )
    return [
        Fold(f"Checks of the model: {passed} of {len(checks.rows)} passed", checks) if checks.rows else None,
        Fold("Landing rules that were tried", bullets(found.landing.sentences())) if found.landing else None,
        Fold("Correlations of the numbers", identify_figures.correlations(judged))
        if judged and len(judged.names) > 1
        else None,
        Fold(
            f"Files and events: {files}", _purposes(found), Markup('<div class="account">{}</div>').format(
                tables.account_table(found).bare()), bullets(notes) if notes else None,
            "identification.json lists every excluded file and event with its reason.",
        ),
        Fold("Held-out signals, record by record", _records(found.comparisons)) if found.comparisons else None,
        Fold(f"Another zero position: {len(zero.rows)} numbers of the ground again", ZERO, zero)
        if found.shifts
        else None,
    ]  # fmt: skip


ZERO = """The identification as if the zero position were another (Table 2.2 of the source). Heights count from the
ground seen in the records, so only the constant of the drive's law should change."""


def _held_out(comparisons: Sequence[Comparison]) -> Foldable:
    """Records that no step has seen beside their simulations."""
    counted = [one.measured.counting for one in comparisons]
    heights, dwells = ([float(getattr(one, name)) for one in counted] for name in ("height", "dwell"))
    about = (
        "Records that no step has used, compared with simulations of the identified device. A bounce is a flight that "
        f"clears {interval(min(heights), max(heights), 'm', 3)} after a contact shorter than "
        f"{interval(min(dwells), max(dwells), 's', 3)}. Errors are (measured − simulated) / measured."
    )
    return Foldable("Held-out signals", about, _summary(comparisons), identify_figures.held_out(comparisons))


def _records(comparisons: Sequence[Comparison]) -> Table:
    """Every held-out record beside its simulation."""
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
    return Table("", columns, rows, flagged=flagged)


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


def _zero(found: Identification) -> Table:
    """The ground's numbers again, with the zero position elsewhere."""
    known = float_paths(found.model.scene)
    rows: list[list[Any]] = []
    for path, value in zip(found.known.paths, found.known.values.tolist(), strict=True):
        if not path.startswith("ground."):
            continue
        rows.append([path, value])
        for shift in found.shifts.values():
            other = shift.get(path)
            change = other / value - 1.0 if value and other is not None else None
            rows[-1] += [other, 0.0 if change is not None and abs(change) < NO_CHANGE else change]
    columns = ["parameter", Column("as stated", ROW)]
    for title in found.shifts:
        columns += [Column("value", ROW, over=title), Column("change", "%", 2, over=title)]
    return Table("", columns, rows, units=[known[row[0]].unit for row in rows])


def _purposes(found: Identification) -> Table:
    """What was recorded for each purpose."""
    rows = []
    sets = found.opened.campaign.records
    for purpose in dict.fromkeys(one.purpose for one in sets.values()):
        names = [name for name, one in sets.items() if one.purpose is purpose]
        files = [reading for reading in found.readings if reading.set in names]
        good = [reading.record for reading in files if reading.record is not None]
        samples = sum(record.count for record in good)
        rows.append((purpose.value, len(names), f"{len(good)} of {len(files)}", samples))
    return Table("", ("purpose", "sets", "files read", "samples"), rows)
