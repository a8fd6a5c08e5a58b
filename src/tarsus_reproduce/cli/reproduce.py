"""`tarsus reproduce`: the dissertation's experiments row by row: its model, the measurement, ours."""

from __future__ import annotations

import builtins
import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tarsus.cli.options import FLAG, Json, MaybeFolder, MaybeSeed, Overwrite, Resume, Threads

if TYPE_CHECKING:
    from tarsus_reproduce.reproduction import Reproduction

FUNCTION = "tarsus_reproduce.verb:reproduce"
"""What `tarsus.reproduce` is in Python."""


def reproduce(
    *experiments: str,
    all: Annotated[bool, FLAG] = False,
    device: str | None = None,
    rows: Path | None = None,
    seeds: int | None = None,
    readings: int = 0,
    seed: MaybeSeed = None,
    threads: Threads = None,
    output: MaybeFolder = None,
    resume: Resume = False,
    overwrite: Overwrite = False,
    json: Json = False,
) -> int:
    """Compare with experiments of the dissertation row by row, then summarise; of several, write pages with an index.

    Parameters
    ----------
    experiments
        cantilever: the micro-cantilever under periodic drive (Table A.1); cantilever-1: with the device fitted to the
        source's model. hexapod, quadruped: the bouncing foot of a bulk PZT robot (Table 3.2), its modes and impact
        maps, and its motion in the air. millipede: the trends that are seen in its simulations of walking
        (Figs. 4.7-4.11).
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
        for the millipede: the score over so many random interpretations of what is not printed, kept in the output
        folder and continued there with --resume; left out, those that come with the package.
    output
        folder for reproduction.html, reproduction.json and reproduction.csv.
    """
    from tarsus.base.errors import InputError
    from tarsus.cli import console
    from tarsus_reproduce import verb

    names = tuple(verb.experiments()) if all else tuple(dict.fromkeys(experiments))
    whole = all or len(names) > 1
    problems = _problems(experiments, whole=whole, all=all, device=device, rows=rows, output=output)
    if resume and overwrite:
        problems.append("--resume continues what the folder holds and --overwrite begins again: give one of them")
    if problems:
        raise InputError(problems)
    options = {"device": device, "rows": rows, "seeds": seeds, "readings": readings, "seed": seed}
    kept = console.resumable() if readings and output is not None else contextlib.nullcontext()
    found: dict[str, Reproduction] = {}
    with kept, _folder(output, whole=whole, overwrite=overwrite, resume=resume):
        for number, name in enumerate(names, 1):
            if whole:
                console.say(f"{number} of {len(names)}: {verb.experiments()[name].title}")
            own = {key: value for key, value in options.items() if not whole or key in verb.options_of(name)}
            place = output / name if output is not None and whole else output
            with console.progress_bar("reproducing", time_left=readings > 0) as progress:
                one = verb.reproduce(name, **own, threads=threads, folder=place, progress=progress)
            written: list[Path] = []
            if place is not None:
                with console.spinner("writing the report"):
                    written = one.write(place)
            if not whole:
                console.show(one, json, written)
            console.complain(one.problems)
            found[name] = one
        if whole and output is not None:
            _index(found, output, json=json)
    return 0 if builtins.all(one.ok for one in found.values()) else 1


def _index(found: dict[str, Reproduction], output: Path, *, json: bool) -> None:
    """The index of all pages, and what was written."""
    from tarsus.cli import console
    from tarsus.files.whole import write_text
    from tarsus_reproduce.index import index_html

    write_text(output / "index.html", index_html({name: one.about for name, one in found.items()}))
    if json:
        data = {name: one.to_dict() for name, one in found.items()}
        console.print_json({"index": str(output / "index.html"), "experiments": data})
    else:
        console.wrote([*(output / name for name in found), output / "index.html"])


def _folder(
    output: Path | None, *, whole: bool, overwrite: bool, resume: bool
) -> contextlib.AbstractContextManager[object]:
    """The output folder under the rule that all verbs share; nothing where none is written."""
    from tarsus.files.output import OutputFolder
    from tarsus_reproduce.interpretations import STORE_FILES
    from tarsus_reproduce.reproduction import PAGE_FILES

    if output is None:
        return contextlib.nullcontext()
    files = (*PAGE_FILES, *STORE_FILES)
    files = ("index.html", *(f"*/{name}" for name in files)) if whole else files
    return OutputFolder(output, "reproduce", files, overwrite, resumable=True).writing(resume=resume)


def _problems(
    experiments: Sequence[str], *, whole: bool, all: bool, device: str | None, rows: Path | None, output: Path | None
) -> list[str]:
    """What is wrong with the words together."""
    from tarsus_reproduce import verb

    found = []
    if all and experiments:
        found.append(f"--all makes every page: leave '{experiments[0]}' out")
    if not (all or experiments):
        found.append(f"name an experiment ({', '.join(verb.experiments())}), or give --all")
    if whole and output is None:
        found.append("pages of several experiments need a folder: give it with -o")
    if whole:
        found += [
            f"{name} belongs to one experiment: not with several"
            for name, value in (("--device", device), ("--rows", rows))
            if value is not None
        ]
    return found
