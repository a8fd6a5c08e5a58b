"""Figures that matplotlib draws, as inline SVG: every panel is a picture of half a page's width, and the page sets as
many side by side as there is room for, on a phone one.

matplotlib is loaded by what draws with it.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any, TypeVar

import matplotlib
import numpy as np
import numpy.typing as npt
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter, MaxNLocator, NullFormatter

from tarsus.report.pages import PageFigure
from tarsus.report.style import CONTACT, INK, MUTED, decimate, scale_of, themed
from tarsus.tables.numbers import number, set_power

WIDTH = 3.7
"""Width of a panel [inch]: where it is 330 px wide, a third of a page or a phone, letters of 8 pt are 10 px high."""

QUARTER = 2.8
"""The same where it is 220 px wide, a quarter of a page: they have few words."""

BELOW, LEGEND_ROW = 0.5, 0.19
"""Room for the words of a panel's horizontal axis, and for a row of a legend [inch]."""

DPI = 160
"""Of pictures in a panel, such as maps: two pixels to one of a screen of usual size."""

PIXELS = 300
"""Stretches of a line of which each keeps its extremes: a panel is about so many pixels wide."""

LETTER, HANDLE = 0.062, 0.42
"""Of a legend [inch]: width of a letter, and of a sign with its gaps."""

_RC: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.labelsize": 8.0,
    "axes.titlesize": 8.0,
    "axes.titlelocation": "left",
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
    "figure.constrained_layout.h_pad": 0.03,
    "figure.constrained_layout.w_pad": 0.03,
}


Shown = TypeVar("Shown")


@contextmanager
def figure_style() -> Iterator[None]:
    """The report's matplotlib settings, for the length of a `with` block only."""
    with matplotlib.rc_context(_RC):
        yield


def name_axes(axes: Axes, x: tuple[str, str] | None = None, y: tuple[str, str] | None = None) -> None:
    """Names of axes in which numbers in SI units are drawn, each (words, unit): its ticks stand under one prefix, that
    of what is drawn by now."""
    spans = (axes.dataLim.intervalx, axes.dataLim.intervaly)
    for axis, named, span in zip((axes.xaxis, axes.yaxis), (x, y), spans, strict=True):
        if named is None:
            continue
        scale = scale_of(named[1], *span)
        axis.set_label_text(scale.axis(named[0]))
        if scale.step != 1.0:
            axis.set_major_formatter(partial(_tick, step=scale.step))
            axis.set_minor_formatter(NullFormatter())


def _tick(value: float, _: float, *, step: float) -> str:
    shown = float(f"{value / step:.9g}")  # ticks are sums: none has more digits, and one that is all rounding is 0
    return number(shown if abs(shown) > 1e-12 else 0.0, 6)


def few_ticks(axes: Axes, x: int | None = None, y: int | None = None) -> None:
    """At most so many tick intervals per axis."""
    if x is not None:
        axes.xaxis.set_major_locator(MaxNLocator(x))
    if y is not None:
        axes.yaxis.set_major_locator(MaxNLocator(y))


def whole_ticks(axis: Axis, values: npt.ArrayLike) -> None:
    """Ticks at whole numbers alone where all values (n,) of an axis are whole: there is no half impact."""
    known, ticks = np.ravel(np.asarray(values, dtype=float)), axis.get_major_locator()
    known = known[np.isfinite(known)]
    if isinstance(ticks, MaxNLocator) and len(known) and np.array_equal(known, np.rint(known)):
        ticks.set_params(integer=True, min_n_ticks=1)


def line(axes: Axes, x: npt.ArrayLike, y: npt.ArrayLike, **look: Any) -> None:
    """A line through points (n,) in order of x, of as many points as a panel has pixels."""
    axes.plot(*decimate(np.asarray(x, dtype=float), np.asarray(y, dtype=float), PIXELS), **look)


