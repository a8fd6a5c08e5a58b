"""Explorers in the documentation: `.. explorer:: cantilever` is the page of `tarsus explore cantilever`, alive."""

from __future__ import annotations

from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.application import Sphinx

PLACE = Path(__file__).parent / "_static" / "explorers"
"""Made at a build that lacks them; no part of the repository."""


class ExplorerDirective(Directive):
    """A device by name; the page is loaded when it is scrolled to."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        (name,) = self.arguments
        page = PLACE / f"{name}.html"
        if not page.is_file():
            import tarsus as ts

            page.parent.mkdir(exist_ok=True)
            ts.explore(name, page)
        source = f'title="Explorer of {name}" loading="lazy" src="_static/explorers/{name}.html"'
        return [nodes.raw("", f'<iframe class="explorer" {source}></iframe>', format="html")]


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive; the engine for pages is made where it lacks."""
    from tarsus.solve.page_engine import compiled_engine

    compiled_engine()
    app.add_directive("explorer", ExplorerDirective)
    return {"parallel_read_safe": True}
