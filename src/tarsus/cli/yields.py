"""`tarsus yield`: what scatter in manufacture, dead and weak legs, and grounds do to a robot."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tarsus.cli.options import (
    HERE,
    PAGES,
    UNCHANGED,
    Changes,
    Count,
    Many,
    MaybeFolder,
    Pages,
    Resume,
    Seed,
    Work,
    at_least,
)

if TYPE_CHECKING:
    from tarsus.study.sweep import Sweep
    from tarsus.study.yields import Yield

WALKS = ["mean_speed", "cost_of_transport"]
"""Measures unless others are asked for: how fast it walks, and at what price."""


def yields(
    scene: str,
    /,
    *,
    scatter: Many = None,
    dead: str | None = None,
    weak: str | None = None,
    over: Many = None,
    measure: Many = None,
    require: Many = None,
    changes: Changes = UNCHANGED,
    count: Count = 1024,
    draws: Annotated[int, at_least(0)] = 64,
    seed: Seed = 0,
    chunk: str = "2 s",
    output: MaybeFolder = None,
    work: Work = HERE,
    resume: Resume = False,
    pages: Pages = PAGES,
) -> int:
    """Build many robots with the scatter of a workshop, and say how many are good enough.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file.
    scatter
        path=5% or path=value: standard deviation about the scene's own value; `*` in the path stands for every leg,
        each drawn by itself: "robot.drives.*.law.gain=10%". May be repeated.
    dead
        legs=0:5: fewest and most legs whose drive does nothing.
    weak
        legs=0:5@60%: fewest and most legs whose drive has so much of its gain left.
    over
        path=a:b: grounds between two values; may be repeated.
    measure
        a measure to judge by; may be repeated. mean_speed and cost_of_transport when left out.
    require
        measure=value: print the share of robots that meet it; may be repeated.
    count
        robots.
    draws
        draws behind the Sobol indices, a power of 2: they take (legs + grounds + 2) times as many runs beside those of
        the robots; 0 leaves them out.
    chunk
        time that a unit of work takes, or a number of runs.
    output
        folder for both sweeps, yield.json and report.html.
    """
    from tarsus.cli import console
    from tarsus.files.jsontext import json_text
    from tarsus.files.runstore import SWEEP_FILES
    from tarsus.files.store import write_text
    from tarsus.study.sweeping import run_sweep
    from tarsus.study.yields import read_robots, yield_of

    the_scene = changes.scene(scene)
    robots = read_robots(the_scene, scatter or (), over or (), dead, weak)
    measures = measure or WALKS
    wanted = _requirements(require or (), measures, the_scene)
    size = int(chunk) if chunk.isdecimal() else chunk
    with _said_of_options():
        whole = robots.sweep(count, measures, seed=seed, chunk=size)
        legs = robots.legs_sweep(draws, measures, seed=seed, chunk=size) if draws else None
    folder = output if output is not None else Path(f"{Path(scene).stem}.yield")
    names = [f"{place}/{name}" for place in ("robots", "legs") for name in SWEEP_FILES]
    target = pages.target(folder, "yield", ("yield.json", "report.html", *names), resume=resume)
    runs = {}
    if legs is not None:
        console.note([_further(whole, legs)])
    with console.resumable(), target.writing(resume=resume), work.workers() as workers:
        for name, sweep in (("robots", whole), ("legs", legs)):
            if sweep is None:
                continue
            begun = time.monotonic()
            with console.progress_bar(name, time_left=True) as progress:
                runs[name] = run_sweep(
                    sweep, folder / name, resume=resume and (folder / name).exists(), threads=workers,
                    progress=lambda done, total, who: progress(done, total, ""),
                )  # fmt: skip
            made = sweep.runs - runs[name].kept
            if sweep is whole and legs is not None and made:
                left = _seconds(begun, legs.runs / made)
                console.note([f"the {legs.runs} runs about legs follow, about {left}"])
        found = yield_of(
            robots, whole, runs["robots"].file, None if legs is None else (legs, runs["legs"].file)
        )
        write_text(folder / "yield.json", json_text(found.table()) + "\n")
        if pages.report:
            from tarsus.report.yield_page import write_yield_report

            write_yield_report(found, folder / "report.html")
    shares = {f"{name}={text}": found.share(name, value) for name, text, value in wanted}
    if pages.json:
        console.print_json(found.table() | {"shares": shares, "folder": str(folder)})
    else:
        _print(found, shares)
        console.wrote([folder / name for name in ("yield.json", "report.html") if (folder / name).exists()])
    return 0


def _further(whole: Sweep, legs: Sweep) -> str:
    """What the runs about legs are, and what they cost beside those of the robots."""
    from tarsus.study.manufacture import Saltelli

    assert isinstance(legs.design, Saltelli)
    return (
        f"after the {whole.runs} robots, {legs.runs} further runs ({legs.design.count} draws times "
        f"{len(legs.design.names)} groups and 2) tell whose scatter matters most, {legs.runs / whole.runs:.2g} times "
        "as many; --draws 0 leaves them out"
    )


def _seconds(begun: float, share: float) -> str:
    """How long work takes that is a multiple of what was begun then."""
    left = share * (time.monotonic() - begun)
    return f"{left:.0f} s" if left < 120.0 else f"{left / 60.0:.0f} min"


OPTIONS = {
    "Scattered.count": "--count", "Saltelli.count": "--draws", "Sweep.measures": "--measure", "Sweep.chunk": "--chunk",
    "Sweep.vary": "--dead, --weak",
}  # fmt: skip
"""What the line calls fields of its sweeps."""


@contextlib.contextmanager
def _said_of_options() -> Iterator[None]:
    """Problems with fields of a sweep, said of the options that they come from."""
    from tarsus.base.errors import InputError

    try:
        yield
    except InputError as error:
        said = [one.partition(": ") for one in error.problems]
        names = [next((OPTIONS[key] for key in OPTIONS if path.startswith(key)), path) for path, _, _ in said]
        raise InputError(
            [f"{name}: {what}" for name, (_, _, what) in zip(names, said, strict=True)]
        ) from None


def _requirements(words: list[str] | tuple[()], measures: list[str], scene) -> list[tuple[str, str, float]]:
    """Measure, text and value [SI] of every requirement."""
    from tarsus.base.errors import InputError
    from tarsus.base.units import parse_quantity
    from tarsus.solve.offered import offered

    known, problems, out = offered(scene, scene.duration), [], []
    for word in words:
        name, _, text = word.partition("=")
        if name not in measures or name not in known:
            problems.append(f"--require takes measure=value, one of {', '.join(measures)}; got '{word}'")
            continue
        try:
            out.append((name, text, parse_quantity(text, known[name].unit)))
        except InputError as error:
            problems += [f"--require {name}: {one}" for one in error.problems]
    if problems:
        raise InputError(problems)
    return out


def _print(found: Yield, shares: dict[str, tuple[float, float, float]]) -> None:
    from tarsus.base.units import format_quantity
    from tarsus.study.workunit import OUTCOMES

    print(f"{found.robots.scene.name}: {len(found.lost)} robots")
    for name, count in found.outcomes.items():
        print(f"  {count:>8}  {OUTCOMES[name]}")
    for name in found.measures:
        curve = found.curves[name]
        nine = curve.requirement[curve.share >= 0.9]
        if len(nine):
            value = float(nine.min() if curve.less else nine.max())
            word = "at most" if curve.less else "at least"
            print(f"  nine in ten: {name} {word} {format_quantity(float(f'{value:.4g}'), curve.unit)}")
    for word, (share, low, high) in shares.items():
        print(f"  {word}: {100 * share:.1f} % of robots (95 %: {100 * low:.1f} to {100 * high:.1f})")
    for name, leader in found.leaders.items():
        print(f"  {leader.sentence(name)}")
