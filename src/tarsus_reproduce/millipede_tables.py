"""The walking millipede: every trend of section 4.4.1 with ours, the curves behind it, and Fig. 4.7."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tarsus.measure import STANDSTILL
from tarsus.tables import Column, Section, Table, amount, spaced
from tarsus.tables.numbers import percent
from tarsus_reproduce.claims import DIRECTIONAL, FROM_REST, TRENDS, examples, of_episode
from tarsus_reproduce.interpretations import CHOICES, PERIODS, SEED, UNPRINTED, distribution, packaged_interpretations
from tarsus_reproduce.millipede import DeviceTrends, JudgedTrend, judge_devices
from tarsus_reproduce.reproduction import FigureCall, Progress, Reproduction
from tarsus_reproduce.trends import CRITERION, TrendVerdict

DRAWN_BY = "tarsus_reproduce.pages.millipede_figures"

FIGURES = {
    "millipede-electrostatics": ("Fig. 4.8: electrostatics", "C_e"),
    "millipede-film-nano": ("Fig. 4.9: squeeze film in nN m² s", "C_sfd"),
    "millipede-film-micro": ("Fig. 4.9: squeeze film in µN m² s", "C_sfd"),
    "millipede-adhesion": ("Fig. 4.10: growth of adhesion", "C_adh"),
    "millipede-payload": ("Fig. 4.11: payload", "mass of the body"),
}
"""Study -> what its figure shows and the symbol of what varies."""


def reproduce_millipede(
    devices: str | Sequence[str] | None = None, *, progress: Progress | None = None
) -> Reproduction:
    """Every trend of section 4.4.1 on devices, with a distribution of the score over what is not printed; arguments and
    errors as for `tarsus_reproduce.verb.reproduce` and `judge_devices`."""
    return millipede_reproduction(judge_devices(devices, progress=progress))


def millipede_reproduction(devices: Sequence[DeviceTrends]) -> Reproduction:
    """HasMeasures devices as tables, figures and files."""
    return Reproduction(
        name="millipede",
        title="The walking millipede",
        about="What section 4.4.1 of the dissertation says of its simulations (Figs. 4.7–4.11), and what ours do",
        rows=Table(
            TRENDS_TITLE, ROWS, [(device.name, *_row(device, one)) for device in devices for one in device.trends]
        ),
        sections=(
            Section("Trends", _scores(devices), _trends(devices)),
            _distribution(devices),
            Section("Over ground and payload", *_over(devices)),
            Section("Two grounds in time", *_walks(devices)),
        ),
        problems=tuple(problem for one in devices for problem in one.problems),
    )


TRENDS_TITLE = "Trends of section 4.4.1"
ROWS = (
    "variant",
    "figure",
    "quantity",
    "says",
    "directional",
    "scored",
    "measure",
    "motion",
    "unit",
    "verdict",
    "words",
    "first",
    "last",
    "least rho",
    "largest rho",
)
"""Columns of the CSV file."""


def _row(device: DeviceTrends, one: JudgedTrend) -> tuple[Any, ...]:
    """One trend by one measure."""
    trend, found = one.trend, one.finding
    return (
        trend.figure,
        trend.quantity,
        trend.says,
        trend.directional,
        one.of_figure and device.scores(trend),
        one.measure,
        str(one.motion),
        one.unit,
        found.verdict.value,
        found.words,
        found.first,
        found.last,
        min(found.rho, default=None),
        max(found.rho, default=None),
    )


def _scores(devices: Sequence[DeviceTrends]) -> Table:
    rows: list[tuple[Any, ...]] = []
    for device in devices:
        for one, motion in zip((device.score, device.lasting), device.motions, strict=True):
            if one is None:
                continue
            *counts, right, every = one.values()
            rows.append((device.name, motion, *counts, f"{right} of {every}"))
    drawn = packaged_interpretations()
    *means, last = (one["mean"] for one in distribution(drawn).values())
    mean = f"{len(drawn)} random interpretations, mean"
    rows.append((mean, OF_DRAWN, *means, f"{last:.1f} of {DIRECTIONAL}"))
    notes = [
        "From rest: by the measure of each figure, whose caption says maximum, in one run from the device's start. "
        "Settled: by the measure of a drive period that the words could mean as well, over the motions that last, "
        "means by their share of the starts. The film is in the device's own interpretation of its unit. Insensitive "
        "means that nothing changes over the printed range: that is about the device, not about the dissertation.",
        f"White noise nearly always has local extrema; the {DIRECTIONAL} directional trends, which it rarely has, are "
        "counted apart.",
        *(f"{device.name}: {device.about}." for device in devices),
    ]
    verdicts = (Column(one.value, digits=2) for one in TrendVerdict)
    columns = ("device", "measured over", *verdicts, "directional trends that agree")
    return Table("Score over 16 trends", columns, rows, notes)


def _trends(devices: Sequence[DeviceTrends]) -> Table:
    """Every trend by every measure that its words could mean: the verdict of each device and the reason."""
    found = [{(one.trend, one.measure): one for one in device.trends} for device in devices]
    rows, flagged = [], []
    for trend in TRENDS:
        for measure in trend.measures:
            first = measure == trend.measures[0]
            cells: list[str | None] = []
            for judged, device in zip(found, devices, strict=True):
                one = judged.get((trend, measure))
                if one is None:
                    cells.append(None)
                    continue
                finding = one.finding
                if finding.verdict is TrendVerdict.CONTRADICTS:
                    flagged.append((len(rows), 3 + len(cells)))
                ends = f"{_shown(finding.first, one.unit)} to {_shown(finding.last, one.unit)}"
                why = "not scored" if trend.film is None else "not this device's film unit"
                other = "" if device.scores(trend) else f"; {why}"
                cells.append(f"{finding.verdict.value}\n{finding.words}; {ends}{other}")
            said = f"{trend.quantity} {trend.says}" if first else ""
            over = "from rest" if of_episode(measure) else "settled"
            shown = f"{spaced(measure.removesuffix(FROM_REST))}{'' if first else ' *'}\n{over}"
            rows.append((trend.figure if first else "", said, shown, *cells))
    notes = (
        "The dissertation prints no numbers, only trends in words, and neither masses nor stiffness of its model: the "
        "devices are interpretations of it, none is the device. Each trend is judged on the measure of its figure and "
        "on others (*) that its words could mean; captions say maximum, so heights, travel and contact are those of "
        "a whole run from rest, and every rebound counts, however low. Measures of a drive period are of the settled "
        f"motion ({_of_settled(devices)}). Replicates are the restitutions of Table 4.2. 'Much greater' is taken as at "
        "least twice; that electrostatics cause it contradicts Fig. 4.8, by which attraction lowers the amplitude "
        "(erratum E15).",
        CRITERION,
    )
    columns = ("Fig.", "the source says", "measure", *(device.name for device in devices))
    return Table(TRENDS_TITLE, columns, rows, notes, flagged=flagged)


OF_DRAWN = f"from rest, {PERIODS} periods"
"""What random interpretations are measured over."""


def _of_settled(devices: Sequence[DeviceTrends]) -> str:
    """What settled motions are, and how many of the runs had settled."""
    shares = ", ".join(
        f"{device.name} {percent(float(np.mean(own)))}"
        for device in devices
        if (own := [one.settled for one in device.swept if one.settled is not None])
    )
    return f"{devices[0].motions[1]}; of the starts so many repeat: {shares}" if shares else "not judged"


def _shown(value: float, unit: str) -> str:
    """A value for reading; lengths of rounding are 0."""
    return amount(_still(value) if unit == "m" else value, unit, 3)


def _distribution(devices: Sequence[DeviceTrends]) -> Section:
    drawn = packaged_interpretations()
    most = distribution(drawn)["agree"]["quantile_95"]
    notes = [
        f"{len(drawn)} interpretations drawn from the ranges below (seed {SEED}), {len(drawn)} of which could "
        "be run; what is printed stays as printed. They are the honest score of the model: a named device far to the "
        "right was found by choosing, not by luck. They are judged on fewer values and three restitutions, which makes "
        f"agreement a little easier. 95 % of them agree with at most {most:g} of 16."
    ]
    ranges = [(one.name, (one.low, one.high), one.meaning) for one in UNPRINTED]
    return Section(
        "Random interpretations of what is not printed",
        FigureCall(f"{DRAWN_BY}.interpretations_figure", drawn, devices),
        Table(
            "Numbers that are not printed",
            ("number", Column("from, to", "row", 3), "because"),
            ranges,
            notes,
            units=[one.unit or "1" for one in UNPRINTED],
        ),
        Table(
            "Choices that are not stated",
            ("choice", "one of", "because"),
            [(one["name"], " or ".join(one["options"]), one["why"]) for one in CHOICES],
        ),
    )


def _over(devices: Sequence[DeviceTrends]) -> list[FigureCall]:
    """A figure for every study that was run."""
    drawn = []
    for study, (title, symbol) in FIGURES.items():
        curves = [(device.name, one) for device in devices for one in device.swept if one.study == study]
        if curves:
            drawn.append(FigureCall(f"{DRAWN_BY}.swept_figure", curves, title, symbol))
    return drawn


def _walks(devices: Sequence[DeviceTrends]) -> list[FigureCall]:
    return [FigureCall(f"{DRAWN_BY}.walks_figure", one.scene, examples(one.film), one.name) for one in devices]


def _still(length: float) -> float:
    """A length [m], 0 where it is rounding."""
    return 0.0 if abs(length) < STANDSTILL else length
