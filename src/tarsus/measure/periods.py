"""Statistics by drive period or by any window of time, with their spread."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.measure.cautions import cautions
from tarsus.measure.history import RESOLUTION, Counting, EventHistories, Histories
from tarsus.measure.measure import Caution, Definition, Measure, Measured, Measures, Moments, Scope, of_feet
from tarsus.measure.table import HasMeasures, Judgement, RunTable
from tarsus.measure.windows import WindowedHistories, Windows

if TYPE_CHECKING:
    from tarsus.measure.segments import Floats


def scene_period(scene: Any, duration: float) -> float:
    """Period [s] that statistics refer to: the longest of the drives' and the ground's, or the whole run."""
    periods = [p for p in (waveform.period for waveform in scene.waves.values()) if p is not None]
    return max((p for p in periods if p <= duration), default=duration)


def histories_of(run: HasMeasures) -> EventHistories:
    """What every foot of a run did, in the order of its feet."""
    return Judgement(RunTable.of(run)).histories


def period_statistics(
    run: HasMeasures,
    period: float | None = None,
    skip: int | None = None,
    height: float = RESOLUTION,
    dwell: float | None = None,
) -> Measures:
    """Measures of a run by drive period, after transients.

    Parameters
    ----------
    period
        Drive period [s]; the run's own by default.
    skip
        Periods dropped as transient at the start; by default a third of the whole ones (none of a single one).
    height
        Height [m] that a flight must clear to be seen; lower ones are contact.
    dwell
        Length [s] that the contact before a flight must stay below for it to be a bounce; by default 0.5 ms or a tenth
        of the period, whichever is shorter.
    """
    judgement = Judgement(RunTable.of(run), period, skip, height, dwell)
    found = {name: one.of(0) for name, one in by_period(judgement).items()}
    return Measures(found, cautions_of(judgement, found))


def cautions_of(judgement: Judgement, found: Mapping[str, Measure]) -> list[Caution]:
    """Warnings on measures by drive period of a single run."""
    return cautions(judgement.seen, judgement.table.feet, found, count=judgement.windows.count[0], periods=True)


def by_period(judgement: Judgement, names: Collection[str] | None = None) -> dict[str, Measured]:
    """The measures of `period_statistics` of many runs: all, or those of ``names`` at the cost of these alone."""
    wanted = [name for name in PER_WINDOW if names is None or name in names]
    if not wanted:
        return {}
    return _measured(judgement.seen, wanted, judgement.table, "drive period", judgement.counting)


def window_statistics(
    run: HasMeasures,
    start: float,
    length: float,
    count: int = 1,
    height: float = RESOLUTION,
    dwell: float | None = None,
) -> Measures:
    """The measures of `period_statistics` as an instrument takes them: over windows of time, whatever the drive does.

    ``count`` windows of ``length`` [s] follow each other from ``start`` [s]; value and spread are taken over them. A
    flight counts in the window in which it begins, and its apex in the window in which it is reached. ``peak`` is the
    highest apex or gap at a period mark in the window; ``duty_factor`` the share of the window in contact.

    Raises
    ------
    InputError
        If the windows are not within the time that the run reached.
    """
    last = start + count * length
    if not (start >= 0.0 and length > 0.0 and count >= 1 and last <= run.end_time * (1.0 + 1e-9)):
        raise InputError(
            f"window: expected {count} times {length:g} s from {start:g} s on to lie within the {run.end_time:g} s "
            "that the run reached, each longer than 0 s"
        )
    table = RunTable.of(run)
    counting = Counting.of(run.period, height, dwell)
    edges = start + length * np.arange(count + 1, dtype=float)
    seen = WindowedHistories(histories_of(run), Windows.alike(edges, len(table.feet)), counting)
    found = _measured(seen, PER_WINDOW, table, f"window of {length * 1e3:.4g} ms", counting)
    values = {name: one.of(0) for name, one in found.items()}
    return Measures(values, cautions(seen, table.feet, values, count=count, periods=False))


def by_window(
    histories: Histories, edges: Floats, counting: Counting, names: Iterable[str] | None = None
) -> dict[str, Floats]:
    """Measures (nh, np) of nh feet in each window between ``edges`` (np + 1,) [s], SI, NaN where there is none: all
    that `period_statistics` has, or those in ``names``."""
    count = len(histories.flights.until)
    seen = WindowedHistories(histories, Windows.alike(edges, count), counting)
    wanted = PER_WINDOW if names is None else names
    return {name: PER_WINDOW[name].values(name, seen).reshape(count, max(len(edges) - 1, 0)) for name in wanted}


def _measured(
    seen: WindowedHistories, names: Iterable[str], table: RunTable, span: str, counting: Counting
) -> dict[str, Measured]:
    own, count = seen.windows.own, len(seen.windows.count)
    return {
        name: of_feet(
            Moments.of(PER_WINDOW[name].values(name, seen), own, count),
            len(table),
            table.feet,
            PER_WINDOW[name],
            span,
            counting,
        )
        for name in names
    }


@dataclass(frozen=True)
class PerWindow(Definition):
    """A measure whose values (nw,) are those of every window of every foot. of: what gives them of one that is added;
    those of the engine's measures have none."""

    of: Callable[[WindowedHistories], Floats] | None = None

    def values(self, name: str, seen: WindowedHistories) -> Floats:
        """Its values, under a name."""
        return seen.of(name) if self.of is None else self.of(seen)


_BOUNCE = (
    "flights from a touchdown to the next, or cut off by the end, whose apex clears {height}, after a contact shorter "
    "than {dwell}, however they began"
)
PER_WINDOW: dict[str, PerWindow] = {
    "bounces": PerWindow("1", Scope.MEAN, f"bounces per {{span}}: {_BOUNCE}"),
    "contact_duration": PerWindow(
        "s", Scope.MEAN, "total time per {span} with zero gap, flights below {height} included"
    ),
    "peak": PerWindow(
        "m",
        Scope.WORST,
        "peak oscillation amplitude: from the contact level to the highest point in a {span}; 0 if always held",
    ),
    "mean_apex": PerWindow(
        "m", Scope.MEAN, "mean of the highest points in a {span} of the flights from the ground that clear {height}"
    ),
    "mean_height": PerWindow("m", Scope.MEAN, "gap averaged over the time of a {span}"),
    "bounces_per_second": PerWindow("1/s", Scope.MEAN, f"bounces in a {{span}} over its length: {_BOUNCE}"),
    "rebounds": PerWindow("1", Scope.MEAN, "flights per {span} that begin by restitution and clear {height}"),
    "duty_factor": PerWindow("1", Scope.MEAN, "contact duration over {span}, flights below {height} included"),
    "impacts": PerWindow("1", Scope.MEAN, "touchdowns per {span}, captures and chatter included"),
    "impact_speed": PerWindow("m/s", Scope.MEAN, "mean approach speed of the touchdowns in a {span}"),
    "hardest_impact": PerWindow("m/s", Scope.WORST, "highest approach speed of a touchdown in a {span}"),
}
"""Measures of a foot in a window of time, by name, carried out by the engine (`native/measure/windows.hpp`), so that
pages with the engine have the same; one that is added here runs, batches, sweeps and tables have too."""
