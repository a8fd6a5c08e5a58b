"""The report of an identification: every number with its interval and verdict, every fit with its residuals, the
account of the data, held-out signals and the shifted zero."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import count
from pathlib import Path

import numpy as np

from tarsus.base.spec import float_paths
from tarsus.files.store import package_version, write_text
from tarsus.identify.assessment import assessed
from tarsus.identify.chain import Identification
from tarsus.identify.heldout import Comparison
from tarsus.identify.result import TAKEN
from tarsus.identify.step import LeftOut, StepResult
from tarsus.identify.verdict import Assessment, Determined
from tarsus.report import identify_figures, modal_figures
from tarsus.report.html import (
    MISSING,
    Cell,
    Column,
    Markup,
    amount,
    code,
    escape,
    figure,
    number,
    page,
    table,
    warning,
)
from tarsus.report.style import figure_style

__all__ = ["identify_html", "write_identify_report"]

NOTABLE = 0.30
"""Relative error below which a held-out case counts, as in Table 2.3 of the source."""

MOST_LISTED = 60
"""Left-out data listed one by one; of more, the first ones and how many there are."""

_WHAT = {
    "resonances": "Sweeps in the air: natural frequencies and damping ratios, by poly-reference least "
    "squares and a local "
    "maximum-likelihood finish.",
    "hysteresis": "Static loops: K x = load F(V), equation (2.8), with a Prandtl-Ishlinskii operator F; on "
    "the ground the "
    "combination of points that its force does not move.",
    "film": "Ring-down after break-off: F = -C g' / (g + g0)^3, equation (2.10) with the sign of E2, "
    "fitted to all flights "
    "at once; the moment of each release, the state at it and a drift of the drive are free.",
    "adhesion": "Pull-off force (2.13) at the moment of release over contact time: f_a = C_a0 + C_a (t - "
    "t_c), equation "
    "(2.14).",
    "restitution": "Velocities before and after impacts (2.12), from the flights on both sides; a ratio "
    "with errors in both.",
    "electrostatics": "Records close to the ground, (3.25) and (3.26).",
    "impact map": "Changes of the points' velocities at impacts per change of the foot's: a column of the "
    "map (3.22), with "
    "the velocities of all coordinates free to jump.",
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
    used = found.files_used
    judged = assessed(found)
    parts = [
        f"<h1>Identification: {escape(name)}</h1>\n",
        f'<p class="lede">{used} of {len(found.readings)} files used; {found.seconds:.0f} s; Tarsus '
        f"{escape(package_version())}.</p>\n",
        *(warning(f"{said}.") for said in found.remarks),
        *(warning(f"{one.name} was not done: {'; '.join(one.reasons)}.") for one in found.not_done),
        "<h2>Parameters</h2>\n",
        _parameters(found, judged),
    ]
    numbers = count(1)
    with figure_style():
        if judged is not None and len(judged.names) > 1:
            parts.append(figure(identify_figures.correlations(judged), next(numbers)))
        for step in found.steps.values():
            parts += _step(found, step, numbers)
        parts += _validation(found.comparisons, numbers)
    parts += _landing(found)
    parts += _in_air(found)
    parts += _zero(found)
    parts += _account(found)
    parts.append(
        f"<footer><p>Made by Tarsus {escape(package_version())}. Intervals are 95 %: draws over repeats, "
        "with what earlier "
        "steps do not know drawn along.</p></footer>"
    )
    return page(f"{name} – identification", "".join(parts))


def _parameters(found: Identification, judged: Assessment | None) -> str:
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
                    _percent(float(value), low, high),
                    TAKEN if path in step.taken else _word(judged, path),
                ]
            )
        for name, (value, draws, unit) in step.combinations.items():
            low, high = (float(q) for q in np.quantile(draws, [0.025, 0.975]))
            interval = f"{amount(low, unit, 5)} to {amount(high, unit, 5)}"
            rows.append([name, amount(value, unit, 5), interval, _percent(value, low, high), "combination"])
    head = (
        Column("parameter", number=False),
        Column("value"),
        Column("95 % interval"),
        Column("half-width", "%"),
        Column("verdict", number=False),
    )
    sentences = "" if judged is None else _sentences(judged, {path: one.unit for path, one in units.items()})
    return table(head, rows) + sentences


def _word(judged: Assessment | None, path: str) -> str:
    return MISSING if judged is None or path not in judged.names else judged[path].word


def _sentences(judged: Assessment, units: dict[str, str]) -> str:
    said = [
        one.sentence(units.get(one.name, "1")) for one in judged.verdicts if not isinstance(one, Determined)
    ]
    return "".join(f"<p>{escape(sentence)}</p>\n" for sentence in said)


def _percent(value: float, low: float, high: float) -> str:
    return number(50.0 * (high - low) / abs(value), 2) if value and np.isfinite(high - low) else MISSING


def _step(found: Identification, step: StepResult, numbers: Iterator[int]) -> list[str]:
    parts = [f"<h2>{escape(step.name.capitalize())}</h2>\n", f"<p>{escape(_WHAT.get(step.name, ''))}</p>\n"]
    account = "; ".join(str(one) for one in step.used)
    left = f", {len(step.left_out)} left out (reasons at the end)" if step.left_out else ""
    parts.append(f"<p>Used: {escape(account)}{left}.</p>\n")
    parts += [f"<p>{escape(note)}</p>\n" for note in step.notes]
    if step.name == "resonances" and found.resonances is not None:
        fit = found.resonances.fit
        for plate in (
            modal_figures.stabilisation(fit),
            modal_figures.nyquist(fit),
            modal_figures.synthesis(fit),
        ):
            parts.append(figure(plate, next(numbers)))
    if step.panels:
        plate = identify_figures.panels(
            step.panels, f"{step.name.capitalize()}: measured (points) and fitted (lines)."
        )
        parts.append(figure(plate, next(numbers)))
    if step.residuals:
        parts.append(_residuals(step))
    return parts


def _residuals(step: StepResult) -> str:
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
    return table(head, rows, tall=len(rows) > 14)


def _validation(comparisons: Sequence[Comparison], numbers: Iterator[int]) -> list[str]:
    if not comparisons:
        return []
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
    parts = [
        "<h2>Held-out signals</h2>\n",
        "<p>Records that no step has seen, against simulations of the identified device, both judged by "
        "the same rules at "
        "the noise of the record (section 2.5 of the source). Errors are (measured − simulated) / measured. "
        f"{_counted(comparisons)}</p>\n",
        table(head, rows, over=over),
        _summary(comparisons),
        figure(identify_figures.held_out(comparisons), next(numbers)),
    ]
    return parts


def _counted(comparisons: Sequence[Comparison]) -> str:
    """What counts as a bounce in these records."""
    heights = [1e6 * float(one.measured.counting.height) for one in comparisons]
    dwells = [1e3 * float(one.measured.counting.dwell) for one in comparisons]
    height, dwell = (
        number(min(these), 3)
        if min(these) == max(these)
        else f"{number(min(these), 3)} to {number(max(these), 3)}"
        for these in (heights, dwells)
    )
    return (
        f"A bounce is a flight that clears {height} µm after a contact shorter than {dwell} ms; lower flights are "
        "contact."
    )


def _coloured(error: float) -> Cell:
    if not np.isfinite(error):
        return MISSING
    shown = number(100.0 * error, 2)
    return Markup(f'<td class="n bad">{shown}</td>') if abs(error) >= NOTABLE else shown


def _summary(comparisons: Sequence[Comparison]) -> str:
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
        mean = f"{100 * known.mean():.2g}" if len(known) else MISSING
        size = f"{100 * np.abs(known).mean():.2g}" if len(known) else MISSING
        rows.append([f"{which}: error below 30 %", f"{below} of {total}", mean, size])
    head = (
        Column("summary, as Table 2.3", number=False),
        Column("cases"),
        Column("mean error", "%"),
        Column("mean absolute", "%"),
    )
    return table(head, rows)


def _in_air(found: Identification) -> list[str]:
    if not found.in_air:
        return []
    points = list(found.in_air[0].off)
    rows: list[list[Cell]] = [
        [one.file, *(number(100.0 * one.off[point], 2) for point in points)] for one in found.in_air
    ]
    head = (Column("record", number=False), *(Column(point, "%") for point in points))
    return [
        "<h2>In the air</h2>\n",
        "<p>Records with the drive of the bounces in the air, against simulations of the identified structure "
        "and drive: root mean square of what is left of the motion of each point.</p>\n",
        table(head, rows, tall=len(rows) > 14),
    ]


def _landing(found: Identification) -> list[str]:
    """Every landing rule that was tried, against one record of each set."""
    verdict = found.landing
    if verdict is None:
        return []
    columns = [
        Column("rule", number=False),
        Column("speed", "mm/s"),
        Column("contradicted by"),
        Column("off", "%"),
    ]
    rows: list[list[Cell]] = []
    for one, wrong in zip(verdict.fits, verdict.contradicted, strict=True):
        speed = getattr(one.rule, "speed", None)
        shown = MISSING if speed is None else number(1e3 * speed, 3)
        off = number(100.0 * float(np.median(one.off)), 3) if np.isfinite(one.off).all() else MISSING
        rows.append([code(one.rule.kind), shown, str(wrong), off])
    return [
        "<h2>Landing rule</h2>\n",
        f"<p>The identified device under every rule, against one record of each of {len(verdict.sets)} sets of ramps "
        "and bounces. A record contradicts a rule where the foot moves off it more than twice as much as under the "
        "rule that meets it best; off is the median of the root mean square of that, over the foot's motion.</p>\n",
        *(f"<p>{escape(said)}.</p>\n" for said in verdict.sentences()),
        table(columns, rows),
    ]


def _zero(found: Identification) -> list[str]:
    if not found.shifts:
        return []
    units = float_paths(found.model.scene)
    own = dict(zip(found.known.paths, found.known.values, strict=True))
    rows: list[list[Cell]] = []
    for path, value in own.items():
        if not path.startswith("ground."):
            continue
        row: list[Cell] = [code(path), amount(float(value), units[path].unit, 4)]
        for shift in found.shifts:
            other = shift.values.get(path, float("nan"))
            row += [
                amount(other, units[path].unit, 4),
                number(100.0 * (other / value - 1.0), 2) if value else MISSING,
            ]
        rows.append(row)
    columns = [Column("parameter", number=False), Column("as stated")]
    for _ in found.shifts:
        columns += [Column("value"), Column("change", "%")]
    over = [("", 2), *((shift.title, 2) for shift in found.shifts)]
    return [
        "<h2>Zero position</h2>\n",
        "<p>The identification again as if the zero position were another (Table 2.2 of the source). The "
        "ground is seen in "
        "the records themselves, so that forces and gaps count from the contact: the constant of the "
        "drive's law changes "
        "with the zero, and what is printed here should not.</p>\n",
        table(columns, rows, over=over),
    ]


def _account(found: Identification) -> list[str]:
    parts = ["<h2>Account of the data</h2>\n"]
    rows: list[list[Cell]] = []
    for name, one in found.opened.campaign.records.items():
        mine = [reading for reading in found.readings if reading.set == name]
        good = sum(reading.record is not None for reading in mine)
        samples = sum(reading.record.count for reading in mine if reading.record is not None)
        rows.append([name, one.purpose.value, f"{good} of {len(mine)}", str(samples)])
    head = (
        Column("set", number=False),
        Column("serves", number=False),
        Column("files read"),
        Column("samples"),
    )
    parts.append(table(head, rows, tall=True))
    left = found.all_left_out
    if left:
        parts.append("<h3>Left out</h3>\n")
        parts.append(_left_out(left))
    notes = sorted({note for r in found.readings if r.record is not None for note in r.record.notes})
    if notes:
        parts.append("<h3>Said by the readers</h3>\n")
        rows = [[note] for note in notes]
        parts.append(table((Column("note", number=False),), rows, tall=True))
    return parts


def _left_out(left: Sequence[LeftOut]) -> str:
    rows: list[list[Cell]] = [[one.file, one.channel or MISSING, one.reason] for one in left[:MOST_LISTED]]
    more = len(left) - len(rows)
    head = (Column("file", number=False), Column("channel", number=False), Column("reason", number=False))
    said = (
        f"<p>{more} more of the same kinds are not listed; identification.json counts them.</p>\n"
        if more
        else ""
    )
    return table(head, rows, tall=True) + said