def shade(axes: Axes, stretches: Iterable[tuple[float, float]], label: str = "") -> None:
    """Stretches of the horizontal axis, shaded from bottom to top."""
    for start, end in stretches:
        axes.axvspan(start, end, color=CONTACT, lw=0.0, zorder=0, label=label)
        label = ""


def intervals(
    axes: Axes,
    at: npt.ArrayLike,
    values: npt.ArrayLike,
    low: npt.ArrayLike,
    high: npt.ArrayLike,
    *,
    color: str,
    label: str = "",
    across: bool = False,
) -> None:
    """Dots at values (n,), each with a line from low to high if these are numbers. across: values go to the right."""
    values = np.asarray(values, dtype=float)
    ends = np.abs(np.nan_to_num(np.stack([values - low, np.asarray(high, dtype=float) - values])))
    look: dict[str, Any] = {"fmt": "o", "ms": 3.0, "mew": 0.0, "lw": 0.8, "color": color, "label": label}
    if across:
        axes.errorbar(values, at, xerr=ends, **look)
    else:
        axes.errorbar(at, values, yerr=ends, **look)


def named(axes: Axes) -> tuple[list[str], list[Any]]:
    """The names of what a panel shows, each once, and what the last of that name looks like."""
    looks = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    return list(looks), list(looks.values())


