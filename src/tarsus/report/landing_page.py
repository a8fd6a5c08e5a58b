"""The report of a landing design: the picture, the switching times, the grounds, and why to believe it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tarsus.base.spec import float_paths
from tarsus.design.energy import energy_of
from tarsus.design.headers import digest, header_text
from tarsus.design.landing_request import Sensor
from tarsus.report import landing_figures
from tarsus.report.pages import page, rendered
from tarsus.tables.numbers import number
from tarsus.tables.table import ROW, Column, Table

if TYPE_CHECKING:
    from tarsus.design.landing_design import LandingDesign


def landing_html(design: LandingDesign) -> str:
    """The page of a result, as text."""
    request, learning = design.request, design.learning
    pair = landing_figures.DesignPair(design)
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
        digest=digest(design.signal), percents=design.percents.table(),
    )  # fmt: skip
    return page(f"{request.scene.name} – soft landing", body)


def _compared(design: LandingDesign) -> Table:
    names = (
        ("hardest touchdown", "speed", "m/s"), ("touchdowns a step", "touchdowns", "1"),
        ("largest impulse", "impulse", "N s"),
        ("contact a period", "contact", "s"), ("highest gap", "peak", "m"), ("mean gap in the air", "lifted", "m"),
    )  # fmt: skip
    rows = [
        (title, *(getattr(one, name)[0, 0] for one in (design.before, design.after)), unit)
        for title, name, unit in names
    ]
    for title, before, after in zip(
        ("energy a period, plain on-off", "energy a period, charge recovered"),
        energy_of(design.request.actuator, design.plain_signal), design.energies, strict=True,
    ):  # fmt: skip
        rows.append((title, before, after, "J"))
    columns = ("", Column("before", ROW), Column("after", ROW))
    return Table("", columns, [row[:3] for row in rows], units=[row[3] for row in rows])


def _signal(design: LandingDesign) -> Table:
    tick = design.request.step.period / design.request.ticks
    steps = zip(design.switching_times, design.signal.levels, design.signal.durations, strict=True)
    columns = ("switching", "tick", Column("time", "s", 6), Column("level", "V", 5), Column("lasts", "s", 6))
    rows = [(i, round(time / tick), time, level, span) for i, (time, level, span) in enumerate(steps)]
    return Table("", columns, rows)


def _grounds(design: LandingDesign) -> Table:
    known = float_paths(design.request.scene)
    paths, values = list(design.grounds.values), design.grounds.values.values()
    after = design.on_grounds
    speeds = (Column("before", "m/s", 3), Column("after", "m/s", 3), Column("touchdowns", digits=3))
    found = (design.before_on_grounds.speed[0], after.speed[0], after.touchdowns[0])
    return Table(
        "", (*(Column(p, known[p].unit) for p in paths), *speeds), list(zip(*values, *found, strict=True))
    )


def _front(design: LandingDesign) -> Table:
    rows = [
        (
            one.pairs,
            one.speed,
            one.energy,
            one.recovered,
            ", ".join(number(level, 3) for level in one.signal.levels),
        )
        for one in design.front
    ]
    columns = (
        "pairs",
        Column("speed", "m/s", 3),
        Column("energy", "J", 3),
        Column("recovered", "J", 3),
        "levels (V)",
    )
    return Table("", columns, rows)
