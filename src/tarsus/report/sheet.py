"""Figures that matplotlib draws, as inline SVG: each on wide and on narrow paper, of which a page shows what fits.

matplotlib is loaded by what draws with it: the report of a run does not.
"""

from __future__ import annotations

import io
import re
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tarsus.report.figures import Plate
from tarsus.report.style import INK, LEGEND_ROW, MUTED, NARROW_IN, WIDTH_IN, themed

__all__ = ["Sheet", "few_ticks", "figure_style", "plate", "to_svg"]

LEFT, RIGHT, BELOW = 0.68, 0.18, 0.44
"""Margins around a panel [inch]: value labels and axis label; last tick label; ticks and label of the axis below."""

LETTER, HANDLE = 0.062, 0.42
"""Of a legend [inch]: width of a letter, and of a sign with its gaps."""

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

@contextmanager
def figure_style() -> Iterator[None]:
    """The report's matplotlib settings, for the length of a `with` block only."""
    with matplotlib.rc_context(_RC):
        yield


def few_ticks(axes: Axes, x: int | None = None, y: int | None = None) -> None:
    """At most so many tick intervals per axis."""
    if x is not None:
        axes.xaxis.set_major_locator(MaxNLocator(x))
    if y is not None:
        axes.yaxis.set_major_locator(MaxNLocator(y))


class Sheet:
    """Paper of one width [inch]. Places are fixed, not fitted: measuring text would double the time a figure takes."""

    def __init__(self, width: float) -> None:
        self.width = width
        self.narrow = width < WIDTH_IN
        self.figure = Figure(figsize=(width, 1.0))

    def grid(self, count: int, height: float, **how: Any) -> list[Axes]:
        """Panels of a height [inch], beside each other in rows; ``how`` as in `stacks`."""
        return [panels[0] for panels in self.stacks(count, [height], **how)]

    def stack(self, heights: Sequence[float], gap: float = 0.14) -> list[Axes]:
        """Panels below each other with one horizontal axis, of the given heights and a gap between them [inch]."""
        return self.stacks(1, heights, gap=gap)[0]

    def stacks(
        self, count: int, heights: Sequence[float], *, across: int = 2, left: float = LEFT, title: int = 0,
        joined: bool = False, gap: float = 0.14,
    ) -> list[list[Axes]]:  # fmt: skip
        """Stacks of panels of the given heights [inch], row by row: so many across, on narrow paper below each other.

        Panels of a stack share the horizontal axis. left: room for the words beside a panel; title: lines of one above;
        joined: panels beside each other share the vertical axis and its words; gap: between panels of a stack.
        """
        columns = 1 if self.narrow else min(across, count)
        between = 0.14 if joined else left
        wide = (self.width - left - RIGHT - (columns - 1) * (between + RIGHT)) / columns
        above = 0.05 + 0.15 * title if title else 0.0
        tall = above + sum(heights) + gap * (len(heights) - 1) + BELOW
        total = -(-count // columns) * tall + 0.06
        self.figure.set_size_inches(self.width, total)
        stacks: list[list[Axes]] = []
        for k in range(count):
            row, column = divmod(k, columns)
            beside = stacks[k - column] if joined and column else None
            x, top = left + column * (wide + between + RIGHT), total - 0.06 - row * tall - above
            panels: list[Axes] = []
            for i, height in enumerate(heights):
                place = (x / self.width, (top - height) / total, wide / self.width, height / total)
                axes = self.figure.add_axes(
                    place, sharex=panels[0] if panels else None, sharey=beside[i] if beside else None
                )
                axes.tick_params(labelleft=beside is None)
                if len(heights) > 1:
                    axes.yaxis.set_label_coords(-0.45 / wide, 0.5)
                panels.append(axes)
                top -= height + gap
            for axes in panels[:-1]:  # ticks without labels would be a tenth of all that a page draws
                axes.xaxis.set_visible(False)
            stacks.append(panels)
        return stacks

    def square(self, side: float, beside: float) -> Axes:
        """A square panel [inch] with room for equal words left of it and below it, and a bar above."""
        total = side + beside + 0.55
        self.figure.set_size_inches(self.width, total)
        x = beside + max(0.0, 0.5 * (self.width - beside - side - 0.3))
        return self.figure.add_axes((x / self.width, beside / total, side / self.width, (side + 0.4) / total))

    def legend(self, axes: Axes, **look: Any) -> None:
        """The names of what a panel shows, in rows above all panels."""
        handles, labels = axes.get_legend_handles_labels()
        if not labels:
            return
        column = LETTER * max(map(len, labels)) + HANDLE
        columns = min(len(labels), max(1, int(self.width / column)))
        self.raise_by(LEGEND_ROW * -(-len(labels) // columns) + 0.06)
        self.figure.legend(
            handles, labels, loc="upper center", ncols=columns, borderaxespad=0.1, columnspacing=1.2,
            handletextpad=0.5, **look,
        )  # fmt: skip

    def raise_by(self, above: float) -> None:
        """Make room above all panels [inch]."""
        width, total = self.figure.get_size_inches()
        self.figure.set_size_inches(width, total + above)
        part = total / (total + above)
        for axes in self.figure.axes:
            x, y, wide, tall = axes.get_position().bounds
            axes.set_position((x, y * part, wide, tall * part))


def plate(draw: Callable[[Sheet], object], caption: str, *, wide: bool = True) -> Plate:
    """A figure as ``draw`` draws it on wide and on narrow paper; one that is not ``wide`` on narrow paper alone."""
    with figure_style():
        pictures = []
        for width in (WIDTH_IN, NARROW_IN) if wide else (NARROW_IN,):
            sheet = Sheet(width)
            draw(sheet)
            pictures.append(to_svg(sheet.figure, caption))
    if not wide:
        return Plate(pictures[0], caption, wide=False)
    return Plate.of_both(pictures[0], pictures[1], caption)


_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_TAG = re.compile(r"<[^>]*>")
_ID = re.compile(r' id="([^"]*)"')
_REFERENCE = re.compile(r"#([A-Za-z_][\w.-]*)")


def to_svg(figure: Figure, label: str) -> Markup:
    """A figure as one `<svg>` element for inline use: no fixed size, no metadata, coordinates rounded.

    The same figure always gives the same text; ids are unique to its content.
    """
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
