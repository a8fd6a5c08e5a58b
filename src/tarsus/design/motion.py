"""What the motion of a candidate is: how much of it is flight, how high, how hard or how far feet slide, and whether it
repeats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.arrays import Ints
from tarsus.design.measures import definition_of
from tarsus.files.settled import repetition
from tarsus.measure.limits import model_range
from tarsus.model.structure import Walker
from tarsus.tables.numbers import percent
from tarsus.tables.table import Column

if TYPE_CHECKING:
    from tarsus.design.front import Candidate
    from tarsus.design.grounds import Grounds
    from tarsus.design.runs import Runs
    from tarsus.solve import Batch

MOTIONS = 24
"""Starts from which a motion is looked at: one that an eighth of the starts lead to is missed once in 25."""
WATCHED = 32
"""Drive periods after which a motion that is judged by its last one is looked at: a mode of damping ratio 1 % at 30
oscillations a period has forgotten its start long before."""
NAMES = {
    "duty_factor": "a foot down",
    "all_feet_up": "all feet up",
    "heave_span": "heave",
    "slip_ratio": "slip ratio",
    "peak": "peak",
    "impacts": "touchdowns",
    "hardest_impact": "hardest touchdown",
}
"""Measures that say what a motion is, as heads of columns."""
OF_WALKERS = ("duty_factor", "all_feet_up", "heave_span", "slip_ratio")
OF_OTHERS = ("duty_factor", "peak", "impacts", "hardest_impact")
VARYING = {"stride": "strides", "hardest_impact": "touchdowns"}
"""Of which measure it is said how much it differs from period to period."""


@dataclass(frozen=True)
class DesignMotion:
    """What the motion is on the scene's own ground.

    means: measures by name, SI, means of runs from several starts, NaN where there is none; highest [m]: heave of a
    body, the most from any start; repeats: share of the runs whose contacts repeat at their end, NaN where periods or
    events are too few; varies: standard deviation from period to period of the stride, or of the hardest touchdown of
    a robot that does not walk, as a share of its mean; outside: what of the model's range it leaves, in a sentence,
    else empty.
    """

    means: Mapping[str, float]
    highest: float
    repeats: float
    varies: float
    outside: str
    what: str = ""

    @property
    def words(self) -> str:
        """Whether it repeats."""
        if np.isnan(self.repeats):
            return "not known"
        if self.repeats == 1.0:
            return "repeats"
        differs = "" if np.isnan(self.varies) else f", {self.what} differ by {percent(self.varies, 2)}"
        return ("does not repeat" if self.repeats == 0.0 else f"{percent(self.repeats, 2)} of starts repeat") + differs

    @property
    def columns(self) -> list[Column]:
        """Columns of a table of such motions."""
        shares = {name: "%" if (unit := definition_of(name).unit) == "1" else unit for name in self.means}
        shares |= {"impacts": "1"} if "impacts" in shares else {}
        return [*(Column(NAMES[name], unit, 3) for name, unit in shares.items()), Column("from period to period")]

    @property
    def row(self) -> tuple[Any, ...]:
        """Of that table."""
        return *self.means.values(), self.words

    @property
    def head(self) -> tuple[str, ...]:
        """Heads of the numbers of `to_dict`, with units."""
        return (
            *(f"{name.replace('_', ' ')} ({definition_of(name).unit})" for name in self.means),
            "highest heave (m)",
            "starts that repeat (1)",
            "varies from period to period (1)",
            "outside its model",
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI units."""
        return {
            **self.means,
            "highest": self.highest,
            "repeats": self.repeats,
            "varies": self.varies,
            "outside": self.outside,
        }


UNSEEN = DesignMotion({}, *[np.nan] * 3, outside="")
"""The motion of a candidate that nobody has looked at."""


def motions_of(runs: Runs, points: Sequence[Candidate], starts: Grounds) -> list[Candidate]:
    """Candidates with what their motions are, on the scene's own ground from these starts."""
    limit = model_range(runs.scene)
    walks = isinstance(runs.scene.robot.structure, Walker)
    means, varying = (OF_WALKERS, "stride") if walks else (OF_OTHERS, "hardest_impact")
    names = [*means, varying]
    if limit is not None and limit.measure not in names:
        names.append(limit.measure)
    lasting = None if runs.skip is None else WATCHED / (runs.skip + 1) * runs.duration
    found = []
    for one in points:
        batch = runs.batch(*starts.crossed(one.row[None]), lasting)
        seen = batch.measured(names)
        values = {name: each.value for name, each in seen.items()}
        done = np.flatnonzero(batch.done)
        size = float(np.abs(values[varying][done]).mean()) if len(done) else np.nan
        spread = seen[varying].spread[done]
        varies = float(np.sqrt((spread**2).mean())) / size if len(done) and size > 0.0 else np.nan
        motion = DesignMotion(
            {name: float(values[name][done].mean()) if len(done) else np.nan for name in means},
            float(values["heave_span"][done].max(initial=0.0)) if walks else np.nan,
            _repeating(batch, done),
            varies,
            "" if limit is None else limit.left(np.fmax.reduce(values[limit.measure][done], initial=0.0)),
            VARYING[varying],
        )
        found.append(replace(one, motion=motion))
    return found


def _repeating(batch: Batch, done: Ints) -> float:
    """Share of the runs whose contacts repeat."""
    each = [repetition(batch.events(i), float(batch.periods[i]), batch.duration) for i in done.tolist()]
    known = [bool(one.multiple) for one in each if one is not None]
    return float(np.mean(known)) if known else np.nan
