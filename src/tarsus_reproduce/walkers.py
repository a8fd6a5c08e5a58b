"""The millipede's leg, two rows of which make a robot of as many legs as one likes.

The packaged millipedes are files (`tarsus_reproduce/devices`), each number with its provenance. Only what an argument
decides is computed here: the number of legs, and the scatter of their stiffness.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.design.runs import without_legs
from tarsus.files.toml import parse_scene
from tarsus.model.drive.gait import Alternating, AnyGait, Tripod
from tarsus.model.robot import Robot
from tarsus.model.scene import Provenance, Scene, Source
from tarsus_reproduce.packaged import data_text

PITCH, WIDTH = 10e-3 / 15, 2e-3
"""Assumed: way from leg to leg along a side, so that 15 pairs make a body of 10 mm, and width of the body [m]."""

LEGS = 30
"""Legs of the prototype (section 4.1)."""


def many_legs(
    legs: int = LEGS,
    *,
    scatter: float = 0.0,
    dead: Sequence[str] = (),
    seed: int = 0,
    gait: AnyGait | None = None,
    name: str | None = None,
) -> Scene:
    """The whole millipede: legs ``L1, R1, L2 ...`` from the front in two rows under a slab that also rolls and pitches.

    Parameters
    ----------
    legs
        Even number of legs.
    scatter
        Spread of the legs' stiffness: standard deviation of its logarithm, upward and along the way apart.
    dead
        Legs without a drive, by name; they stand, and keep their place in the gait.
    seed
        Of the scattered stiffness.
    gait
        Pattern; alternating when absent.
    name
        Of the scene.

    Raises
    ------
    InputError
        For a number of legs that is not even and positive, unknown dead legs and a negative spread.
    """
    problems = []
    if legs < 2 or legs % 2:
        problems.append(f"legs: expected an even number of legs, 2 or more, got {legs}")
    if not scatter >= 0.0:
        problems.append(f"scatter: expected a spread of 0 or more, got {scatter:g}")
    if problems:
        raise InputError(problems)
    pair = _pair()
    pattern = gait or pair.gait
    assert pattern is not None
    provenance = _provenance(pair, legs // 2, scatter, seed)
    if pattern.kind == "free":
        provenance["gait.phases"] = Provenance(source=Source.ASSUMED, note="Chosen with the gait.")
    scene = Scene(
        name=name or f"millipede-{legs}",
        robot=_robot(pair, legs // 2, scatter, seed),
        ground=pair.ground,
        gait=pattern,
        initial=pair.initial,
        duration=pair.duration,
        provenance=provenance,
        citations=pair.citations,
    )
    return without_legs(scene, dead)


def hexapod_walker() -> Scene:
    """Six legs of the millipede under a slab that also rolls and pitches, walking in tripods."""
    own = _pair().gait
    assert isinstance(own, Alternating)
    return many_legs(6, gait=Tripod(frequency=own.frequency, high=own.high), name="hexapod-walker")


@lru_cache
def _pair() -> Scene:
    """Two legs and their share of the body, with the provenance of every number."""
    return parse_scene(data_text("millipede_pair.toml"))


def _robot(pair: Scene, pairs: int, scatter: float, seed: int) -> Robot:
    """The first leg of the pair, with its drive and foot, at every hip from the front, the left one of a pair first."""
    one = pair.robot.model_dump()
    body, leg = one["structure"]["body"], one["structure"]["legs"]["L1"]
    drive, foot = one["drives"]["L1"], one["feet"]["L1"]
    ahead = [(0.5 * (pairs - 1) - number) * PITCH for number in range(pairs)]
    sides = (("L", 0.5 * WIDTH), ("R", -0.5 * WIDTH))
    hips = {f"{side}{number + 1}": (x, y) for number, x in enumerate(ahead) for side, y in sides}
    factors = np.random.default_rng(seed).lognormal(0.0, scatter, (len(hips), 2)).tolist()
    mass, length = pairs * body["mass"], pairs * PITCH
    turning = {"roll_inertia": mass * WIDTH**2 / 12.0, "pitch_inertia": mass * length**2 / 12.0}
    legs, drives, feet = {}, {}, {}
    for (name, (x, y)), (upward, along) in zip(hips.items(), factors, strict=True):
        stiffness = {"stiffness_v": leg["stiffness_v"] * upward, "stiffness_l": leg["stiffness_l"] * along}
        legs[name] = _tidy({**leg, **stiffness, "x": x, "y": y})
        weights = {point.replace("L1", name): w for point, w in drive["load"]["weights"].items()}
        load, law = {**drive["load"], "weights": _tidy(weights)}, _tidy(drive["law"])
        drives[name] = {**_tidy(drive), "load": load, "law": law}
        feet[name] = {**foot, "point": name, "electrode": name}
    slab = _tidy({**body, "mass": mass, "length": length, **turning})
    return Robot.model_validate(
        {"structure": {"kind": "walker", "body": slab, "legs": legs}, "drives": drives, "feet": feet}
    )


def _tidy(values: dict[str, Any]) -> dict[str, Any]:
    """Numbers to six digits, so that a file reads well; no parameter is known better."""
    return {name: float(f"{one:.6g}") if isinstance(one, float) else one for name, one in values.items()}


def _provenance(pair: Scene, pairs: int, scatter: float, seed: int) -> dict[str, Provenance]:
    origins = dict(pair.provenance)
    share = origins["robot.structure.body.mass"]
    if pairs > 1:
        bounds = tuple((pairs * low, pairs * high) for low, high in share.interval or ())
        note = f"{pairs} times the share of two legs. {share.note}"
        origins["robot.structure.body.mass"] = share.model_copy(update={"note": note, "interval": bounds})
    if scatter > 0.0:
        spread = f"Scattered at random (lognormal, seed {seed}) by {scatter * 100:g} %"
        for name in ("stiffness_v", "stiffness_l"):
            path = f"robot.structure.legs.*.{name}"
            nominal = getattr(pair.robot.structure.legs["L1"], name)  # pyright: ignore[reportAttributeAccessIssue]
            note = f"{spread} about {nominal:.4g} N/m. {origins[path].note}"
            origins[path] = Provenance(source=Source.ASSUMED, note=note)
    return origins
