"""What is drawn over a map: boundaries that branches find, cuts along which a study ran, curves of a file."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError, InputProblem
from tarsus.base.spec import get_value, with_values
from tarsus.base.workers import Workers, spread
from tarsus.files.rows import number_of, parse_rows
from tarsus.files.tables import read_text
from tarsus.study.studyfile import load_sweep

if TYPE_CHECKING:
    from tarsus.atlas.result import Atlas
    from tarsus.study.sweep import Sweep

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Overlay:
    """Lines over a map, each of places (k, 2) [SI] in its order, or marks; name: what they are."""

    name: str
    lines: tuple[Floats, ...]
    marks: bool = False


def overlays_of(found: Atlas, what: str | os.PathLike[str]) -> list[Overlay]:
    """Overlays by a name: a table (.csv, two columns [SI]) is a curve; a packaged study or study file is what it says
    is drawn, or else the lines along which it ran.

    Raises
    ------
    InputError
        For tables that cannot be read, studies of another robot, and ones that vary neither number of the map.
    """
    word = os.fspath(what)
    if Path(word).suffix == ".csv":
        return [Overlay(Path(word).stem, (_curve(word),))]
    study = load_sweep(word)
    return [one for part in study.draw for one in overlays_of(found, part)] or [_cuts(found, study)]


def branches_over(found: Atlas, count: int, threads: Workers = None) -> list[Overlay]:
    """What happens to the periodic motions at both ends of so many lines of constant y along them (`tarsus.branch`): a
    mark each, by its kind. A line on which no motion is found has none. Raises InputError for fewer than 1 line."""
    if count < 1:
        raise InputError(InputProblem.at("branch", f"expected a number of lines of 1 or more, got {count}"))
    from tarsus.orbits.branching import Tracer

    x, y = found.x, found.y

    def followed(level: float) -> list[tuple[str, float, float]]:
        tracer = Tracer(with_values(found.scene, {y.path: level}), x.path, x.unit, (x.low, x.high), False, None)
        for ends in ((x.low, x.high), (x.high, x.low)):
            tracer.ends = ends
            with contextlib.suppress(InputError):
                tracer.own(None)
        return [(one.kind, one.at, level) for made in tracer.branches for one in made.special]

    marks: dict[str, list[tuple[float, float]]] = {}
    for some in spread(followed, y.at((np.arange(count) + 0.5) / count).tolist(), threads):
        for kind, *place in some:
            marks.setdefault(kind, []).append((place[0], place[1]))
    return [Overlay(f"{kind} of a branch", (np.array(own),), marks=True) for kind, own in marks.items()]


def _curve(file: str) -> Floats:
    """The first two columns of a table."""
    rows = parse_rows(read_text(file), file)
    try:
        return np.array([[number_of(row[name]) for name in rows.columns[:2]] for row in rows.rows], dtype=float)
    except (ValueError, TypeError):
        raise InputError(f"{file}: a curve has two columns of numbers [SI]") from None


def _cuts(found: Atlas, study: Sweep) -> Overlay:
    """Lines along which a study ran: over the range of one number, at every value of the other."""
    if study.scene.name != found.scene.name:
        raise InputError(f"{study.name}: is a study of {study.scene.name}, and the map is of {found.scene.name}")
    x, y = (_values(study, axis.path) for axis in (found.x, found.y))
    if len(x) == len(y) == 1:
        raise InputError(f"{study.name}: varies neither {found.x.path} nor {found.y.path}")
    return Overlay(study.name, tuple(_lines(x, y)))


def _values(study: Sweep, path: str) -> Floats:
    """What a number runs through in a study."""
    for name, axis in study.vary.items():
        if path in study.paths(name):
            return axis.values_on_grid() if axis.size is not None else np.array(axis.ends)
    return np.array([float(get_value(study.scene, path))])


def _lines(x: Floats, y: Floats) -> Iterator[Floats]:
    """Along the number of more values, at each of the other's."""
    long, few = (x, y) if len(x) >= len(y) else (y, x)
    for value in few.tolist():
        line = np.column_stack([np.sort(long), np.full(len(long), value)])
        yield line if len(x) >= len(y) else line[:, ::-1]
