"""The report of a landing design: the picture, the switching times, the grounds, and why to believe it."""

from __future__ import annotations

import math
from pathlib import Path

from tarsus.base.spec import float_paths
from tarsus.design.energy import energy_of
from tarsus.design.headers import digest, header_text
from tarsus.design.landing_design import LandingDesign
from tarsus.design.landing_request import Sensor
from tarsus.files.store import write_text
from tarsus.report import landing_figures
from tarsus.report.html import MISSING, Cell, Column, Markup, amount, number, page, table
from tarsus.report.render import rendered

__all__ = ["landing_html", "write_landing_report"]


def write_landing_report(design: LandingDesign, path: str | Path) -> Path:
    """Write a design as one self-contained HTML file; returns its path. Raises InputError if it cannot be written."""
    target = Path(path)
    write_text(target, landing_html(design))
    return target


def landing_html(design: LandingDesign) -> str:
    """The page as text; see `write_landing_report`."""
    request, learning = design.request, design.learning
    pair = landing_figures.Pair(design)
    several = len(design.grounds) > 1
    speed = learning is not None and learning.sensor is Sensor.SPEED
    body = rendered(
        "landing.html", design=design, request=request, judged=math.isfinite(design.worst),
        picture=landing_figures.picture(pair), zoom=landing_figures.landing_zoom(pair), compared=_compared(design),
        unpriced=not math.isfinite(design.energies[0]), signal=_signal(design),
        tick=request.step.period / request.ticks, last=design.rounds[-1] if design.rounds else None,
        rival=design.nominal_worst / design.worst if math.isfinite(design.nominal_worst) else None,
        on_grounds=landing_figures.on_grounds(design) if several else None,
        grounds=_grounds(design) if several else None, front=landing_figures.front(design), designs=_front(design),
        sensed="how hard each step struck" if speed else "whether the contact had closed",
        learning=landing_figures.learning(design) if learning is not None else None, header=header_text(design),
        digest=digest(design.signal),
    )  # fmt: skip
    return page(f"{request.scene.name} – soft landing", body)


def _compared(design: LandingDesign) -> Markup:
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
    plain = energy_of(design.request.actuator, design.plain_signal)
    rows.append(["energy a period, plain on-off", amount(plain[0], "J"), amount(energy, "J")])
    rows.append(["energy a period, charge recovered", amount(plain[1], "J"), amount(recovered, "J")])
    return table((Column("", number=False), Column("before"), Column("after")), rows)


def _signal(design: LandingDesign) -> Markup:
    tick = design.request.step.period / design.request.ticks
    rows: list[list[Cell]] = [
        [str(i), f"{round(time / tick)}", amount(time, "s", 6), number(level, 5), amount(span, "s", 6)]
        for i, (time, level, span) in enumerate(
            zip(design.switching_times, design.signal.levels, design.signal.durations, strict=True)
        )
    ]
    head = (Column("switching"), Column("tick"), Column("time"), Column("level", "V"), Column("lasts"))
    return table(head, rows)


def _grounds(design: LandingDesign) -> Markup:
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


def _front(design: LandingDesign) -> Markup:
    rows: list[list[Cell]] = [
        [
            str(one.pairs), number(one.speed, 3), amount(one.energy, "J", 3) if math.isfinite(one.energy) else MISSING,
            amount(one.recovered, "J", 3) if math.isfinite(one.recovered) else MISSING,
            ", ".join(number(level, 3) for level in one.signal.levels),
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
