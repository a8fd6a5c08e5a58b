"""Checks of an identification by what it predicts: each has a figure, a limit, and the numbers that it speaks of.

A check that fails takes the word "determined" from the numbers that depend on it: what a wrong model does to a number
is not in its draws, which come from residuals under that model. Only what is a scatter widens intervals: the draws of
every step are over groups of its data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tarsus.identify.estimates import Estimates
from tarsus.identify.step import Check, StepResult

if TYPE_CHECKING:
    from tarsus.identify.heldout import Comparison
    from tarsus.identify.instruments import Instruments
    from tarsus.identify.prediction import AirFit


STRUCTURE, LOAD, LAW, GROUND = "robot.structure.", ".load.", ".law.", "ground."
"""Parts of paths: what a check or a difference from the model touches."""
OFFSET = (".law.constant", ".law.offset")
"""Ends of the path of the drive's force at rest."""
SURE = 25.0
"""Gain in chi-squared over what is left that a difference from the model must have: five standard deviations of one
unknown."""
SHIFTED = 2.0
"""Standard deviations by which a number may move and stay determined: as far as its 95 % interval reaches."""
OVER_NOISE = 1.15
"""What a fit or a prediction may leave over the noise: that is known to 7 % from a hundred samples at rest, to 3 or
4 % over the channels of a record; sound campaigns leave 0.98 to 1.06."""
APART = 4.0
"""Standard deviations by which records that were not fitted may tell numbers otherwise, along any of their directions:
of a dozen directions one is by chance farther off in one of a thousand campaigns, of four hundred where noise is taken
for 7 % less than it is."""
HELD_OUT = 2.0
"""Held-out motion over what noise alone would leave of it, median over records: landings at the edge of being held
leave sound ones with 1.2."""
SMEARED = 0.1
"""Samples by which a low-pass may delay: moments of release and impact are found to about as much."""
GAP = 0.05
"""Error of a gap that a number which counts from it must bear where no interval of the gap is stated: the source's were
set by hand, and one of its devices has two that are a quarter apart (Table 2.2)."""
_ALL = (STRUCTURE, LOAD, LAW, GROUND)


def touched(known: Estimates, parts: Sequence[str]) -> tuple[str, ...]:
    """Paths of the identified numbers that hold one of some parts."""
    return tuple(path for path in known.paths if any(part in path for part in parts))


def air_checks(fit: AirFit | None, known: Estimates) -> tuple[Check, ...]:
    """Whether the identified structure and drive predict the motion in the air. Where they do not, everything is in
    doubt, since the air may misread a number as its own data do: intervals are widened for a small difference, and the
    word is lost to a larger one."""
    if fit is None:
        return ()
    paths = touched(known, _ALL)
    std = dict(zip(known.paths, np.std(known.samples, axis=0).tolist(), strict=True))
    beyond = dict.fromkeys(paths, fit.beyond) | dict(fit.missed)
    far = {path: by * std[path] for path, by in beyond.items() if path in paths}
    cause = fit.cause
    if fit.widens:
        paths, far, cause = (), {}, f"{cause}: all intervals are {fit.beyond:.2g} times as wide for it"
    figures = (
        ("motion in the air over its noise", fit.predicted, OVER_NOISE),
        ("numbers determined by the motion in the air and by all else (standard deviations)", fit.apart, APART),
    )
    return tuple(Check(*one, paths=paths, cause=cause, record=fit.record, far=far) for one in figures)


def left_check(step: StepResult, known: Estimates) -> tuple[Check, ...]:
    """What a step leaves over the noise."""
    later = {
        "hysteresis": (LAW, LOAD, GROUND),
        "film": (GROUND,),
        "electrostatics": (GROUND,),
        "restitution": ("ground.restitution",),
    }
    noisy = [one for one in step.residuals if np.isfinite(one.noise) and one.noise > 0.0]
    if step.name not in later or not noisy:
        return ()
    count = np.array([one.count for one in noisy], dtype=float)
    ratio = np.array([one.rms / one.noise for one in noisy])
    left = float(np.sqrt(np.sum(count * ratio**2) / count.sum()))
    cause = f"the fit of the step {step.name} leaves more than noise"
    record = f"repeat {step.records or 'its records'} at half the volts: what does not shrink is no motion of it"
    paths = touched(known, later[step.name])
    return (Check(f"{step.name}: residual over noise", left, OVER_NOISE, paths=paths, cause=cause, record=record),)


def smeared_check(instruments: Instruments, known: Estimates) -> tuple[Check, ...]:
    """Whether a low-pass smears what happens in a moment over more than a sample's fraction."""
    low = instruments.low(instruments.of)
    if low is None:
        return ()
    cause = (
        f"behind a low-pass at {low.corner:.4g} Hz releases and impacts are seen only as far as the sampling rate "
        "shows what is left of them"
    )
    paths = touched(known, (GROUND,))
    name = "samples over which a low-pass smears them"
    record = "record ramps and bounces without the low-pass"
    return (Check(name, low.delay / instruments.step, SMEARED, paths=paths, cause=cause, record=record),)


def gap_check(step: StepResult, known: Estimates) -> tuple[Check, ...]:
    """Whether the constant of the drive's law, which is the level at which the ground is seen less the gap as stated,
    bears an error of a gap that states no interval."""
    model = known.model()
    path = next((one for one in step.paths if one.endswith(OFFSET)), None)
    if path is None or path in step.taken or model.scene.interval(f"robot.feet.{model.foot}.gap") is not None:
        return ()
    low, high = step.interval(path)
    cause = "the force offset assumes the stated gap: with an interval of that it gets one"
    share = 0.5 * (high - low) * abs(model.static_load) / model.gap
    name = "gap uncertainty not stated (it limits the force offset)"
    record = "measure the gap, and state its interval in the provenance of the device file"
    return (Check(name, share, GAP, least=True, paths=(path,), cause=cause, record=record),)


def held_out_check(comparisons: Sequence[Comparison], known: Estimates) -> tuple[Check, ...]:
    """Whether signals that no step has seen are predicted."""
    if not comparisons:
        return ()
    cause = "held-out signals move otherwise than the identified device"
    paths = touched(known, (GROUND,))
    return (
        Check(
            "held-out motion over its noise, median",
            float(np.median([one.over for one in comparisons])),
            HELD_OUT,
            paths=paths,
            cause=cause,
            record="record ramps and bounces with the drives that are held out",
        ),
    )


def with_checks(step: StepResult, checks: Sequence[Check]) -> StepResult:
    """A step with further checks."""
    return replace(step, checks=(*step.checks, *checks))
