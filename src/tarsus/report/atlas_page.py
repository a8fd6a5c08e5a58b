"""The page of an atlas: a map to look around in, with every run's numbers and its command line."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.atlas.cells import MEASURES
from tarsus.atlas.classes import meanings, words
from tarsus.atlas.overlays import Overlay
from tarsus.atlas.result import Atlas
from tarsus.orbits.returns import drive_period
from tarsus.report.packing import packed, script_text
from tarsus.report.pages import Fold, Section, rendered, sections_page, terms, write_page
from tarsus.tables.numbers import amount, spaced

MOST_BYTES = 2_600_000
"""Of the numbers of all runs before they are written as text, which takes a third more: a page stays below 4 MB."""


def atlas_html(found: Atlas) -> str:
    """The page as text."""
    table, (measures,) = found.table(), found.table().parts
    notes = [f"{note}." for note in table.notes]
    what = Fold("What the classes are", terms(meanings(found.classes)))
    sections = [Section("Classes", table.bare(), *notes, what), Section("Measures", measures.bare())]
    about = [_ranges(found), rendered("atlas.html", found=found, data=script_text(page_data(found)))]
    scene = found.scene.name
    return sections_page(f"Atlas: {scene}", about, sections, head=f"{scene} – atlas")


def _ranges(found: Atlas) -> str:
    """What the map is over."""
    ends = [
        f"{one.path} from {amount(one.low, one.unit)} to {amount(one.high, one.unit)}" for one in (found.x, found.y)
    ]
    return f"{', '.join(ends)}."


def write_atlas(found: Atlas, folder: Path) -> list[Path]:
    """Write an atlas and its page into a folder and return the files."""
    return [*found.write(folder), write_page(atlas_html(found), folder / "report.html")]


def page_data(found: Atlas) -> dict[str, Any]:
    """What the script draws: which points were run (a bit each, by x and y), and numbers of these in that order; of
    every second point each way, or fewer, where a page does not hold all."""
    names = [name for name, values in found.measures.items() if np.isfinite(values).any()]
    step = 1
    while True:
        known, source = found.grid.known[::step, ::step], found.grid.source[::step, ::step]
        order = source[known]
        sizes = {bits: len(order) * (1 + bits // 8 * len(names)) + known.size // 8 for bits in (16, 8)}
        fitting = [bits for bits, size in sizes.items() if size <= MOST_BYTES]
        if fitting:
            break
        step *= 2
    bits, kinds = fitting[0], found.classes
    number = {code: i for i, code in enumerate(kinds)}
    own = np.array([number.setdefault(int(code), len(number)) for code in found.code[order]], dtype=np.uint8)
    return {
        "axes": [axis.to_dict() | {"name": axis.path} for axis in (found.x, found.y)],
        "size": len(known),
        "coarse": _coarse(known),
        "known": _text(np.packbits(known)),
        "own": _text(own),
        "classes": [{"name": words(code), "open": code < 0, "share": found.share(code)} for code in kinds],
        "measures": [
            {
                "name": spaced(name),
                "unit": MEASURES[name][0],
                "about": MEASURES[name][1],
                **packed(found.measures[name][order][None], bits, gaps=True),
            }
            for name in names
        ],
        "overlays": [_drawn(one, found) for one in found.overlays],
        "period": _period(found),
        "paths": [found.x.path, found.y.path],
    }


def _coarse(known: np.ndarray) -> int:
    """Step of the grid of which every point was run."""
    step = len(known) - 1
    while not known[::step, ::step].all():
        step //= 2
    while step > 1 and known[:: step // 2, :: step // 2].all():
        step //= 2
    return step


def _period(found: Atlas) -> float | None:
    """Drive period [s]; None where it is not that of the whole map."""
    moved = any(axis.path.endswith(".frequency") for axis in (found.x, found.y))
    return None if moved else drive_period(found.scene)


def _drawn(one: Overlay, found: Atlas) -> dict[str, Any]:
    """An overlay in shares of the axes."""
    lines = [np.column_stack([found.x.share(places[:, 0]), found.y.share(places[:, 1])]) for places in one.lines]
    kept = [line[np.isfinite(line).all(axis=1)].round(6).tolist() for line in lines]
    return {"name": one.name, "marks": one.marks, "lines": kept}


def _text(content: np.ndarray) -> str:
    return base64.b64encode(content.tobytes()).decode()
