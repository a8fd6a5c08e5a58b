"""Walks that no identification has seen: by what share of itself their speed is off what draws predict, and what that
says of everything that is made with these draws."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.quantities import Quantity
from tarsus.base.spec import with_values
from tarsus.files.draws import Reliance
from tarsus.identify.step import Check, failures
from tarsus.identify.walking import WalkRecord
from tarsus.measure.periods import scene_period
from tarsus.measure.table import periods_used
from tarsus.model.scene import Scene
from tarsus.solve import Output, ResultCode, simulate

WALKED = 24
"""Draws that walk: the middle of so many is known to a quarter of their spread."""
NAME = "share of its speed by which a walk that was left out is off its prediction"
MOST = 0.1
"""That share from which a prediction is none: a gait that is designed gains several times as much."""
ALONG = Output(Quantity.DISPLACEMENT, "body_x")
"""What gives a speed: how far the body has gone."""


def prediction_check(paths: Sequence[str], samples: Floats, records: Sequence[WalkRecord]) -> Check:
    """Whether draws (ns, np) of the numbers at paths predict the speed of records that were left out."""
    cause = "the identified robot does not walk as the robot does with another gait"
    record = "walks with other gaits, to be fitted"
    return Check(NAME, missed(paths, samples, records), MOST, cause=cause, record=record)


def reliance_of(checks: Iterable[Check]) -> Reliance:
    """How far draws of an identification with these checks can be relied on."""
    found = list(checks)
    return Reliance(tuple(failures(found)), max((one.value for one in found if one.name == NAME), default=0.0))


def missed(paths: Sequence[str], samples: Floats, records: Sequence[WalkRecord]) -> float:
    """The largest share of its speed by which any record is off the middle of what draws (ns, np) of the numbers at
    paths predict; 0 where none shows how far the body went. How much of it is the draws' own spread one walk does not
    say, and all of it is taken for what the model misses."""
    shares = [_missed(one, paths, samples) for one in records if ALONG in one.outputs]
    return max(shares, default=0.0)


def _missed(record: WalkRecord, paths: Sequence[str], samples: Floats) -> float:
    row = record.values[record.outputs.index(ALONG)]
    seen = _speed(record.scene, record.times, row)
    drawn = np.linspace(0, len(samples) - 1, min(WALKED, len(samples))).astype(int)
    each = (dict(zip(paths, samples[k].tolist(), strict=True)) for k in drawn)
    walked = np.array([_predicted(with_values(record.scene, one), record.times) for one in each])
    middle = float(np.median(walked[np.isfinite(walked)])) if np.isfinite(walked).any() else 0.0
    most = max(abs(middle), abs(seen))
    return abs(middle - seen) / most if most > 0.0 else 0.0


def _predicted(scene: Scene, times: Floats) -> float:
    """Speed [m/s] of a walk; NaN of one that does not reach its end."""
    run = simulate(scene, float(times[-1]))
    if run.ended is not ResultCode.DONE:
        return float("nan")
    return _speed(scene, times, run.outputs([ALONG], times)[0])


def _speed(scene: Scene, times: Floats, along: Floats) -> float:
    """Speed [m/s] over all whole drive periods but the first third, as of a gait: the slope of a line through all
    samples, for two of them are as far off as their noise."""
    period = scene_period(scene, float(times[-1]))
    (skipped,), (count,) = periods_used(times[-1:] + 0.5 * np.diff(times[-2:]), np.array([period]), None)
    used = (times > period * skipped) & (times < period * count * (1.0 + 1e-9))
    return float(np.polyfit(times[used], along[used], 1)[0])
