"""The report of a landing design: the picture, the switching times, the grounds, and why to believe it."""

from __future__ import annotations

import math
from itertools import count
from pathlib import Path

from tarsus.base.spec import float_paths
from tarsus.design.landing_files import digest, header_text
from tarsus.design.request import Sensor
from tarsus.design.soft_landing import LandingDesign
from tarsus.files.store import package_version, write_text
from tarsus.report import landing_figures
from tarsus.report.html import MISSING, Cell, Column, amount, escape, figure, number, page, table
from tarsus.report.style import figure_style

__all__ = ["landing_html", "write_landing_report"]


def write_landing_report(design: LandingDesign, path: str | Path) -> Path:
    """Write a design as one self-contained HTML file; returns its path. Raises InputError if it cannot be written."""
    target = Path(path)
    write_text(target, landing_html(design))
    return target


def landing_html(design: LandingDesign) -> str:
    """The page as text; see `write_landing_report`."""
    request, numbers = design.request, count(1)
    with figure_style():
        pair = landing_figures.Pair(design)
        parts = [
            f"<h1>Soft landing: {escape(request.scene.name)}, foot {escape(request.foot)}</h1>\n",
            f'<p class="lede">{escape(_lede(design))}</p>\n',
            figure(landing_figures.picture(pair), next(numbers)),
            figure(landing_figures.landing_zoom(pair), next(numbers)),
            "<h2>What changes</h2>\n", _compared(design),
            "<h2>The signal</h2>\n", _signal(design),
        ]  # fmt: skip
        if len(design.grounds) > 1:
            grounds = figure(landing_figures.on_grounds(design), next(numbers))
            parts += ["<h2>Grounds</h2>\n", _believed(design), grounds, _grounds(design)]
        parts += [
            "<h2>Speed against energy</h2>\n",
            figure(landing_figures.front(design), next(numbers)),
            _front(design),
        ]
        if design.learning is not None:
            parts += ["<h2>Learning on hidden grounds</h2>\n", _learned(design),
                      figure(landing_figures.learning(design), next(numbers))]  # fmt: skip
    parts += ["<h2>landing.h</h2>\n", f"<pre>{escape(header_text(design))}</pre>\n", _footer(design)]
    return page(f"{request.scene.name} – soft landing", "".join(parts))


def _lede(design: LandingDesign) -> str:
    before, after = float(design.before.speed[0, 0]), design.speed
    told = (
        f"The plain step strikes at {before:.3g} m/s with {design.before.touchdowns[0, 0]:g} touchdowns a step; the "
        f"design at {after:.3g} m/s with {design.touchdowns:g}. Every touchdown of the whole period counts; the "
        f"motion is {design.regime.words}."
    )
    if math.isfinite(design.worst):
        told += f" On the worst ground found it strikes at {design.worst:.3g} m/s."
    return told


def _compared(design: LandingDesign) -> str:
    names = (
        ("hardest touchdown", "speed", "m/s"), ("touchdowns a step", "touchdowns", ""),
        ("largest impulse", "impulse", "N s"),
        ("contact a period", "contact", "s"), ("highest gap", "peak", "m"), ("mean gap in the air", "lifted", "m"),
    )  # fmt: skip
    rows: list[list[Cell]] = [
        [title, *(amount(float(getattr(one, name)[0, 0]), unit) for one in (design.before, design.after))]
        for title, name, unit in names
    ]
    energy, recovered = design.energies
    plain = _plain_energy(design)
    rows.append(["energy a period, plain on-off", amount(plain[0], "J"), amount(energy, "J")])
    rows.append(["energy a period, charge recovered", amount(plain[1], "J"), amount(recovered, "J")])
    note = "" if math.isfinite(energy) else (
        f"<p>The drive {escape(design.request.drive)} has no capacitance, so its energy is not known.</p>\n"
    )  # fmt: skip
    return table((Column("", number=False), Column("before"), Column("after")), rows) + note


def _plain_energy(design: LandingDesign) -> tuple[float, float]:
    from tarsus.design.energy import energy_of

    return energy_of(design.request.actuator, design.plain_signal)


