"""What a calibration is, as a study file writes it: table, conditions, measures, unknowns, choices, constraints."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, StringConstraints, model_validator

from tarsus.base.messages import PathErrors
from tarsus.base.spec import Amount, Description, MaybeAmount, Name, quantity
from tarsus.fit.unknowns import Unknown, Value
from tarsus.model.scene import Scene

Identifier = Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]


class MeasureColumn(Description):
    """A column that says what was seen: a value v is known within sqrt(absolute^2 + (relative v)^2)."""

    column: str | None = Field(default=None, description="name of the column; the measure's own when absent")
    unit: str = Field(default="1", description="unit of the column")
    measure: str = Field(description="measure of the run")
    relative: float = Field(default=0.0, ge=0.0, description="relative tolerance")
    absolute: Value = Field(default=0.0, description="absolute tolerance: rounding, resolution")
    counts: bool = Field(default=False, description="a count, known within 1 in the window")
    existence: bool = Field(default=False, description="whether it is above zero is a likelihood of its own")
    weight: float = Field(default=1.0, ge=0.0, description="factor of its cost")


class Choice(Description):
    """A discrete unknown: one of some words, which the study's function looks at, or by word what a column means."""

    options: tuple[Name, ...] | dict[Name, dict[str, str]] = Field(
        min_length=1,
        description="words; or by word the measures of the run that columns then are, by the column's name",
    )
    meaning: str = ""

    def measures(self, option: str) -> dict[str, str]:
        """Measures of the run that columns are under an option."""
        return dict(self.options[option]) if isinstance(self.options, dict) else {}


class Constraint(Description):
    """What is known besides the table: a measure stays between bounds under some conditions.

    The largest value of the windows is held against `max`, the smallest against `min`.
    """

    name: str = Field(min_length=1)
    conditions: tuple[dict[str, Any], ...] = Field(
        min_length=1, description="cells of the condition columns, one table a run; those absent: the first row's"
    )
    set: dict[str, Any] = Field(default={}, description="values of the scene by path, added to the conditions")
    measure: str
    unit: str = "1"
    min: Value | None = None
    max: Value | None = None
    softness: Value = Field(description="excess that counts as one standard deviation")
    reason: str = Field(default="", description="why it is known, shown with the result")

    @model_validator(mode="after")
    def _complete(self) -> Constraint:
        if self.min is None and self.max is None:
            raise PathErrors([("", "expected min, max or both")])
        return self


class TableSampling(Description):
    """How the table was sampled: transient, window, resolution; and in how many windows the model is looked at."""

    foot: str | None = Field(default=None, description="the foot that is judged; the first when absent")
    settle: Amount = quantity("s", "transient that is dropped", ge=0)
    window: MaybeAmount = quantity(
        "s", "length of the window that the table's numbers come from; a drive period when absent", default=None, gt=0
    )
    windows: int = Field(default=4, ge=1, le=1000, description="windows of each run, one after the other")
    draws: int = Field(default=1, ge=1, le=1000, description="runs with random initial velocities; 1: from rest")
    speed: Amount = quantity("m/s", "standard deviation of the foot's initial speed", default=1e-3, gt=0)
    resolution: Amount = quantity("m", "height below which the instrument sees nothing", default=1e-7, gt=0)
    accuracy: float = Field(default=1e-6, gt=0, le=1e-2, description="relative error of the gap in a step")


class Search(Description):
    """How long is searched, in sets of unknowns; never in seconds, so that a study has one result.

    Every hypothesis, a combination of options, gets `prescreening` sets spread evenly and `short` generations; those
    that are still `rejected` times the best are rejected; the others get `generations` more, and the best set of each
    goes down by `local_search` steps of least squares; then `spread` generations follow the likelihood of those that
    are kept. The same search is made without each row (`leave_out`), from nothing that knew it.
    """

    seed: int = Field(default=1, ge=0)
    population: int = Field(default=10, ge=5, description="sets a generation")
    prescreening: int = Field(default=128, ge=5, description="sets a hypothesis at the start")
    short: int = Field(default=6, ge=0, description="generations before hypotheses are rejected")
    generations: int = Field(default=40, ge=0, description="generations of a hypothesis that is not")
    local_search: int = Field(default=10, ge=0, description="most steps of the local search; 0: none")
    spread: int = Field(default=40, ge=0, description="generations of the ensemble")
    leave_out: bool = Field(
        default=True, description="search again without each row, and predict it; as much again for every row"
    )
    members: int = Field(default=32, ge=4, description="members of a hypothesis's ensemble, and chains")
    rejected: float = Field(
        default=3.0,
        gt=1,
        description="a hypothesis is rejected when its cost after the short search is so many times the best and 10 "
        "more: a short search leaves one at up to about twice its optimum",
    )


class Study(Description):
    """A calibration as data: a scene, what of a table was done and seen, and what of the scene is not known."""

    name: str = Field(min_length=1)
    scene: Scene
    train: tuple[int, ...] | None = Field(
        default=None, description="rows that are fitted, from 1; all that hold a measured value when absent"
    )
    conditions: tuple[str, ...] = Field(description="columns that say what was done")
    measures: dict[Name, MeasureColumn] = Field(min_length=1)
    unknowns: dict[Identifier, Unknown] = Field(min_length=1)
    choices: dict[Identifier, Choice] = Field(default={})
    constraints: tuple[Constraint, ...] = ()
    sampling: TableSampling
    search: Search = Search()
