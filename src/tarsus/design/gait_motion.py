"""What the motion of a gait is: how much of it is flight, how high, how far feet slide, and whether it repeats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.arrays import Floats, Ints
from tarsus.design.limits import DEFINITIONS, WalkLimit, model_limit
from tarsus.files.settled import repetition
from tarsus.tables.numbers import amount, percent
from tarsus.tables.table import Column

if TYPE_CHECKING:
    from tarsus.design.gait_front import GaitPoint
    from tarsus.design.grounds import Grounds
    from tarsus.design.walks import Walks
    from tarsus.solve import Batch

MOTIONS = 24
"""Starts from which a motion is looked at: one that an eighth of the starts lead to is missed once in 25."""


@dataclass(frozen=True)
class GaitMotion:
    """Measures by name, means of the walks from several starts on the scene's own ground, SI: share of the time that a
    foot is down and that none is, heave of the body once it has settled and the most from any start, share of the way
    that feet slide.

    repeats: share of the walks whose contacts repeat at their end, NaN where too few periods or events tell; varies:
    standard deviation of the stride from period to period, as a share of its mean; outside: what of the model's range
    it leaves, in a sentence, else empty.
    """

    duty_factor: float
    all_feet_up: float
    heave_span: float
    highest: float
    slip_ratio: float
    repeats: float
    varies: float
    outside: str

    @property
    def words(self) -> str:
        """Whether it repeats."""
        if np.isnan(self.repeats):
            return "not told"
        if self.repeats == 1.0:
            return "repeats"
        differs = f", strides differ by {percent(self.varies, 2)}"
        return (
            "does not repeat" if self.repeats == 0.0 else f"{percent(self.repeats, 2)} of starts repeat"
        ) + differs

    @classmethod
    def columns(cls) -> list[Column]:
        """Columns of a table of motions."""
        return [
            Column("a foot down", "%", 3), Column("all feet up", "%", 3), Column("heave", "m", 3),
            Column("slip ratio", "%", 3), Column("from period to period"),
        ]  # fmt: skip

    @property
    def row(self) -> tuple[Any, ...]:
        """Of that table."""
        return self.duty_factor, self.all_feet_up, self.heave_span, self.slip_ratio, self.words

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI units."""
        return {one.name: getattr(self, one.name) for one in fields(self)}


UNSEEN = GaitMotion(*[np.nan] * 7, outside="")
"""The motion of a gait that nobody has looked at."""
MOTION_HEAD = (
    "duty factor (1)", "all feet up (1)", "heave (m)", "highest heave (m)", "slip ratio (1)", "starts that repeat (1)",
    "strides vary (1)", "outside its model",
)  # fmt: skip
"""Heads of the numbers of a motion in a file, in the order of its fields."""
_MEANS = ("duty_factor", "all_feet_up", "heave_span", "slip_ratio")


def motions_of(walks: Walks, points: Sequence[GaitPoint], starts: Grounds) -> list[GaitPoint]:
    """Gaits with what their motions are, on the scene's own ground from these starts."""
    limit = model_limit(walks.scene)
    names = [*_MEANS, "stride", *([] if limit is None else [limit.measure])]
    found = []
    for one in points:
        batch = walks.batch(*starts.crossed(one.point[None]))
        seen = batch.measured(dict.fromkeys(names))
        values = {name: each.value for name, each in seen.items()}
        found.append(replace(one, motion=_motion(batch, values, seen["stride"].spread, limit)))
    return found


def _motion(
    batch: Batch, values: Mapping[str, Floats], spread: Floats, limit: WalkLimit | None
) -> GaitMotion:
    done = np.flatnonzero(batch.done)
    each = [repetition(batch.events(i), float(batch.periods[i]), batch.duration) for i in done.tolist()]
    told = [bool(one.multiple) for one in each if one is not None]
    way = float(np.abs(values["stride"][done]).mean()) if len(done) else np.nan
    varies = float(np.sqrt((spread[done] ** 2).mean())) / way if len(done) and way > 0.0 else np.nan
    means = {name: float(values[name][done].mean()) if len(done) else np.nan for name in _MEANS}
    highest = float(values["heave_span"][done].max(initial=0.0))
    repeats = float(np.mean(told)) if told else np.nan
    return GaitMotion(
        **means, highest=highest, repeats=repeats, varies=varies, outside=_outside(values, done, limit)
    )


def _outside(values: Mapping[str, Floats], done: Ints, limit: WalkLimit | None) -> str:
    """A sentence where a walk leaves the range of its model."""
    if limit is None or not (limit.beyond(values[limit.measure][done]) > 0.0).any():
        return ""
    most = amount(float(values[limit.measure][done].max()), DEFINITIONS[limit.measure].unit)
    named = limit.measure.replace("_", " ")
    return f"leaves its model's range: {named} {most}, and the model holds for a {limit} ({limit.reason})"
