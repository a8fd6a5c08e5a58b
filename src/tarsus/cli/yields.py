"""`tarsus yield`: what scatter in manufacture, dead and weak legs, and grounds do to a robot."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.cli.options import (
    HERE,
    UNCHANGED,
    Changes,
    Json,
    Many,
    MaybeFolder,
    Overwrite,
    Pages,
    Resume,
    Seed,
    Work,
)

if TYPE_CHECKING:
    from tarsus.study.robots import Scatter
    from tarsus.study.sweep import Sweep


def yields(
    scene: str,
    /,
    *,
    scatter: Many = None,
    require: Many = None,
    changes: Changes = UNCHANGED,
    count: str = "1024",
    seed: Seed = 0,
    output: MaybeFolder = None,
    work: Work = HERE,
    resume: Resume = False,
    overwrite: Overwrite = False,
    json: Json = False,
) -> int:
    """Build many robots with the scatter of a workshop, and say how many are good enough.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file.
    scatter
        path=5% or path=value: standard deviation about the scene's own value; `*` in the path stands for every leg,
        each drawn by itself: "robot.drives.*.law.gain=10%". path=a:b: evenly between two values, as a ground.
        dead=0:5: fewest and most legs whose drive does nothing; weak=0:5@60%: whose drive has so much of its gain left.
        May be repeated.
    require
        measure=value: print the share of robots that meet it; or a measure alone, to be judged by; may be repeated.
        when left out mean_speed and cost_of_transport of a walker, peak and bounces of any other robot.
    count
        robots: 1024. 1024:64 also determines whose scatter matters, by Sobol indices of 64 draws (a power of 2), which
        take (legs + grounds + 2) times as many runs more. 1024:0:4: starts of every robot, over whose settled motions
        it is measured, 4 of a walker; 1024:0:200ms: an episode from rest.
    output
        folder for both sweeps, yield.json and report.html.
    """
    from tarsus.cli import console
    from tarsus.files.runstore import SWEEP_FILES
    from tarsus.report.pages import write_page
    from tarsus.report.yield_page import yield_html
    from tarsus.study.robots import Robots, as_arguments
    from tarsus.study.yields import YieldStudy

    robots, draws, over = _counts(count)
    with _options():
        drawing = Robots.of(changes.scene(scene), **as_arguments(_scattered(scatter or ())))
        study = YieldStudy.of(drawing, _required(require), count=robots, draws=draws, seed=seed, **over)
    folder = output if output is not None else Path(f"{Path(scene).stem}.yield")
    names = [f"{place}/{name}" for place in ("robots", "legs") for name in SWEEP_FILES]
    target = Pages(overwrite=overwrite).target(
        folder, "yield", ("yield.json", "report.html", *names), resume=resume
    )
    if study.legs is not None:
        console.note([_further(study.sweep, study.legs)])
    with console.resumable(), target.writing(resume=resume), work.workers() as workers:
        with console.progress_bar("robots, legs", time_left=True) as progress:
            found = study.run(folder, resume=resume, threads=workers, progress=progress)
        write_page(yield_html(found), folder / "report.html")
    if json:
        said = dict(word.split("=", 1) for word in require or () if "=" in word)
        shares = {f"{name}={said[name]}": share for name, share in found.shares.items()}
        console.print_json(found.to_dict() | {"shares": shares, "folder": str(folder)})
    else:
        console.table(found.table())
        console.wrote([folder / name for name in ("yield.json", "report.html")])
    return 0


def _further(whole: Sweep, legs: Sweep) -> str:
    """What the runs about legs are, and what they cost beside those of the robots."""
    from tarsus.study.manufacture import Saltelli

    assert isinstance(legs.design, Saltelli)
    return (
        f"after the {whole.runs} robots, {legs.runs} further runs ({legs.design.count} draws times "
        f"{len(legs.design.names)} groups and 2) determine whose scatter matters most, {legs.runs / whole.runs:.2g} "
        f"times as many"
    )


OPTIONS = (
    (r"Scattered\.count|Saltelli\.count", "--count"),
    (r"Sweep\.measures", "--require"),
    (r"draws$", "--count"),
    (r"Sweep\.starts|Sweep\.from_rest", "--count"),
    (r"Sweep\.vary|(dead|weak)$", "--scatter dead, weak"),
)
"""What the line calls fields of its sweeps."""


@contextlib.contextmanager
def _options() -> Iterator[None]:
    """Problems with fields of a sweep, said of the options that they come from."""
    from tarsus.base.errors import InputError

    try:
        yield
    except InputError as error:
        said = []
        for problem in error.problems:
            name = next((option for pattern, option in OPTIONS if re.match(pattern, problem.path)), None)
            said.append(f"{name}: {problem.said}" if name else problem)
        raise InputError(said) from None


def _counts(text: str) -> tuple[int, int, dict[str, Any]]:
    """`ROBOTS`, `ROBOTS:DRAWS` or `ROBOTS:DRAWS:OVER`, where the last is what measures are taken over: a number of
    starts, or the time of an episode from rest."""
    from tarsus.base.errors import InputError

    found = re.fullmatch(r"([1-9]\d*)(?::(\d+))?(?::([\d.]+[a-zµ ]*s?))?", text.replace(" ", ""))
    if found is None:
        raise InputError(
            f"--count takes ROBOTS, ROBOTS:DRAWS, ROBOTS:DRAWS:STARTS or ROBOTS:DRAWS:TIME, such as 1024, 1024:64, "
            f"1024:0:4 or 1024:0:200ms, got '{text}'"
        )
    robots, draws, last = found.groups()
    over: dict[str, Any] = (
        {} if last is None else {"starts": int(last)} if last.isdecimal() else {"from_rest": last}
    )
    return int(robots), int(draws or 0), over


def _scattered(words: Sequence[str]) -> dict[str, Scatter]:
    """What `--scatter` says, by path."""
    from tarsus.base.errors import InputError

    found: dict[str, Scatter] = {}
    for word in words:
        path, _, text = (one.strip() for one in word.partition("="))
        if not path or not text:
            raise InputError(f"--scatter takes PATH=5%, PATH=value or PATH=a:b, got '{word}'")
        found[path] = text
    return found


def _required(words: list[str] | None) -> dict[str, str | None] | None:
    """What `--require` says: by measure the value, None of one that robots are only judged by."""
    if not words:
        return None
    pairs = (word.partition("=") for word in words)
    return {name.strip(): value.strip() if equals else None for name, equals, value in pairs}
