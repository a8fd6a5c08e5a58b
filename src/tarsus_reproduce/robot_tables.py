"""A bulk PZT robot compared with chapter 3 of the dissertation: rows of Table 3.2, motion, modes and impact laws."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tarsus.calibrate.compared import numbers_table
from tarsus.files.library import load_scene
from tarsus.model.impact_energy import creation_warning
from tarsus.model.scene import Scene
from tarsus.tables import Column, Section, Table
from tarsus_reproduce.compared import ComparedTable
from tarsus_reproduce.impacts import energies_table, impact_energies, maps_table, modes_table
from tarsus_reproduce.reproduction import FigureCall, Progress, Reproduction
from tarsus_reproduce.robot_runs import AIR_GAP, RobotRun, check_device, robot_runs
from tarsus_reproduce.robots import MEAN_HEIGHT, OBSERVED, SEEDS, SETTLE, WINDOW, drive_frequency, robot_table

DRAWN_BY = "tarsus_reproduce.pages.robot_figures"

MOTION = "Every run is one of many: motion with bounces forgets its start within a few impacts."

FOOTER = (
    "A bounce is a rebound whose apex clears the resolution of the published measurements, 0.1 µm; peak is the highest "
    "clearance of the foot in a drive period, mean over the periods, and mean height its clearance averaged over time."
)


def reproduce_robot(
    robot: str,
    device: str | None = None,
    rows: str | Path | None = None,
    *,
    seeds: int = SEEDS,
    progress: Progress | None = None,
) -> Reproduction:
    """A robot compared with Table 3.2, with single runs over the ground and in the air; parameters and errors as for
    `tarsus_reproduce.robots.robot_table`. The single runs are of the named device, or of the packaged one."""
    name = device or robot
    scene = load_scene(name)
    check_device(scene, name)
    found = robot_table(robot, device, rows, seeds=seeds, progress=progress)
    near, air = robot_runs(robot, scene, progress)
    struck = near[min(1, len(near) - 1)]  # the second row, a square wave
    caution = creation_warning(scene)
    stopped = (f"{one.title}: {one.run.code.value}" for one in (*near, *air) if not one.run.ok)
    return Reproduction(
        name=robot,
        title=f"The {robot} on its bouncing foot",
        about=f"Device {found.device}",
        rows=numbers_table("Table 3.2, row by row", found.numbers, repeated=True),
        sections=(
            _heights(robot, found),
            _moving("Motion over the ground", near, _sentence(MOTION)),
            _moving("Motion in the air", air[-1:], _steady_table(air)),
            _modes(robot, scene),
            _maps(robot, scene, struck),
        ),
        problems=(*found.problems, *stopped),
        cautions=() if caution is None else (caution,),
        footer=FOOTER,
    )


def _heights(robot: str, found: ComparedTable) -> Section:
    if not found.printed:
        nothing = f"The source prints no table of heights for the {robot}."
        return Section("Heights and bounces", _sentence(nothing))
    notes = [
        f"Every number of ours is the median over windows of {1e3 * WINDOW:g} ms, as the table's counts in multiples "
        f"of 20 suggest. There are {found.runs} runs from random initial states; the interval holds 80 % of the "
        f"windows. {SETTLE:g} s are dropped and {OBSERVED:g} s observed. Mean height is taken as {MEAN_HEIGHT}."
    ]
    caption = (
        "Bounces, peak and mean height of the bouncing foot: measured, by the dissertation's model, and by this one. "
        "Marks are medians over the windows of all seeds, lines hold 80 % of the windows; where a mark is missing "
        "nothing was measured."
    )
    return found.section("Table 3.2", notes, caption)


def _sentence(words: str) -> Table:
    """What stands in place of a table."""
    return Table("", (), (), (words,))


def _moving(title: str, runs: Sequence[RobotRun], table: Table) -> Section:
    """Motion over the last periods, and by drive period, of every run; a table below."""
    from tarsus.report.pages import Fold

    pairs = [[FigureCall(f"{DRAWN_BY}.{name}", one) for name in ("motion", "by_period")] for one in runs if one.run.ok]
    return Section(title, *pairs[:1], Fold("The other runs", *pairs[1:]) if pairs[1:] else None, table)


def _steady_table(air: Sequence[RobotRun]) -> Table:
    rows = [
        (one.title, drive_frequency(one.run.scene), point, float(size))
        for one in air
        if one.run.ok
        for point, size in zip(one.points, one.peak_to_peak, strict=True)
    ]
    note = (
        f"The foot hangs {100 * AIR_GAP:g} cm above the ground, so that nothing touches, and moves as far as the volts "
        "say. The source shows these as figures only, without numbers to compare with."
    )
    columns = ("drive", Column("frequency", "Hz"), "point", Column("peak to peak", "m"))
    return Table("Steady motion in the air", columns, rows, (note,))


def _modes(robot: str, scene: Scene) -> Section:
    title, table = "Modes and the printed impact matrix", modes_table(scene, robot)
    if table is None:
        nothing = "The device's points are not those of the printed matrix, so no mode can be compared."
        return Section(title, _sentence(nothing))
    return Section(title, FigureCall(f"{DRAWN_BY}.mode_shapes", table, scene.robot.structure.points), table)


def _maps(robot: str, scene: Scene, struck: RobotRun) -> Section:
    laws, energies = maps_table(scene, robot), impact_energies(struck.run, robot)
    impacts = len(energies["as run"])
    if struck.run.ok and impacts:
        return Section("Impact maps", laws, energies_table(energies, f"{impacts} impacts at {struck.title}"))
    why = "did not come to its end" if not struck.run.ok else "has no impact"
    return Section("Impact maps", laws, _sentence(f"The run at {struck.title} {why}."))
