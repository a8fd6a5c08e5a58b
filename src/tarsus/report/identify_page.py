"""The report of an identification: what was found, what is open and what to record; then every step as its data say:
numbers, figures, residuals, checks; held-out signals, the shifted zero and the account of the data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tarsus.base.spec import float_paths
from tarsus.identify import tables
from tarsus.identify.assessment import assessed
from tarsus.identify.heldout import Comparison
from tarsus.identify.result import Identification
from tarsus.identify.step import StepResult, failures
from tarsus.report import identify_figures, modal_figures
from tarsus.report.pages import Fold, Foldable, Markup, Section, bullets, said, sections_page, whole
from tarsus.tables.numbers import amount
from tarsus.tables.table import ROW, Column, Table

NO_CHANGE = 1e-5
"""Relative change by another zero position below which there is none: fits stop at some 1e-7."""

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
    words = (f"{step.about} Used: {'; '.join(map(str, step.used))}. {tables.residual_line(step)}", *step.notes)
    return Foldable(step.name.capitalize(), *([[words, shown]] if few else [*words, shown]), *below)


def _account(found: Identification) -> list[Any]:
    """What was checked and tried, and what became of every file and event, to be opened."""
    judged, checks = assessed(found), tables.checks_table(tables.checks_of(found)).bare()
    zero = _zero(found)
    notes = sorted({note for one in found.readings if one.record is not None for note in one.record.notes})
    passed, files = (len(checks.rows) - len(checks.flagged), f"{found.files_used} of {len(found.readings)} files used")
    return [
        Fold(f"Checks of the model: {passed} of {len(checks.rows)} passed", checks) if checks.rows else None,
        Fold("Landing rules that were tried", bullets(found.landing.sentences())) if found.landing else None,
        Fold("Correlations of the numbers", identify_figures.correlations(judged))
        if judged and len(judged.names) > 1
        else None,
        Fold(
            f"Files and events: {files}",
            _purposes(found),
            Markup('<div class="account">{}</div>').format(tables.account_table(found).bare()),
            bullets(notes) if notes else None,
            "identification.json lists every excluded file and event with its reason.",
        ),
        Fold(f"Another zero position: {len(zero.rows)} numbers of the ground again", ZERO, zero)
        if found.shifts
        else None,
    ]


ZERO = """The identification as if the zero position were another (Table 2.2 of the source). Heights count from the
ground seen in the records, so only the constant of the drive's law should change."""


def _held_out(comparisons: Sequence[Comparison]) -> Foldable:
    """Records that no step has seen beside their simulations."""
    columns = ("held-out record", Column("motion missed", "%", 2), Column("over its noise", digits=3))
    table = Table("", columns, [(one.name, one.off, one.over) for one in comparisons])
    about = (
        "Records that no step has used, compared with simulations of the identified device: root mean square of the "
        "measured less the simulated motion of the foot over that of the measured one."
    )
    return Foldable("Held-out signals", about, table, identify_figures.held_out(comparisons))


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
