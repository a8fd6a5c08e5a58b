"""A walker's start in static equilibrium, written into its scene."""

from __future__ import annotations

from tarsus.base.errors import InputError
from tarsus.base.spec import described, with_values
from tarsus.model.scene import Initial, Provenance, Scene, Source, Standing
from tarsus.model.structure import Walker
from tarsus.plan.lowering import lower_scene


def standing(scene: Scene, *, driven: bool = False) -> Scene:
    """The scene starting in static equilibrium: all feet on the ground, the body on its springs, everything at rest.

    Feet are held at gap 0 under gravity and the drives' forces.  Along the way they stand where no force is left on
    them, so that friction has nothing to hold; the body stays where it is.

    Parameters
    ----------
    scene
        Of a walker.
    driven
        With the drives' volts at t = 0; otherwise at 0 V, after their history.

    Returns
    -------
    Scene
        A changed copy, with `initial.displacement` [m] and [rad].

    Raises
    ------
    InputError
        For a structure that is no walker, a body that its feet do not hold up, a foot that pulls harder than
        adhesion holds at first, and forces along the way that do not balance.
    """
    described(scene)
    structure = scene.robot.structure
    if not isinstance(structure, Walker):
        raise InputError(f"only a walker stands on its feet; this structure is of kind '{structure.kind}'")
    start = lower_scene(with_values(scene, {"initial": Initial(standing=Standing(driven=driven))})).initial
    at = "the drives' first volts" if driven else "0 V"
    origin = Provenance(source=Source.DERIVED, note=f"Static equilibrium on all feet at {at}.")
    return with_values(
        scene,
        {
            "initial": Initial(displacement=tuple(start[: structure.size].tolist())),
            "provenance": {**scene.provenance, "initial.displacement": origin},
        },
    )
