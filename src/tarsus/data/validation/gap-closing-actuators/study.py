"""Gap-closing actuators: a layout as it is drawn, the mass, spring, dashpot and laws that it makes; steps, ramps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from tarsus import InputError
from tarsus.files.rows import parse_rows
from tarsus.measure import departure, flight, touchdown, volts_at
from tarsus.validation import RowCase, named

HEIGHT, OXIDE = 40e-6, 2e-6  # device layer, and the gap below it [m]: process file
MODULUS, POISSON, DENSITY = 169e9, 0.069, 2300.0  # silicon: process file
PERMITTIVITY = 8.85e-12  # F/m


@dataclass(frozen=True)
class Medium:
    """What is between the fingers: viscosity [Pa s], density [kg/m^3], relative permittivity, mean free path [m], and
    how far etching moved every drawn edge on the chips that were measured in it [m]."""

    viscosity: float
    density: float
    permittivity: float
    path: float
    undercut: float


MEDIA = {
    "air": Medium(1.85e-5, 1.1839, 1.0, 68e-9, 0.4e-6),
    "water": Medium(8.88e-4, 997.0, 80.0, 0.0, 0.5e-6),
}  # process file; the path is that of air at 1 atm
CHIP = "fawn"  # of rows that name no layout
EVENTS = {one: one for one in ("static", "pull_in", "release", "rear_bounce", "closing_bounce")}


@cache
def drawn() -> dict[str, dict[str, float]]:
    """Drawn dimensions [m] of every chip."""
    table = parse_rows((Path(__file__).parent / "layouts.csv").read_text(encoding="utf-8"), "layouts.csv")
    return {chip: {row["name"]: float(row[chip]) for row in table.rows if row[chip]} for chip in table.columns[1:]}


@dataclass(frozen=True)
class Actuator:
    """Numbers of an actuator as it was made, in SI units: gaps in front of a finger and behind it, travel to the stop,
    moving mass, stiffness, dashpot, and coefficients of attraction and film."""

    front: float
    behind: float
    travel: float
    mass: float
    stiffness: float
    damping: float
    attraction: float
    film: float
    path: float

    @classmethod
    def of(cls, at: dict[str, float], medium: Medium, overlap: float | None, support: float | None) -> Actuator:
        """From the layout; overlap of the fingers and drawn width of the supports [m] of the row's device."""
        edge = 2.0 * medium.undercut
        count, overlap = at["Nfing"], at["fingerL"] if overlap is None else overlap
        front, behind = at["gf"] + edge, at["gb"] + edge
        length = overlap + at["fingerL_buffer"]
        width = (at["supportW"] if support is None else support) - edge
        if not min(width, overlap) > 0.0:
            raise InputError(f"etching takes {1e6 * edge:g} um: no support, or no overlap of fingers, is left")
        spine = (at["spineW"] - edge) * (at["spineL"] - edge) - holes(at, edge)
        stops = 2.0 * (at["gapstopW"] - edge) * at["gapstopL_half"]
        shuttle = spine + count * (at["fingerW"] - edge) * length + stops
        supports = 2.0 * width * at["supportL"]
        between = count * length * (front + behind)
        short, long = min(overlap, HEIGHT), max(overlap, HEIGHT)
        return cls(
            front,
            behind,
            at["x_GCA"] + edge,
            HEIGHT * (DENSITY * (shuttle + supports / 3.0) + medium.density * between),
            2.0 * MODULUS / (1.0 - POISSON**2) * width**3 * HEIGHT / at["supportL"] ** 3,
            medium.viscosity * shuttle / OXIDE,
            0.5 * count * PERMITTIVITY * medium.permittivity * HEIGHT * overlap,
            medium.viscosity * count * long * short**3 * (1.0 - 0.58 * short / long),
            medium.path,
        )

    def changes(self) -> dict[str, object]:
        """What the device has of it. Both electrodes have one distance at contact, so that the back one, which is never
        met, begins as much farther away as it is behind the fingers."""
        near = self.front - self.travel
        return {
            "robot.structure.mass.0.0": self.mass,
            "robot.structure.stiffness.0.0": self.stiffness,
            "robot.structure.damping.0.0": self.damping,
            "robot.feet.stop.gap": self.travel,
            "robot.feet.back.gap": self.behind - near,
            "ground.electrostatic.coefficient": self.attraction,
            "ground.electrostatic.offset": near,
            "ground.laws.fringes.coefficient": self.attraction,
            "ground.laws.fringes.offset": near,
            "ground.laws.film.coefficient": self.film,
            "ground.laws.film.free_path": self.path,
            "ground.laws.film.thickness": near,
        }

    def opening(self) -> dict[str, object]:
        """From the front stop back to the rear one, at 0 V."""
        return {**self.closing(0.0), "initial.displacement": (-self.travel,)}

    def closing(self, volts: float) -> dict[str, object]:
        """A step to some volts [V]."""
        return {**self.changes(), "signals.gate.start": volts, "signals.gate.stop": volts}

    def pull_in_volts(self) -> float:
        """Static pull-in of two figures without fringe and back electrode [V]: a scale for ramps."""
        return math.sqrt(8.0 * self.stiffness * self.front**3 / (27.0 * 2.0 * self.attraction))


