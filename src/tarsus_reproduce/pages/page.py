"""Pages of reproductions, and the index of them, from templates."""

from __future__ import annotations

from tarsus.report.html import page
from tarsus.report.render import rendered
from tarsus_reproduce.reproduction import Reproduction

__all__ = ["reproduction_html"]


def reproduction_html(found: Reproduction) -> str:
    """A reproduction as one self-contained HTML file: every section with its figures and tables."""
    return page(f"{found.name} – reproduction", rendered("tarsus_reproduce:reproduction.html", one=found))
