"""The report of modes: what is determined, responses with their fit, stabilisation, shapes and their MAC."""

from __future__ import annotations

from collections.abc import Sequence

from tarsus.modes.modal import ModalFit
from tarsus.modes.mode import ModeVerdict
from tarsus.report import modal_figures
from tarsus.report.pages import Section, bullets, marked, sections_page


def modes_html(fit: ModalFit, sources: Sequence[str] = ()) -> str:
    """The page of modes, as text."""
    several = len(fit.frf.outputs) > 1
    refused = bullets(fit.refused) if fit.refused else None
    top = [modal_figures.synthesis(fit), *([modal_figures.stabilisation(fit)] if fit.poles else [])]
    sections = [
        Section("Modes", fit.table().bare(), refused, INTERVALS),
        Section("Responses", top),
        Section("Modes in the complex plane", modal_figures.nyquist(fit)),
        Section("Shapes", modal_figures.shapes(fit), modal_figures.likeness(fit)) if several else None,
    ]
    remarks = [marked("{}.", one) for one in fit.remarks]
    return sections_page("Modes", [_about(fit, sources), *remarks], sections, head="modes")


INTERVALS = """Intervals are of 95 %: scatter between repeats, channels or lines, and the spread between orders of the
models, windows and methods."""


def _about(fit: ModalFit, sources: Sequence[str]) -> str:
    """How many modes are determined, and from what."""
    determined = sum(mode.verdict is ModeVerdict.DETERMINED for mode in fit.modes)
    points, drives = len(fit.frf.outputs), len(fit.frf.inputs)
    return (
        f"{determined} of {len(fit.modes)} modes determined, from {points} point{'s' * (points != 1)} and "
        f"{drives} drive{'s' * (drives != 1)}{' in ' if sources else ''}{', '.join(sources)}."
    )
