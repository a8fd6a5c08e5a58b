"""Figures of a modal identification: stabilisation diagram, Nyquist curves of the modes, synthesis."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from tarsus.identify.modal import IdentifiedMode, ModalFit, Verdict
from tarsus.report.figures import Plate
from tarsus.report.style import (
    BLUE,
    INK,
    MUTED,
    RULE,
    VERMILION,
    WIDTH_IN,
    few_ticks,
    scale_of,
    stack,
    to_svg,
)

MOST_CURVES = 9
"""Modes whose Nyquist curve is drawn; of more, the lowest ones."""


def stabilisation(fit: ModalFit) -> Plate:
    """Poles of the models of every order over the summed response."""
    figure, (axes,) = stack([2.6], legend_rows=1)
    frequency = fit.frf.frequency
    summed = np.sqrt(np.sum(np.abs(fit.frf.values) ** 2, axis=(0, 1)))
    top = max(fit.poles)
    level = np.log10(np.maximum(summed, 1e-6 * summed.max()))
    height = (level - level.min()) / max(float(np.ptp(level)), 1e-12)
    axes.fill_between(frequency, 0.0, height * top, color=RULE, lw=0.0, zorder=1)
    order = np.concatenate([np.full(len(poles), n) for n, poles in fit.poles.items()])
    pole = np.concatenate(list(fit.poles.values()))
    inside = (pole.imag / (2.0 * np.pi) > frequency[0]) & (pole.imag / (2.0 * np.pi) < frequency[-1])
    damped = pole.real < 0.0
    for chosen, color, label in ((~damped, MUTED, "growing"), (damped, BLUE, "decaying")):
        part = inside & chosen
        axes.plot(
            pole[part].imag / (2.0 * np.pi), order[part], ".", ms=2.2, color=color, label=label, zorder=2
        )
    for mode in fit.modes:
        kept = mode.verdict is Verdict.DETERMINED
        axes.axvline(
            mode.frequency.value, color=VERMILION, lw=0.8, ls="-" if kept else (0, (4, 3)), zorder=1.5
        )
    axes.set_ylim(0.0, top + 1.0)
    axes.set_xlim(frequency[0], frequency[-1])
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel("order of the model")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, handletextpad=0.2, markerscale=3.0)
    caption = (
        "Poles of models of every order over the size of the response (grey, logarithmic); vertical lines are the "
        "modes found, broken where one is not determined."
    )
    return Plate(to_svg(figure, caption), caption)


def nyquist(fit: ModalFit) -> Plate:
    """Mobility around every mode in its strongest response, measured and synthesised."""
    modes = fit.modes[:MOST_CURVES]
    across = min(3, len(modes))
    down = -(-len(modes) // across)
    height = 2.35 * down + 0.3
    figure = Figure(figsize=(WIDTH_IN, height))
    panels = figure.subplots(down, across, squeeze=False)
    figure.subplots_adjust(
        left=0.09, right=0.985, bottom=0.4 / height, top=1.0 - 0.25 / height, wspace=0.32, hspace=0.42
    )
    for axes in panels.flat[len(modes) :]:
        axes.set_visible(False)
    for axes, mode in zip(panels.flat, modes, strict=False):
        measured, fitted = _mobility(fit, mode)
        scale = scale_of("", np.abs(measured))
        for curve, look in (
            (measured, {"marker": ".", "ls": "none", "color": INK}),
            (fitted, {"color": BLUE}),
        ):
            axes.plot(np.real(curve) / scale.step, np.imag(curve) / scale.step, ms=3.0, **look)
        axes.set_title(f"{mode.frequency.value:.5g} Hz, {100.0 * mode.damping.value:.2g} %", loc="left")
        axes.set_aspect("equal", adjustable="datalim")
        few_ticks(axes, x=4, y=4)
    caption = (
        "Mobility around each mode in the response that shows it most: lines measured (points) and the synthesis of "
        "all modes (curve), imaginary over real part."
    )
    return Plate(to_svg(figure, caption), caption)


def synthesis(fit: ModalFit) -> Plate:
    """Size of every response, summed over outputs, with the synthesis of all modes and what is left."""
    figure, (axes,) = stack([2.6], legend_rows=1)
    for values, label, color in (
        (fit.frf.values, "measured", INK),
        (fit.synthesis, "synthesised", BLUE),
        (fit.frf.values - fit.synthesis, "difference", MUTED),
    ):
        size = np.sqrt(np.sum(np.abs(values) ** 2, axis=(0, 1)))
        axes.semilogy(fit.frf.frequency, size, color=color, lw=0.9, label=label)
    axes.set_xlim(fit.frf.frequency[0], fit.frf.frequency[-1])
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel(f"response ({fit.frf.quantity.unit} per unit of drive)")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
    caption = (
        f"All responses together: measured, synthesised from {len(fit.modes)} modes and a smooth background, and their "
        f"difference, {100.0 * fit.misfit:.2g} % of the measured ones in root mean square."
    )
    return Plate(to_svg(figure, caption), caption)


def _mobility(fit: ModalFit, mode: IdentifiedMode) -> tuple[np.ndarray, np.ndarray]:
    """Measured and synthesised mobility (nl,) in the mode's strongest response, three half-power bands around it."""
    o, k = np.unravel_index(int(np.argmax(np.abs(mode.residues))), mode.residues.shape)
    f = mode.frequency.value
    half = max(6.0 * abs(mode.damping.value) * f, 5.0 * fit.frf.line)
    lines = np.abs(fit.frf.frequency - f) <= half
    power = (2.0j * np.pi * fit.frf.frequency[lines]) ** (1 - fit.frf.derivatives)
    return fit.frf.values[o, k, lines] * power, fit.synthesis[o, k, lines] * power
