"""The report of modes: what is determined, responses with their fit, stabilisation, shapes and their MAC."""

from __future__ import annotations

from collections.abc import Sequence

from tarsus.modes.modal import ModalFit
from tarsus.modes.mode import ModeVerdict
from tarsus.report import modal_figures
from tarsus.report.pages import page, rendered


def modes_html(fit: ModalFit, sources: Sequence[str] = ()) -> str:
    """The page of modes, as text."""
    several = len(fit.frf.outputs) > 1
    body = rendered(
        "modes.html", fit=fit, sources=", ".join(sources), table=fit.table().bare(),
        determined=sum(mode.verdict is ModeVerdict.DETERMINED for mode in fit.modes),
        top=[modal_figures.synthesis(fit), *([modal_figures.stabilisation(fit)] if fit.poles else [])],
        nyquist=modal_figures.nyquist(fit), shapes=modal_figures.shapes(fit) if several else None,
        likeness=modal_figures.likeness(fit) if several else None,
    )  # fmt: skip
    return page("modes", body)
