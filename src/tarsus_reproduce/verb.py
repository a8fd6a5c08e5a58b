"""The verb `reproduce`: experiments of the dissertation with what Tarsus computes of them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.verb import verb
from tarsus.files.library import load_scene
from tarsus_reproduce.packaged import PAGE_FILES, Experiment, experiments

if TYPE_CHECKING:
    from tarsus.base.progress import Progress
    from tarsus_reproduce.index import Reproductions
    from tarsus_reproduce.reproduction import Reproduction

MOST_SEEDS = 10_000
"""More initial states than that narrow no interval by a hundredth and take hours."""
ROBOTS = ("hexapod", "quadruped")
EXPERIMENTS_OF = {"rows": ("cantilever", *ROBOTS), "seeds": ROBOTS}
"""Options that only some experiments have."""
FILES = ("index.html", *PAGE_FILES, *(f"*/{name}" for name in PAGE_FILES))
"""What the output folder may hold of one experiment or several, as glob patterns."""


@verb
def reproduce(
    *experiment: str,
    all: bool = False,
    device: str | None = None,
    rows: str | os.PathLike[str] | None = None,
    seeds: int | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> Reproduction | Reproductions:
    """Compare with experiments of the dissertation row by row, then summarise; of several, write pages with an index.

    Parameters
    ----------
    experiment
        cantilever: the micro-cantilever under periodic drive (Table A.1); cantilever-1: with the device fitted to the
        dissertation's model. hexapod, quadruped: the bouncing foot of a bulk PZT robot (Table 3.2), its modes and
        impact laws, and its motion in the air. millipede: the trends that are seen in its simulations of walking
        (Figs. 4.7-4.11).
    all
        Every experiment into a folder of its own below the output folder, with an index.
    device
        The device that is simulated, with the points of the packaged one; when left out the packaged one, or the
        weighted ensemble of its calibration, and for the millipede all packaged variants.
    rows
        A file of further rows in the format of the packaged table; they are predicted, never fitted.
    seeds
        Random initial states of every row of a robot, 32 when left out.
    output
        Folder for reproduction.html, reproduction.json and reproduction.csv; of several a folder each, with an index.
    progress
        Called as ``progress(done, total, what)``.

    Returns
    -------
    Reproduction or Reproductions
        Rows with `table()`, `to_dict()` and `write(folder)`.

    Raises
    ------
    InputError
        With everything that does not go together, for unknown names and devices that lack what is looked at, and bad
        rows files.
    """
    from tarsus_reproduce.index import Reproductions

    known = experiments()
    names = tuple(known) if all else tuple(dict.fromkeys(experiment))
    several = all or len(names) > 1
    given = {"device": device, "rows": rows, "seeds": seeds}
    asked = {option: value for option, value in given.items() if value is not None}
    problems = [f"there is no experiment '{name}'{nearest(name, known)}" for name in names if name not in known]
    problems += _together(experiment, all, output is None, asked if several else ())
    for name in () if several or problems else names:
        problems += _not_of(known[name].experiment, asked)
    if seeds is not None and not 1 <= seeds <= MOST_SEEDS:
        problems.append(f"seeds: expected a number from 1 to {MOST_SEEDS}, got {seeds}")
    if problems:
        raise InputError(problems)
    found: dict[str, Reproduction] = {}
    for name in names:
        one = known[name]
        own = {option: value for option, value in asked.items() if one.experiment in EXPERIMENTS_OF.get(option, ())}
        found[name] = _run(one, device)(device or one.device, **own, progress=progress)
        if output is not None:
            found[name].write(Path(output, name) if several else Path(output))
    if not several:
        return next(iter(found.values()))
    made = Reproductions(found)
    if output is not None:
        made.write_index(Path(output))
    return made


def _run(one: Experiment, device: str | None) -> Callable[..., Reproduction]:
    """The function of an experiment. Raises InputError where the device is none of it."""
    if one.experiment == "millipede":
        from tarsus_reproduce.millipede_tables import reproduce_millipede

        return reproduce_millipede
    if device is not None:
        _check_points(one.experiment, device)
    if one.experiment == "cantilever":
        from tarsus_reproduce.cantilever import reproduce_cantilever

        return reproduce_cantilever
    from tarsus_reproduce.robot_tables import reproduce_robot

    return partial(reproduce_robot, one.experiment)


def _together(experiment: Sequence[str], all: bool, nowhere: bool, asked: Iterable[str]) -> list[str]:
    """What is wrong with the words together; asked: options that are given with several experiments."""
    found = []
    if all and experiment:
        found.append(f"--all makes every page: leave '{experiment[0]}' out")
    if not (all or experiment):
        found.append(f"name an experiment ({', '.join(experiments())}), or give --all")
    if nowhere and (all or len(set(experiment)) > 1):
        found.append("pages of several experiments need a folder: give it with -o")
    alone = [option for option in asked if option in ("device", "rows")]
    return found + [f"--{option} belongs to one experiment: not with several" for option in alone]


def _not_of(experiment: str, asked: Mapping[str, Any]) -> list[str]:
    """Options that are of other experiments, a sentence each."""
    return [
        f"{option}: is of {' and '.join(EXPERIMENTS_OF[option])}, not of {experiment}"
        for option in asked
        if experiment not in EXPERIMENTS_OF.get(option, (experiment,))
    ]


def _check_points(experiment: str, device: str) -> None:
    """Raise InputError where a device lacks points that were looked at in an experiment."""
    own, other = (load_scene(one).robot.structure.points for one in (experiment, device))
    missing = [point for point in own if point not in other]
    if missing:
        raise InputError(
            f"device: '{device}' has no point {', '.join(map(repr, missing))}, which `reproduce {experiment}` looks "
            "at: it is no device of this experiment"
        )
