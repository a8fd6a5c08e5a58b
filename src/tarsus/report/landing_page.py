"""The report of a landing design: the picture, the switching times, the grounds, and why to believe it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tarsus.base.spec import float_paths
from tarsus.design.energy import energy_of
from tarsus.design.headers import digest, header_text
from tarsus.design.learning import Sensor
from tarsus.report import landing_figures
from tarsus.report.pages import Markup, Section, sections_page
from tarsus.tables.numbers import amount, number
from tarsus.tables.table import ROW, Column, Table

if TYPE_CHECKING:
    from tarsus.design.landing_design import LandingDesign
    from tarsus.design.learning import Learning


def landing_html(design: LandingDesign) -> str:
    """The page of a result, as text."""
    request, pair = design.request, landing_figures.DesignPair(design)
    parts = [
        Section("Before and after", landing_figures.picture(pair), landing_figures.landing_zoom(pair)),
        Section("What changes", _compared(design), _unpriced(design)),
        Section("The signal", _signal(design), _rounding(design)),
        Section("Grounds", _judged(design), landing_figures.on_grounds(design), _grounds(design))
        if len(design.grounds) > 1
        else None,
        Section("What one percent costs", _percents(design), design.percents.table()),
        None
        if design.learning is None
        else Section("Learning on hidden grounds", _learned(design.learning), landing_figures.learning(design)),
        Section("landing.h", Markup('<pre tabindex="0">{}</pre>').format(header_text(design))),
    ]
    footer = (
        f"{design.found.candidates} signals, {design.found.runs} runs; {request.motion}. "
        f"Digest {digest(design.signal)}."
    )
    title = f"Soft landing: {request.scene.name}, foot {design.train.foot}"
    return sections_page(title, [_about(design)], parts, footer, head=f"{request.scene.name} – soft landing")


def _about(design: LandingDesign) -> str:
    """What came of it, in a few sentences."""
    told = (
        f"The plain step strikes at {amount(design.before.speed[0, 0], 'm/s', 3)} with "
        f"{number(design.before.touchdowns[0, 0], 3)} touchdowns a step; the design at "
        f"{amount(design.speed, 'm/s', 3)} with {number(design.touchdowns, 3)}. Every touchdown of the whole period "
        f"counts; from period to period the motion {design.found.robust.motion.words}. Volts are {design.volts}."
    )
    if len(design.put_down):
        told += f" From other starts, {design.as_stated[0]} of {len(design.put_down)} settle to touchdowns no harder."
    if math.isfinite(design.worst):
        told += f" On the worst ground found it strikes at {amount(design.worst, 'm/s', 3)}."
    return told


def _unpriced(design: LandingDesign) -> str:
    if math.isfinite(design.energies[0]):
        return ""
    return f"The drive {design.train.drive} has no capacitance, so its energy is not known."


def _rounding(design: LandingDesign) -> str:
    """What a timer is asked for."""
    tick = amount(design.train.step.period / design.train.ticks, "s")
    return f"Times count from the landing edge, in ticks of {tick}; the period has {design.train.ticks} of them."


def _judged(design: LandingDesign) -> str:
    """By which grounds, and what was found against them."""
    told = [f"Judged by the {design.request.risk.name} of {len(design.grounds)} grounds."]
    if design.found.rounds:
        last, count = design.found.rounds[-1], len(design.found.rounds)
        found = f"a ground {number(100 * last.gap, 2)} % worse" if last.gap > 1e-3 else "no ground worse"
        told.append(
            f"Cutting planes took {'one round' if count == 1 else f'{count} rounds'}; the last found {found} than the "
            f"{last.grounds} of the search."
        )
    if design.found.certificate is not None:
        looked = design.found.certificate
        told.append(f"Of {looked.grounds} grounds drawn at the end {looked.worse} were more than 2 % worse than known.")
    if math.isfinite(design.nominal_worst):
        told.append(
            f"The design for the nominal ground alone strikes at {amount(design.nominal_worst, 'm/s', 3)} on its worst "
            f"ground, {number(design.nominal_worst / design.worst, 2)} times as hard."
        )
    return " ".join(told)


def _percents(design: LandingDesign) -> str:
    """What the table of percents is."""
    over = design.request.over
    bears = (
        f"The design bears {', '.join(over.names)}, as far as the table of grounds says. "
        if over is not None and math.isfinite(design.worst)
        else ""
    )
    return (
        f"{bears}Each number alone, on the scene's own ground: what a percent more adds to the hardest touchdown, with "
        "its error, and the hardest within a percent to either side. With all of them moved "
        f"at once by up to a percent the hardest is {amount(design.percents.box, 'm/s', 3)}."
    )


def _learned(found: Learning) -> str:
    """How fast the learners learnt."""
    sensed = "how hard each step struck" if found.sensor is Sensor.SPEED else "whether the contact had closed"
    return (
        f"Given only {sensed}, {number(100 * found.halved, 3)} % of {len(found.grounds)} learners struck with at most "
        "half the plain step's speed within ten steps."
    )


def _compared(design: LandingDesign) -> Table:
    names = (
        ("hardest touchdown", "speed", "m/s"),
        ("touchdowns a step", "touchdowns", "1"),
        ("largest impulse", "impulse", "N s"),
        ("contact a period", "contact", "s"),
        ("highest gap", "peak", "m"),
        ("mean gap in the air", "lifted", "m"),
    )
    rows = [
        (title, *(getattr(one, name)[0, 0] for one in (design.before, design.after)), unit)
        for title, name, unit in names
    ]
    for title, before, after in zip(
        ("energy a period, plain on-off", "energy a period, charge recovered"),
        energy_of(design.request.scene.robot.drives[design.train.drive], design.plain_signal),
        design.energies,
        strict=True,
    ):
        rows.append((title, before, after, "J"))
    columns = ("", Column("before", ROW), Column("after", ROW))
    return Table("", columns, [row[:3] for row in rows], units=[row[3] for row in rows])


def _signal(design: LandingDesign) -> Table:
    tick = design.train.step.period / design.train.ticks
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
    return Table("", (*(Column(p, known[p].unit) for p in paths), *speeds), list(zip(*values, *found, strict=True)))
