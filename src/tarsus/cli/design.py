"""`tarsus design`: what a description or a signal should be, given what it should do."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import App, Parameter

from tarsus.cli import design_gait
from tarsus.cli.options import (
    HERE,
    PAGES,
    UNCHANGED,
    Changes,
    Folder,
    Grounds,
    Many,
    Pages,
    Risk,
    Seed,
    Work,
    at_least,
)

design = App(name="design", help="What a description or a signal should be, given what it should do.")
design.command(design_gait.gait)
design.command(design_gait.adapt)


@design.command
def landing(
    scene: str,
    /,
    *,
    foot: str,
    output: Folder,
    pairs: Annotated[int, at_least(0)] = 1,
    levels: Annotated[str, Parameter(allow_leading_hyphen=True)] = "-8 V, 8 V",
    over: Grounds = None,
    risk: Risk = None,
    objective: str = "speed",
    drive: str | None = None,
    free: Many = None,
    tick: str = "1 us",
    shortest: str = "10 us",
    ringing: str | None = None,
    learn: Annotated[int, at_least(0)] = 0,
    sensor: str = "speed",
    effort: float = 1.0,
    seed: Seed = 0,
    changes: Changes = UNCHANGED,
    work: Work = HERE,
    pages: Pages = PAGES,
) -> int:
    """Find on-off switching times with which a foot touches down softly, every touchdown of the period counted.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file; its signal gives the period, and the share of it on the ground.
    foot
        name of the foot.
    output
        folder for landing.json, signal.toml, scene.toml, landing.h, scenarios.csv and report.html.
    pairs
        pairs of switchings beside the step's two edges, at most.
    levels
        voltages, e.g. "-8 V, 8 V", or free=-8V:8V for any between; the lowest and the highest are held.
    objective
        speed, impulse or touchdowns.
    drive
        whose volts are designed; the only one when left out.
    free
        path of a switching time that may move, of a scene whose signal is on-off already; no others do, then; may be
        repeated.
    tick
        of the timer that edges are rounded to.
    shortest
        time that a level lasts at least.
    ringing
        greatest overshoot after release over the mean gap in the air, e.g. "20 %".
    learn
        steps in which the landing is learned again on hidden grounds, without a model; 0 for none.
    sensor
        what the learner is told: speed (a scalar) or contact (one bit).
    effort
        factor on the length of the search.
    """
    from tarsus.cli import console, requests
    from tarsus.design.landing_files import LANDING_FILES, landing_table, write_landing
    from tarsus.design.soft_landing import landing as made

    options = _options(objective, sensor, tick, shortest, ringing)
    grounds = requests.grounds_of(over or ())
    the_scene = changes.scene(scene)
    target = pages.target(output, "design landing", LANDING_FILES)
    with console.progress_bar("design") as progress, work.workers() as workers:
        found = made(
            the_scene, foot, pairs=pairs, levels=levels, over=grounds, risk=risk, learn=learn, progress=progress,
            drive=drive, free=tuple(free or ()), seed=seed, effort=effort, threads=workers, **options,
        )  # fmt: skip
    with target.writing() as folder:
        write_landing(found, folder)
        if pages.report:
            from tarsus.report.landing_page import write_landing_report

            write_landing_report(found, folder / "report.html")
    table = landing_table(found)
    if pages.json:
        console.print_json(table)
    else:
        _show(table)
        console.wrote([folder])
    return 0


def _options(objective: str, sensor: str, tick: str, shortest: str, ringing: str | None) -> dict[str, Any]:
    from tarsus.base.errors import InputError
    from tarsus.cli import requests
    from tarsus.design.request import members

    problems: list[str] = []
    found: dict[str, Any] = {}
    quantities = {"tick": (tick, "s"), "shortest": (shortest, "s"), "ringing": (ringing, "1")}
    for read in (
        lambda: members({"objective": objective, "sensor": sensor}, "--"),
        lambda: requests.quantities_of(**quantities),
    ):
        try:
            found |= read()
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return found


def _show(table: dict[str, Any]) -> None:
    from tarsus.cli import console

    rows = [
        (str(i), f"{time * 1e6:.6g}", f"{level:.5g}", f"{span * 1e6:.6g}")
        for i, (time, level, span) in enumerate(
            zip(table["switching_times"], table["levels"], table["durations"], strict=True)
        )
    ]
    console.table(("switching", "time (us)", "level (V)", "lasts (us)"), rows)
    plain = table["plain"]
    print(f"\nplain step: {plain['speed']:.4g} m/s, {plain['touchdowns']:g} touchdowns a step")
    print(
        f"designed:   {table['speed']:.4g} m/s, {table['touchdowns']:g} touchdowns a step, {table['regime']}"
    )
    if table["worst"] == table["worst"]:
        print(f"worst:      {table['worst']:.4g} m/s on {len(table['scenarios'])} grounds"
              + (f", {table['worst_ground']['tried']} looked at" if table["worst_ground"] else "")
              + f"; the nominal design's worst {table['nominal_worst']:.4g} m/s")  # fmt: skip
    if table["energy"] == table["energy"]:
        print(
            f"energy:     {table['energy']:.4g} J a period, {table['energy_recovered']:.4g} J with charge recovery"
        )
