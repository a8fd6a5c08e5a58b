"""`tarsus design`: what a description or a signal should be, given what it should do.

`tarsus design FILE` is the grammar, with the words of `tarsus.design(...)` in a file. Each verb under it is a design
with a name of its own and its settings as a request: a TOML file in sections, single settings as
NAME=VALUE, or both, of which the words prevail. `tarsus design request VERB` prints the file with every setting.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, Parameter

from tarsus.cli.options import HERE, PAGES, UNCHANGED, Changes, Folder, Grounds, Pages, Resume, Work

design = App(name="design", help="What a description or a signal should be, given what it should do.")

Request = Annotated[
    list[str] | None,
    Parameter(
        negative=(),
        help="a TOML file of settings, or one of them as NAME=VALUE, e.g. pairs=2; may be repeated. `tarsus design "
        "request` prints a file with all of them.",
    ),
]
Free = Annotated[
    list[str] | None,
    Parameter(
        negative=(),
        help="what may change: gait.frequency, gait.duty, gait.high=7V:14V, or gait.phases for the phases of all legs; "
        "with commas, or repeated.",
    ),
]
Limits = Annotated[
    list[str] | None,
    Parameter(
        negative=(),
        help="a bound that every walk keeps, e.g. slip_ratio<0.2 or mean_speed>2mm/s; with commas, or repeated.",
    ),
]


@design.default
def whole(
    file: Path,
    /,
    *,
    output: Folder,
    request: Request = None,
    changes: Changes = UNCHANGED,
    work: Work = HERE,
    resume: Resume = False,
    pages: Pages = PAGES,
) -> int:
    """Find what is best by the words of a file: scene, free, objective, limits, over and risk.

    Parameters
    ----------
    file
        a TOML file; `tarsus design request design` prints one to begin with.
    output
        folder for designs.json (of a walker gaits.json), front.csv, report.html, and the scene and the page of every
        design of the front.
    """
    from tarsus.base.errors import InputError
    from tarsus.design.problem import DesignSettings, problem_of
    from tarsus.design.request import settings_of
    from tarsus.design.verb import design as made

    given = _asked(request, None)[1]
    options = settings_of(DesignSettings, file, **given)
    if options.scene is None:
        raise InputError(f"{file}: scene: name a device or a scene file")
    the_scene = changes.scene(options.scene)
    problem_of(the_scene, options, options.risk)  # before a file is touched
    named = {**given, "request": file}
    return _searched(made, the_scene, named, ("design", output), work, pages, resume)


@design.command
def landing(
    scene: str,
    /,
    *,
    output: Folder,
    foot: str | None = None,
    over: Grounds = None,
    request: Request = None,
    changes: Changes = UNCHANGED,
    work: Work = HERE,
    pages: Pages = PAGES,
) -> int:
    """Find on-off switching times with which a foot touches down softly, every touchdown of the period counted.

    Parameters
    ----------
    scene
        a device (see `tarsus devices`) or a scene file; its signal gives the period, and the share of it on the ground.
    output
        folder for landing.json, signal.toml, scene.toml, landing.h, scenarios.csv and report.html.
    foot
        name of the foot.
    """
    from tarsus.cli import console
    from tarsus.design.landing_design import LANDING_FILES
    from tarsus.design.soft_landing import landing as made

    file, given = _asked(request, over, foot=foot)
    the_scene = changes.scene(scene)
    target = pages.target(output, "design landing", LANDING_FILES)
    with console.progress_bar("design") as progress, work.workers() as workers:
        found = made(the_scene, request=file, progress=progress, threads=workers, **given)
    with target.writing() as folder:
        found.write(folder)
        if pages.report:
            from tarsus.report.landing_page import landing_html
            from tarsus.report.pages import write_page

            write_page(landing_html(found), folder / "report.html")
    return _shown(found, folder, pages)


@design.command
def gait(
    scene: str,
    /,
    *,
    output: Folder,
    free: Free = None,
    limits: Limits = None,
    over: Grounds = None,
    request: Request = None,
    changes: Changes = UNCHANGED,
    work: Work = HERE,
    resume: Resume = False,
    pages: Pages = PAGES,
) -> int:
    """Find the gaits that no other beats in speed, energy, slip or contact, on grounds that nobody measured.

    Parameters
    ----------
    scene
        a walker: a device (see `tarsus devices`) or a scene file.
    output
        folder for gaits.json, front.csv, gait.h (the robust gait), report.html, and the scene and the page of every
        gait of the front.
    """
    from tarsus.design.presets import GaitSettings
    from tarsus.design.presets import gait as made
    from tarsus.design.request import settings_of
    from tarsus.design.walker_problem import gait_problem

    file, given = _asked(request, over, free=_free(free), limits=limits and ",".join(limits))
    the_scene = changes.scene(scene)
    options = settings_of(GaitSettings, file, **given)
    gait_problem(the_scene, options, options.risk)  # before a file is touched
    named = {**given, "request": file}
    return _searched(made, the_scene, named, ("design gait", output), work, pages, resume)


@design.command
def adapt(
    scene: str,
    /,
    *,
    output: Folder,
    free: Free = None,
    over: Grounds = None,
    request: Request = None,
    changes: Changes = UNCHANGED,
    work: Work = HERE,
    pages: Pages = PAGES,
) -> int:
    """Find a few gaits, and the table that chooses among them by what the robot senses in its first steps.

    Parameters
    ----------
    scene
        a walker: a device (see `tarsus devices`) or a scene file.
    output
        folder for adapt.json, hidden.csv and report.html.
    """
    from tarsus.cli import console
    from tarsus.design.adaptive import adapt as made
    from tarsus.design.adaptive_gait import ADAPT_FILES

    file, given = _asked(request, over, free=_free(free))
    the_scene = changes.scene(scene)
    target = pages.target(output, "design adapt", ADAPT_FILES)
    with console.progress_bar("adaptive gait") as progress, work.workers() as workers:
        found = made(the_scene, request=file, progress=progress, threads=workers, **given)
    with target.writing() as folder:
        found.write(folder)
        if pages.report:
            from tarsus.report.gait_page import adapt_html
            from tarsus.report.pages import write_page

            write_page(adapt_html(found), folder / "report.html")
    return _shown(found, folder, pages)


@design.command
def request(verb: str, /) -> int:
    """Print the file of settings of a design: every name, its default and what it is for.

    Parameters
    ----------
    verb
        design, landing, gait, adapt or leg.
    """
    from tarsus.design.request import settings_text

    print(settings_text(verb), end="")
    return 0


def _searched(
    made: Callable[..., Any],
    scene: Any,
    given: dict[str, Any],
    named: tuple[str, Path],
    work: Work,
    pages: Pages,
    resume: bool,
) -> int:
    """Make a design in its folder, of the name of a verb, with its pages, and show it."""
    from tarsus.cli import console
    from tarsus.design.front import FRONT_FILES
    from tarsus.design.search import KEPT_FILES

    verb, output = named
    target = pages.target(output, verb, (*FRONT_FILES, *KEPT_FILES), resume=resume)
    with (
        console.resumable(),
        target.writing(resume=resume) as folder,
        console.progress_bar("designs") as progress,
        work.workers() as workers,
    ):
        found = made(scene, folder=folder, resume=resume, progress=progress, threads=workers, **given)
        found.write(folder)
        if pages.report:
            from tarsus.report.gait_page import write_gait_report

            write_gait_report(found, folder)
    return _shown(found, folder, pages)


def _asked(words: list[str] | None, over: list[str] | None, **named: Any) -> tuple[Path | None, dict[str, Any]]:
    """The file of settings, and those that are words of the command line, options of their own among them."""
    from tarsus.base.errors import InputError
    from tarsus.cli import requests
    from tarsus.cli.words import ranges_or_file

    files = [word for word in words or () if "=" not in word]
    if len(files) > 1:
        raise InputError(f"--request: expected one file, got {' and '.join(files)}")
    given = requests.settings([word for word in words or () if "=" in word], "--request")
    if over:
        given["over"] = ranges_or_file(over, "--over")
    given |= {name: value for name, value in named.items() if value is not None}
    return Path(files[0]) if files else None, given


def _free(words: list[str] | None) -> dict[str, Any] | None:
    """``PATH`` and ``PATH=a:b`` words as paths with their ranges."""
    from tarsus.cli.named import values_of
    from tarsus.cli.words import range_of

    parts = [part for word in words or () for part in word.split(",")]
    free = values_of(parts, "--free")
    return {path: None if ends is None else range_of(ends, f"--free {path}=a:b") for path, ends in free.items()} or None


def _shown(found: Any, folder: Path, pages: Pages) -> int:
    from tarsus.cli import console

    if pages.json:
        console.print_json(found.to_dict())
    else:
        console.table(found.table())
        console.wrote([folder])
    return 0
