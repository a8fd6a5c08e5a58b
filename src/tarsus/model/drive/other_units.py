"""Waveforms of other quantities than a voltage: the same forms, with amplitudes, levels and files in another unit."""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import Annotated, Any

from pydantic import Field, create_model

from tarsus.base.quantities import Quantity
from tarsus.base.spec import quantity
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.waveforms.registry import built_in

VOLT = Quantity.VOLTAGE.unit


def waveforms_of(measured: Quantity, module: dict[str, Any]) -> Any:
    """Any waveform of a quantity, as the type of a field; its classes become names of a module, given by its globals,
    so that they can be pickled."""
    made = [_of(wave, measured, module["__name__"]) for wave in built_in().values()]
    module.update({one.__name__: one for one in made})
    return Annotated[reduce(or_, made), Field(discriminator="kind")]


def _of(wave: type[Signal], measured: Quantity, module: str) -> type[Signal]:
    """A waveform whose numbers in volts are in the unit of a quantity."""
    word = measured.name.lower()
    fields: dict[str, Any] = {}
    for name, field in wave.model_fields.items():
        extra = dict(field.json_schema_extra) if isinstance(field.json_schema_extra, dict) else {}
        if extra.pop("unit", None) == VOLT:
            given: dict[str, Any] = extra if field.is_required() else {**extra, "default": field.default}
            said = str(field.description).replace("voltage", word)
            fields[name] = (field.annotation, quantity(measured.unit, said, **given))
    made: Any = create_model(
        f"{wave.__name__}{word.title()}", __base__=wave, __module__=module, __doc__=wave.__doc__, **fields
    )
    made.measured = measured
    return made
