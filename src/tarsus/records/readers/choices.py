"""What the user says about a file: which channels, their units and points, the axis, the drive, the input."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field

from tarsus.base.spec import Description, FrozenDict, MaybeAmount, quantity


class ChannelChoice(Description):
    """What to know of one channel; anything left out is taken from the file."""

    name: str | None = Field(default=None, min_length=1, description="name to give it")
    unit: str | None = Field(default=None, min_length=1, description="unit of its numbers in the file")
    factor: float | None = Field(
        default=None,
        allow_inf_nan=False,
        description="what 1 in the file is of that unit, as the sensitivity of an analogue output",
    )
    point: str | None = Field(default=None, min_length=1, description="point of the structure it looks at")
    noise: float | str | None = Field(default=None, description="standard deviation of one sample")
    full_scale: float | str | None = Field(default=None, description="largest value of the instrument")
    coherence: str | None = Field(default=None, min_length=1, description="series with its coherence")
    imaginary: str | None = Field(
        default=None, min_length=1, description="series with the imaginary part; this one is the real part"
    )
    phase: str | None = Field(
        default=None, min_length=1, description="series with the phase; this one is the amplitude"
    )
    phase_unit: str | None = Field(default=None, min_length=1, description="deg or rad")
    accept_clipped: bool = Field(default=False, description="take it although it looks clipped")


def _table(given: Any) -> Any:
    """A list of names, or names with units, as a table of choices."""
    if isinstance(given, (list, tuple)) and all(isinstance(name, str) for name in given):
        return {name: {} for name in given}
    if isinstance(given, dict):
        return {name: {"unit": one} if isinstance(one, str) else one for name, one in given.items()}
    return given


class Choices(Description):
    """What the user says about a file. It wins over what the file says, and the record notes that it did.

    channels: names in the file, as a list, with their units (``{"Ch1": "mm/s"}``) or with all of a `ChannelChoice`;
    empty takes every channel whose unit the file states.
    """

    channels: Annotated[dict[str, ChannelChoice], BeforeValidator(_table), AfterValidator(FrozenDict)] = Field(
        default_factory=FrozenDict, description="channels to read, by their names in the file"
    )
    axis: str | None = Field(default=None, min_length=1, description="series of the times or frequencies")
    axis_unit: str | None = Field(default=None, min_length=1, description="unit of the axis")
    step: MaybeAmount = quantity("s", "time between samples", default=None, gt=0)
    frequency_step: MaybeAmount = quantity(
        "Hz", "distance of the lines of a response that begins at 0 Hz", default=None, gt=0
    )
    record: int | None = Field(
        default=None, ge=0, description="which of several records in the file, from 1; 0 joins them"
    )
    drive: str | None = Field(default=None, min_length=1, description="channel that recorded the drive")
    inputs: tuple[str, ...] = Field(default=(), description="inputs of the responses to read; empty is all")
    input_unit: str | None = Field(default=None, min_length=1, description="unit of the input of the responses")

    @property
    def groups(self) -> set[str]:
        """Groups of the file that the chosen channels are in, by their names."""
        return {name.rpartition("/")[0] for name in self.channels}


def choices_of(read: Mapping[str, Any]) -> dict[str, Any]:
    """Choices by name as they are typed: fields of `Choices`, and units of channels by name (None: as the file has it).

    ``choices_of({"Ch1": "mm/s", "axis": "t"})`` is ``{"axis": "t", "channels": {"Ch1": "mm/s"}}``.
    """
    own = {name: value for name, value in read.items() if name in Choices.model_fields}
    channels = {name: {} if unit is None else unit for name, unit in read.items() if name not in own}
    return own | ({"channels": {**own.get("channels", {}), **channels}} if channels else {})