def holes(at: dict[str, float], edge: float) -> float:
    """Area of the etch holes along the spine [m^2]."""
    long = at.get("etch_hole_height", at.get("etch_hole_size", 0.0))
    wide = at.get("etch_hole_width", at.get("etch_hole_size", 0.0))
    return math.floor(at["spineL"] / (long + at["etch_hole_spacing"])) * (long + edge) * (wide + edge)


def case(row, device):
    """Steps of volts for times; a slow ramp up for the pull-in voltage, and one down for the pull-out voltage."""
    medium, layout = named(row, "medium", MEDIA, "air"), named(row, "layout", drawn(), CHIP)
    sizes = [1e-6 * row[name] if name in row else None for name in ("overlap_um", "support_width_drawn_um")]
    one = Actuator.of(layout, medium, *sizes)
    event = named(row, "event", EVENTS)
    if event == "static":
        return static(one)
    if event == "pull_in":
        load = {"robot.drives.load.law.offset": 1e-6 * row.get("load_uN", 0.0)}
        return RowCase({**one.closing(row["volts"]), **load}, lambda run: {"time_us": touchdown(run, "stop")})
    if event == "release":
        return RowCase(one.opening(), lambda run: {"time_us": touchdown(run, "rear")})
    number = int(row["number"])
    if event == "rear_bounce":
        return RowCase(one.opening(), lambda run: {"flight_us": flight(run, "rear", number)})
    lossless = {"ground.restitution.coefficient": 1.0}  # for the longest flights that there can be
    changes = {**one.closing(row["volts"]), **lossless}
    return RowCase(changes, lambda run: {"flight_us": flight(run, "stop", number)})


def static(one: Actuator) -> RowCase:
    """Ramps so slow that the shuttle follows its equilibrium: up in 0.5 s, some thousand cycles of the shuttle."""
    top = 1.3 * one.pull_in_volts()
    up = {
        **one.changes(),
        "duration": 0.5,
        "signals.gate.start": 0.0,
        "signals.gate.stop": top,
        "signals.gate.duration": 0.5,
    }
    down = {
        **one.changes(),
        "duration": 5e-3,
        "signals.gate.start": top,
        "signals.gate.stop": 0.0,
        "signals.gate.duration": 5e-3,
        "initial.displacement": (-one.travel,),
    }
    return RowCase(
        [up, down],
        lambda rising, falling: {
            "pull_in_V": volts_at(rising, "gate", touchdown(rising, "stop")),
            "release_V": volts_at(falling, "gate", departure(falling, "stop")),
        },
    )
