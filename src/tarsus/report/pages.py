"""Pages: a list of sections, each with its heading, texts, tables and figures; one template renders any.

To write a page of your own, call ``sections_page(title, about, sections)``. A part of a section is a text, which is a
paragraph; a `tarsus.tables.Table`; a `PageFigure`, which is numbered; a `Section` below the section; a `Fold`, which is
opened by a click; a list of parts, which stand side by side, a tuple of parts being one of these; `Markup`, as it
is; or None, which is nothing.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
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
from tarsus.tables.section import Section

if TYPE_CHECKING:
    from jinja2 import Environment

UPLOT = "vendor/uplot-1.6.32"
"""Where the library that draws series lies, as published."""

_MICRO = re.compile(r"(?<=\d )u(?=(?:m|N|s|g|V|J|W)\b)")
"""The prefix as terminals and files write it."""

_COMMENT = re.compile(r"^ *(?:/\*\*.*?\*/|//[^\n]*)\n", re.DOTALL | re.MULTILINE)
_SCRIPT = re.compile(r"(<script\b.*?</script>)", re.DOTALL)
"""What no reader sees: data and programs, which stay as they are."""


@dataclass(frozen=True)
class PageFigure:
    """One figure of a page: its markup (pictures, or charts), and the sentence below it."""

    picture: Markup
    caption: str


class Fold(Section):
    """A part that shows its heading alone until it is opened."""


class Foldable(Section):
    """A section that is open on wide screens and on paper; on a phone its heading opens it."""


def sentence_case(words: str) -> str:
    """Words as a sentence."""
    return f"{words[:1].upper()}{words[1:].removesuffix('.')}."


def said(sentence: str, *, failed: bool = False) -> Markup:
    """A sentence that a reader must not miss."""
    return Markup('<p class="verdict{}">{}</p>').format(" failed" if failed else "", sentence_case(sentence))


def marked(words: str, *values: Any) -> Markup:
    """A paragraph with marks of HTML in its words; values in the place of its braces are escaped unless marked."""
    return Markup(f"<p>{words}</p>").format(*values)


def bullets(items: Iterable[Any]) -> Markup:
    """A list, an item each."""
    return Markup("<ul>{}</ul>").format(Markup("").join(Markup("<li>{}</li>").format(one) for one in items))


def noted(table: Any) -> Markup | None:
    """What a result says in the notes of its table, as a list."""
    return bullets(map(sentence_case, table.notes)) if table.notes else None


def terms(meanings: Mapping[str, str]) -> Markup:
    """Words, each with what it means."""
    pairs = (Markup("<dt>{}</dt><dd>{}</dd>").format(*one) for one in meanings.items())
    return Markup("<dl>{}</dl>").format(Markup("").join(pairs))


def sources(citations: Sequence[str]) -> Section | None:
    """Where a scene's numbers are from; None where it says nothing."""
    return Section("Sources of this scene", bullets(citations)) if citations else None


def whole(table: Any) -> Markup:
    """A table that a page shows with all of its rows."""
    return Markup('<div class="all">{}</div>').format(table)


def sections_page(title: str, about: Sequence[Any], sections: Iterable[Section | None], footer: str = "") -> str:
    """The page of sections, those that are None left out. about: texts and parts below its title; footer: after who
    made the page."""
    shown = [one for one in sections if one is not None]
    return page(title, rendered("sections.html", title=title, about=about, sections=shown, footer=footer))


@lru_cache
def asset(name: str, folder: str = "assets", package: str = "tarsus.report") -> str:
    """A file of a page as it is: style, template; a script without its comments."""
    text = files(package).joinpath(folder, name).read_text(encoding="utf-8")
    return _COMMENT.sub("", text) if name.endswith(".js") else text


def rendered(template: str, **values: Any) -> Markup:
    """A template with its values; texts among them are escaped, `Markup` is used as it stands.

    In a template ``figure(one)`` is a `PageFigure` with the next number below it.
    """
    return Markup(_environment().get_template(template).render(numbers=count(1), **values))


def page(title: str, body: str) -> str:
    """The whole page around `body`, with what its figures need."""
    parts = _SCRIPT.split(body)
    parts[::2] = seen = [_MICRO.sub("µ", one) for one in parts[::2]]
    charts, plays = (any(mark in one for one in seen) for mark in ('<div class="charts"', '<div class="walk"'))
    return str(rendered("base.html", title=title, body=Markup("".join(parts)), charts=charts, plays=plays))


def write_page(text: str, path: str | Path) -> Path:
    """Write a page and return its path. Raises InputError if it cannot be written."""
    write_text(Path(path), text)
    return Path(path)


@lru_cache
def _environment() -> Environment:
    from jinja2 import Environment, FunctionLoader, StrictUndefined, pass_context

    @pass_context
    def figure(context: Any, one: Any) -> Markup:
        whole = Markup("<figure>{}<figcaption><b>Figure {}.</b> {}</figcaption></figure>")
        return whole.format(one.picture, next(context["numbers"]), one.caption)

    environment = Environment(
        loader=FunctionLoader(lambda name: asset(name, "templates")),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters.update(amount=amount, number=number, percent=percent, words=spaced)
    environment.tests.update(
        page_figure=lambda one: isinstance(one, PageFigure),
        section=lambda one: isinstance(one, Section),
        fold=lambda one: isinstance(one, Fold),
        foldable=lambda one: isinstance(one, Foldable),
        together=lambda one: isinstance(one, tuple),
        several=lambda one: isinstance(one, list),
        paragraph=lambda one: isinstance(one, str) and bool(one) and not isinstance(one, Markup),
    )
    environment.globals.update(
        asset=lambda *place: Markup(asset(*place)),
        vendor=UPLOT,
        figure=figure,
        version=package_version(),
        missing=MISSING,
    )
    return environment
