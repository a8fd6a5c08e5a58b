"""The series of a run by name, each with dimensions, unit and long name."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tarsus.files.series import Variable
from tarsus.measure.path import path_of
from tarsus.model.structure.walker import TURNS
from tarsus.solve.series import command_volts

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.solve.series import Series


def to_variables(scene: Scene, series: Series) -> dict[str, Variable]:
    """Series of a run over time, foot, drive and point, with these as coordinates; of a walker also over coordinates of
    its body."""
    structure = scene.robot.structure
    points = list(structure.points)
    rows = np.array([structure.row(p) for p in points]).reshape(len(points), structure.size)
    state = series.state
    variables: dict[str, Variable] = {}

    def add(name: str, dims: tuple[str, ...], values: np.ndarray, units: str, long_name: str) -> None:
        variables[name] = Variable(dims, values, {"units": units, "long_name": long_name})

    add("volts", ("drive", "time"), series.volts, "V", "drive voltage")
    command = command_volts(scene, series.time)
    if command is not None:
        add("command", ("drive", "time"), command, "V", "voltage that the amplifier is commanded to give")
    add("drive_force", ("drive", "time"), series.force, "N", "drive force")
    add("charge", ("drive", "time"), series.charge, "C", "electric charge on a drive's actuator")
    add("current", ("drive", "time"), series.current, "A", "current into a drive's actuator")
    add("displacement", ("point", "time"), rows @ state.x, "m", "displacement of a point along +z")
    add("velocity", ("point", "time"), rows @ state.v, "m/s", "velocity of a point along +z")
    foot = ("foot", "time")
    add("gap", foot, state.gap, "m", "clearance of a foot")
    add("gap_rate", foot, state.rate, "m/s", "rate of the clearance, negative when approaching")
    add("contact", foot, state.held, "1", "foot held on the ground")
    add("pull", foot, state.pull, "N", "structure's pull on a held foot, away from the ground")
    add("adhesion_strength", foot, series.strength, "N", "pull that the contact would hold")
    laws = scene.ground.acting_laws
    for name, force in series.laws.items():
        add(
            f"{name}_force", foot, force, "N", f"force of the {laws[name].title} on the foot along the normal"
        )
    add(
        "contact_force",
        foot,
        series.contact,
        "N",
        "reaction of the ground on a held foot, below 0 when it holds back",
    )
    add("kinetic_energy", ("time",), series.kinetic, "J", "kinetic energy")
    add("elastic_energy", ("time",), series.elastic, "J", "elastic energy")
    for name, (key, text) in _CUMULATIVE.items():
        add(name, ("time",), series.cumulative[key], "J", f"{text}, from the start")
    for name, work in series.works.items():
        text = f"work of the {laws[name].title} on the structure, from the start"
        add(f"{name}_work", ("time",), work, "J", text)
    names = {"foot": scene.robot.feet, "drive": scene.robot.drives, "point": points}
    if body := structure.body_coordinates:
        names["coordinate"] = body
        units = ", ".join("rad" if name in TURNS else "m" for name in body)
        assert series.body is not None  # a walker has one
        add("body", ("coordinate", "time"), series.body, units, "coordinates of the body")
        if "yaw" in body:
            surge, sway, yaw = (series.body[body.index(name)] for name in ("surge", "sway", "yaw"))
            for name, values, way in zip(
                ("path_x", "path_y"), path_of(surge, sway, yaw), ("forward", "to the left"), strict=True
            ):
                add(name, ("time",), values, "m", f"place of the body in the world, {way} of its start")
    if series.foot_x is not None:
        lost = series.cumulative["friction"]
        for name, dims, values, unit, text in (
            ("foot_x", foot, series.foot_x, "m", "displacement of a foot along the way"),
            ("slipping", foot, series.slipping, "1", "foot in contact that slides"),
            ("friction_force", foot, series.friction, "N", "friction on a foot, positive forward"),
            (
                "friction_loss",
                ("time",),
                lost,
                "J",
                "energy lost to friction along the ground, from the start",
            ),
        ):
            assert values is not None  # they come together
            add(name, dims, values, unit, text)
    if series.foot_y is not None:
        assert series.friction_across is not None
        add("foot_y", foot, series.foot_y, "m", "displacement of a foot across the way, to the left")
        add(
            "friction_across",
            foot,
            series.friction_across,
            "N",
            "friction on a foot across the way, positive to the left",
        )
    variables["time"] = Variable(("time",), series.time, {"units": "s", "long_name": "time"})
    for dim, known in names.items():
        variables[dim] = Variable((dim,), np.array(list(known), dtype=object), {})
    return variables


_CUMULATIVE = {
    "work_in": ("work_in", "work of drives and weight"),
    "damping_loss": ("damping", "energy lost to structural damping"),
    "impact_loss": ("impacts", "energy lost in impacts"),
    "adhesion_loss": ("adhesion", "kinetic energy taken by adhesive capture"),
}