class PanelGrid:
    """The panels of one figure."""

    def __init__(self) -> None:
        self.figures: list[Figure] = []

    def grid(self, count: int, height: float, *, width: float = WIDTH) -> list[Axes]:
        """So many panels of a height [inch], each a picture of its own."""
        return [panels[0] for panels in self.stacks(count, [height], width=width)]

    def stacks(self, count: int, heights: Sequence[float], *, width: float = WIDTH) -> list[list[Axes]]:
        """So many stacks of panels of the given heights [inch], each a picture."""
        stacks: list[list[Axes]] = []
        for _ in range(count):
            figure = Figure(figsize=(width, sum(heights) + BELOW), layout="constrained", dpi=DPI)
            made = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
            stacks.append(list(made[:, 0]))
            for axes in stacks[-1][:-1]:  # ticks without labels would be a tenth of all that a page draws
                axes.xaxis.set_visible(False)
            figure.align_ylabels(stacks[-1])
            self.figures.append(figure)
        return stacks

    def legend(self, axes: Axes) -> None:
        """The names of what a panel shows, in rows above it."""
        labels, handles = named(axes)
        if not labels:
            return
        figure = axes.get_figure(root=True)
        assert figure is not None
        column = LETTER * max(map(len, labels)) + HANDLE
        columns = min(len(labels), max(1, int(figure.get_figwidth() / column)))
        figure.set_figheight(figure.get_figheight() + LEGEND_ROW * -(-len(labels) // columns))
        figure.legend(
            handles,
            labels,
            loc="outside upper left",
            ncols=columns,
            borderaxespad=0.1,
            columnspacing=1.2,
            handletextpad=0.5,
        )


def page_figure(draw: Callable[[PanelGrid], object], caption: str) -> PageFigure:
    """A figure as ``draw`` draws it."""
    with figure_style():
        page = PanelGrid()
        draw(page)
        for figure in page.figures:
            _read_powers(figure)
        pictures = [to_svg(one, f"{caption} {number}") for number, one in enumerate(page.figures)]
    panels = Markup("").join(Markup('<div class="plate">{}</div>').format(one) for one in pictures)
    small = bool(page.figures) and page.figures[0].get_figwidth() <= QUARTER
    picture = Markup('<div class="panels{}" role="img" aria-label="{}">{}</div>')
    return PageFigure(picture.format(" quarters" if small else "", caption, panels), caption)


def panels(
    shown: Iterable[Shown], height: float, draw: Callable[[Axes, Shown], object], caption: str, *, width: float = WIDTH
) -> PageFigure:
    """A figure of a panel of a height [inch] for each thing that is shown, with the names of what it shows above it."""
    things = list(shown)

    def each(page: PanelGrid) -> None:
        for axes, one in zip(page.grid(len(things), height, width=width), things, strict=True):
            draw(axes, one)
            page.legend(axes)

    return page_figure(each, caption)


def panel(height: float, draw: Callable[[Axes], object], caption: str, *, width: float = WIDTH) -> PageFigure:
    """A figure of one panel."""
    return panels((None,), height, lambda axes, _: draw(axes), caption, width=width)


def _read_powers(figure: Figure) -> None:
    """Powers of ten on logarithmic axes in raised letters, which are larger than matplotlib's raised numbers."""
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        if isinstance(axis.get_major_formatter(), LogFormatter):
            axis.set_major_formatter(lambda value, _: set_power(f"{value:.0e}").replace("1·", "") if value else "0")
            axis.set_minor_formatter(NullFormatter())


_TAG, _LONG_NUMBER = re.compile(r"<(?!image)[^>]*>"), re.compile(r"-?\d+\.\d{3,}")
_NEEDLESS = re.compile(
    r' id="[A-Za-z][A-Za-z0-9.]*_\d+"|<metadata>.*?</metadata>|<defs>\s*<style.*?</style>\s*</defs>'
    r'|\s*\n\s*(?=[<LCQMz"])| transform="rotate\(-0 [^"]*"|<path d="[^"]*" style="fill: none"/>',
    re.DOTALL,
)
"""Names of groups, which are the same in every figure and used by nothing; who made it; how lines join, which the
page's style says; line breaks; turns by nothing; frames that are not drawn."""

_WORDS = re.compile(r'<text style="([^"]*)"')
_USUAL = re.compile(rf"font-family: .*|font-size: 8px|text-anchor: start|fill: {INK}")
"""What the page's style says of letters."""

_MARKS = re.compile(r'<g([^>]*)>((?:<use [^>]*?( style="[^"]*")/>)(?:<use [^>]*?\3/>)*)</g>')
"""Marks of one look, which is said once for all of them."""

_FRAME = re.compile(
    rf' style="(?:fill: (?:none|{MUTED}); )?stroke: {MUTED}; stroke-width: 0\.6'
    r'(?:; stroke-linejoin: miter; stroke-linecap: square)?"'
)
"""What ticks and the lines of axes look like, which is in the page's style."""


def to_svg(figure: Figure, salt: str) -> Markup:
    """A figure as one `<svg>` element for inline use: no fixed size, no metadata, coordinates to hundredths of a point,
    colours that follow the page's. `salt` makes the ids of its parts its own: give every figure of a page another one.

    matplotlib writes whole files with colours of their own; it has no setting for any of this.
    """
    stream = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": salt}):
        FigureCanvasSVG(figure).print_svg(stream, metadata={"Date": None})
    text = stream.getvalue()
    head, body = text[text.index("<svg") :].split(">", 1)
    box = re.search(r'viewBox="[^"]*"', head)
    assert box is not None, "matplotlib writes one"
    body = _TAG.sub(lambda tag: _LONG_NUMBER.sub(_hundredths, tag[0]), _NEEDLESS.sub("", body))
    body = _MARKS.sub(lambda found: f"<g{found[1]}{found[3]}>{found[2].replace(found[3], '')}</g>", body)
    body = _FRAME.sub(' class="frame"', _WORDS.sub(_look_of_words, body)).replace("<g/>", "").replace("<g></g>", "")
    return themed(f'<svg xmlns="http://www.w3.org/2000/svg" {box[0]} aria-hidden="true">{body}')


def _look_of_words(found: re.Match[str]) -> str:
    own = [one for one in found[1].split("; ") if not _USUAL.fullmatch(one)]
    return f'<text style="{"; ".join(own)}"' if own else "<text"


def _hundredths(number: re.Match[str]) -> str:
    return f"{float(number[0]):.2f}".rstrip("0").rstrip(".")
