"""Ramped squares -> pull-off force against contact time -> C_a0 and C_a.

The pull (2.13) at the moment of release is the foot's adhesion ``f_a = C_a0 + C_a (t - t_c)`` (2.14); a line through
pulls over contact durations, weighted by the errors of both, gives both constants. Where the restitution is known, the
contacts are counted from the last touchdown by a simulation (`tarsus.identify.touchdown`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.identify.covariance import scattered
from tarsus.identify.detachment import Detachments
from tarsus.identify.draws import within
from tarsus.identify.estimates import Estimates
from tarsus.identify.film import FilmFit
from tarsus.identify.flight import PULLS, SAME_EVENT
from tarsus.identify.influence import CONTACT, EVENT, Influence, events_of, of_records
from tarsus.identify.step import Residual, StepResult, Used, points_and_line
from tarsus.identify.touchdown import ContactDurations, seen_contacts, simulated_contacts
from tarsus.model.drive.waveforms import Waveform
from tarsus.records.excluded import Excluded

BOUNDS = ((0.0, np.inf), (0.0, np.inf))
"""Neither adhesion nor its growth pushes."""
_FEWEST = 4
"""Pull-off forces that a line takes: two for its numbers and two to see their scatter."""
_OUTSIDE = 4.0
"""Deviations from the line beyond which a detachment is another event: of a hundred normal ones none is."""
_ROUNDS = 20
"""Rounds of weights and of what is kept at most: beyond, two sets would alternate."""
_PASSES = 2
"""Times that contacts are simulated with the adhesion of the time before."""


@dataclass(frozen=True)
class Line:
    """A weighted straight line: values (2,), at zero and slope, neither of which is negative; free (2,): those that
    least squares alone would have; scatter [N] beyond the errors; weights (n,)."""

    values: Floats
    free: Floats
    scatter: float
    weights: Floats


def identify_adhesion(
    film: FilmFit, known: Estimates, signals: Mapping[str, Waveform], bounces: bool, seed: int
) -> StepResult:
    """Adhesion at first contact [N] and its growth [N/s].

    Parameters
    ----------
    film
        Detachments with their pulls.
    known
        What earlier steps found.
    signals
        Drive by set of records.
    bounces
        Whether the restitution is known, so that contacts can be simulated.
    seed
        Of the draws.

    Raises
    ------
    InputError
        If there are too few detachments, or all contacts lasted equally long.
    """
    pulls, duration = film.pulls.pull, film.pulls.duration
    if len(pulls) < _FEWEST:
        raise InputError(
            f"{len(pulls)} detachments can be used, at least {_FEWEST} are needed for adhesion over contact time"
        )
    if np.ptp(duration) < 0.2 * duration.mean():
        raise InputError(
            f"all contacts lasted about {duration.mean():.3g} s, so that adhesion at first contact "
            "cannot be separated from "
            "its growth: vary lambda or the frequency of the ramped squares"
        )
    contacts = seen_contacts(film)
    found = _fit(film, contacts, seed)
    for _ in range(_PASSES if bounces else 0):
        contacts = simulated_contacts(known.after(found).model(), film, signals)
        found = _fit(film, contacts, seed)
    count = int(contacts.simulated.sum())
    note = f"{count} of {len(contacts.simulated)} contacts are counted from the last touchdown of a simulation."
    return replace(found, notes=(*found.notes, note)) if bounces else found


def _fit(film: FilmFit, contacts: ContactDurations, seed: int) -> StepResult:
    """The line with its draws, for contacts that began at given times."""
    pulls, offs, late = film.pulls, film.offs, contacts.error
    kept = _near_line(contacts.duration, pulls.pull, pulls.error, late)
    left = tuple(
        Excluded(
            offs.traces[offs.items[int(r)].trace].file,
            "",
            f"the pull-off force of {1e9 * pulls.pull[r]:.4g} nN after {1e3 * contacts.duration[r]:.4g} ms "
            "is far off the line",
        )
        for r in np.flatnonzero(~kept)
    )
    duration, pull, error = contacts.duration[kept], pulls.pull[kept], pulls.error[kept]
    line = _line(duration, pull, error, late[kept])
    error = np.hypot(error, line.values[1] * late[kept])  # when a contact began is not known exactly either
    influence = _influence(offs, duration, pull, line, kept)
    weighted = line.weights[:, None] * np.column_stack([np.ones_like(duration), duration])
    shared = weighted * film.drawn[:, kept, None]
    influence = replace(influence, shared=shared)
    from_before = np.linalg.solve(influence.information.sum(axis=0), shared.sum(axis=1).T).T
    drawn = line.free + scattered(influence, seed) + from_before
    _, samples, reached = within(line.values, drawn, BOUNDS)
    support = f"Adhesion at touch is extrapolated by {1e3 * float(duration.min()):.3g} ms: no contact is shorter."

    rest = pull - line.values[0] - line.values[1] * duration
    panel = points_and_line(
        "pull-off force over contact time",
        ("contact time", "s", "force", "N"),
        ("detachments", "line"),
        (duration, pull),
        tuple(line.values.tolist()),
        error,
    )
    return StepResult(
        "adhesion",
        PULLS,
        line.values,
        samples,
        residuals=(Residual.of("pull-off forces about the line", "N", rest, error),),
        used=(Used("detachments", int(kept.sum()), len(kept)),),
        left_out=left,
        panels=(panel,),
        notes=(support,),
        bounds=dict(zip(PULLS, reached, strict=True)),
        files=offs.files(kept),
        influence=influence,
    )


def _near_line(duration: Floats, pull: Floats, error: Floats, late: Floats) -> NDArray[np.bool_]:
    """Detachments near the line of the others."""
    kept = np.ones(len(pull), dtype=bool)
    for _ in range(_ROUNDS):
        line = _line(duration[kept], pull[kept], error[kept], late[kept])
        off = (pull - line.values[0] - line.values[1] * duration) / np.hypot(error, line.values[1] * late)
        spread = max(1.4826 * float(np.median(np.abs(off[kept]))), 1.0)
        new = np.abs(off) < _OUTSIDE * spread
        if np.count_nonzero(new) < _FEWEST or np.array_equal(new, kept):
            break
        kept = new
    return kept


def _line(duration: Floats, pull: Floats, error: Floats, late: Floats) -> Line:
    """Weighted line; ``late`` [s] are the errors of the durations; the scatter beyond the errors follows by moments."""
    design = np.column_stack([np.ones_like(duration), duration])
    slope, scatter, weights, values, free = 0.0, 0.0, np.ones_like(pull), np.zeros(2), np.zeros(2)
    for _ in range(_ROUNDS):
        variance = error**2 + (slope * late) ** 2
        weights = 1.0 / (variance + scatter**2)
        normal = design.T @ (weights[:, None] * design)
        values = free = np.linalg.solve(normal, design.T @ (weights * pull))
        if np.any(free < 0.0):
            size, root = np.array([1.0, float(duration.max())]), np.sqrt(weights)
            top = float(np.abs(pull).max())
            values = nnls(root[:, None] * design / size, root * pull / top)[0] * top / size
        slope = float(values[1])
        rest = pull - design @ values
        plain = 1.0 / variance
        excess = float(np.sum(plain * rest**2)) - (len(pull) - 2)
        new = float(np.sqrt(max(excess, 0.0) / plain.sum()))
        if abs(new - scatter) < 1e-3 * (new + np.sqrt(variance.mean())):
            break
        scatter = new
    return Line(np.asarray(values, dtype=np.float64), np.asarray(free, dtype=np.float64), scatter, weights)


def _influence(offs: Detachments, duration: Floats, pull: Floats, line: Line, kept: NDArray[np.bool_]) -> Influence:
    """What each pull says of the line: what the moments of contact are off is the same in all repeats of a release."""
    design = np.column_stack([np.ones_like(duration), duration])
    weighted = line.weights[:, None] * design
    items = [one for one, yes in zip(offs.items, kept, strict=True) if yes]
    traces = [offs.traces[one.trace] for one in items]
    when = [trace.time[one.hold.last] for trace, one in zip(traces, items, strict=True)]
    levels, covariates = of_records(offs.traces, [one.trace for one in items])
    levels = {EVENT: events_of([one.set for one in traces], when, SAME_EVENT)} | levels
    return Influence(
        PULLS,
        np.einsum("na,nb->nab", weighted, design),
        weighted * (pull - design @ line.free)[:, None],
        np.ones(2),
        levels,
        covariates | {CONTACT: duration},
    )
