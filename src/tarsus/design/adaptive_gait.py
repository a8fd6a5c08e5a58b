"""An adaptive gait: what was found, as a table, as data, and as files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.design.gait_choice import GaitChoice
from tarsus.design.grounds import Grounds
from tarsus.design.problem import DesignProblem
from tarsus.design.results import DesignResult, csv_text, units_of
from tarsus.files.jsontext import json_text
from tarsus.files.version import package_version
from tarsus.tables.numbers import how_many, interval, percent
from tarsus.tables.table import Column, Table

Floats = NDArray[np.float64]

ADAPT_FILES = ("adapt.json", "hidden.csv", "report.html")
"""Names of everything that `tarsus design adapt` writes."""
DRAWS = 2000
"""Resamplings of the hidden grounds for the interval of the regret (Efron's bootstrap)."""


class Sense(Enum):
    """What a robot can sense of its own walk."""

    NOTHING = "nothing"
    """Nothing: one gait for all grounds."""
    CHARGE = "charge"
    """The charge of its actuators, which shows when a foot meets and leaves the ground: the share of the time on
    the ground, and touchdowns a step."""
    SLIP = "slip"
    """Its way over the ground: path that the feet slide, and stride."""


@dataclass(frozen=True, repr=False)
class AdaptiveGait(DesignResult):
    """A few gaits, a table by which one of them is chosen, and what that loses.

    gaits: values by path of each; probes: numbers of those that are walked first, each from a stand; senses: names of
    what each probe senses; posterior: from what all probes sense to a gait. costs (nh, k): of the gaits on
    the hidden grounds; known (nh,): of the best gait found for each ground by a search of its own; chosen (nh,): by the
    posterior; best (nh,): the best of the few, by other walks where there are several; grounds (nh,) by path.
    probe_steps: of each probe. runs: made in all. Of settled motions the gait that knows the ground is judged from
    other starts than those that it was found by, so that chance is nobody's merit, and losses may be below 0.
    """

    request: DesignProblem
    sense: tuple[Sense, ...]
    gaits: tuple[Mapping[str, float], ...]
    probes: tuple[int, ...]
    senses: tuple[str, ...]
    posterior: GaitChoice
    costs: Floats
    known: Floats
    chosen: NDArray[np.int64]
    best: NDArray[np.int64]
    grounds: Grounds
    probe_steps: int
    runs: int

    def _of(self, gaits: NDArray[np.int64]) -> Floats:
        return self.costs[np.arange(len(gaits)), gaits]

    def _lost(self, costs: Floats) -> float:
        return float(np.mean(costs - self.known) / np.mean(np.abs(self.known)))

    @property
    def regret(self) -> float:
        """Mean loss on the hidden grounds against the gait that knows the ground, over its mean value."""
        return self._lost(self._of(self.chosen))

    @property
    def regret_interval(self) -> tuple[float, float]:
        """95 % interval of the regret by resampling of the hidden grounds."""
        rows = np.random.default_rng(17).integers(0, len(self.known), (DRAWS, len(self.known)))
        lost, known = (self._of(self.chosen) - self.known)[rows], np.abs(self.known)[rows]
        low, high = np.quantile(lost.mean(axis=1) / known.mean(axis=1), (0.025, 0.975))
        return float(low), float(high)

    @property
    def fixed_regret(self) -> float:
        """The same of that one of the gaits which is best on the mean of the hidden grounds: the best of no
        sensing."""
        return self._lost(self.costs[:, int(np.argmin(self.costs.mean(axis=0)))])

    @property
    def choice_regret(self) -> float:
        """The same were the best of the gaits always chosen: what is lost by having only a few, and what no sense
        takes away."""
        return self._lost(self._of(self.best))

    @property
    def rule(self) -> list[tuple[str, int]]:
        """Gaits that the table chooses, and on how many of its grounds, in words."""
        if not self.probes:
            return [("always", int(np.argmax(self.posterior.shares)))]
        shares = self.posterior.shares
        order = np.argsort(-shares, kind="stable")
        return [(f"on {100.0 * shares[i]:.3g} % of the grounds", int(i)) for i in order if shares[i] > 0.0]

    def table(self) -> Table:
        """The few gaits, how often each is taken on the hidden grounds, and what is lost there."""
        units = units_of(self.request.scene, self.gaits[0])
        columns = ["gait", "taken", *(Column(path, unit) for path, unit in units.items())]
        rows = [
            (
                f"{number}{' (probe)' * (number in self.probes)}",
                f"{int((self.chosen == number).sum())} of {len(self.chosen)}",
                *gait.values(),
            )
            for number, gait in enumerate(self.gaits)
        ]
        low, high = self.regret_interval
        notes = [str(self.request.motion), *(f"gait {number} {said}" for said, number in self.rule)]
        notes.append(
            f"lost on {len(self.known)} hidden grounds: {percent(self.regret, 2)} ({interval(low, high, '%', 2)}); the "
            f"best single gait loses {percent(self.fixed_regret, 2)}, the best of these each time "
            f"{percent(self.choice_regret, 2)}"
        )
        gaits, regret = how_many(len(self.gaits), "gait"), percent(self.regret)
        title = f"AdaptiveGait of '{self.request.scene.name}': {gaits}, regret {regret}"
        return Table(title, columns, rows, notes)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI units.

        table: how often each gait is chosen on the table's grounds, in words; gaits: values by path; probes: numbers of
        the gaits that are walked first, so many steps each; posterior: what the robot carries: ``readings`` of the
        probes and ``costs`` of the gaits on each of its grounds, and one standard ``deviations`` of each reading;
        regret: mean loss on the hidden grounds against the gait that knows the ground, with its 95 % interval;
        fixed_regret: of the best single gait; choice_regret: were the best of these gaits always chosen.
        """
        return {
            "scene": self.request.scene.name,
            "objective": self.request.objectives[0].name,
            "sense": [one.value for one in self.sense],
            "senses": list(self.senses),
            "probes": list(self.probes),
            "probe_steps": self.probe_steps,
            "gaits": [dict(one) for one in self.gaits],
            "table": [{"when": said, "gait": number} for said, number in self.rule],
            "posterior": asdict(self.posterior),
            "regret": self.regret,
            "regret_interval": list(self.regret_interval),
            "fixed_regret": self.fixed_regret,
            "choice_regret": self.choice_regret,
            "hidden": len(self.known),
            "motion": str(self.request.motion),
            "starts": self.request.motion.starts,
            "runs": self.runs,
            "version": package_version(),
        }

    def texts(self) -> dict[str, str]:
        """The data, and what was chosen and reached on every hidden ground."""
        objective = self.request.objectives[0]
        head = [*self.grounds.names, "gait", f"{objective.name} chosen ({objective.unit})", f"{objective.name} known"]
        rows = [
            (*ground, int(chosen), float(objective.value(self.costs[i, chosen])), float(objective.value(self.known[i])))
            for i, (ground, chosen) in enumerate(zip(self.grounds.points().tolist(), self.chosen, strict=True))
        ]
        return {"adapt.json": json_text(self.to_dict()) + "\n", "hidden.csv": csv_text(head, rows)}
