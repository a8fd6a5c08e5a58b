"""The report of an identification: every number with its interval and verdict, every fit with its residuals, the
account of the data, held-out signals and the shifted zero."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.base.spec import float_paths
from tarsus.files.store import write_text
from tarsus.identify.assessment import assessed, law_slopes
from tarsus.identify.chain import Identification
from tarsus.identify.heldout import Comparison
from tarsus.identify.result import TAKEN
from tarsus.identify.step import StepResult
from tarsus.identify.verdict import Assessment, Determined
from tarsus.records.excluded import Excluded
from tarsus.report import identify_figures, modal_figures
from tarsus.report.html import MISSING, Cell, Column, Markup, amount, code, number, page, table
from tarsus.report.render import rendered

__all__ = ["identify_html", "write_identify_report"]

NOTABLE = 0.30
"""Relative error below which a held-out case counts, as in Table 2.3 of the source."""

MOST_LISTED = 60
"""Left-out data listed one by one; of more, the first ones and how many there are."""

_WHAT = {
    "resonances": "Sweeps in the air: natural frequencies and damping ratios, by poly-reference least squares and a "
    "local maximum-likelihood finish.",
    "hysteresis": "Static loops: K x = load F(V), equation (2.8), with a Prandtl-Ishlinskii operator F; on the ground "
    "the combination of points that its force does not move.",
    "film": "Ring-down after break-off: F = −C g′ / (g + g₀)³, equation (2.10) with the sign of E2, fitted to all "
    "flights at once; the moment of each release, the state at it and a drift of the drive are free.",
    "adhesion": "Pull-off force (2.13) at the moment of release over contact time: f_a = C_a0 + C_a (t − t_c), "
    "equation (2.14).",
    "restitution": "Velocities before and after impacts (2.12), from the flights on both sides; a ratio with errors in "
    "both.",
    "electrostatics": "Records close to the ground, (3.25) and (3.26).",
    "impact map": "Changes of the points' velocities at impacts per change of the foot's: a column of the map (3.22), "
    "with the velocities of all coordinates free to jump.",
}


def write_identify_report(found: Identification, path: str | Path) -> Path:
    """Write an identification as one self-contained HTML file and return its path.

    Raises InputError if `path` cannot be written.
    """
    target = Path(path)
    write_text(target, identify_html(found))
    return target


def identify_html(found: Identification) -> str:
    """The page as text; see `write_identify_report`."""
    name = found.opened.campaign.name
    judged = assessed(found)
    slopes = law_slopes(found.known)
    left = found.all_left_out
    body = rendered(
        "identify.html", found=found, name=name, parameters=_parameters(found, judged, slopes), of_slope=bool(slopes),
        open=[] if judged is None else _open(found, judged),
        correlations=identify_figures.correlations(judged) if judged and len(judged.names) > 1 else None,
        steps=[_step(found, step) for step in found.steps.values()], held_out=_held_out(found.comparisons),
        landing=_landing(found), in_air=_in_air(found), zero=_zero(found), sets=_sets(found),
        left_out=_left_out(left), unlisted=max(0, len(left) - MOST_LISTED), notes=_notes(found),
    )  # fmt: skip
    return page(f"{name} – identification", body)


def _parameters(found: Identification, judged: Assessment | None, slopes: Mapping[str, float]) -> Markup:
    units = float_paths(found.model.scene)
    rows: list[list[Cell]] = []
    for step in found.steps.values():
        for path, value in zip(step.paths, step.values, strict=True):
            unit = units[path].unit
            low, high = step.interval(path)
            rows.append(
                [
                    code(path),
                    amount(float(value), unit, 5),
                    f"{amount(low, unit, 5)} to {amount(high, unit, 5)}" if np.isfinite(low) else MISSING,
                    _percent(slopes.get(path, float(value)), low, high) + " of slope" * (path in slopes),
                    TAKEN if path in step.taken else _word(judged, path),
                ]
            )
        for name, (value, draws, unit) in step.combinations.items():
            low, high = (float(q) for q in np.quantile(draws, [0.025, 0.975]))
            interval = f"{amount(low, unit, 5)} to {amount(high, unit, 5)}"
            rows.append([name, amount(value, unit, 5), interval, _percent(value, low, high), "combination"])
    head = (
        Column("parameter", number=False), Column("value"), Column("95 % interval"), Column("half-width"),
        Column("verdict", number=False),
    )  # fmt: skip
    return table(head, rows)


def _word(judged: Assessment | None, path: str) -> str:
    return MISSING if judged is None or path not in judged.names else judged[path].word


def _open(found: Identification, judged: Assessment) -> list[str]:
    """A sentence for every number that the data leave open."""
    units = float_paths(found.model.scene)
    return [
        one.sentence(units[one.name].unit if one.name in units else "1")
        for one in judged.verdicts
        if not isinstance(one, Determined)
    ]


def _percent(size: float, low: float, high: float) -> str:
    """Half an interval as a part of a size."""
    if not size or not np.isfinite(high - low):
        return MISSING
    return f"{number(50.0 * (high - low) / abs(size), 2)} %"


def _step(found: Identification, step: StepResult) -> dict[str, Any]:
    """What the page shows of a step."""
    plates = []
    if step.name == "resonances" and found.resonances is not None:
        fit = found.resonances.fit
        plates = [modal_figures.stabilisation(fit), modal_figures.nyquist(fit), modal_figures.synthesis(fit)]
    if step.panels:
        caption = f"{step.name.capitalize()}: measured (points) and fitted (lines)."
        plates.append(identify_figures.panels(step.panels, caption))
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


def _residuals(step: StepResult) -> Markup | str:
    rows: list[list[Cell]] = [
        [
            one.label,
            amount(one.rms, one.unit, 3),
            amount(one.noise, one.unit, 3) if np.isfinite(one.noise) else MISSING,
            str(one.count),
        ]
        for one in step.residuals
    ]
    head = (Column("residual", number=False), Column("rms"), Column("of noise alone"), Column("values"))
    return table(head, rows, tall=len(rows) > 14) if rows else ""


def _held_out(comparisons: Sequence[Comparison]) -> dict[str, Any]:
    """Records that no step has seen beside their simulations."""
    if not comparisons:
        return {}
    rows: list[list[Cell]] = []
    for one in comparisons:
        a, b = one.measured, one.simulated
        rows.append(
            [
                one.name,
                number(a.bounces, 3), number(b.bounces, 3),
                number(1e6 * a.peak, 4), number(1e6 * b.peak, 4), _coloured(one.error("peak")),
                number(1e3 * a.contact, 4), number(1e3 * b.contact, 4), _coloured(one.error("contact")),
                number(100.0 * one.off, 2),
            ]
        )  # fmt: skip
    head = (
        Column("held-out record", number=False),
        Column("measured"), Column("simulated"),
        Column("measured", "µm"), Column("simulated", "µm"), Column("error", "%"),
        Column("measured", "ms"), Column("simulated", "ms"), Column("error", "%"),
        Column("off", "%"),
    )  # fmt: skip
    over = (("", 1), ("bounces", 2), ("peak", 3), ("contact", 3), ("motion", 1))
    counted = [one.measured.counting for one in comparisons]
    return {
        "height": _between([1e6 * float(one.height) for one in counted]),
        "dwell": _between([1e3 * float(one.dwell) for one in counted]),
        "records": table(head, rows, over=over), "summary": _summary(comparisons),
        "plate": identify_figures.held_out(comparisons),
    }  # fmt: skip


def _between(values: Sequence[float]) -> str:
    low, high = number(min(values), 3), number(max(values), 3)
    return low if low == high else f"{low} to {high}"


def _coloured(error: float) -> Cell:
    if not np.isfinite(error):
        return MISSING
    shown = number(100.0 * error if abs(error) >= 1e-6 else 0.0, 2)
    return Markup('<td class="n off">{}</td>').format(shown) if abs(error) >= NOTABLE else shown


def _summary(comparisons: Sequence[Comparison]) -> Markup:
    rows: list[list[Cell]] = []
    total = len(comparisons)
    exists = sum((one.measured.bounces > 0) == (one.simulated.bounces > 0) for one in comparisons)
    right = sum(abs(one.measured.bounces - one.simulated.bounces) < 0.5 for one in comparisons)
    rows.append(["presence of bounces right", f"{exists} of {total}", MISSING, MISSING])
    rows.append(["number of bounces right, within 0.5", f"{right} of {total}", MISSING, MISSING])
    for which in ("peak", "contact"):
        errors = np.array([one.error(which) for one in comparisons])
        known = errors[np.isfinite(errors)]
        below = int(np.count_nonzero(np.abs(known) < NOTABLE))
        mean, size = (
            number(100 * float(of.mean()), 2) if len(of) else MISSING for of in (known, np.abs(known))
        )
        rows.append([f"{which}: error below 30 %", f"{below} of {total}", mean, size])
    head = (
        Column("summary, as Table 2.3", number=False),
        Column("cases"),
        Column("mean error", "%"),
        Column("mean absolute", "%"),
    )
    return table(head, rows)


def _in_air(found: Identification) -> Markup | str:
    if not found.in_air:
        return ""
    points = list(found.in_air[0].off)
    rows: list[list[Cell]] = [
        [one.file, *(number(100.0 * one.off[point], 2) for point in points)] for one in found.in_air
    ]
    head = (Column("record", number=False), *(Column(point, "%") for point in points))
    return table(head, rows, tall=len(rows) > 14)


def _landing(found: Identification) -> Markup | str:
    """Every landing rule that was tried, against one record of each set."""
    verdict = found.landing
    if verdict is None:
        return ""
    columns = [
        Column("rule", number=False), Column("speed", "mm/s"), Column("contradicted by"), Column("off", "%"),
    ]  # fmt: skip
    rows: list[list[Cell]] = []
    for one, wrong in zip(verdict.fits, verdict.contradicted, strict=True):
        speed = getattr(one.rule, "speed", None)
        shown = MISSING if speed is None else number(1e3 * speed, 3)
        off = number(100.0 * float(np.median(one.off)), 3) if np.isfinite(one.off).all() else MISSING
        rows.append([code(one.rule.kind), shown, str(wrong), off])
    return table(columns, rows)


def _zero(found: Identification) -> Markup | str:
    """The ground's numbers again, with the zero position elsewhere."""
    if not found.shifts:
        return ""
    units = float_paths(found.model.scene)
    rows: list[list[Cell]] = []
    for path, value in zip(found.known.paths, found.known.values, strict=True):
        if not path.startswith("ground."):
            continue
        row: list[Cell] = [code(path), amount(float(value), units[path].unit, 4)]
        for shift in found.shifts:
            other = shift.values.get(path, float("nan"))
            change = 100.0 * (other / value - 1.0) if value else float("nan")
            row += [amount(other, units[path].unit, 4), number(0.0 if abs(change) < 1e-3 else change, 2)]
        rows.append(row)
    columns = [Column("parameter", number=False), Column("as stated")]
    for _ in found.shifts:
        columns += [Column("value"), Column("change", "%")]
    return table(columns, rows, over=[("", 2), *((shift.title, 2) for shift in found.shifts)])


def _sets(found: Identification) -> Markup:
    rows: list[list[Cell]] = []
    for name, one in found.opened.campaign.records.items():
        mine = [reading for reading in found.readings if reading.set == name]
        good = sum(reading.record is not None for reading in mine)
        samples = sum(reading.record.count for reading in mine if reading.record is not None)
        rows.append([name, one.purpose.value, f"{good} of {len(mine)}", str(samples)])
    head = (
        Column("set", number=False), Column("serves", number=False), Column("files read"), Column("samples"),
    )  # fmt: skip
    return table(head, rows, tall=True)


def _notes(found: Identification) -> Markup | str:
    notes = sorted({note for r in found.readings if r.record is not None for note in r.record.notes})
    return table((Column("note", number=False),), [[note] for note in notes], tall=True) if notes else ""


def _left_out(left: Sequence[Excluded]) -> Markup | str:
    rows: list[list[Cell]] = [
        [one.file, one.channel or MISSING, str(one.count), one.reason] for one in left[:MOST_LISTED]
    ]
    head = (
        Column("file", number=False),
        Column("channel", number=False),
        Column("how many"),
        Column("reason", number=False),
    )
    return table(head, rows, tall=True) if rows else ""
