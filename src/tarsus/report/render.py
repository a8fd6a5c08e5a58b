"""Templates of pages: loaded when a page is written, and not before."""

from __future__ import annotations

from functools import lru_cache
from importlib.resources import files
from itertools import count
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from tarsus.files.store import package_version
from tarsus.tables.numbers import MISSING, amount, number

if TYPE_CHECKING:
    from jinja2 import Environment

__all__ = ["UPLOT", "asset", "rendered"]

UPLOT = "vendor/uplot-1.6.32"
"""Where the library that draws series lies, as published."""


@lru_cache
def asset(name: str, folder: str = "assets") -> str:
    """A file of a page as it is: style, script."""
    return files("tarsus.report").joinpath(folder, name).read_text(encoding="utf-8")


def rendered(template: str, **values: Any) -> Markup:
    """A template with its values; texts among them are escaped, `Markup` is used as it stands.

    ``package:name`` is the template of that name in another package's folder `templates`.
    In it ``figure(plate)`` is a plate with the next number below it, or what a function makes of that number.
    """
    return Markup(_environment().get_template(template).render(numbers=count(1), **values))


def _source(template: str) -> str:
    package, _, name = template.rpartition(":")
    return files(package or "tarsus.report").joinpath("templates", name).read_text(encoding="utf-8")


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
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined,
    )  # fmt: skip
    environment.filters.update(amount=amount, number=number, words=lambda name: name.replace("_", " "))
    environment.globals.update(
        asset=lambda *place: Markup(asset(*place)), vendor=UPLOT, figure=figure, version=package_version(),
        missing=MISSING,
    )  # fmt: skip
    return environment