def _signal(design: LandingDesign) -> str:
    tick = design.request.step.period / design.request.ticks
    rows: list[list[Cell]] = [
        [str(i), f"{round(time / tick)}", amount(time, "s", 6), number(level, 5), amount(span, "s", 6)]
        for i, (time, level, span) in enumerate(
            zip(design.switching_times, design.signal.levels, design.signal.durations, strict=True)
        )
    ]
    head = (Column("switching"), Column("tick"), Column("time"), Column("level", "V"), Column("lasts"))
    lost = "costs" if design.loss >= 0.0 else "gains"
    note = (
        f"<p>Times count from the landing edge. Rounding to a timer of {escape(amount(tick, 's'))} {lost} "
        f"{escape(amount(abs(design.loss), 'm/s', 2))}; the period has {design.request.ticks} ticks.</p>\n"
    )
    return table(head, rows) + note


def _believed(design: LandingDesign) -> str:
    told = [f"Judged by the {design.request.risk.name} of {len(design.grounds)} grounds."]
    if design.rounds:
        last = design.rounds[-1]
        found = f"a ground {100.0 * last.gap:.2g} % worse" if last.gap > 1e-3 else "no ground worse"
        rounds = "one round" if len(design.rounds) == 1 else f"{len(design.rounds)} rounds"
        told.append(
            f"Cutting planes took {rounds}; the last found {found} than the {last.grounds} of the search."
        )
    if design.attack is not None:
        told.append(f"The last search of the box tried {design.attack.tried} grounds.")
    if math.isfinite(design.nominal_worst):
        told.append(
            f"The design for the nominal ground alone strikes at {design.nominal_worst:.3g} m/s on its worst ground, "
            f"{design.nominal_worst / design.worst:.2g} times as hard."
        )
    return f"<p>{escape(' '.join(told))}</p>\n"


def _grounds(design: LandingDesign) -> str:
    units = float_paths(design.request.scene)
    paths = list(design.grounds.values)
    rows: list[list[Cell]] = [
        [
            *(amount(float(design.grounds.values[path][i]), units[path].unit) for path in paths),
            number(float(design.before_on_grounds.speed[0, i]), 3), number(float(design.on_grounds.speed[0, i]), 3),
            number(float(design.on_grounds.touchdowns[0, i]), 3),
        ]
        for i in range(len(design.grounds))
    ]  # fmt: skip
    head = (
        *(Column(path) for path in paths),
        Column("before", "m/s"),
        Column("after", "m/s"),
        Column("touchdowns"),
    )
    return table(head, rows, tall=len(rows) > 14)


def _front(design: LandingDesign) -> str:
    rows: list[list[Cell]] = [
        [
            str(one.pairs), number(one.speed, 3), amount(one.energy, "J", 3) if math.isfinite(one.energy) else MISSING,
            amount(one.recovered, "J", 3) if math.isfinite(one.recovered) else MISSING,
            ", ".join(f"{level:.3g}" for level in one.signal.levels),
        ]
        for one in design.front
    ]  # fmt: skip
    head = (
        Column("pairs"),
        Column("speed", "m/s"),
        Column("energy"),
        Column("recovered"),
        Column("levels", "V", number=False),
    )
    return table(head, rows)


def _learned(design: LandingDesign) -> str:
    found = design.learning
    assert found is not None
    told = "how hard each step struck" if found.sensor is Sensor.SPEED else "whether the contact had closed"
    return (
        f"<p>Told only {told}, {100.0 * found.halved:.0f} % of {len(found.grounds)} learners struck with at most half "
        f"the plain step's speed within ten steps.</p>\n"
    )


def _footer(design: LandingDesign) -> str:
    return (
        f"<p>{design.runs} runs; a run takes {design.settle} periods, of which the last is looked at: "
        f"{design.settle - 1} settle the motion, by measurement. "
        f"Digest {digest(design.signal)}; Tarsus {escape(package_version())}.</p>\n"
    )
