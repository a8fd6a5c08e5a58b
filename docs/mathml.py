"""Formulas as MathML, which browsers draw by themselves: pages need neither scripts nor the network."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util import logging

WRITTEN_OUT = {r"\arg": r"\operatorname{arg}"}
"""Commands that the converter does not know, and what says the same."""

LOG = logging.getLogger(__name__)


def mathml(node: nodes.Element, display: str) -> str:
    """A formula's node as MathML; a warning, which fails the build, where a command is not understood."""
    text = node.astext()
    for command, other in WRITTEN_OUT.items():
        text = text.replace(command, other)
    found = convert(text, display=display)
    if "\\" in found:
        LOG.warning("a command of this formula is not known: %s", node.astext(), location=node)
    return found


def inline(writer: Any, node: nodes.math) -> None:
    """Write a formula within a line."""
    writer.body.append(mathml(node, "inline"))
    raise nodes.SkipNode


def block(writer: Any, node: nodes.math_block) -> None:
    """Write a formula of its own."""
    writer.body.append(f'<div class="formula">{mathml(node, "block")}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Make this the way to write formulas."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
