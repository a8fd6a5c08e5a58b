"""What the impact laws of a robot do: modes with the printed CoR column, and the energy each law would make."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.events import IMPACTS
from tarsus.impacts.shapes import mode_shapes
from tarsus.measure.mac import mac
from tarsus.model.impact_energy import directed
from tarsus.model.laws import DominantMode, ImpactMap, MassWeighted, MeasuredImpactMap
from tarsus.model.scene import Scene
from tarsus.solve import Run
from tarsus.tables import Column, Table
from tarsus_reproduce.printed import printed_model

ROUNDING = 1e-9
"""Gains of kinetic energy and energies that differ by less of their size are one: sums of a run round far below."""


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


def modes_table(scene: Scene, robot: str) -> Table | None:
    """Frequency and shape of every mode at the points relative to the struck foot, with its MAC against the printed CoR
    column, which is the last row; None where the points are not those of the column."""
    structure, column = scene.robot.structure, printed_column(robot)
    if len(structure.points) != len(column):
        return None
    frequencies, shapes = mode_shapes(structure, structure.points)
    rows: list[tuple[Any, ...]] = [
        (str(k + 1), float(hertz), float(mac(shape, column)), *(shape / shape[0]).tolist())
        for k, (hertz, shape) in enumerate(zip(frequencies, shapes.T, strict=True))
    ]
    columns = (
        "mode",
        Column("frequency", "Hz"),
        Column("MAC", digits=3),
        *(Column(one, digits=3, over="shape") for one in structure.points),
    )
    note = (
        "MAC: likeness of the mode and the printed CoR column, 1 = the same shape; the last line is that column. "
        "Shapes are relative to the struck foot."
    )
    printed = ("printed", None, None, *column.tolist())
    return Table("Modes and the printed CoR column", columns, [*rows, printed], (note,))


def maps_table(scene: Scene, robot: str) -> Table:
    """Every named map at the bouncing foot: restitution, part of its direction across the foot's normal (against that
    along it, in the mass metric), and worst factor of kinetic energy in one impact, as it is and made passive."""
    columns = (
        "map",
        Column("restitution"),
        Column("skew", digits=3),
        Column("as it is", digits=3, over="worst gain"),
        Column("made passive", digits=3, over="worst gain"),
    )
    laws = {name: directed(scene, chosen) for name, chosen in named_maps(scene, robot).items()}
    rows = [(name, one.restitution, one.skew, one.gain(), one.gain(passive=True)) for name, one in laws.items()]
    gains = [(one[3], one[4]) for one in rows]
    flagged = [(k, 3 + j) for k, both in enumerate(gains) for j, gain in enumerate(both) if gain > 1.0 + ROUNDING]
    impact = scene.ground.impact
    acting = (
        "The device's ground has no impact law of its own: mass-weighted."
        if impact is None
        else f"The device acts through the {impact.title} map, {'made passive' if impact.passive else 'as it is'}."
    )
    note = (
        "Gain is the largest factor by which one impact can multiply the kinetic energy; above 1 the map can create "
        f"energy. Skew is how far the map's direction lies across that of an impulse at the foot, in the mass metric. "
        f"{acting}"
    )
    return Table("Impact laws at the bouncing foot", columns, rows, (note,), flagged=flagged)


def impact_energies(run: Run, robot: str) -> dict[str, Floats]:
    """Energy [J] that is made (positive) or destroyed at every impact (ni,) of the first foot of a run: by the run's
    own impacts ("as run"), and by every named map with the velocities just before each."""
    events = run.events[(run.events["foot"] == 0) & np.isin(run.events["kind"], IMPACTS)]
    times = events["time"]
    before = run.states(np.nextafter(times, -np.inf)).v
    return {"as run": -events["energy"]} | {
        f"{name}, as it is": directed(run.scene, chosen).energy(before) if len(times) else np.zeros(0)
        for name, chosen in named_maps(run.scene, robot).items()
    }


def energies_table(energies: Mapping[str, Floats], title: str) -> Table:
    """Energies of at least one impact, by what makes them."""
    columns = (
        "energy made by",
        Column("sum", "J", 3),
        Column("mean of an impact", "J", 3),
        Column("most made", "J", 3),
        Column("most lost", "J", 3),
        Column("impacts that make energy", "%", 3),
    )
    rows = []
    for name, own in energies.items():
        least = ROUNDING * float(np.abs(own).max())
        made, lost = (most if (most := float(one.max())) > least else 0.0 for one in (own, -own))
        rows.append((name, float(own.sum()), float(own.mean()), made, lost, float(np.mean(own > least))))
    note = (
        "Each map is asked what it would have done with the velocities just before every impact of this one run; a run "
        "under another map would meet other velocities."
    )
    return Table(title, columns, rows, (note,))
