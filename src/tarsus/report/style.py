"""Look of every figure: colours, unit prefixes, decimation."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from tarsus.tables.numbers import prefixed, set_power

INK = "#1f2328"
MUTED = "#6b7280"
RULE = "#d5d9df"
CONTACT = "#e9e4d8"
BLUE = "#0072b2"
VERMILION = "#d55e00"
GREEN = "#009e73"
PURPLE = "#a6558b"
ORANGE = "#c98600"
SKY = "#56b4e9"
CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
"""Colours that readers with any of the common colour deficiencies distinguish (after Okabe and Ito)."""

FAR_BODY, NEAR_BODY, FAR_LEG = "#d9dee5", "#b9c3cf", "#9fb4c6"
"""Of a drawn robot."""

ON_LIGHT, ON_DARK = "#1a1a1a", "#fdfdfd"
"""Words on coloured fields, whose ground is the field and not the page: no colours that a dark page changes."""

MOST_LINES = len(CYCLE)
"""Points or feet that are drawn unless others are asked for: as many as there are such colours."""

PAINTS = {
    INK: "ink",
    MUTED: "muted",
    RULE: "rule",
    CONTACT: "contact",
    BLUE: "c-blue",
    VERMILION: "c-vermilion",
    GREEN: "c-green",
    PURPLE: "c-purple",
    ORANGE: "c-orange",
    SKY: "c-sky",
    "#ffffff": "paper",
    FAR_BODY: "body-far",
    NEAR_BODY: "body-near",
    FAR_LEG: "leg-far",
}
"""What each colour is called in the page's style, which has others for a dark page."""


def paint_of(color: str) -> str:
    """What a colour of a figure is called in the page's style. Raises KeyError for one that has no name there."""
    return PAINTS[color]


def themed(svg: str) -> Markup:
    """An SVG element whose colours follow the page's style."""
    return Markup(_COLOR.sub(lambda m: f"var(--{PAINTS[m[0]]})" if m[0] in PAINTS else m[0], svg))


_COLOR = re.compile(r"#[0-9a-f]{6}\b")


@dataclass(frozen=True)
class AxisScale:
    """Engineering prefix for plotting: shown number = SI value / `step`, with `label` as its unit, "" for none."""

    step: float
    label: str

    def axis(self, words: str) -> str:
        """What an axis is called: words with the unit."""
        return f"{words} ({self.label})".lstrip() if self.label else words


SMALLEST = 1e-15
"""Magnitude below which there is no prefix."""


def scale_of(unit: str, *values: np.ndarray | float) -> AxisScale:
    """Prefix that brings the largest finite magnitude of `values` (SI, in `unit`) into 1..1000, if the unit bears one.

    Where no prefix reaches it is a power of ten, for an axis has no room for numbers of 1e-22.
    """
    largest = max((float(np.max(np.abs(v), initial=0.0, where=np.isfinite(v))) for v in values), default=0.0)
    step, label = prefixed(largest, unit)
    if step == 1.0 and 0.0 < largest < SMALLEST:
        power = 3 * int(np.floor(np.log10(largest) / 3.0))
        return AxisScale(10.0**power, f"{set_power(f'1e{power}').removeprefix('1·')} {label}".rstrip())
    return AxisScale(step, label)


ROUNDING = 1e-9
"""Values that differ by less of their size are one: orbits are closed to 1e-10, and sums of a run round far below."""


def level_limits(*values: np.ndarray) -> tuple[float, float] | None:
    """Limits of an axis whose values are one to rounding, a twentieth of their size about it, so that they are drawn
    as a level line; None where they differ, or are all 0."""
    known = np.concatenate([one[np.isfinite(one)] for one in map(np.ravel, values)] or [np.zeros(0)])
    size = float(np.max(np.abs(known), initial=0.0))
    if size == 0.0 or float(np.ptp(known)) > ROUNDING * size:
        return None
    middle = float(0.5 * (known.min() + known.max()))
    return middle - 0.05 * size, middle + 0.05 * size


def samples_inside(time: np.ndarray, window: tuple[float, float]) -> slice:
    """Samples within a window, with one more on either side so that lines reach the frame."""
    first = max(int(np.searchsorted(time, window[0], side="right")) - 1, 0)
    last = min(int(np.searchsorted(time, window[1], side="left")) + 1, len(time))
    return slice(first, last)


def decimate(x: np.ndarray, values: np.ndarray, bins: int = 700) -> tuple[np.ndarray, np.ndarray]:
    """One series (n,) as `thinned` has it, to the extremes of so many bins."""
    x, rows = thinned(x, values[None], 2 * bins)
    return x, rows[0]


def thinned(x: np.ndarray, rows: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Series (rows, n) thinned to at most ``most`` common times: the extremes of each bin, in their order.

    All rows share the times, a quarter of a bin from its ends; ends of a series stay where they are. A bin in which
    a row has no number stays empty.
    """
    if len(x) <= most:
        return x, rows
    bins = most // 2
    starts = np.unique(np.linspace(0, len(x), bins, endpoint=False).astype(int))
    ends = np.append(starts[1:], len(x)) - 1
    low, high = (extreme.reduceat(rows, starts, axis=1) for extreme in (np.fmin, np.fmax))
    falls = rows[:, ends] < rows[:, starts]
    first, second = np.where(falls, high, low), np.where(falls, low, high)
    long = x[ends] - x[starts]
    times = np.column_stack([x[starts] + 0.25 * long, x[ends] - 0.25 * long]).ravel()
    times[0], times[-1] = x[0], x[-1]
    return times, np.stack([first, second], axis=2).reshape(len(rows), -1)
