"""The measured cells of a table in SI, with their tolerances; constraints as limits of channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tarsus.base.units import parse_quantity
from tarsus.calibrate.description import MeasureColumn, Study, TableSampling
from tarsus.calibrate.faults import Faults
from tarsus.calibrate.objective import Cells, SoftLimit
from tarsus.calibrate.readings import unit_of
from tarsus.calibrate.scenes import Variant
from tarsus.files.rows import Cell, TableRows
from tarsus.measure.periods import scene_period
from tarsus.solve import too_long


def cells_of(
    study: Study,
    table: TableRows,
    numbers: Sequence[int],
    variant: Variant,
    middle: Mapping[str, float],
    faults: Faults,
) -> Cells:
    """Cells of the table's rows of these numbers; rows of the variant are in that order."""
    measures = list(study.measures.items())
    units = [unit_of(one.measure) for _, one in measures]
    ones = [
        faults.quantity(_with(one.unit, 1), unit, f"measures.{name}.unit")
        for (name, one), unit in zip(measures, units, strict=True)
    ]
    observed = np.full((len(numbers), len(measures)), np.nan)
    absolute = np.zeros(observed.shape)
    for place, number in enumerate(numbers):
        scene = variant.scene_of(middle, variant.rows[place])
        period = scene_period(scene, np.inf)
        window = study.sampling.window or period
        if not np.isfinite(window):
            faults.add(f"sampling.window: row {number + 1} has no drive period; say how long a window is")
        elif said := too_long(scene, study.sampling.settle + study.sampling.windows * window):
            faults.add(f"sampling: row {number + 1}: {said}")
        for k, (name, one) in enumerate(measures):
            absolute[place, k] = absolute_of(study.sampling, one, period, f"measures.{name}", faults)
            column = one.column or name
            where = f"line {table.lines[number]} of the table"
            value, fault = Cell(ranges=True).read(table.rows[number][column], column)
            if fault is not None:
                faults.add(f"{where}: {fault}")
            if value is None or np.isnan(ones[k]):
                continue
            observed[place, k] = parse_quantity(_with(one.unit, value), units[k])
            if observed[place, k] == 0.0 and absolute[place, k] == 0.0:
                faults.add(f"measures.{name}: a value of zero needs an absolute tolerance ({where})")
            elif absolute[place, k] == 0.0 and one.relative == 0.0:
                faults.add(f"measures.{name}: expected an absolute or a relative tolerance above 0")
    return Cells(
        tuple(study.measures),
        tuple(one.unit for _, one in measures),
        observed,
        absolute,
        np.array([one.relative for _, one in measures]),
        np.array([one.weight for _, one in measures]),
        np.array([one.existence for _, one in measures]),
    )


def _with(unit: str, value: float | str) -> str:
    return f"{value!r} {unit}".removesuffix(" 1")


def absolute_of(sampling: TableSampling, one: MeasureColumn, period: float, where: str, faults: Faults) -> float:
    """Absolute tolerance of a column [SI] in a row of this drive period [s]: its own, and one count in the window."""
    unit = unit_of(one.measure)
    own = faults.quantity(one.absolute, unit, f"{where}.absolute")
    if not one.counts:
        return own
    window = sampling.window or period
    return float(np.hypot(own, 1.0 / window if unit == "1/s" else period / window))


def limits_of(study: Study, channels: Sequence[str], faults: Faults) -> list[SoftLimit]:
    """Constraints over the rows of their conditions, one after the other."""
    limits, place = [], 0
    for n, one in enumerate(study.constraints):
        if one.measure not in channels:
            continue
        where = f"constraints.{n}"
        unit = unit_of(one.measure)
        low = -np.inf if one.min is None else faults.quantity(one.min, unit, f"{where}.min")
        high = np.inf if one.max is None else faults.quantity(one.max, unit, f"{where}.max")
        softness = faults.quantity(one.softness, unit, f"{where}.softness")
        if softness <= 0.0:
            faults.add(f"{where}.softness: expected a value above 0")
        if low > high:
            faults.add(f"{where}: expected min below max")
        rows = tuple(range(place, place + len(one.conditions)))
        place += len(one.conditions)
        limits.append(SoftLimit(one.name, rows, channels.index(one.measure), low, high, softness))
    return limits


def column_value(value: float, unit: str) -> float:
    """An SI value in a column's unit."""
    return value / parse_quantity(f"1 {unit}", unit) if unit != "1" else value
