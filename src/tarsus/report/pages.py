"""Pages: a template with its values, figures numbered in their order, and the page around them.

To write a page of your own, put a template into the folder `templates` of your package and call
``page(title, rendered("your_package:name.html", table=some_table, plate=some_plate))``. In it ``{{ table }}`` is a
`tarsus.tables.Table` (or any text, escaped), ``{{ figure(plate) }}`` a `Plate` with the next number below it,
``{{ value|amount("m") }}``, ``|number``, ``|percent`` and ``|words`` are numbers and names for reading. Every ``<h2>``
becomes an entry of the contents, and tables, ``class="lede"`` and ``class="verdict"`` are styled by the page.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from tarsus.files.version import package_version
from tarsus.files.whole import write_text
from tarsus.tables.numbers import MISSING, amount, number, percent, spaced

if TYPE_CHECKING:
    from jinja2 import Environment

__all__ = ["Markup", "Plate", "asset", "page", "rendered", "write_page"]

UPLOT = "vendor/uplot-1.6.32"
"""Where the library that draws series lies, as published."""

_MICRO = re.compile(r"(?<=\d )u(?=(?:m|N|s|g|V|J|W)\b)")
"""The prefix as terminals and files write it."""

_HEADING = re.compile(r"<h2>(.*?)</h2>")
_SCRIPT = re.compile(r"(<script\b.*?</script>)", re.DOTALL)
"""What no reader sees: data and programs, which stay as they are."""


@dataclass(frozen=True)
class Plate:
    """One figure of a page: its markup (pictures, or charts), and the sentence below it."""

    picture: Markup
    caption: str


@lru_cache
def asset(name: str, folder: str = "assets", package: str = "tarsus.report") -> str:
    """A file of a page as it is: style, script, template."""
    return files(package).joinpath(folder, name).read_text(encoding="utf-8")


def rendered(template: str, **values: Any) -> Markup:
    """A template with its values; texts among them are escaped, `Markup` is used as it stands.

    ``package:name`` is the template of that name in another package's folder `templates`. In a template
    ``figure(plate)`` is a plate with the next number below it, or what a function makes of that number.
    """
    return Markup(_environment().get_template(template).render(numbers=count(1), **values))


def page(title: str, body: str) -> str:
    """The whole page around `body`, with a list of its headings before the first of them."""
    headings: list[tuple[str, Markup]] = []

    def marked(found: re.Match[str]) -> str:
        headings.append((f"part-{len(headings) + 1}", Markup(found[1])))
        return f'<h2 id="{headings[-1][0]}">{found[1]}</h2>'

    parts = _SCRIPT.split(body)
    seen = [_MICRO.sub("µ", _HEADING.sub(marked, one)) for one in parts[::2]]
    charts = any('<div class="charts"' in one for one in seen)
    parts[::2] = seen
    body = Markup("".join(parts))
    first = body.find('<h2 id="part-1">')
    if first >= 0:
        body = body[:first] + rendered("contents.html", headings=headings) + body[first:]
    return str(rendered("base.html", title=title, body=body, charts=charts))


def write_page(text: str, path: str | Path) -> Path:
    """Write a page and return its path. Raises InputError if it cannot be written."""
    write_text(Path(path), text)
    return Path(path)


def _source(template: str) -> str:
    package, _, name = template.rpartition(":")
    return asset(name, "templates", package or "tarsus.report")


@lru_cache
def _environment() -> Environment:
    from jinja2 import Environment, FunctionLoader, StrictUndefined, pass_context

    @pass_context
    def figure(context: Any, plate: Any) -> Markup:
        index = next(context["numbers"])
        made: Any = plate(index) if callable(plate) else rendered("figure.html", plate=plate, index=index)
        return made

    environment = Environment(
        loader=FunctionLoader(_source),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters.update(amount=amount, number=number, percent=percent, words=spaced)
    environment.globals.update(
        asset=lambda *place: Markup(asset(*place)), vendor=UPLOT, figure=figure, version=package_version(),
        missing=MISSING,
    )  # fmt: skip
    return environment
