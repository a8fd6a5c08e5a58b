"""The energy account of a run: as plain data, as it is kept, and in words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

LEDGER_WORDS: dict[str, str] = {
    "work_in": "work in by the drives",
    "kinetic": "change of kinetic energy",
    "elastic": "change of elastic energy",
    "damping": "lost to structural damping",
    "friction": "lost to friction",
    "impacts": "lost in impacts",
    "adhesion": "lost to adhesion",
}
"""Term of every energy account -> its line in reports; those of the laws follow."""
GROUND = "work in by the ground"
"""The line of ground that moves."""


@dataclass(frozen=True)
class Ledger:
    """Where the energy of a run went [J]: work_in + ground + the sum of laws = kinetic + elastic + damping + friction
    + impacts + adhesion + residual.

    work_in: work of the drives and of the weight; ground: of ground that moves, in its own frame; laws: work on the
    structure of every law that acts on a foot in the air, by name, below 0 where it takes energy; kinetic, elastic:
    change from start to end; damping, friction, impacts, adhesion: losses. ``adhesion`` is the kinetic energy of feet
    that were captured and would have bounced without adhesion. closure: \\|residual\\| over the largest term, or where
    all return to next to nothing, the most energy that the robot stored on its way; where every term is below 1e-20 of
    the plan's force times length, over that, for then all are rounding. Where resistive laws act on feet that move less
    than 0.05 of the plan's length, it is over as much more as the account is less exact: see
    `tarsus.solve.motion.RESOLVED`.
    """

    work_in: float
    kinetic: float
    elastic: float
    damping: float
    friction: float
    impacts: float
    adhesion: float
    laws: Mapping[str, float]
    residual: float
    closure: float
    ground: float = 0.0

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> Ledger:
        """From plain data that `to_dict` gave; an energy that is null is not known."""
        laws = {name: read_number(work) for name, work in table["laws"].items()}
        return cls(**{name: read_number(value) for name, value in table.items() if name != "laws"}, laws=laws)

    def to_dict(self) -> dict[str, Any]:
        """As plain data [J], works of laws by name under `laws`; `closure` [1]."""
        laws = {name: float(work) for name, work in self.laws.items()}
        terms = {one.name: float(getattr(self, one.name)) for one in fields(self) if one.name != "laws"}
        return {**terms, "laws": laws}


def ledger_lines(run: Any) -> list[tuple[str, float]]:
    """Lines of a run's energy account in words, with their energies [J]; one for every law that acted."""
    acting = run.scene.ground.acting_laws
    lines = [(text, float(getattr(run.ledger, name))) for name, text in LEDGER_WORDS.items()]
    if run.scene.ground.motion is not None:
        lines.insert(1, (GROUND, float(run.ledger.ground)))
    for name, work in run.ledger.laws.items():
        law = acting[name]
        lines.append((law.label(), -float(work) if law.loses else float(work)))
    return lines


def read_number(value: float | None) -> float:
    """A number as JSON holds it: null is not a number."""
    return math.nan if value is None else float(value)
