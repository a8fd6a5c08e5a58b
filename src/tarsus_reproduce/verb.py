"""The verb `reproduce`: an experiment of the dissertation beside what Tarsus computes of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.files.library import load_scene
from tarsus_reproduce.packaged import data_table

if TYPE_CHECKING:
    from tarsus_reproduce.reproduction import Progress, Reproduction


MOST = {"seeds": 10_000, "readings": 100_000}
"""More initial states than that narrow no interval by a hundredth and take hours; more interpretations take half a day
on a processor."""
ROBOTS = ("hexapod", "quadruped")
EXPERIMENTS_OF = {"rows": ("cantilever", *ROBOTS), "seeds": ROBOTS, "readings": ("millipede",), "seed": ("millipede",)}
"""Options that only some experiments have."""


@dataclass(frozen=True)
class Experiment:
    """A page: the experiment it is of, with which device (None: the packaged one), and what cannot be matched whatever
    the device."""

    name: str
    title: str
    experiment: str
    unmatched: tuple[str, ...]
    device: str | None = None


@lru_cache
def experiments() -> dict[str, Experiment]:
    """All experiments by name, in the order of the chapters (`data/experiments.toml`)."""
    return {
        name: Experiment(name, **{**table, "unmatched": tuple(table["unmatched"])})
        for name, table in data_table("experiments.toml").items()
    }


def options_of(name: str) -> tuple[str, ...]:
    """Arguments of `reproduce` that an experiment takes beside a device and rows."""
    experiment = experiments()[name].experiment
    return tuple(option for option, of in EXPERIMENTS_OF.items() if experiment in of and option != "rows")


def reproduce(
    name: str,
    *,
    device: str | None = None,
    rows: str | Path | None = None,
    seeds: int | None = None,
    readings: int = 0,
    seed: int | None = None,
    threads: int | None = None,
    folder: str | Path | None = None,
    progress: Progress | None = None,
) -> Reproduction:
    """Compare with an experiment of the dissertation row by row.

    Parameters
    ----------
    name
        ``"cantilever"``: the micro-cantilever under periodic drive (Table A.1); ``"cantilever-1"``: the same with the
        device fitted to the source's model. ``"hexapod"``, ``"quadruped"``: the bouncing foot of a bulk PZT robot
        (Table 3.2), its modes and impact laws, and its motion in the air. ``"millipede"``: the trends that are seen in
        its simulations of walking (Figs. 4.7-4.11).
    device
        Name or file of the device, with the points of the packaged one; the packaged one, or the weighted ensemble of
        its calibration, when absent; for the millipede all packaged variants.
    rows
        A file of further rows in the format of the packaged table; they are predicted, never fitted.
    seeds
        Random initial states of every row of a robot, 32 when absent.
    readings
        For the millipede: the score over so many random interpretations of what is not printed; those that come with
        the package when 0.
    seed
        Of the readings; 1 when absent.
    threads
        Interpretations that are judged at a time; by default one for each processor that this process may use.
    folder
        Where finished interpretations are kept, and read back.
    progress
        Called as ``progress(done, total, what)``.

    Returns
    -------
    Reproduction
        Rows with `table()`, `to_dict()` and `write(folder)`.

    Raises
    ------
    InputError
        With everything that does not go together, for unknown names and devices that lack what is looked at, and bad
        rows files.
    """
    known = experiments()
    if name not in known:
        raise InputError(f"there is no experiment '{name}'{nearest(name, known)}")
    one = known[name]
    asked = {"rows": rows, "seeds": seeds, "readings": readings or None, "seed": seed}
    problems = _problems(one.experiment, {option: value for option, value in asked.items() if value is not None})
    chosen = device or one.device
    if not problems and device is not None and one.experiment != "millipede":
        problems += _lacking(one.experiment, device)
    if problems:
        raise InputError(problems)
    if one.experiment == "cantilever":
        from tarsus_reproduce.cantilever import reproduce_cantilever

        return reproduce_cantilever(chosen, rows, progress)
    if one.experiment == "millipede":
        from tarsus_reproduce.millipede_tables import reproduce_millipede

        return reproduce_millipede(
            chosen,
            interpretations=readings,
            seed=1 if seed is None else seed,
            folder=None if folder is None else Path(folder),
            threads=threads,
            progress=progress,
        )
    from tarsus_reproduce.robot_tables import reproduce_robot
    from tarsus_reproduce.robots import SEEDS

    return reproduce_robot(one.experiment, chosen, rows, seeds=seeds or SEEDS, progress=progress)


def _problems(experiment: str, asked: Mapping[str, Any]) -> list[str]:
    """What of the options that were given does not go together."""
    found = [
        f"{option}: is of {' and '.join(EXPERIMENTS_OF[option])}, not of {experiment}"
        for option in asked
        if experiment not in EXPERIMENTS_OF[option]
    ]
    if not found and "seed" in asked and "readings" not in asked:
        found.append("seed: is the seed of readings, which are not given")
    wrong = [option for option, most in MOST.items() if option in asked and not 1 <= asked[option] <= most]
    return found + [f"{option}: expected a number from 1 to {MOST[option]}, got {asked[option]}" for option in wrong]


def _lacking(experiment: str, device: str) -> list[str]:
    """What a device lacks for being compared with an experiment: the points that were looked at there."""
    own, other = (load_scene(one).robot.structure.points for one in (experiment, device))
    missing = [point for point in own if point not in other]
    if not missing:
        return []
    return [
        f"device: '{device}' has no point {', '.join(map(repr, missing))}, which `reproduce {experiment}` looks at: "
        "it is no device of this experiment"
    ]
