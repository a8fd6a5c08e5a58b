"""`tarsus reproduce`: the dissertation's experiments row by row: its model, the measurement, ours."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Annotated, Literal

from tarsus.cli.options import FLAG, Json, MaybeFolder, MaybeSeed, Overwrite, Resume, Threads

MOST_SEEDS = 10_000
"""More initial states than that tell nothing more and take hours."""

MOST_READINGS = 100_000
"""More readings than that take days."""


def reproduce(
    experiment: Literal["cantilever", "hexapod", "quadruped", "millipede"] | None = None,
    /,
    *,
    all: Annotated[bool, FLAG] = False,
    device: str | None = None,
    rows: Path | None = None,
    seeds: int | None = None,
    readings: int = 0,
    scatter: int = 0,
    seed: MaybeSeed = None,
    threads: Threads = None,
    output: MaybeFolder = None,
    resume: Resume = False,
    overwrite: Overwrite = False,
    json: Json = False,
) -> int:
    """Compare with an experiment of the dissertation row by row, then summarise; or make all pages.

    Parameters
    ----------
    experiment
        cantilever: the micro-cantilever under periodic drive (Table A.1). hexapod, quadruped: the bouncing foot of a
        bulk PZT robot (Table 3.2), its modes and impact maps, and its motion in the air. millipede: the trends that are
        seen in its simulations of walking (Figs. 4.7-4.11).
    all
        every experiment into a folder of its own below the output folder, with an index.
    device
        the device that is simulated, with the points of the packaged one; the packaged one of the experiment's name
        when left out, for the millipede all packaged variants.
    rows
        a file of further rows in the format of the packaged table; they are predicted, never fitted.
    seeds
        random initial states of every row of a robot, 32 when left out.
    readings
        for the millipede: the score over so many random readings of what is not printed, kept in the output folder and
        continued there with --resume; left out, those that come with the package.
    scatter
        for the millipede: the range of every variant's score over so many neighbours whose unprinted numbers are off by
        up to 10 %.
    output
        folder for reproduction.html, reproduction.json and reproduction.csv.
    """
    from tarsus.base.errors import InputError
    from tarsus.cli import console
    from tarsus_reproduce.cli import cantilever, everything, millipede, robot

    drawn = max(readings, scatter)
    problems = _problems(experiment, all, device, rows, seeds, drawn, seed, output)
    if min(readings, scatter) < 0 or drawn > MOST_READINGS:
        problems.append(f"--readings, --scatter: expected numbers from 0 to {MOST_READINGS}")
    if resume and overwrite:
        problems.append(
            "--resume continues what the folder holds and --overwrite begins again: give one of them"
        )
    if not problems and device is not None and experiment in ("cantilever", "hexapod", "quadruped"):
        problems += _lacking(experiment, device)
    if problems:
        raise InputError(problems)
    kept = console.resumable() if readings and output is not None else contextlib.nullcontext()
    with kept, _folder(output, whole=all, overwrite=overwrite, resume=resume):
        asked = millipede.Asked(readings, scatter, 1 if seed is None else seed, threads)
        if all:
            assert output is not None
            return everything.run(output, seeds, asked, json=json)
        if experiment == "cantilever":
            return cantilever.run(device, rows, output, json=json)
        if experiment == "millipede":
            return millipede.run(device, output, asked, json=json)
        assert experiment is not None
        return robot.run(experiment, device, rows, seeds, output, json=json)


def _lacking(experiment: str, device: str) -> list[str]:
    """What a device lacks for being compared with an experiment: the points that were looked at there."""
    from tarsus.files.library import load_scene

    own = load_scene(experiment).robot.structure.points
    missing = [point for point in own if point not in load_scene(device).robot.structure.points]
    if not missing:
        return []
    return [
        f"--device: '{device}' has no point {', '.join(map(repr, missing))}, which `reproduce {experiment}` looks at: "
        "it is no device of this experiment"
    ]


def _folder(
    output: Path | None, *, whole: bool, overwrite: bool, resume: bool
) -> contextlib.AbstractContextManager[object]:
    """The output folder under the rule that all verbs share; nothing where none is written."""
    from tarsus.files.output import OutputFolder
    from tarsus_reproduce.cli.outputs import FILES

    if output is None:
        return contextlib.nullcontext()
    files = ("index.html", *(f"*/{name}" for name in FILES)) if whole else FILES
    return OutputFolder(output, "reproduce", files, overwrite, resumable=True).writing(resume=resume)


def _problems(
    experiment: str | None,
    everything: bool,
    device: str | None,
    rows: Path | None,
    seeds: int | None,
    drawn: int,
    seed: int | None,
    output: Path | None,
) -> list[str]:
    """What is wrong with the words together."""
    found = []
    if everything:
        if experiment is not None:
            found.append(f"--all makes every page: leave '{experiment}' out")
        if output is None:
            found.append("--all writes pages: give their folder with -o")
        found += [
            f"{name} belongs to one experiment: not with --all"
            for name, value in (("--device", device), ("--rows", rows))
            if value is not None
        ]
    elif experiment is None:
        found.append("name an experiment (cantilever, hexapod, quadruped or millipede), or give --all")
    if seeds is not None and experiment in ("cantilever", "millipede"):
        found.append(f"--seeds: the {experiment} has one start; only the robots have seeds")
    if rows is not None and experiment == "millipede":
        found.append("--rows: no table is printed for the millipede, only trends in words")
    if (drawn or seed is not None) and not everything and experiment not in (None, "millipede"):
        found.append("--readings, --scatter and --seed are of the millipede")
    elif seed is not None and not drawn:
        found.append("--seed: is the seed of --readings and --scatter, which are not given")
    if seeds is not None and not 1 <= seeds <= MOST_SEEDS:
        found.append(f"--seeds: expected a number from 1 to {MOST_SEEDS}, got {seeds}")
    return found
