"""`tarsus validate`: a published experiment row by row: the source's model, the measurement, ours."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

MOST_SEEDS = 10_000
"""More initial states than that tell nothing more and take hours."""


def validate(
    experiment: Literal["cantilever", "hexapod", "quadruped", "millipede"],
    /,
    *,
    device: str | None = None,
    rows: Path | None = None,
    seeds: int | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    overwrite: Annotated[bool, Parameter(negative=())] = False,
    json: Annotated[bool, Parameter(negative=())] = False,
) -> int:
    """Compare with a published experiment row by row, then summarise.

    Parameters
    ----------
    experiment
        cantilever: the micro-cantilever under periodic drive (Table A.1 of the source). hexapod, quadruped: the
        bouncing foot of a bulk PZT robot (Table 3.2), its modes and impact maps, and its motion in the air.
        millipede: the trends that the source sees in its simulations of walking (Figs. 4.7-4.11).
    device
        the device that is simulated; the packaged one of the experiment's name when left out.
    rows
        a file of further rows in the format of the packaged table.
    seeds
        random initial states of every row of a robot, 32 when left out.
    output
        folder for validation.html, validation.json and validation.csv.
    overwrite
        replace what `validate` wrote into the folder before; other files stay.
    json
        print one JSON object instead of tables.
    """
    from tarsus.cli import validate_cantilever, validate_files, validate_millipede, validate_robot
    from tarsus.errors import InputError

    if seeds is not None and experiment in ("cantilever", "millipede"):
        raise InputError(f"--seeds: the {experiment} starts from rest; only the robots have seeds")
    if rows is not None and experiment == "millipede":
        raise InputError("--rows: the source prints no table for the millipede, only trends in words")
    if seeds is not None and not 1 <= seeds <= MOST_SEEDS:
        raise InputError(f"--seeds: expected a number from 1 to {MOST_SEEDS}, got {seeds}")
    target = None if output is None else validate_files.target(output, overwrite)
    if target is not None:
        target.check()
    if experiment == "cantilever":
        return validate_cantilever.run(device or "cantilever", rows, target, json=json)
    if experiment == "millipede":
        return validate_millipede.run(device or "millipede", target, json=json)
    return validate_robot.run(experiment, device, rows, seeds, target, json=json)
