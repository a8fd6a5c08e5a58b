"""Figures of a modal fit show what was found and what is left."""

from __future__ import annotations

from modes.test_modal import responses
from tarsus.modes import identify_modes
from tarsus.records.measurement import Quantity
from tarsus.report.modes_page import modes_html, nyquist, stabilisation, synthesis
from tarsus.report.sheet import figure_style


def test_figures_of_a_fit():
    fit = identify_modes(responses(Quantity.VELOCITY, 0.001), (110.0, 990.0), 12)
    with figure_style():
        plates = stabilisation(fit), nyquist(fit), synthesis(fit)
    for plate in plates:
        assert "<svg" in plate.picture and plate.caption
    for text in ("300 Hz, 2 %", "340 Hz, 1.5 %", "700 Hz, 5 %"):
        assert text in plates[1].picture, "a curve for every mode, with its figures"
    assert "order of the model" in plates[0].picture and "response per unit of drive" in plates[2].picture
    assert "3 modes" in plates[2].caption
    assert 0.0009 < fit.misfit < 0.0011, "the noise is what is left"
    assert f"{100.0 * fit.misfit:.2g} %" in plates[2].caption


def test_the_page_counts_in_words_and_its_mac_has_numbers():
    text = modes_html(identify_modes(responses(Quantity.VELOCITY, 0.001), (110.0, 990.0), 12))
    assert "from 3 points and 1 drive." in text
    assert text.count(">1.00</text>") == 3, "each mode with itself"
