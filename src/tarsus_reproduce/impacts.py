"""What the impact maps of a robot do: modes beside the printed CoR column, and the energy each map would make."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.events import IMPACTS
from tarsus.impacts.shapes import mode_shapes
from tarsus.measure.mac import mac
from tarsus.model.impact_energy import directed
from tarsus.model.laws import DominantMode, ImpactMap, MassWeighted, MeasuredImpactMap
from tarsus.model.scene import Scene
from tarsus.solve import Run
from tarsus_reproduce.printed import printed_model


@dataclass(frozen=True)
class ModeRow:
    """One mode: frequency [Hz], shape at the points relative to the struck foot, MAC with the printed CoR column."""

    number: int
    freq_hz: float
    mac: float
    shape: tuple[float, ...]


@dataclass(frozen=True)
class MapRow:
    """One impact map at the bouncing foot: worst factor of kinetic energy in one impact, as it is and made passive.

    skew: part of its direction across the foot's normal, against that along it, in the mass metric.
    """

    map: str
    restitution: float
    skew: float
    worst_gain: float
    passive_worst_gain: float


def printed_column(robot: str) -> Floats:
    """Change of the points' velocities per unit change of the foot's (n,): (R - I) / (R_11 - 1), R as printed."""
    column = printed_model(robot).restitution_column.copy()
    if column[0] > 0.0:  # erratum E6: the printed sign would drive the foot into the ground
        column[0] = -column[0]
    column[0] -= 1.0
    return column / column[0]


def named_maps(scene: Scene, robot: str) -> dict[str, ImpactMap]:
    """The three maps by name; the printed one only for a structure with as many points as it has entries."""
    maps: dict[str, ImpactMap] = {"mass-weighted": MassWeighted(), "dominant mode": DominantMode()}
    column, points = printed_column(robot), scene.robot.structure.points
    if len(points) == len(column) == scene.robot.structure.size:
        foot = next(iter(scene.robot.feet))
        maps["printed"] = MeasuredImpactMap(columns={foot: dict(zip(points, column.tolist(), strict=True))})
    return maps


def map_rows(scene: Scene, robot: str) -> tuple[MapRow, ...]:
    """Worst-case energy of every named map."""
    rows = []
    for name, chosen in named_maps(scene, robot).items():
        impact = directed(scene, chosen)
        rows.append(MapRow(name, impact.restitution, impact.skew, impact.gain(), impact.gain(passive=True)))
    return tuple(rows)


def mode_rows(scene: Scene, robot: str) -> tuple[ModeRow, ...]:
    """Every mode with its MAC against the printed CoR column; none where the points do not match."""
    structure = scene.robot.structure
    column = printed_column(robot)
    if len(structure.points) != len(column):
        return ()
    frequencies, shapes = mode_shapes(structure, structure.points)
    return tuple(
        ModeRow(
            k + 1,
            float(frequencies[k]),
            float(mac(shapes[:, k], column)),
            tuple((shapes[:, k] / shapes[0, k]).tolist()),
        )
        for k in range(shapes.shape[1])
    )


@dataclass(frozen=True)
class ImpactEnergies:
    """Energy [J] (ni,) that each map, as it is, would have made (positive) or destroyed at every impact of a run.

    time (ni,) [s]; by map name; actual: what the run's own impacts took (negative) or made.
    """

    time: Floats
    by_map: dict[str, Floats]
    actual: Floats


def impact_energies(run: Run, robot: str) -> ImpactEnergies:
    """What every named map would have done with the velocities just before each impact of the first foot."""
    events = run.events[(run.events["foot"] == 0) & np.isin(run.events["kind"], IMPACTS)]
    times = events["time"]
    before = run.states(np.nextafter(times, -np.inf)).v
    made = {
        name: directed(run.scene, chosen).energy(before) if len(times) else np.zeros(0)
        for name, chosen in named_maps(run.scene, robot).items()
    }
    return ImpactEnergies(times, made, -events["energy"])
