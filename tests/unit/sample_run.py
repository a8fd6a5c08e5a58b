"""A run to test the store and the report with, made without the engine.

One spring-mass foot under a periodic drive, stepped finely in plain Python: impacts with restitution,
adhesion that grows with time, film. It has the attributes of a `Run`, and numbers of the size that a
micro-cantilever gives.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
import xarray

from tarsus.files.series import Variables, variables_of
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.waveforms import Square
from tarsus.model.laws import Adhesion, Film, Restitution
from tarsus.model.scene import Drive, Foot, Ground, PointLoad, Provenance, Robot, Scene, Source
from tarsus.model.structure.modal import Modal

EVENT = np.dtype(
    [("time", "f8"), ("foot", "i8"), ("kind", "i1")]
    + [(n, "f8") for n in ("speed_before", "speed_after", "pull", "strength", "energy", "apex", "apex_time")]
)


class Code(Enum):
    FINISHED = "The run reached its end."


@dataclass(frozen=True)
class Measure:
    value: float
    unit: str
    spread: float
    n: int
    definition: str
    per_foot: Mapping[str, float] = field(default_factory=dict)
    scope: str = "mean over feet"
    height: float | None = None
    dwell: float | None = None


@dataclass(frozen=True)
class Ledger:
    work_in: float
    kinetic: float
    elastic: float
    damping: float
    friction: float
    impacts: float
    adhesion: float
    laws: Mapping[str, float]
    residual: float
    closure: float


@dataclass(frozen=True)
class SampleRun:
    scene: Scene
    dataset: xarray.Dataset
    events: np.ndarray
    foot_names: tuple[str, ...]
    ledger: Ledger
    measures: Mapping[str, Measure]
    duration: float
    code: Code = Code.FINISHED
    ok: bool = True
    wall_s: float = 0.0123

    def variables(self) -> Variables:
        return variables_of(self.dataset)

    def to_dataset(self) -> xarray.Dataset:
        return self.dataset


def make_scene(feet: int = 1, hz: float = 50.0, name: str = "sample cantilever") -> Scene:
    """A scene with provenance, citations and markup characters in its texts."""
    points = {f"tip{i or ''}": (1.0, 1.0) for i in range(feet)} | {"center": (0.36, -0.2)}
    structure = Modal(
        frequencies=(623.0, 6424.0), damping_ratios=(0.02, 0.02), modal_masses=(4e-10, 1e-10), shapes=points
    )
    names = [f"foot-{i + 1}" if feet > 1 else "tip" for i in range(feet)]
    force = Drive(load=PointLoad(weights={"tip": 1.0}), law=LinearForce(gain=-0.075e-6, offset=-0.05e-6))
    return Scene(
        name=name,
        robot=Robot(
            structure=structure,
            drives={"pzt": force},
            feet={foot: Foot(point=f"tip{i or ''}", gap=70e-6) for i, foot in enumerate(names)},
        ),
        ground=Ground(
            restitution=Restitution(coefficient=0.51),
            film=Film(coefficient=1.747e-21, thickness=2e-6),
            adhesion=Adhesion(initial=0.274e-6, rate=1.7e-6),
        ),
        signals={"pzt": Square(amplitude=8.0, frequency=hz)},
        duration=0.1,
        provenance={
            "robot.structure.frequencies": Provenance(
                source=Source.PRINTED, note="section 2.2, <laser vibrometer> & network analyser"
            ),
            "ground.film": Provenance(source=Source.CALIBRATED, note="to Table A.1"),
        },
        citations=("J. Ryou, K. R. Oldham: contact dynamics of <micro> robots",),
    )


def make_run(
    *, feet: int = 1, hz: float = 50.0, duration: float = 0.1, adhesive: bool = True, step: float = 4e-6
) -> SampleRun:
    """Step the foot through `duration`; further feet are the same one, each a fifth of a period later."""
    parts = [_simulate(hz, duration, adhesive, step, delay=0.2 * i / hz) for i in range(feet)]
    scene = make_scene(feet, hz)
    names = tuple(scene.robot.feet)
    points = [*(f.point for f in scene.robot.feet.values()), "center"]
    time = parts[0]["time"]

    def per_foot(name: str) -> tuple[tuple[str, str], np.ndarray]:
        return ("foot", "time"), np.stack([p[name] for p in parts])

    def total(name: str) -> tuple[tuple[str], np.ndarray]:
        return ("time",), np.sum([p[name] for p in parts], axis=0)

    moved = [p["x"] for p in parts]
    speed = [p["v"] for p in parts]
    data: dict[str, Any] = {
        "volts": (("drive", "time"), parts[0]["volts"][None, :]),
        "drive_force": (("drive", "time"), parts[0]["drive"][None, :]),
        "displacement": (("point", "time"), np.stack([*moved, 0.36 * moved[0]])),
        "velocity": (("point", "time"), np.stack([*speed, 0.36 * speed[0]])),
    }
    foot_names = ("gap", "gap_rate", "contact", "pull", "adhesion_strength", "film_force", "contact_force")
    data |= {name: per_foot(name) for name in foot_names}
    energy_names = (
        "kinetic_energy",
        "elastic_energy",
        "work_in",
        "damping_loss",
        "film_work",
        "impact_loss",
        "adhesion_loss",
    )
    data |= {name: total(name) for name in energy_names}
    coords = {"time": time, "foot": list(names), "drive": ["pzt"], "point": points}
    dataset = xarray.Dataset(data, coords=coords)
    units = {
        "volts": "V",
        "contact": "1",
        "velocity": "m/s",
        "gap_rate": "m/s",
        "gap": "m",
        "displacement": "m",
        "time": "s",
    }
    for key in dataset.variables:
        name = str(key)
        if name in ("foot", "drive", "point"):
            continue
        last = name.rsplit("_", 1)[-1]
        dataset[key].attrs["units"] = units.get(
            name, "J" if last in ("energy", "in", "loss", "work") else "N"
        )
    rows = sorted((time, foot, *rest) for foot, p in enumerate(parts) for time, *rest in p["events"])
    events = np.array(rows, dtype=EVENT)
    end = {name: float(dataset[name].values[-1]) for name in energy_names}
    spent = end["damping_loss"] - end["film_work"] + end["impact_loss"] + end["adhesion_loss"]
    residual = end["work_in"] - end["kinetic_energy"] - end["elastic_energy"] - spent
    ledger = Ledger(
        work_in=end["work_in"],
        kinetic=end["kinetic_energy"],
        elastic=end["elastic_energy"],
        damping=end["damping_loss"],
        friction=0.0,
        impacts=end["impact_loss"],
        adhesion=end["adhesion_loss"],
        laws={"film": end["film_work"]},
        residual=residual,
        closure=abs(residual) / max(abs(end["work_in"]), 1e-30),
    )
    measures = {
        "bounces": Measure(
            2.0,
            "1",
            0.0,
            4,
            "flights per period whose apex clears 0.1 µm",
            dict.fromkeys(names, 2.0),
            height=1e-7,
            dwell=0.5e-3,
        ),
        "contact_duration": Measure(
            9.12e-3, "s", 4e-5, 4, "time per period with gap = 0", dict.fromkeys(names, 9.12e-3)
        ),
        "peak": Measure(
            264.1e-6,
            "m",
            2e-7,
            4,
            "contact level to highest point after break-off",
            dict.fromkeys(names, 264.1e-6),
        ),
        "impact_speed": Measure(
            math.nan, "m/s", math.nan, 0, "gap rate just before a rebound", dict.fromkeys(names, math.nan)
        ),
    }
    return SampleRun(scene, dataset, events, names, ledger, measures, duration)


def _simulate(hz: float, duration: float, adhesive: bool, step: float, delay: float) -> dict[str, Any]:
    omega, zeta, compliance, gap0, e, film, thickness = (
        2 * math.pi * 623.0,
        0.02,
        164.0,
        70e-6,
        0.51,
        1.747e-21,
        2e-6,
    )
    k = 1.0 / compliance
    m = k / omega**2
    c = 2 * zeta * omega * m
    count = round(duration / step)
    names = (
        "time", "volts", "drive", "x", "v", "gap", "gap_rate", "contact", "pull", "adhesion_strength",
        "film_force", "contact_force", "kinetic_energy", "elastic_energy", "work_in", "damping_loss",
        "film_work", "impact_loss", "adhesion_loss",
    )  # fmt: skip
    out = {name: np.zeros(count + 1) for name in names}
    x = v = work = damped = filmed = impact = stuck_loss = 0.0
    stuck, since, apex, apex_time = False, 0.0, 0.0, 0.0
    events: list[tuple[float, ...]] = []
    nan = math.nan
    for i in range(count + 1):
        t = i * step
        volts = 8.0 if ((t - delay) * hz) % 1.0 < 0.5 else -8.0
        drive = -0.075e-6 * volts - 0.05e-6
        gap = x + gap0
        free = drive - k * x
        strength = (0.274e-6 + 1.7e-6 * (t - since)) if adhesive else 0.0
        resistance = film / (max(gap, 0.0) + thickness) ** 3
        film_force = 0.0 if stuck else -resistance * v
        values = (
            t, volts, drive, x, v, gap, v, stuck, max(free, 0.0) if stuck else 0.0,
            strength if stuck else 0.0, film_force, -free if stuck else 0.0, 0.5 * m * v * v, 0.5 * k * x * x,
            work, damped, -filmed, impact, stuck_loss,
        )  # fmt: skip
        for name, value in zip(names, values, strict=True):
            out[name][i] = value
        if stuck:
            if free > strength:
                stuck = False
                events.append((t, 3, nan, 0.0, free, strength, 0.0, nan, nan))
                apex = 0.0
            continue
        v_new = (v + step * free / m) / (1.0 + step * (c + resistance) / m)
        dx = step * v_new
        work += drive * dx
        damped += c * v_new * dx
        filmed += resistance * v_new * dx
        x, v = x + dx, v_new
        if x + gap0 > apex:
            apex, apex_time = x + gap0, t
        if x <= -gap0 and v < 0.0:
            before, x = -v, -gap0
            lost = 0.5 * m * before**2
            if before < 0.02:
                stuck, since, v = True, t, 0.0
                impact += lost
                events.append(
                    (t, 2, before, 0.0, drive - k * x, 0.274e-6 if adhesive else 0.0, lost, apex, apex_time)
                )
            else:
                v = e * before
                impact += lost * (1 - e * e)
                events.append((t, 1, before, v, nan, nan, lost * (1 - e * e), apex, apex_time))
            apex = 0.0
    out["contact"] = out["contact"].astype(bool)
    return {**out, "events": events}
