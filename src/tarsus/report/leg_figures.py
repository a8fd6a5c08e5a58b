"""Figures of a leg: its answer to a step beside the single-mode model, and the landscape of its lengths."""

from __future__ import annotations

import numpy as np

from tarsus.base.spec import float_paths, get_value
from tarsus.design.legs import Landscape, LinkDesign
from tarsus.model.structure.base import Array
from tarsus.model.structure.leg import Leg
from tarsus.model.structure.leg_motion import LegMotion
from tarsus.report.pages import Plate
from tarsus.report.sheet import Sheet, few_ticks, name_axes, plate
from tarsus.report.style import BLUE, INK, MUTED, VERMILION, scale_of


def step_figure(motion: LegMotion, single: Array, volts: float) -> Plate:
    """Lift of the body after a step: the multi-body leg and a single-mode model (as Fig. 4.4).

    Parameters
    ----------
    motion
        The nonlinear leg (n samples).
    single
        Lift of the single-mode model (4.3) at the same times (n,) [m].
    volts
        Height of the step [V].
    """
    time = motion.time
    first = int(np.argmax(motion.lift))

    def draw(sheet: Sheet) -> None:
        (axes,) = sheet.grid(1, 2.2)
        axes.plot(time, motion.lift, color=BLUE, label="multi-body leg (Fig. 4.3)")
        axes.plot(time, single, color=VERMILION, ls=(0, (5, 2)), label="single mode (4.3)")
        if 0 < first < len(time) - 1:
            axes.plot(time[first], motion.lift[first], "o", ms=3.5, color=BLUE)
        axes.set_xlim(time[0], time[-1])
        axes.set_ylim(bottom=min(0.0, float(motion.lift.min())))
        name_axes(axes, ("time", "s"), ("lift of the body", "m"))
        few_ticks(axes, y=6)
        sheet.legend(axes)

    return plate(draw, f"Lift of the body after a step to {volts:g} V, from rest under its load.")


def landscape_figure(land: Landscape, leg: Leg, load: float, design: LinkDesign | None = None) -> Plate:
    """Mean speed over two floats of a leg, the limit of its load, and where leg and design stand.

    Parameters
    ----------
    land
        The landscape.
    leg
        The leg to mark.
    load
        Force that must be carried [N].
    design
        A design to mark.
    """
    infos = float_paths(leg)
    speed, weight = scale_of("m/s", land.speed), scale_of("N", load)
    x, y = land.x, land.y
    tight = land.capacity.min() < load < land.capacity.max()
    marks = (("as given", leg, "o", INK), ("design", design and design.leg, "*", VERMILION))

    def draw(sheet: Sheet) -> None:
        (axes,) = sheet.grid(1, 2.6)
        shown = axes.contourf(x, y, land.speed / speed.step, levels=14, cmap="Blues")
        bar = axes.figure.colorbar(shown, ax=axes, pad=0.02)
        bar.set_label(speed.axis("mean speed to the first peak"), color=INK)
        if tight:
            axes.contour(x, y, land.capacity / load, levels=[1.0], colors=[INK], linewidths=1.2)
            axes.contourf(x, y, land.capacity / load, levels=[0.0, 1.0], colors=[MUTED], alpha=0.35)
        for name, one, mark, color in marks:
            if one is not None:
                at = (get_value(one, land.across), get_value(one, land.up))
                size = 9 if mark == "*" else 5
                axes.plot(*at, mark, ms=size, color=color, label=name, clip_on=False, zorder=3)
        name_axes(axes, *((path, infos[path].unit) for path in (land.across, land.up)))
        sheet.legend(axes)

    caption = "Mean speed of the body from the step to its first peak; none where the leg creeps without one."
    if tight:
        caption += f" In grey the leg does not carry {load / weight.step:.3g} {weight.label}."
    return plate(draw, caption)
