"""Equations of motion of a scene's robot: M x'' + C x' + K x = forces, its feet and what drives push."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import eigh

Array = np.ndarray


@dataclass(frozen=True)
class Robot:
    """mass, damping, stiffness (n, n); normals, tangents, sideways (n, m): rows that give gaps and places along the
    ground and across the way, zeros where a foot knows none;
    loads (n, nd); up, ahead (n,): unit translations off the ground and along it; directions (n, m) of impacts, None for
    impulses at the foot;
    points (k, n): rows of independent points; own_point: which of them each foot is, and its normal."""

    mass: Array
    damping: Array
    stiffness: Array
    normals: Array
    tangents: Array
    sideways: Array
    loads: Array
    up: Array
    ahead: Array
    directions: Array | None
    points: Array
    own_point: list[tuple[int, int]]


def robot_of(scene: Any) -> Robot:
    structure = scene.robot.structure
    made = {"lumped": lumped, "modal": modal, "walker": walker}[structure.kind](structure)
    mass, damping, stiffness, rows, up = made
    ahead = np.zeros(len(mass))
    if structure.kind == "walker":  # as every foot and the body go
        ahead[0] = 1.0
        ankles = [f"{leg}_ankle" for leg, one in structure.legs.items() if one.tip is not None]
        for moving in (*structure.legs, *structure.payloads, *ankles):
            ahead += rows[f"{moving}_x"]
    elif getattr(structure, "forward", None) is not None:
        ahead = np.array(structure.forward)
    feet = list(scene.robot.feet.items())
    normals = np.stack([foot.normal * rows[foot.point] for _, foot in feet], axis=1)
    ways = [f"{foot.point}_x" if structure.kind == "walker" else foot.along for _, foot in feet]
    tangents = np.stack([rows[way] if way else np.zeros(len(mass)) for way in ways], axis=1)
    sideways = np.stack([rows.get(f"{foot.point}_y", np.zeros(len(mass))) for _, foot in feet], axis=1)
    loads = []
    for drive in scene.robot.drives.values():
        if drive.load.kind == "modal":
            loads.append(np.array(drive.load.participation))
        else:
            loads.append(sum(weight * rows[point] for point, weight in drive.load.weights.items()))
    found = None
    impact = scene.ground.impact
    if impact is not None and impact.kind != "mass_weighted":
        found = np.stack(
            [direction(impact, name, normals[:, i], mass, stiffness, rows) for i, (name, _) in enumerate(feet)], axis=1
        )
    # displacements that (2.13) goes by: coordinates, of which a foot is one, or those of as many points as modes
    points = np.array(list(rows.values())) if structure.kind == "modal" else np.eye(len(mass))
    own = [int(np.argmin(np.abs(points - rows[foot.point]).sum(axis=1))) for _, foot in feet]
    return Robot(
        mass,
        damping,
        stiffness,
        normals,
        tangents,
        sideways,
        np.array(loads).reshape(len(loads), len(mass)).T,
        up,
        ahead,
        found,
        points,
        [(place, foot.normal) for place, (_, foot) in zip(own, feet, strict=True)],
    )


def lumped(s: Any) -> tuple[Array, Array, Array, dict[str, Array], Array]:
    n = len(s.coordinates)
    mass, stiffness = np.array(s.mass), np.array(s.stiffness)
    if s.damping is not None:
        damping = np.array(s.damping)
    elif s.damping_ratios is not None:  # by the undamped modes: phi' M phi = 1, phi' C phi = 2 zeta omega
        squares, shapes = eigh(stiffness, mass)
        onto = shapes.T @ mass
        damping = onto.T @ np.diag(2.0 * np.array(s.damping_ratios) * np.sqrt(np.maximum(squares, 0.0))) @ onto
    else:
        damping = np.zeros((n, n))
    rows = dict(zip(s.coordinates, np.eye(n), strict=True)) | {p: np.array(w) for p, w in s.weights.items()}
    return mass, damping, stiffness, rows, np.ones(n) if s.upward is None else np.array(s.upward)


def modal(s: Any) -> tuple[Array, Array, Array, dict[str, Array], Array]:
    w, mass = 2.0 * np.pi * np.array(s.frequencies), np.array(s.modal_masses)
    damping = 2.0 * np.array(s.damping_ratios) * w * mass
    rows = {point: np.array(shape) for point, shape in s.shapes.items()}
    up = np.zeros(len(w)) if s.upward is None else np.array(s.upward)
    return np.diag(mass), np.diag(damping), np.diag(mass * w * w), rows, up


def walker(s: Any) -> tuple[Array, Array, Array, dict[str, Array], Array]:
    """Coordinates: surge, heave, roll and pitch where the body turns; sway and yaw where it does so; its modes; x and z
    of payloads, of feet above compliant tips, and of every foot; y of every foot that moves across the way."""
    turns = [one for one in ("roll", "pitch") if getattr(s.body, f"{one}_inertia") is not None]
    sways = all(leg.stiffness_t is not None for leg in s.legs.values())
    beside = ["sway"] * sways + ["yaw"] * (s.body.yaw_inertia is not None)
    ankles = [f"{leg}_ankle" for leg, one in s.legs.items() if one.tip is not None]
    carried = [f"{one}{way}" for one in (*s.payloads, *ankles) for way in ("_x", "")]
    names = ["surge", "heave", *turns, *beside, *s.body.modes, *carried]
    n = len(names) + (3 if sways else 2) * len(s.legs)
    basis = np.eye(n)
    body = dict(zip(names, basis, strict=False))
    nothing = np.zeros(n)
    roll, pitch, yaw = (body.get(turn, nothing) for turn in ("roll", "pitch", "yaw"))
    masses = [s.body.mass, s.body.mass, *(getattr(s.body, f"{one}_inertia") for one in turns)]
    masses += [s.body.mass if one == "sway" else s.body.yaw_inertia for one in beside]
    rows = {"body": body["heave"], "body_x": body["surge"]}
    up = body["heave"].copy()
    damping, stiffness = np.zeros((n, n)), np.zeros((n, n))

    def spring(upper: tuple[Array, Array], lower: tuple[Array, Array], by: Any, tilt: float = 0.0) -> None:
        x, z = (a - b for a, b in zip(upper, lower, strict=True))
        turned = np.exp(1j * tilt) * (x + 1j * z)  # along the leg is upward once it is turned upright
        for row, k, c in ((turned.real, by.stiffness_l, by.damping_l), (turned.imag, by.stiffness_v, by.damping_v)):
            stiffness[:] += k * np.outer(row, row)
            damping[:] += c * np.outer(row, row)

    def on_body(name: str, at: Any) -> tuple[Array, Array]:
        along, upward = body["surge"] + at.z * pitch - at.y * yaw, body["heave"] + at.y * roll - at.x * pitch
        for mode, one in s.body.modes.items():
            along = along + one.along.get(name, 0.0) * body[mode]
            upward = upward + one.upward.get(name, 0.0) * body[mode]
        return along, upward

    for name, mode in s.body.modes.items():
        rate = 2.0 * np.pi * mode.frequency
        masses.append(mode.mass)
        stiffness += mode.mass * rate**2 * np.outer(body[name], body[name])
        damping += 2.0 * mode.damping_ratio * mode.mass * rate * np.outer(body[name], body[name])
    for name, one in s.payloads.items():
        rows |= {name: body[name], f"{name}_x": body[f"{name}_x"]}
        spring(on_body(name, one), (body[f"{name}_x"], body[name]), one)
        masses += [one.mass, one.mass]
        up += body[name]
    for name in ankles:
        rows |= {name: body[name], f"{name}_x": body[f"{name}_x"]}
        masses += [s.legs[name.removesuffix("_ankle")].mass] * 2
        up += body[name]
    for i, (name, leg) in enumerate(s.legs.items()):
        x, z = basis[len(names) + 2 * i], basis[len(names) + 2 * i + 1]
        hip = on_body(name, leg)
        rows |= {name: z, f"{name}_x": x, f"{name}_hip": hip[1], f"{name}_hip_x": hip[0]}
        last = leg
        if leg.tip is not None:
            ankle = (body[f"{name}_ankle_x"], body[f"{name}_ankle"])
            spring(hip, ankle, leg, leg.tilt or 0.0)
            hip, last = ankle, leg.tip
        spring(hip, (x, z), last)
        masses += [last.mass, last.mass]
        up += z
    for i, (name, leg) in enumerate(s.legs.items()):
        if not sways:
            break
        y = basis[len(names) + 2 * len(s.legs) + i]
        hip = body["sway"] + leg.x * yaw - leg.z * roll
        rows |= {f"{name}_y": y, f"{name}_hip_y": hip, "body_y": body["sway"]}
        stiffness += leg.stiffness_t * np.outer(hip - y, hip - y)
        damping += leg.damping_t * np.outer(hip - y, hip - y)
        masses.append(leg.mass)
    return np.diag(masses), damping, stiffness, rows, up


def direction(impact: Any, foot: str, normal: Array, mass: Array, stiffness: Array, rows: dict[str, Array]) -> Array:
    """Change of the velocities per unit change of the foot's rate."""
    if impact.kind == "dominant_mode":
        _, shapes = eigh(stiffness, mass)
        shares = (normal @ shapes) ** 2
        shape = shapes[:, np.argmax(shares) if impact.mode is None else impact.mode - 1]
    else:
        column = impact.columns[foot]
        shape = np.linalg.lstsq(np.array([rows[p] for p in column]), np.array(list(column.values())), rcond=None)[0]
    return shape / (normal @ shape)
