"""Walkers whose bodies have modes, payloads and legs with compliant tips."""

from __future__ import annotations

from typing import Any

import tarsus as ts
from tarsus.model.scene import Scene
from tarsus.model.structure import Payload, Walker, WalkerMode, WalkerTip

LEGS = ("leg0", "leg1", "leg2")
MODE = WalkerMode(
    frequency=900.0,
    damping_ratio=0.02,
    mass=5e-8,
    upward={"leg0": 1.0, "leg1": -0.6, "leg2": 0.4},
    along={"leg1": 0.3, "bag": 0.2},
)
BAG = Payload(x=2e-4, y=-1e-4, z=3e-4, mass=2e-7, stiffness_v=0.8, damping_v=2e-5, stiffness_l=1.1, damping_l=1e-5)
TIP = WalkerTip(mass=4e-10, stiffness_v=30.0, damping_v=3e-6, stiffness_l=20.0, damping_l=3e-6)


def with_body(scene: Scene, modes: Any = (), payloads: Any = (), tips: tuple[str, ...] = ()) -> Scene:
    """The scene with more in its walker's body; drives of a leg with a tip act on the foot above it."""
    walker = scene.robot.structure
    assert isinstance(walker, Walker)
    legs = {name: one.model_copy(update={"tip": TIP}) if name in tips else one for name, one in walker.legs.items()}
    structure = Walker(body=walker.body.model_copy(update={"modes": dict(modes)}), legs=legs, payloads=dict(payloads))
    above = {f"{leg}{way}": f"{leg}_ankle{way}" for leg in tips for way in ("", "_x")}
    drives = dict(scene.robot.drives)
    for name, drive in drives.items():
        weights = {above.get(point, point): w for point, w in drive.load.weights.items()}
        drives[name] = drive.model_copy(update={"load": ts.PointLoad(weights=weights)})
    return ts.with_values(scene, {"robot.structure": structure, "robot.drives": drives})


BODIES: dict[str, dict[str, Any]] = {
    "mode": {"modes": {"bends": MODE.model_copy(update={"along": {"leg1": 0.3}})}},
    "payload": {"payloads": {"bag": BAG}},
    "tips": {"tips": LEGS},
    "all": {"modes": {"bends": MODE}, "payloads": {"bag": BAG}, "tips": ("leg1",)},
}
