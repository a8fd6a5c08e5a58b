"""Look of every figure: colours, sizes, unit prefixes, decimation, and a matplotlib figure as inline SVG.

matplotlib is loaded by what draws with it: the report of a run does not.
"""

from __future__ import annotations

import io
import math
import re
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tarsus.report.charts import Panel

WIDTH_IN = 7.4
"""Width of a full-width figure [inch]; the page scales it."""

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
"""Colours told apart by readers with any of the common colour deficiencies (after Okabe and Ito)."""

PAINTS = {
    INK: "ink", MUTED: "muted", RULE: "rule", CONTACT: "contact", BLUE: "c-blue", VERMILION: "c-vermilion",
    GREEN: "c-green", PURPLE: "c-purple", ORANGE: "c-orange", SKY: "c-sky", "#ffffff": "paper",
    "#d9dee5": "body-far", "#b9c3cf": "body-near", "#9fb4c6": "leg-far",
}  # fmt: skip
"""What each colour is called in the page's style, which has others for a dark page."""


def paint_of(color: str) -> str:
    """What a colour of a figure is called in the page's style. Raises KeyError for one that has no name there."""
    return PAINTS[color]


def themed(svg: str) -> str:
    """An SVG text whose colours follow the page's style; alone it looks as before."""
    return _COLOR.sub(lambda m: f"var(--{PAINTS[m[0]]}, {m[0]})" if m[0] in PAINTS else m[0], svg)


_COLOR = re.compile(r"#[0-9a-f]{6}\b")

_RC: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.labelsize": 8.0,
    "axes.titlesize": 8.0,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
    "axes.formatter.useoffset": False,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "lines.linewidth": 1.1,
    "lines.solid_joinstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "legend.handlelength": 1.6,
    "path.simplify": True,
    "path.simplify_threshold": 0.2,
    "text.color": INK,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "mathtext.default": "regular",
}

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


@dataclass(frozen=True)
class Scale:
    """Engineering prefix for plotting: shown number = SI value / `step`, with `label` as its unit."""

    step: float
    label: str


def time_axis(axes: Axes | Panel, window: tuple[float, float], clock: Scale) -> None:
    """Limits and label of a lowest axis that shows a window of time [s]."""
    axes.set_xlim(window[0] / clock.step, window[1] / clock.step)
    axes.set_xlabel(f"time ({clock.label})")


def scale_of(unit: str, *values: np.ndarray | float) -> Scale:
    """Prefix that brings the largest finite magnitude of `values` (SI, in `unit`) into 1..1000, if one does."""
    largest = max((float(np.max(np.abs(v), initial=0.0, where=np.isfinite(v))) for v in values), default=0.0)
    if largest <= 0.0:
        return Scale(1.0, unit)
    power = 3 * math.floor(math.log10(largest * 1.000001) / 3)
    if power not in _PREFIXES:
        return Scale(1.0, unit)
    return Scale(10.0**power, _PREFIXES[power] + unit)


@contextmanager
def figure_style() -> Iterator[None]:
    """The report's matplotlib settings, for the length of a `with` block only."""
    import matplotlib

    with matplotlib.rc_context(_RC):
        yield


LEFT, RIGHT, BOTTOM = 0.76, 0.10, 0.42
"""Margins around the panels [inch]: value labels and axis label, last tick label, time axis."""

LEGEND_ROW = 0.19
"""Height of one row of legend [inch]."""


def stack(
    heights_in: Sequence[float], gap_in: float = 0.14, legend_rows: int = 0
) -> tuple[Figure, list[Axes]]:
    """A figure of panels above each other, with one horizontal axis, of the given heights [inch].

    `legend_rows` leaves room above the first panel.
    Places are fixed, not fitted: laying out by measuring text would double the time a figure takes.
    """
    from matplotlib.figure import Figure

    above = 0.06 + LEGEND_ROW * legend_rows
    total = sum(heights_in) + gap_in * (len(heights_in) - 1) + BOTTOM + above
    figure = Figure(figsize=(WIDTH_IN, total))
    width = WIDTH_IN - LEFT - RIGHT
    panels: list[Axes] = []
    top = total - above
    for height in heights_in:
        place = (LEFT / WIDTH_IN, (top - height) / total, width / WIDTH_IN, height / total)
        axes = figure.add_axes(place, sharex=panels[0] if panels else None)
        axes.yaxis.set_label_coords(-0.47 / width, 0.5)
        panels.append(axes)
        top -= height + gap_in
    for axes in panels[:-1]:  # ticks without labels would be a tenth of all that a report draws
        axes.xaxis.set_visible(False)
    panels[-1].xaxis.set_label_coords(0.5, -0.26 / heights_in[-1])
    return figure, panels


def few_ticks(axes: Axes, x: int | None = None, y: int | None = None) -> None:
    """At most so many tick intervals per axis."""
    from matplotlib.ticker import MaxNLocator

    if x is not None:
        axes.xaxis.set_major_locator(MaxNLocator(x))
    if y is not None:
        axes.yaxis.set_major_locator(MaxNLocator(y))


