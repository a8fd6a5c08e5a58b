"""Records near the ground with records of the same drive in the air: an impact map without the law of the drive, and
a look at the motion in the air, where nothing but structure and drive counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.identify.draws import DRAWS
from tarsus.identify.foot import FootModel
from tarsus.identify.traces import Trace
from tarsus.impacts.estimates import Spread
from tarsus.impacts.impact_map import ImpactMapEstimate, estimate_impact_map
from tarsus.model.drive.waveforms import Waveform
from tarsus.model.standing import rest_state
from tarsus.records.excluded import Excluded
from tarsus.records.measurement import Measurement, Quantity
from tarsus.records.purpose import IN_AIR
from tarsus.solve import ResultCode, simulate

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Pair:
    """Repeats of a set near the ground and of the one with the same drive in the air, by the sets' names."""

    near: str
    air: str
    close: tuple[Measurement, ...]
    in_air: tuple[Measurement, ...]


def map_from_pairs(
    model: FootModel, pairs: Sequence[Pair]
) -> tuple[dict[str, ImpactMapEstimate], list[Excluded]]:
    """Restitution and impact column by the sets near the ground, after section 3.4.2 of the source, and the pairs
    that cannot tell them, with the reason: where the ground is felt before it is touched, through a film, the record
    in the air does not explain the one near the ground."""
    found: dict[str, ImpactMapEstimate] = {}
    left: list[Excluded] = []
    for pair in pairs:
        name = _velocity(pair.close[0], model.foot_point)
        try:
            if name is None:
                raise InputError(f"no channel is the velocity of point '{model.foot_point}'")
            found[pair.near] = estimate_impact_map(pair.close, pair.in_air, model.scene.robot.structure, name)
        except InputError as error:
            reason = error.problems[0][:1].lower() + error.problems[0][1:]
            left.append(
                Excluded(f"{pair.near} less {pair.air}", name or "", f"as a pair: {reason.rstrip('.')}")
            )
    return found, left


def _velocity(record: Measurement, point: str) -> str | None:
    return next((c.name for c in record.channels if c.at == point and c.quantity is Quantity.VELOCITY), None)


def from_pairs(found: dict[str, ImpactMapEstimate], seed: int) -> dict[str, tuple[float, Floats, str]]:
    """Restitution and jumps by name, as (value, draws (nd,), unit)."""
    random = np.random.default_rng([seed, 17])
    out: dict[str, tuple[float, Floats, str]] = {}

    def add(name: str, one: Spread) -> None:
        out[name] = (one.value, one.value + one.std * random.standard_normal(DRAWS), "1")

    for near, estimate in found.items():
        add(f"restitution, from {near} less the air", estimate.restitution)
        for name, one in zip(estimate.names, estimate.column, strict=True):
            if name != estimate.foot:
                add(f"jump of {name} over the foot's, from {near} less the air", one)
    return out


@dataclass(frozen=True)
class InAir:
    """A record in the air against the identified structure and drive: set and file; off (np,) by point: root mean
    square of measured less simulated motion over that of the measured one."""

    name: str
    file: str
    off: dict[str, float]


def compare_in_air(model: FootModel, trace: Trace, signal: Waveform) -> InAir:
    """Simulate a record in the air.

    Raises
    ------
    InputError
        If the simulation does not reach its end.
    """
    far = IN_AIR if trace.gap is None else trace.gap
    changes = {f"robot.feet.{name}.gap": far for name in model.scene.robot.feet}
    rest = np.array(rest_state(model.scene))
    driven = trace.time >= -1e-9
    time = np.maximum(trace.time[driven], 0.0)
    run = simulate(with_values(model.driven(signal), changes), float(time[-1]) + trace.step)
    if run.ended is not ResultCode.DONE:
        raise InputError(f"{trace.file}: the identified device cannot be simulated in the air: {run.ended}")
    moved = model.rows @ (run.states(time).x - rest[:, None])
    seen = trace.x[:, driven]
    off = np.sqrt(np.mean((seen - moved) ** 2, axis=1) / np.mean(seen**2, axis=1))
    return InAir(trace.set, trace.file, dict(zip(trace.points, off.tolist(), strict=True)))
