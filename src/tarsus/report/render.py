"""Templates of pages: loaded when a page is written, and not before."""

from __future__ import annotations

from functools import lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment

__all__ = ["UPLOT", "asset", "rendered"]

UPLOT = "vendor/uplot-1.6.32"
"""Where the library that draws series lies, as published."""


@lru_cache
def asset(name: str, folder: str = "assets") -> str:
    """A file of a page as it is: style, script."""
    return files("tarsus.report").joinpath(folder, name).read_text(encoding="utf-8")


def rendered(template: str, **values: Any) -> str:
    """A template with its values; texts among them are escaped, `Markup` is used as it stands."""
    return _environment().get_template(template).render(values)


@lru_cache
def _environment() -> Environment:
    from jinja2 import Environment, FunctionLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=FunctionLoader(lambda name: asset(name, "templates")),
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined,
    )  # fmt: skip
    environment.globals["asset"] = lambda *place: Markup(asset(*place))
    environment.globals["vendor"] = UPLOT
    return environment