def upright(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Samples with jumps drawn upright: a step between two level stretches, slanted by sampling, gets both its ends
    in the middle between its samples.

    `values` shape [..., samples]; where one row jumps, the others get two samples on their line.
    """
    rows = np.atleast_2d(values)
    change = np.diff(rows)
    known = np.where(np.isfinite(rows), rows, np.nan)
    if rows.shape[1] < 2 or np.isnan(known).all():
        return time, values
    span = np.nanmax(known, axis=1, initial=-np.inf) - np.nanmin(known, axis=1, initial=np.inf)
    span = np.where(np.isfinite(span) & (span > 0.0), span, np.inf)[:, None]
    level = np.abs(change) < 1e-3 * span
    ends = np.ones((len(rows), 1), dtype=bool)
    jumps = np.abs(change) > 0.1 * span
    jumps &= np.concatenate([ends, level[:, :-1]], axis=1) & np.concatenate([level[:, 1:], ends], axis=1)
    at = np.flatnonzero(jumps.any(axis=0))
    if not len(at):
        return time, values
    middle = 0.5 * (rows[:, at] + rows[:, at + 1])
    before = np.where(jumps[:, at], rows[:, at], middle)
    after = np.where(jumps[:, at], rows[:, at + 1], middle)
    place, between = np.repeat(at + 1, 2), np.repeat(0.5 * (time[at] + time[at + 1]), 2)
    put = np.stack([before, after], axis=2).reshape(len(rows), -1)
    shown = np.insert(rows, place, put, axis=1)
    return np.insert(time, place, between), shown.reshape(*values.shape[:-1], -1)


def decimate(time: np.ndarray, values: np.ndarray, bins: int = 700) -> tuple[np.ndarray, np.ndarray]:
    """Thin a long series to its extremes per bin of time, so that no peak is lost.

    `time`, `values` shape [samples]; returns the kept samples in order, at most 2 * `bins` + 2 of them (and
    one more per bin with NaN, so that gaps in a line stay gaps).
    """
    if len(time) <= 2 * bins + 2:
        return time, values
    span = time[-1] - time[0]
    bin_of = np.minimum(((time - time[0]) * (bins / span)).astype(int), bins - 1)
    starts = np.flatnonzero(np.diff(bin_of, prepend=-1))
    counts = np.diff(starts, append=len(time))
    keep = [np.array([0, len(time) - 1])]
    for extreme in (np.fmin, np.fmax):
        keep.append(_first_of_bin(values == np.repeat(extreme.reduceat(values, starts), counts), bin_of))
    keep.append(_first_of_bin(np.isnan(values), bin_of))
    keep = np.unique(np.concatenate(keep))
    return time[keep], values[keep]


def _first_of_bin(chosen: np.ndarray, bin_of: np.ndarray) -> np.ndarray:
    """Index of the first chosen sample in each bin that has one."""
    index = np.flatnonzero(chosen)
    return index[np.diff(bin_of[index], prepend=-1) != 0]


_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_TAG = re.compile(r"<[^>]*>")
_ID = re.compile(r' id="([^"]*)"')
_REFERENCE = re.compile(r"#([A-Za-z_][\w.-]*)")


def to_svg(figure: Figure, label: str) -> str:
    """A figure as one `<svg>` element for inline use: no fixed size, no metadata, coordinates rounded.

    The same figure always gives the same text; ids are unique to its content.
    """
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    stream = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "tarsus"}):
        nothing = {"Date": None, "Creator": None, "Format": None, "Type": None}
        FigureCanvasSVG(figure).print_svg(stream, metadata=nothing)
    text = stream.getvalue()
    head, body = text[text.index("<svg") :].split(">", 1)
    box = re.search(r'viewBox="[^"]*"', head)
    if box is None:
        raise ValueError("matplotlib wrote an SVG without viewBox")
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r"<!--.*?-->", "", body, flags=re.DOTALL)
    body = re.sub(r"\n\s*", "\n", body)
    body = _TAG.sub(lambda m: _LONG_NUMBER.sub(_short, m.group()), body)
    body = body.replace("'DejaVu Sans'", "inherit")
    used = set(_REFERENCE.findall(body))
    prefix = f"f{zlib.crc32(body.encode()):08x}"
    body = _ID.sub(lambda m: f' id="{prefix}-{m.group(1)}"' if m.group(1) in used else "", body)
    body = re.sub(r"(url\(|href=\")#", rf"\1#{prefix}-", body)
    opening = (
        f'<svg xmlns="http://www.w3.org/2000/svg" {box.group()} role="img" aria-label="{_attribute(label)}">'
    )
    return themed(opening + body)


def _short(number: re.Match[str]) -> str:
    return f"{float(number.group()):.2f}".rstrip("0").rstrip(".")


def _attribute(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
