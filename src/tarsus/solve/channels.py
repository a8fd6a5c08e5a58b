"""All that a run gives, in one table: each by its name, unit, symbol and words, and how it is read from the run.

Series, datasets and their files, what instruments see, states of robots that are stepped, and columns and labels of a
page follow from it, so that another one costs a row.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from tarsus.base.quantities import Quantity

if TYPE_CHECKING:
    from tarsus.solve.outputs import Readings, Weights
    from tarsus.solve.series import Series

TIME, DRIVE, FOOT, POINT, BODY = "time", "drive", "foot", "point", "coordinate"
"""Dimensions of a dataset."""


class RunChannel(NamedTuple):
    """One thing that a run gives.

    name: in a dataset; unit: SI; symbol; over: what it has rows of (nothing: one row of times); words: what it is; of:
    what it is of a `Series`, None for robots without it, by law where name and words have a place for the law's;
    quantity and linear: of what an instrument sees what that measures, and the weights with which it is read from a
    state, by the name of a point or drive; motional: of charges and currents the part by motion alone; kept: whether
    series hold it.
    """

    name: str
    unit: str
    symbol: str
    over: str
    words: str
    of: Callable[[Series], Any] | None = None
    quantity: Quantity | None = None
    linear: Callable[[Readings, str], Weights] | None = None
    motional: bool = False
    kept: bool = True


Q = Quantity
CHANNELS = (
    RunChannel("volts", "V", "V", DRIVE, "drive voltage", None, Q.VOLTAGE, lambda r, at: r.volts(at)),
    RunChannel("command", "V", "V_c", DRIVE, "voltage that the amplifier is commanded to give", lambda s: s.command),
    RunChannel("drive_force", "N", "F", DRIVE, "drive force", lambda s: s.force, Q.FORCE, lambda r, at: r.force(at)),
    RunChannel(
        "charge", "C", "q", DRIVE, "electric charge on a drive's actuator", None, Q.CHARGE, lambda r, at: r.charge(at)
    ),
    RunChannel(
        "current", "A", "i", DRIVE, "current into a drive's actuator", None, Q.CURRENT, lambda r, at: r.current(at)
    ),
    RunChannel(
        "displacement",
        "m",
        "x",
        POINT,
        "displacement of a point along +z",
        None,
        Q.DISPLACEMENT,
        lambda r, at: r.place(at),
    ),
    RunChannel(
        "velocity", "m/s", "v", POINT, "velocity of a point along +z", None, Q.VELOCITY, lambda r, at: r.speed(at)
    ),
    RunChannel("gap", "m", "g", FOOT, "clearance of a foot", lambda s: s.state.gap),
    RunChannel(
        "gap_rate", "m/s", "g'", FOOT, "rate of the clearance, negative when approaching", lambda s: s.state.rate
    ),
    RunChannel("contact", "1", "", FOOT, "foot held on the ground", lambda s: s.state.held),
    RunChannel("pull", "N", "P", FOOT, "structure's pull on a held foot, away from the ground", lambda s: s.state.pull),
    RunChannel("adhesion_strength", "N", "f_a", FOOT, "pull that the contact would hold", lambda s: s.strength),
    RunChannel("{}_force", "N", "", FOOT, "force of the {} on the foot along the normal", lambda s: s.laws),
    RunChannel(
        "contact_force",
        "N",
        "N",
        FOOT,
        "reaction of the ground on a held foot, below 0 when it holds back",
        lambda s: s.contact,
    ),
    RunChannel("kinetic_energy", "J", "T", "", "kinetic energy", lambda s: s.kinetic),
    RunChannel("elastic_energy", "J", "U", "", "elastic energy", lambda s: s.elastic),
    RunChannel("work_in", "J", "W", "", "work of drives and weight, from the start", lambda s: s.cumulative["work_in"]),
    RunChannel(
        "ground_work",
        "J",
        "W_s",
        "",
        "work of moving ground, in its own frame, from the start",
        lambda s: s.cumulative["ground"] if s.ground else None,
    ),
    RunChannel(
        "ground_normal", "m", "s_n", "", "displacement of the ground along its normal", lambda s: s.ground.get("normal")
    ),
    RunChannel(
        "ground_along", "m", "s_x", "", "displacement of the ground along the way", lambda s: s.ground.get("along")
    ),
    RunChannel(
        "damping_loss",
        "J",
        "",
        "",
        "energy lost to structural damping, from the start",
        lambda s: s.cumulative["damping"],
    ),
    RunChannel("impact_loss", "J", "", "", "energy lost in impacts, from the start", lambda s: s.cumulative["impacts"]),
    RunChannel(
        "adhesion_loss",
        "J",
        "",
        "",
        "kinetic energy taken by adhesive capture, from the start",
        lambda s: s.cumulative["adhesion"],
    ),
    RunChannel("{}_work", "J", "", "", "work of the {} on the structure, from the start", lambda s: s.works),
    RunChannel("body", "m, rad", "", BODY, "coordinates of the body", lambda s: s.body),
    RunChannel(
        "path_x",
        "m",
        "",
        "",
        "place of the body in the world, forward of its start",
        lambda s: None if s.path is None else s.path[0],
    ),
    RunChannel(
        "path_y",
        "m",
        "",
        "",
        "place of the body in the world, to the left of its start",
        lambda s: None if s.path is None else s.path[1],
    ),
    RunChannel("foot_x", "m", "", FOOT, "displacement of a foot along the way", lambda s: s.foot_x),
    RunChannel("slipping", "1", "", FOOT, "foot in contact that slides", lambda s: s.slipping),
    RunChannel("friction_force", "N", "F_t", FOOT, "friction on a foot, positive forward", lambda s: s.friction),
    RunChannel(
        "friction_loss",
        "J",
        "",
        "",
        "energy lost to friction along the ground, from the start",
        lambda s: None if s.foot_x is None else s.cumulative["friction"],
    ),
    RunChannel("foot_y", "m", "", FOOT, "displacement of a foot across the way, to the left", lambda s: s.foot_y),
    RunChannel(
        "friction_across",
        "N",
        "",
        FOOT,
        "friction on a foot across the way, positive to the left",
        lambda s: s.friction_across,
    ),
    RunChannel(TIME, "s", "t", "", "time", lambda s: s.time),
    # what instruments measure besides: no series hold it
    RunChannel(
        "acceleration",
        "m/s^2",
        "a",
        POINT,
        "acceleration of a point along +z",
        None,
        Q.ACCELERATION,
        lambda r, at: r.acceleration(at),
        kept=False,
    ),
    RunChannel("angle", "rad", "", BODY, "angle of the body", None, Q.ANGLE, lambda r, at: r.place(at), kept=False),
    RunChannel(
        "angular_velocity",
        "rad/s",
        "",
        BODY,
        "rate of an angle of the body",
        None,
        Q.ANGULAR_VELOCITY,
        lambda r, at: r.speed(at),
        kept=False,
    ),
    RunChannel(
        "motional_charge",
        "C",
        "q_m",
        DRIVE,
        "charge of an actuator by motion alone, behind a bridge",
        None,
        Q.CHARGE,
        lambda r, at: r.charge(at, motional=True),
        motional=True,
        kept=False,
    ),
    RunChannel(
        "motional_current",
        "A",
        "i_m",
        DRIVE,
        "current of an actuator by motion alone, behind a bridge",
        None,
        Q.CURRENT,
        lambda r, at: r.current(at, motional=True),
        motional=True,
        kept=False,
    ),
)
"""All of them."""


ON_A_PAGE = (
    "time",
    "volts",
    "gap",
    "contact_force",
    "friction_force",
    "contact",
    "foot_x",
    "body",
    "kinetic_energy",
    "elastic_energy",
)
"""Those that the engine of a page gives, in the order of native/packet/page_samples.hpp: of ``contact`` what feet do
(`tarsus.base.events.FootState`)."""


def channel(name: str) -> RunChannel:
    """That of a name."""
    return next(one for one in CHANNELS if one.name == name)


def measured_by(quantity: Quantity, motional: bool = False) -> RunChannel:
    """What an instrument for a quantity sees."""
    return next(one for one in CHANNELS if (one.quantity, one.motional) == (quantity, motional))
