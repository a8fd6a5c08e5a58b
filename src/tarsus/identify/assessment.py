"""What a whole identification says of its numbers: a verdict for each, and their correlations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tarsus.identify.estimates import Estimates
from tarsus.identify.step import failures
from tarsus.identify.verdict import Assessment, judge_samples

if TYPE_CHECKING:
    from tarsus.identify.result import Identification


def assessed(found: Identification) -> Assessment | None:
    """Verdicts on all numbers of an identification by their draws; None where no number has draws that differ.

    Weights of plays may be of either sign or zero; what they leave open is compared with the slope of the drive's law.
    """
    known = found.known
    taken = {path for step in found.steps.values() for path in step.taken}
    moving = (np.std(known.samples, axis=0) > 0.0) & np.array([path not in taken for path in known.paths], dtype=bool)
    names = tuple(path for path, yes in zip(known.paths, moving, strict=True) if yes)
    if not names:
        return None
    sizes = {path: size for path, size in law_slopes(known).items() if path in names}
    drawn = dict(zip(names, known.samples[:, moving].T, strict=True))
    bounds = {path: ends for step in found.steps.values() for path, ends in step.bounds.items() if path in names}
    # an end that the data leave to physics is open: it counts as cut where the draws end
    limits = {
        path: (
            float(drawn[path].min()) if np.isfinite(low) else low,
            float(drawn[path].max()) if np.isfinite(high) else high,
        )
        for path, (low, high) in bounds.items()
    }
    checks = [check for step in found.steps.values() for check in step.checks]
    far: dict[str, float] = {}
    for path, size in (pair for one in checks if not one.passed for pair in one.far.items()):
        far[path] = max(size, far.get(path, 0.0))
    doubts = {path: failures(one for one in checks if path in one.paths) for path in names}
    return judge_samples(
        names, known.values[moving], known.samples[:, moving], sizes=sizes, limits=limits, doubts=doubts, far=far
    )


def law_slopes(known: Estimates) -> dict[str, float]:
    """Slope of the drive's law by the path of every play's weight: the linear term and all plays together."""
    values = dict(zip(known.paths, np.abs(known.values).tolist(), strict=True))
    out: dict[str, float] = {}
    for path in known.paths:
        law, weight, _ = path.partition(".weights.")
        if weight:
            own = (size for name, size in values.items() if name.startswith(f"{law}.weights."))
            out[path] = values.get(f"{law}.linear", 0.0) + sum(own)
    return {path: size for path, size in out.items() if size > 0.0}
