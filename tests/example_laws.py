"""A law of every kind with plausible numbers: the library's own, and a user's from a file."""

from __future__ import annotations

import tarsus as ts
from scene_files import SCENES
from tarsus.model.laws import Law
from tarsus.model.laws.ageing_adhesion import AgeingAdhesion
from tarsus.model.laws.power_restitution import PowerRestitution
from tarsus.model.laws.rarefied_film import RarefiedFilm
from tarsus.model.laws.rate_friction import RateWeakeningFriction, StribeckFriction
from tarsus.model.laws.static_friction import StaticKineticFriction

OWN = ts.load_laws(SCENES / "squeeze.py")
EXAMPLES: list[Law] = [
    ts.Film(coefficient=1.7e-21, thickness=5e-6),
    ts.Electrostatic(coefficient=2e-20, offset=1e-6),
    ts.laws.FringingField(coefficient=2e-20, offset=1e-6, height=4e-5),
    ts.laws.LegElectrostatic(coefficient=2e-20, offset=1e-6, rest=1e-5),
    ts.Adhesion(initial=1e-6, rate=1e-3),
    ts.Restitution(coefficient=0.378),
    ts.Friction(coefficient=0.35),
    ts.laws.AdhesiveFriction(coefficient=0.35),
    StribeckFriction(static=0.4, dynamic=0.2, speed=1e-3),
    RateWeakeningFriction(static=0.4, dynamic=0.2, speed=1e-3),
    StaticKineticFriction(static=0.4, kinetic=0.25),
    PowerRestitution(coefficient=0.7, speed=0.1),
    RarefiedFilm(coefficient=1.7e-21, thickness=5e-7, free_path=68e-9),
    OWN["own_film"](coefficient=1.7e-21, thickness=5e-6),
    OWN["own_electrostatic"](coefficient=2e-20, offset=1e-6),
    OWN["own_rebound"](coefficient=0.5),
    OWN["own_latch"](initial=1e-6, rate=1e-3),
    OWN["drag"](coefficient=1e-4, height=1e-6),
    OWN["magnet"](strength=1e-26, depth=1e-6),
    AgeingAdhesion(initial=1e-6, gain=4e-6, ageing=5e-3, fading=1e-3),
]
