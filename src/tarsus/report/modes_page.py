"""The report of modes: what is determined, responses with their fit, stabilisation, shapes and their MAC."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from tarsus.modes.modal import ModalFit
from tarsus.modes.mode import IdentifiedMode, ModeVerdict
from tarsus.records.measurement import Quantity
from tarsus.report.pages import PageFigure, Section, bullets, marked, sections_page
from tarsus.report.panel_grid import QUARTER, few_ticks, name_axes, panel, panels
from tarsus.report.style import BLUE, INK, MUTED, ON_DARK, ON_LIGHT, ORANGE, VERMILION, decimate
from tarsus.tables.numbers import how_many

MOST_NUMBERED = 12
"""Modes up to which the fields of their MAC have room for a number."""

MOST_CURVES = 9
"""Modes whose Nyquist curve is drawn; of more, the lowest ones."""


def modes_html(fit: ModalFit, sources: Sequence[str] = ()) -> str:
    """The page of modes, as text."""
    several = len(fit.frf.outputs) > 1
    refused = bullets(fit.refused) if fit.refused else None
    top = [synthesis(fit), *([stabilisation(fit)] if fit.poles else [])]
    sections = [
        Section("Modes", fit.table().bare(), refused, INTERVALS),
        Section("Responses", top),
        Section("Modes in the complex plane", nyquist(fit)),
        Section("Shapes", shapes(fit), likeness(fit)) if several else None,
    ]
    remarks = [marked("{}.", one) for one in fit.remarks]
    return sections_page("Modes", [_about(fit, sources), *remarks], sections)


INTERVALS = """Intervals are of 95 %: scatter between repeats, channels or lines, and the spread between orders of the
models, windows and methods."""


def _about(fit: ModalFit, sources: Sequence[str]) -> str:
    """How many modes are determined, and from what."""
    determined = sum(mode.verdict is ModeVerdict.DETERMINED for mode in fit.modes)
    points, drives = how_many(len(fit.frf.outputs), "point"), how_many(len(fit.frf.inputs), "drive")
    return (
        f"{determined} of {how_many(len(fit.modes), 'mode')} determined, from {points} and {drives}"
        f"{' in ' if sources else ''}{', '.join(sources)}."
    )


def stabilisation(fit: ModalFit) -> PageFigure:
    """Poles of the models of every order over the summed response."""
    frequency = fit.frf.frequency
    summed = np.sqrt(np.sum(np.abs(fit.frf.values) ** 2, axis=(0, 1)))
    top = max(fit.poles)
    level = np.log10(np.maximum(summed, 1e-6 * summed.max()))
    height = (level - level.min()) / max(float(np.ptp(level)), 1e-12)
    order = np.concatenate([np.full(len(poles), n) for n, poles in fit.poles.items()])
    pole = np.concatenate(list(fit.poles.values()))
    inside = (pole.imag / (2.0 * np.pi) > frequency[0]) & (pole.imag / (2.0 * np.pi) < frequency[-1])

    def draw(axes: Axes) -> None:
        x, grey = decimate(frequency, height * top)
        axes.fill_between(x, 0.0, grey, color=MUTED, alpha=0.3, lw=0.0)
        for chosen, color, label in ((pole.real >= 0.0, MUTED, "growing"), (pole.real < 0.0, BLUE, "decaying")):
            hertz = pole[inside & chosen].imag / (2.0 * np.pi)
            axes.plot(hertz, order[inside & chosen], "o", ms=2.0, mew=0.0, color=color, label=label)
        for verdict, color, label in ((True, VERMILION, "mode"), (False, ORANGE, "mode, not determined")):
            found = [m.frequency.value for m in fit.modes if (m.verdict is ModeVerdict.DETERMINED) is verdict]
            if found:
                axes.vlines(found, 0.0, top + 1.0, color=color, lw=1.0, label=label)
        axes.set(xlim=(frequency[0], frequency[-1]), ylim=(0.0, top + 1.0))
        name_axes(axes, ("frequency", "Hz"), ("order of the model", "1"))

    return panel(
        1.6,
        draw,
        "Poles of models of every order over the size of the response (grey, logarithmic); vertical lines are the "
        "modes found.",
    )


def nyquist(fit: ModalFit) -> PageFigure:
    """Mobility around every mode in its strongest response, measured and synthesised."""

    def draw(axes: Axes, mode: IdentifiedMode) -> None:
        measured, fitted = (one[:: max(1, len(one) // 250)] for one in _mobility(fit, mode))
        axes.plot(np.real(measured), np.imag(measured), ".", ms=4.5, mew=0.0, color=MUTED)
        axes.plot(np.real(fitted), np.imag(fitted), color=BLUE, lw=0.8)
        axes.set_title(f"{mode.frequency.value:.5g} Hz, {100.0 * mode.damping.value:.2g} %")
        axes.set_aspect("equal", adjustable="datalim")
        name_axes(axes, *((f"{part} part", Quantity.VELOCITY.unit) for part in ("real", "imaginary")))
        few_ticks(axes, x=4, y=4)

    return panels(
        fit.modes[:MOST_CURVES],
        1.6,
        draw,
        "Mobility around each mode in the response that shows it most: lines measured (points) and the synthesis of "
        "all modes (curve), imaginary over real part, per unit of drive.",
        width=QUARTER,
    )


def synthesis(fit: ModalFit) -> PageFigure:
    """Size of every response, summed over outputs, with the synthesis of all modes and what is left."""
    curves = [
        (np.sqrt(np.sum(np.abs(values) ** 2, axis=(0, 1))), label, color)
        for values, label, color in (
            (fit.frf.values, "measured", INK),
            (fit.synthesis, "synthesised", BLUE),
            (fit.frf.values - fit.synthesis, "difference", MUTED),
        )
    ]

    def draw(axes: Axes) -> None:
        for size, label, color in curves:
            axes.plot(*decimate(fit.frf.frequency, size), color=color, lw=0.9, label=label)
        axes.set_yscale("log")
        name_axes(axes, ("frequency", "Hz"), ("response per unit of drive", fit.frf.quantity.unit))

    return panel(
        1.6,
        draw,
        f"All responses together: measured, synthesised from {how_many(len(fit.modes), 'mode')} and a smooth "
        f"background, and their difference, {100.0 * fit.misfit:.2g} % of the measured ones in root mean square.",
    )


def likeness(fit: ModalFit) -> PageFigure:
    """MAC of the modes with each other, as a picture."""
    names = [f"{mode.frequency.value:.4g}" for mode in fit.modes]

    def draw(axes: Axes) -> None:
        mac = fit.mac()
        axes.imshow(mac, cmap="Blues", vmin=0.0, vmax=1.0)
        for (row, column), value in np.ndenumerate(mac if len(names) <= MOST_NUMBERED else mac[:0]):
            axes.text(column, row, f"{value:.2f}", ha="center", va="center", color=ON_DARK if value > 0.5 else ON_LIGHT)
        axes.set_xticks(range(len(names)), names, rotation=90)
        axes.set_yticks(range(len(names)), names)
        axes.set(xlabel="mode (Hz)", ylabel="mode (Hz)")

    return panel(
        2.6,
        draw,
        "Modal assurance criterion of the modes' shapes with each other: 1 of shapes that are alike, 0 of shapes that "
        "have nothing in common.",
    )


def shapes(fit: ModalFit) -> PageFigure:
    """Shapes of the modes in the complex plane: an arrow for every point."""
    values = fit.complex_shapes()[:MOST_CURVES]

    def draw(axes: Axes, shown: tuple[IdentifiedMode, NDArray[np.complex128]]) -> None:
        mode, shape = shown
        for value in shape:
            axes.plot([0.0, value.real], [0.0, value.imag], color=BLUE, lw=1.0)
        axes.plot(shape.real, shape.imag, ".", ms=4.0, color=INK)
        axes.set_title(f"{mode.frequency.value:.5g} Hz")
        axes.set(xlim=(-1.1, 1.1), ylim=(-1.1, 1.1), xlabel="real part", ylabel="imaginary part")
        few_ticks(axes, x=3, y=3)

    return panels(
        zip(fit.modes[:MOST_CURVES], values, strict=True),
        1.6,
        draw,
        "Shapes of the modes: the value of each point over that of the largest, in the complex plane. Points of a real "
        "mode lie on one line.",
        width=QUARTER,
    )


def _mobility(fit: ModalFit, mode: IdentifiedMode) -> tuple[np.ndarray, np.ndarray]:
    """Measured and synthesised mobility (nl,) in the mode's strongest response, three half-power bands around it."""
    o, k = np.unravel_index(int(np.argmax(np.abs(mode.residues))), mode.residues.shape)
    f = mode.frequency.value
    half = max(6.0 * abs(mode.damping.value) * f, 5.0 * fit.frf.line)
    lines = np.abs(fit.frf.frequency - f) <= half
    power = (2.0j * np.pi * fit.frf.frequency[lines]) ** (1 - fit.frf.derivatives)
    return fit.frf.values[o, k, lines] * power, fit.synthesis[o, k, lines] * power
