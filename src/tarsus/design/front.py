"""What a design found: candidates that no other beats, as a table, as data, and as files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.design.free import designed
from tarsus.design.grounds import Grounds
from tarsus.design.headers import gait_header_text
from tarsus.design.judge import CLOSED, Certificate, Round
from tarsus.design.motion import UNSEEN, DesignMotion
from tarsus.design.percents import Percents
from tarsus.design.results import DesignResult, csv_text, units_of
from tarsus.files.jsontext import json_text
from tarsus.files.toml import scene_text
from tarsus.files.version import package_version
from tarsus.fit.front import hypervolume, undominated
from tarsus.model.scene import Scene
from tarsus.orbits.motion import SettledMotion
from tarsus.tables.numbers import percent
from tarsus.tables.table import Column, Table

if TYPE_CHECKING:
    from tarsus.design.measures import DesignObjective
    from tarsus.design.problem import DesignProblem

Floats = NDArray[np.float64]

FRONT_FILES = (
    "front.csv",
    "gait.h",
    "report.html",
    *(f"{noun}{end}" for noun in ("gaits", "designs") for end in (".json", "/*.toml", "/*.html")),
)
"""Names of everything that a design writes at its end."""
TICK, TICKS = 1e-6, 1000
"""Tick of the timer of `gait.h` [s], and the least number of them in a period: shorter ones where the gait is fast."""
SHOWN = 4
"""Numbers of a gait in a table; all are in the files."""


@dataclass(frozen=True)
class Candidate:
    """A candidate on a front: a gait, a signal.

    row (np,): its values [SI]; values: by path of the scene; nominal, risk, worst: its objectives, in their
    units and order, on the scene's own ground, under the risk, and the worst that was found (NaN without grounds) on
    grounds that are the same for all: those that candidates were judged on, and those that an attack found worst for
    any of them; worst_ground: values by path of the ground where the first objective that depends on the ground is
    worst; energy [J]: plain, a drive period, and recovered: with charge recovery (NaN where nothing of the front needs
    energy); intervals: between which 95 % of what it does lies with 95 % confidence, by objective: over grounds
    and starts drawn by chance, over starts without grounds (NaN where fewer than 93 were tried), wider by what draws
    are known to miss (NaN where they are in doubt, and by what is not known); beyond: share of its runs that do not
    keep the limits; motion: what it is on the scene's own ground. nominal is the mean of starts that it was not
    searched by; from rest, of the one start.
    """

    row: Floats
    values: Mapping[str, float]
    nominal: tuple[float, ...]
    risk: tuple[float, ...]
    worst: tuple[float, ...]
    worst_ground: Mapping[str, float]
    energy: float
    recovered: float
    intervals: tuple[tuple[float, float], ...]
    beyond: float
    motion: DesignMotion = UNSEEN


@dataclass(frozen=True, repr=False)
class Design(DesignResult):
    """Candidates that no other beats, and why to believe it.

    members: one list, all judged alike, of which none beats another under the risk; optimum: of the candidates
    that were judged with them the best on the scene's own ground in the first objective. grounds: that candidates were
    judged on; rounds of cutting planes; gap: share by which the last attack found any that was attacked worse than on
    those grounds, NaN without a box. rows, costs: every candidate (n, np) and its costs (n, no) under the risk, the
    least the best; runs: made; reused: read from an earlier call. certificate: of all that were attacked, of that one
    which has most grounds worse than its worst known before; None without a box. percents: what one percent of each
    number costs the robust one.
    """

    request: DesignProblem
    members: tuple[Candidate, ...]
    optimum: Candidate
    grounds: Grounds
    rounds: tuple[Round, ...]
    gap: float
    rows: Floats
    costs: Floats
    candidates: int
    runs: int
    reused: int
    certificate: Certificate | None
    percents: Percents

    @property
    def objectives(self) -> tuple[DesignObjective, ...]:
        """What the front is of."""
        return self.request.objectives

    @property
    def robust(self) -> Candidate:
        """The best of the front under the risk in the first objective."""
        return self.members[0]

    @property
    def front(self) -> Floats:
        """Costs (nf, no) of all candidates that no other beats."""
        return self.costs[undominated(self.costs)]

    def hypervolume(self, reference: Sequence[float]) -> float:
        """Volume between the front and a reference (no,), in the objectives' units, that is worse."""
        given = np.array(
            [one.cost(np.array([value]))[0] for one, value in zip(self.objectives, reference, strict=True)]
        )
        return hypervolume(self.front, given)

    def scene_of(self, point: Candidate, *, worst: bool = False) -> Scene:
        """The scene with a candidate, on the scene's own ground or on its worst one; its numbers are marked as
        designed."""
        found = self.request.runs().scene_of(point.row, point.worst_ground if worst else None)
        return designed(found, self.request.free.paths)

    @property
    def gain(self) -> float:
        """Worst value of the robust gait over that of the nominal optimum, in the first objective (its inverse
        where the least is best); NaN without a box."""
        own, other = self.robust.worst[0], self.optimum.worst[0]
        if not self.objectives[0].most:
            own, other = other, own
        return own / other if other > 0.0 else (np.inf if own > 0.0 else np.nan)

    @property
    def spread_of(self) -> str:
        """What intervals are over, in words."""
        return "95 % of runs lie in the intervals, over starts" + (
            "" if self.request.over is None else " and grounds drawn by chance"
        )

    @property
    def better(self) -> bool | None:
        """Whether the robust gait is more robust than the nominal optimum: better by more than 2 % in the worst that
        was found, and at the worse end of its interval where both have one. None without a box."""
        if np.isnan(self.gain):
            return None
        ends = np.array([one.intervals[0][0 if self.objectives[0].most else 1] for one in (self.robust, self.optimum)])
        own, other = self.objectives[0].cost(ends)
        return self.gain > 1.0 + CLOSED and (not np.isfinite(ends).all() or bool(own < other))

    @property
    def verdict(self) -> str:
        """The comparison of the robust gait with the nominal optimum, in words; nothing without a box."""
        if self.better is None:
            return ""
        said = f"worst {self.objectives[0].name}, robust over nominal optimum: {self.gain:.3g}"
        return said if self.better else f"{said}: none was found that is more robust than the nominal optimum"

    @property
    def named(self) -> list[tuple[str, Candidate]]:
        """Candidates that get files of their own, with the files' names without ending."""
        members = [(f"{self.request.noun}-{number:02d}", point) for number, point in enumerate(self.members, start=1)]
        return [*members, ("robust", self.robust), ("optimum", self.optimum)]

    @property
    def once(self) -> list[tuple[list[str], Candidate]]:
        """Candidates with all of their names: the robust one is one of the front, and the optimum as often as not."""
        alike: dict[tuple[float, ...], tuple[list[str], Candidate]] = {}
        for name, point in self.named:
            alike.setdefault(tuple(point.values.values()), ([], point))[0].append(name)
        return list(alike.values())

    @property
    def problems(self) -> list[str]:
        """What the user must not miss: that nothing was found that keeps the limits."""
        lost = self.robust.beyond >= 1.0
        return [f"no {self.request.noun} was found that keeps the limits: all runs of the robust one break them"] * lost

    @property
    def remarks(self) -> list[str]:
        """Sentences on draws in doubt, on the limits, and on gaits that leave them or the range of their model."""
        said = self.request.reliance.sentences()
        said += [f"limit: {one}" + f", for {one.reason}" * bool(one.reason) for one in self.request.limits]
        for names, one in self.once:
            none = [
                about.name for about, value in zip(self.objectives, one.nominal, strict=True) if not np.isfinite(value)
            ]
            if none:
                said.append(f"{names[0]}: its motion has no {' and no '.join(none)}")
            if one.beyond:
                said.append(f"{names[0]}: {percent(one.beyond, 2)} of its runs go beyond a limit")
            if one.motion.outside:
                said.append(f"{names[0]}: {one.motion.outside}")
        return said

    def table(self) -> Table:
        """The gaits of the front, the robust one and the nominal optimum: what they reach, and the numbers that make
        them."""
        judged = self.request.over is not None
        paths = self.request.free.paths[:SHOWN]
        columns, kinds = [Column(self.request.noun)], []
        for j, one in enumerate(self.objectives):
            for kind in ("nominal", "worst") if judged and one.grounded else ("nominal",):
                columns.append(Column(f"worst {one.name}" if kind == "worst" else one.name, one.unit))
                kinds.append((kind, j))
            if one.grounded and np.isfinite([point.intervals[j] for _, point in self.named]).any():
                columns.append(Column(f"{one.name}, 95 %", one.unit, 3))
                kinds.append(("intervals", j))
        columns += [*self.robust.motion.columns, *(Column(*one) for one in units_of(self.request.scene, paths).items())]
        rows = [
            (
                ", ".join(names),
                *(getattr(point, kind)[j] for kind, j in kinds),
                *point.motion.row,
                *(point.values[path] for path in paths),
            )
            for names, point in self.once
        ]
        read = f", {self.reused} read" if self.reused else ""
        notes = [f"{self.candidates} tried, {self.runs} runs{read}", f"{self.request.motion}"]
        if isinstance(self.request.motion, SettledMotion):
            notes.append(self.spread_of)
        if judged and self.gap == self.gap:
            notes.append(f"gap of the worst grounds: {percent(self.gap, 2)}; {len(self.grounds)} grounds active")
        if self.certificate is not None:
            looked = self.certificate
            notes.append(
                f"of {looked.grounds} grounds drawn by chance at the end {looked.worse} were more than 2 % worse for "
                f"any that is shown than known; at most {percent(looked.share, 2)} of the box are (95 %)"
            )
        notes += [f"robust, {self.percents.words}", *self.remarks, *([self.verdict] if self.verdict else [])]
        names = " against ".join(one.name for one in self.objectives)
        title = f"Design of '{self.request.scene.name}': a front of {len(self.members)}, {names}"
        return Table(title, columns, rows, notes)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI units; NaN where there is none.

        objectives: name, unit, whether the most is best; limits; front: gaits, each with ``values`` by path, ``motion``
        and, by objective, ``nominal``, ``risk`` and ``worst``; robust, optimum: the two gaits that are compared, and
        gain: worst value of the first over that of the second; percents: what one percent of each number costs the
        robust one; gap: what is left open about the worst grounds; certificate: grounds drawn by chance at the end,
        those more than 2 % worse than known, and the box's share that may be so.
        """
        request, looked = self.request, self.certificate
        proof = None if looked is None else {"grounds": looked.grounds, "worse": looked.worse, "share": looked.share}
        return {
            "certificate": proof,
            "scene": request.scene.name,
            "risk": request.risk.name,
            "free": list(request.free.names),
            "objectives": [{"name": one.name, "unit": one.unit, "most": one.most} for one in self.objectives],
            "limits": [
                {"measure": one.measure, "most": one.most, "value": one.value, "reason": one.reason}
                for one in request.limits
            ],
            "remarks": self.remarks,
            "front": [_point(self, one) for one in self.members],
            "robust": _point(self, self.robust),
            "optimum": _point(self, self.optimum),
            "gain": self.gain,
            "percents": self.percents.to_dict(),
            "over": [] if request.over is None else list(request.over.names),
            "grounds": self.grounds.each(),
            "motion": str(request.motion),
            "starts": request.motion.starts,
            "better": self.better,
            "gap": self.gap,
            "rounds": [{"what": one.what, "grounds": one.grounds, "gap": one.gap} for one in self.rounds],
            "candidates": self.candidates,
            "runs": self.runs,
            "reused": self.reused,
            "duration": request.duration,
            "version": package_version(),
        }

    def texts(self) -> dict[str, str]:
        """The front as data and rows, its gaits as scenes, the robust one as a header."""
        noun = f"{self.request.noun}s"
        found = {f"{noun}.json": json_text(self.to_dict()) + "\n", "front.csv": _front_csv(self)}
        found |= {f"{noun}/{name}.toml": scene_text(self.scene_of(point)) for name, point in self.named}
        robust = self.scene_of(self.robust)
        if robust.gait is not None:
            found["gait.h"] = gait_header_text(robust, tick=min(TICK, 1.0 / (TICKS * robust.gait.frequency)))
        return found


def _point(design: Design, point: Candidate) -> dict[str, Any]:
    names = [one.name for one in design.objectives]
    named = {key: dict(zip(names, getattr(point, key), strict=True)) for key in ("nominal", "risk", "worst")}
    return {
        "intervals": {name: list(ends) for name, ends in zip(names, point.intervals, strict=True)},
        "values": dict(point.values),
        **named,
        "worst_ground": dict(point.worst_ground),
        "energy": point.energy,
        "energy_recovered": point.recovered,
        "beyond": point.beyond,
        "motion": point.motion.to_dict(),
    }


def _front_csv(design: Design) -> str:
    kinds = ("nominal", "risk", "worst")
    paths = units_of(design.request.scene, design.request.free.paths)
    head = [
        design.request.noun,
        *(f"{path} ({unit})" for path, unit in paths.items()),
        *(f"{one.name} {kind} ({one.unit})" for one in design.objectives for kind in (*kinds, "low 95 %", "high 95 %")),
        "energy (J)",
        "energy with charge recovery (J)",
        "share of runs beyond limits",
        *design.robust.motion.head,
    ]
    rows = [
        (
            name,
            *point.values.values(),
            *(
                one
                for j in range(len(design.objectives))
                for one in (*(getattr(point, kind)[j] for kind in kinds), *point.intervals[j])
            ),
            point.energy,
            point.recovered,
            point.beyond,
            *point.motion.to_dict().values(),
        )
        for name, point in design.named
    ]
    return csv_text(head, rows)
