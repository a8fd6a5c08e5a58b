"""Every quantity of every description of the model keeps its unit and its bounds, which stand here once more."""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Iterator
from inspect import isabstract

import tarsus.model
from tarsus.base.errors import InputError
from tarsus.base.spec import Description, quantity_units
from tarsus.base.units import describe_unit

BY_UNIT = {
    "(0, inf)": "F|Hz|K|V/s|kg|kg m^2|kg/m|kg/m^3|N m/rad|s",
    "[0, inf)": "N m|N m s|N m s/rad|N m^2 s|N m^2/V^2|N s/m|N/m|N/s",
    "(-inf, inf)": "1|1/K|1/m|N|N/V|N/V^2|N/V^3|V|m|m/s|m/s^2|rad",
}
BY_FIELD = {
    "(-inf, inf)": "Lumped.mass Lumped.damping Lumped.stiffness Leg.torque",
    "(0, inf)": (
        "Film.thickness RarefiedFilm.thickness Electrostatic.offset FringingField.offset FringingField.height "
        "LegElectrostatic.offset Pits.spacing Pits.width Pits.depth RandomGround.correlation_length "
        "RandomGround.spacing Sawtooth.length Sawtooth.height Staircase.tread SurveyedGround.spacing "
        "SurveyedGround.unit Beam.length Beam.tip_length Beam.tip_width Beam.tip_thickness WalkerBody.length "
        "Link.length Payload.stiffness_v Payload.stiffness_l WalkerTip.stiffness_v WalkerTip.stiffness_l "
        "Leg.rated_volts Amplifier.clip PowerRestitution.speed StribeckFriction.speed RateWeakeningFriction.speed"
    ),
    "[0, inf)": (
        "Adhesion.initial ElectroAdhesion.initial ElectroAdhesion.coefficient AgeingAdhesion.initial "
        "AgeingAdhesion.gain PrandtlIshlinskii.thresholds Creeping.thresholds RarefiedFilm.free_path "
        "LegElectrostatic.rest RandomGround.rms RestituteFirst.speed Gravity.acceleration Friction.coefficient "
        "AdhesiveFriction.coefficient StaticKineticFriction.static StaticKineticFriction.kinetic "
        "StribeckFriction.static StribeckFriction.dynamic RateWeakeningFriction.static RateWeakeningFriction.dynamic "
        "Profile.adhesion Profile.friction Beam.damping_ratios Modal.damping_ratios Lumped.damping_ratios "
        "WalkerMode.damping_ratio Modal.frequencies Poling.fall Sampled.times Sampled.start"
    ),
    "[0, 1]": (
        "RampedSquare.duty Square.duty PowerRestitution.coefficient PowerRestitution.power PowerRestitution.most "
        "Restitution.coefficient Profile.restitution Sawtooth.rising Drive.recovery"
    ),
    "(0, 1)": "Gait.duty",
    "(0, 1]": "RandomGround.hurst",
    "[1, 10]": "StribeckFriction.exponent",
    "[-2, 2]": "Gait.turn",
    "[0, 9007199254740992]": "RandomGround.seed",
    f"[{-math.pi}, {math.pi}]": "_Ground.incline",
    f"({-0.5 * math.pi}, {0.5 * math.pi})": "WalkerLeg.tilt",
}
UNIT_BOUNDS = {unit: bounds for bounds, units in BY_UNIT.items() for unit in units.split("|")}
FIELD_BOUNDS = {field: bounds for bounds, fields in BY_FIELD.items() for field in fields.split()}


def classes(of: type[Description] = Description) -> Iterator[type[Description]]:
    """Descriptions of the model that can be made, each once."""
    for module in pkgutil.walk_packages(tarsus.model.__path__, "tarsus.model."):
        importlib.import_module(module.name)
    found, some = {}, [of]
    while some:
        some += some.pop().__subclasses__()
        found |= {
            one: None
            for one in some
            if one.__module__.startswith("tarsus.model.") and not (isabstract(one) or one.__name__ == "_Ground")
        }
    return iter(found)


def ends(bounds: str) -> tuple[list[float], list[float]]:
    """Values at and beside the ends of an interval that a field takes, and that it refuses."""
    taken, refused = [], [math.nan, math.inf, -math.inf]
    for end, inward in zip(map(float, bounds[1:-1].split(",")), (1.0, -1.0), strict=True):
        if math.isinf(end):
            taken.append(-1e9 * inward)
        else:
            step = inward * max(1e-9, 1e-15 * abs(end) * 2.0)
            closed = bounds[0 if inward > 0.0 else -1] in "[]"
            taken += [end + step, *([end] if closed else [])]
            refused += [end - step, *([] if closed else [end])]
    return taken, refused


def faults(cls: type[Description], field: str, value: object) -> list[str]:
    """What is said of a field, if anything: with its path, and with the quantity that is expected."""
    try:
        cls(**{field: value})
    except InputError as error:
        path, wanted = f"{cls.__name__}.{field}", f": expected {describe_unit(quantity_units(cls)[field])}"
        return [one for one in error.problems if one.startswith((f"{path}:", f"{path}.")) and wanted in one]
    return []


def test_every_quantity_keeps_its_unit_and_its_bounds() -> None:
    seen = set()
    for cls in classes():
        for field, unit in quantity_units(cls).items():
            owner = next(one for one in cls.__mro__ if field in vars(one).get("__annotations__", {}))
            name = f"{owner.__name__}.{field}"
            seen.add(name)
            by_unit = "[0, inf)" if field == "amplitude" else UNIT_BOUNDS[unit]
            taken, refused = ends(FIELD_BOUNDS.get(name, by_unit))
            assert [value for value in taken if faults(cls, field, value)] == [], name
            assert [value for value in (*refused, "1 m^7", "soon") if not faults(cls, field, value)] == [], name
    assert seen >= set(FIELD_BOUNDS) and len(seen) > 200
