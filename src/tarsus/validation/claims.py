"""Claims about an experiment, as `claims.toml` states them before the run that judges them."""

from __future__ import annotations

from datetime import date
from enum import Enum

from pydantic import Field, field_validator, model_validator

from tarsus.base.errors import InputError
from tarsus.base.messages import PathErrors
from tarsus.base.spec import Description, FrozenDict, Name, Named
from tarsus.base.units import parse_quantity, si_unit
from tarsus.validation.selection import Selection


class SeenBefore(Enum):
    """Which of the rows of a claim its author had looked at when it was written."""

    ALL = "all"
    SOME = "some"
    NONE = "none"


class Within(Description):
    """At least a share of the rows has at most an error."""

    error: float = Field(gt=0.0, description="largest relative error of a row that counts")
    share: float = Field(gt=0.0, le=1.0, description="share of the rows")


class StatedClaim(Description):
    """What is claimed of some rows. Errors are relative: computed over measured, less one."""

    rows: str = Field(default="", description="which rows, as a condition on their columns; absent: all")
    of: Name | None = Field(default=None, description="the measured column; absent where there is only one")
    median_error: float | None = Field(
        default=None, gt=0.0, description="largest median of the sizes of errors; a row without a number is the worst"
    )
    within: Within | None = None
    bias: tuple[float, float] | None = Field(
        default=None, description="least and greatest median error of the rows that have a number"
    )
    mean_deviation: str | None = Field(
        default=None, description="largest mean size of computed less measured, with its unit"
    )
    closes: float | None = Field(default=None, gt=0.0, le=1.0, description="least share of rows with a number")
    r2: float | None = Field(default=None, le=1.0, description="least coefficient of determination, without a fit")
    written: date = Field(description="day on which the claim was written, before the run that judges it")
    after_run: bool = Field(
        default=False, description="whether it was written after a run, to keep what came out: no prediction"
    )
    seen: SeenBefore
    should_fail: bool = Field(default=False, description="whether the claim is known to fail; it stays")
    note: str = Field(default="", description="a sentence")

    @property
    def when(self) -> str:
        """The day on which it was written, and whether a run came before."""
        return f"{self.written.isoformat()}, after a run" if self.after_run else self.written.isoformat()

    @field_validator("rows")
    @classmethod
    def _is_a_condition(cls, value: str) -> str:
        try:
            Selection(value)
        except InputError as error:
            raise PathErrors([("", problem) for problem in error.problems]) from None
        return value

    @model_validator(mode="after")
    def _claims_something(self) -> StatedClaim:
        criteria = ("median_error", "within", "bias", "mean_deviation", "closes", "r2")
        if all(getattr(self, name) is None for name in criteria):
            raise PathErrors([("", f"claims nothing: give one of {', '.join(criteria)}")])
        if self.bias is not None and self.bias[0] > self.bias[1]:
            raise PathErrors([("bias", f"begins at its lower end, got {self.bias[0]:g} to {self.bias[1]:g}")])
        return self


class MeasuredColumn(Description):
    """A measured column: words for it, the unit of its cells, and the column of their spread."""

    words: str = Field(min_length=1, description="what was measured")
    unit: str = Field(min_length=1, description="unit of the cells, such as us")
    scale: float = Field(default=1.0, gt=0.0, description="what cells are multiplied by: 2.54 of inches, for cm")
    spread: Name | None = Field(default=None, description="column of the half width of the interval, in the same unit")
    formula: bool = Field(
        default=False, description="whether the study gives the number by a formula, and the table has no such column"
    )

    @field_validator("unit")
    @classmethod
    def _is_a_unit(cls, value: str) -> str:
        try:
            si_unit(value)
        except InputError as error:
            raise PathErrors([("", problem) for problem in error.problems]) from None
        return value

    @property
    def si(self) -> str:
        """The SI unit."""
        return si_unit(self.unit)

    @property
    def factor(self) -> float:
        """SI value of a cell of 1."""
        return self.scale * parse_quantity(f"1 {self.unit}", self.si)


class CitedSource(Description):
    """Where the rows come from."""

    cite: str = Field(min_length=1, description="what to cite")
    data: str = Field(default="", description="where the numbers were read")
    licence: str = Field(default="", description="what the source says of its numbers")


class Parameters(Description):
    """What is known of the numbers of the device besides their provenance."""

    fitted: tuple[str, ...] = Field(default=(), description="numbers that were fitted to the rows, by path")
    chosen: tuple[str, ...] = Field(default=(), description="numbers that were chosen, each with the reason")


class Claims(Description):
    """What `claims.toml` holds: source, measured columns, claims, and what else was tried."""

    title: str = Field(min_length=1, description="the experiment in a few words")
    device: str = Field(default="device.toml", description="a file of the folder, or a packaged device's name")
    source: CitedSource
    measured: Named[MeasuredColumn]
    parameters: Parameters = Parameters()
    claims: Named[StatedClaim] = FrozenDict()
    variants: dict[str, str] = Field(default_factory=dict, description="what else was tried, with its score")

    @model_validator(mode="after")
    def _columns_are_measured(self) -> Claims:
        faults = [] if self.measured else [("measured", "names no measured column")]
        for name, claim in self.claims.items():
            if claim.of is None and len(self.measured) > 1:
                known = ", ".join(self.measured)
                faults.append((f"claims.{name}.of", f"missing: one of the measured columns ({known})"))
            elif claim.of is not None and claim.of not in self.measured:
                faults.append((f"claims.{name}.of", f"'{claim.of}' is no measured column"))
            elif claim.mean_deviation is not None and self.measured:
                faults += _deviation_faults(name, claim.mean_deviation, self.measured[self.column_of(claim)].si)
        if faults:
            raise PathErrors(faults)
        return self

    def column_of(self, claim: StatedClaim) -> str:
        """The measured column of a claim."""
        return claim.of or next(iter(self.measured))


def _deviation_faults(name: str, text: str, unit: str) -> list[tuple[str, str]]:
    """What is wrong with a deviation that should be one of a measured column's unit."""
    try:
        parse_quantity(text, unit)
    except InputError as error:
        return [(f"claims.{name}.mean_deviation", problem) for problem in error.problems]
    return []
