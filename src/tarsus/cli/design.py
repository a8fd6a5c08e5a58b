"""`tarsus design`: what numbers or a signal of a scene should be, given what its robot should do.

`tarsus design FILE` is the grammar, with the words of `tarsus.design(...)` in a file. Each verb under it is a design
with a name of its own and its settings as a request: a TOML file in sections, single settings as
NAME=VALUE, or both, of which the words prevail. `tarsus design request VERB` prints the file with every setting.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cyclopts import App

from tarsus.base.errors import InputError
from tarsus.cli.asked import Asked
from tarsus.cli.line import line_of
from tarsus.cli.options import Grounds, Many
from tarsus.cli.verb import Verb

design = App(name="design", help="What numbers or a signal of a scene should be, given what its robot should do.")

FILES, PAGE = "tarsus.design.search:DESIGN_FILES", "tarsus.report.gait_page:write_gait_report"
WRITE = "tarsus.design.results:DesignResult.write"
GRAMMAR = Verb("tarsus.design.verb:design", files=FILES, write=WRITE, page=PAGE, title="designs")
NAMED = {
    "landing": Verb(
        "tarsus.design.landing:landing",
        files="tarsus.design.landing_design:LANDING_FILES",
        page="tarsus.report.landing_page:landing_html",
        title="design",
    ),
    "gait": Verb("tarsus.design.presets:gait", files=FILES, write=WRITE, page=PAGE, title="designs"),
    "adapt": Verb(
        "tarsus.design.adaptive:adapt",
        files="tarsus.design.adaptive_gait:ADAPT_FILES",
        page="tarsus.report.gait_page:adapt_html",
        title="adaptive gait",
    ),
}
"""Designs with a name of their own."""


def landed(asked: Asked, *, over: Grounds = None, request: Many = None) -> int:
    """A landing by its settings.

    Parameters
    ----------
    over
        PATH=a:b, a number that is not known, from a to b; may be repeated. Or a draws.npz of `tarsus identify`.
    request
        A TOML file of settings, or one of them as NAME=VALUE, e.g. pairs=2; may be repeated. `tarsus design request`
        prints a file with all of them.
    """
    return named(asked, over=over, request=request)


def named(asked: Asked, *, free: Many = None, limits: Many = None, over: Grounds = None, request: Many = None) -> int:
    """A design by its settings.

    Parameters
    ----------
    free
        What may change: gait.frequency, gait.duty, gait.high=7V:14V, or gait.phases for the phases of all legs; with
        commas, or repeated.
    limits
        Of a gait, a bound that every walk keeps, e.g. slip_ratio<0.2 or mean_speed>2mm/s; with commas, or repeated.
    over
        PATH=a:b, a number that is not known, from a to b; may be repeated. Or a draws.npz of `tarsus identify`.
    request
        A TOML file of settings, or one of them as NAME=VALUE, e.g. pairs=2; may be repeated. `tarsus design request`
        prints a file with all of them.
    """
    from tarsus.cli.words import ranges_or_file

    files, given = _settings(request)
    if len(files) > 1:
        raise InputError(f"--request: expected one file, got {' and '.join(files)}")
    words = {
        "foot": asked.words.get("foot"),
        "free": _free(free),
        "limits": ",".join(limits or ()) or None,
        "over": ranges_or_file(over, "--over") if over else None,
    }
    said = {name: value for name, value in words.items() if value is not None}
    twice = [f"--request {name}: the line itself names it already" for name in said if name in given]
    if twice:
        raise InputError(twice)
    return asked.carry_out(**{**given, **said, "request": Path(files[0]) if files else None})


for _verb, _row in NAMED.items():
    design.command(line_of(_row, f"design {_verb}", landed if _verb == "landing" else named), name=_verb)


def whole(asked: Asked, file: Path, /, *, request: Many = None) -> int:
    """The words of a file.

    Parameters
    ----------
    file
        A TOML file; `tarsus design request design` prints one to begin with.
    request
        NAME=VALUE, one setting in place of that of the file; may be repeated.
    """
    from tarsus.design.problem import DesignSettings
    from tarsus.design.request import settings_of
    from tarsus.files.kinds import folder_sentence

    if file.suffix != ".toml" and not file.is_file():
        held = folder_sentence(file, ()) if file.is_dir() else ""
        begin = "`tarsus new design FILE.toml` writes one to begin with"
        raise InputError(f"'{file}' is no file of a design (.toml){held}; {begin}")
    files, given = _settings(request)
    if files:
        raise InputError(f"--request {files[0]}: '{file}' is the file of settings; give further settings as NAME=VALUE")
    scene = settings_of(DesignSettings, file, **given).scene
    if scene is None:
        raise InputError(f"{file}: scene: name a device or a scene file")
    return asked.carry_out(**{**given, "scene": asked.scene(scene), "request": file})


design.default(line_of(GRAMMAR, "design", whole))


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


def _settings(words: list[str] | None) -> tuple[list[str], dict[str, Any]]:
    """Files of settings, and single ones."""
    from tarsus.cli import requests

    single = [word for word in words or () if "=" in word]
    return [word for word in words or () if "=" not in word], requests.settings(single, "--request")


def _free(words: list[str] | None) -> dict[str, Any] | None:
    """``PATH`` and ``PATH=a:b`` words as paths with their ranges."""
    from tarsus.cli.named import values_of
    from tarsus.cli.words import range_of

    parts = [part for word in words or () for part in word.split(",")]
    free = values_of(parts, "--free")
    return {path: None if ends is None else range_of(ends, f"--free {path}=a:b") for path, ends in free.items()} or None
