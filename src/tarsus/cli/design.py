"""`tarsus design`: what a description or a signal should be, given what it should do.

`tarsus design FILE` is the grammar, with the words of `tarsus.design(...)` in a file. Each verb under it is a design
with a name of its own and its settings as a request: a TOML file in sections, single settings as
NAME=VALUE, or both, of which the words prevail. `tarsus design request VERB` prints the file with every setting.
"""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, Parameter

from tarsus.cli.options import HERE, PAGES, UNCHANGED, Changes, Folder, Grounds, Pages, Resume, Work
from tarsus.cli.verb import Verb

design = App(name="design", help="What a description or a signal should be, given what it should do.")

GRAMMAR = Verb(
    "tarsus.design.verb:found_for",
    files="tarsus.design.search:DESIGN_FILES",
    page="tarsus.report.gait_page:write_gait_report",
    title="designs",
)
LANDING = Verb(
    "tarsus.design.landing:landing",
    files="tarsus.design.landing_design:LANDING_FILES",
    page="tarsus.report.landing_page:landing_html",
    title="design",
)
ADAPT = Verb(
    "tarsus.design.adaptive:adapt",
    files="tarsus.design.adaptive_gait:ADAPT_FILES",
    page="tarsus.report.gait_page:adapt_html",
    title="adaptive gait",
)

Request = Annotated[
    list[str] | None,
    Parameter(
        negative=(),
        help="a TOML file of settings, or one of them as NAME=VALUE, e.g. pairs=2; may be repeated. `tarsus design "
        "request` prints a file with all of them.",
    ),
]
Words = Annotated[
    list[str] | None,
    Parameter(negative=(), help="NAME=VALUE, one setting in place of that of the file; may be repeated."),
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
    request: Words = None,
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

    other, given = _asked(request, None)
    if other is not None:
        raise InputError(f"--request {other}: '{file}' is the file of settings; give further settings as NAME=VALUE")
    options = settings_of(DesignSettings, file, **given)
    if options.scene is None:
        raise InputError(f"{file}: scene: name a device or a scene file")
    asked = problem_of(changes.scene(options.scene), options, options.risk)
    return _made(GRAMMAR, "design", output, work, pages, {"asked": asked, "options": options}, resume)


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
    file, given = _asked(request, over, scene=scene, foot=foot)
    given |= {"scene": changes.scene(scene), "request": file}
    return _made(LANDING, "design landing", output, work, pages, given)


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
    from tarsus.design.request import settings_of
    from tarsus.design.walker_problem import gait_problem

    file, given = _asked(request, over, scene=scene, free=_free(free), limits=limits and ",".join(limits))
    options = settings_of(GaitSettings, file, **given)
    asked = gait_problem(changes.scene(scene), options, options.risk)
    return _made(GRAMMAR, "design gait", output, work, pages, {"asked": asked, "options": options}, resume)


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
    file, given = _asked(request, over, scene=scene, free=_free(free))
    given |= {"scene": changes.scene(scene), "request": file}
    return _made(ADAPT, "design adapt", output, work, pages, given)


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


def _made(
    row: Verb, verb: str, output: Path, work: Work, pages: Pages, given: dict[str, Any], resume: bool | None = None
) -> int:
    """Make a design in its folder, with its page, and show it; ``resume`` of one that keeps its runs there."""
    from tarsus.cli import console
    from tarsus.cli.asked import Asked

    words = {"output": output, "work": work, "pages": pages}
    if resume is not None:
        words, given = {**words, "resume": resume}, {**given, "folder": output}
    asked = Asked(row, verb, words)
    asked.check(output)
    with contextlib.ExitStack() as stack:
        if resume is not None:
            stack.enter_context(asked.writing(output))
        with asked.calling(**given) as function:
            found = function()
        if resume is None:
            stack.enter_context(asked.writing(output))
        found.write(output)
        asked.paged(found, output)
    if pages.json:
        console.print_json(found.to_dict())
    else:
        console.table(found.table())
        console.wrote([output])
    return 0


def _asked(words: list[str] | None, over: list[str] | None, **named: Any) -> tuple[Path | None, dict[str, Any]]:
    """The file of settings, and those that are words of the command line, options of their own among them."""
    from tarsus.base.errors import InputError
    from tarsus.cli import requests
    from tarsus.cli.words import ranges_or_file

    files = [word for word in words or () if "=" not in word]
    if len(files) > 1:
        raise InputError(f"--request: expected one file, got {' and '.join(files)}")
    given = requests.settings([word for word in words or () if "=" in word], "--request")
    named = {name: value for name, value in named.items() if value is not None}
    if over:
        named["over"] = ranges_or_file(over, "--over")
    twice = [f"--request {name}: the line itself names it already" for name in named if name in given]
    if twice:
        raise InputError(twice)
    given |= named
    return Path(files[0]) if files else None, given


def _free(words: list[str] | None) -> dict[str, Any] | None:
    """``PATH`` and ``PATH=a:b`` words as paths with their ranges."""
    from tarsus.cli.named import values_of
    from tarsus.cli.words import range_of

    parts = [part for word in words or () for part in word.split(",")]
    free = values_of(parts, "--free")
    return {path: None if ends is None else range_of(ends, f"--free {path}=a:b") for path, ends in free.items()} or None
