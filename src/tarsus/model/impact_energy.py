"""Energy that one impact at a foot can create or take: a scene's impact law as it is."""

from __future__ import annotations

from tarsus.model.laws.impact_map import Body, Directed, ImpactMap
from tarsus.model.scene import Scene

ROUNDING = 1e-9
"""A gain above 1 by no more than this creates no energy."""


def directed(scene: Scene, chosen: ImpactMap, name: str | None = None) -> Directed:
    """A map at a foot of a scene, the first unless named, with the scene's restitution (0 without one)."""
    structure = scene.robot.structure
    matrices = structure.matrices()
    name = name if name is not None else next(iter(scene.robot.feet))
    foot = scene.robot.feet[name]
    normal = foot.normal * structure.row(foot.point)
    direction = chosen.direction(name, normal, Body(matrices.mass, matrices.stiffness, structure.row))
    law = scene.ground.restitution
    return Directed(matrices.mass, normal, direction, law.coefficient if law is not None else 0.0)


def creation_warning(scene: Scene) -> str | None:
    """A sentence when the scene's impact law acts as it is and one impact at some foot can create energy; else None."""
    impact = scene.ground.impact
    if impact is None or impact.passive or not scene.robot.feet:
        return None
    gain = max(directed(scene, impact, name).gain() for name in scene.robot.feet)
    if gain <= 1.0 + ROUNDING:
        return None
    return (
        f"This impact law can create energy: the {impact.title} law acts as it is (ground.impact.passive = false), and "
        f"one impact can multiply the kinetic energy by up to {gain:.3g}."
    )
