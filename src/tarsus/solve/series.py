"""Series of a run: states, forces and energies at sample times, each with its name, unit and words."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import NDArray

from tarsus.base.events import CONTACT_BEGINS, EventKind
from tarsus.base.messages import Hinted
from tarsus.base.quantities import Quantity
from tarsus.files.ledger import Ledger
from tarsus.files.series import Variable
from tarsus.measure.path import path_of
from tarsus.model.laws.base import AdhesionLaw, Law
from tarsus.model.structure.walker import TURNS
from tarsus.solve.motion import contact_strength, law_value
from tarsus.solve.outputs import Output, output_rows

if TYPE_CHECKING:
    from tarsus.core.modes import LinearSystem
    from tarsus.core.states import SampledStates
    from tarsus.model.scene import Scene
    from tarsus.solve.motion import Account, Sliding, Way
    from tarsus.solve.run import Run

Floats = NDArray[np.float64]

NOTHING = 1e-20
"""Part of the plan's force times length below which energies are rounding, and an account of nothing else is closed:
motion of 1e-10 of the length, which is what a step may err by."""
RESOLVED = 1.5e-5
"""Way of a foot in a resistive law, as part of the plan's length, below which its account closes less exactly. Where a
foot lands the powers of time of its momentum P leave 3e-13 P of rounding (as measured), and a way x through a film as
thick as the length changes P by 2 x of itself: 1.5e-13 / x is 1e-8, what counts as closed, at 1.5e-5."""
LEAST = 1e-12
"""Way of a foot, as part of the plan's length, below which it is rounding."""
FEWEST, MOST, PER_PERIOD, PER_CYCLE = 2001, 20001, 400, 6
VALUES = 4_000_000
"""Numbers that the series of a run have together, about, where that leaves them enough samples."""


@dataclass(frozen=True)
class Series(Hinted):
    """A run at nt times [s]: state of the structure and, per foot, its forces [N].

    points (np, n): rows of the points' displacements; force, volts, charge, current, command (nd, nt): of the drives
    [N, V, C, A, V]; laws: force (m, nt) of every smooth law on the
    foot by name, positive along the normal; contact (m, nt): the ground's reaction on a held foot, positive pushing;
    strength (m, nt): f_a of a held foot.
    cumulative, works: energies of the ledger and works of the laws by name, from the start (nt,) [J].
    Of walkers also the body's coordinates (nb, nt) [m, rad]; where friction acts the feet's places along the way foot_x
    (m, nt) [m], where they slide (m, nt), and friction on them (m, nt) [N], positive forward; where feet move across it
    their places and friction across, positive to the left; path (2, nt) [m]: of a body that turns, in the world.
    """

    _guesses: ClassVar[Mapping[str, str]] = {"t": "'time'", "gap": "state.gap", "x": "state.x", "v": "state.v"}

    time: Floats
    state: SampledStates
    points: Floats
    force: Floats
    volts: Floats
    charge: Floats
    current: Floats
    laws: Mapping[str, Floats]
    contact: Floats
    strength: Floats
    kinetic: Floats
    elastic: Floats
    cumulative: Mapping[str, Floats]
    works: Mapping[str, Floats]
    ledger: Ledger
    body: Floats | None = None
    path: tuple[Floats, Floats] | tuple[None, None] = (None, None)
    foot_x: Floats | None = None
    slipping: NDArray[np.bool_] | None = None
    friction: Floats | None = None
    foot_y: Floats | None = None
    friction_across: Floats | None = None
    command: Floats | None = None


class SeriesChannel(NamedTuple):
    """A series of a run: its name in a dataset, SI unit, what it has rows of (nothing: one row of times), in words, and
    what it is of a `Series`, None for robots without it. One of laws by name has a place for theirs in its name and
    words."""

    name: str
    unit: str
    over: str
    words: str
    of: Callable[[Series], Any]


TIME, DRIVE, FOOT, POINT, BODY = "time", "drive", "foot", "point", "coordinate"
"""Dimensions of a dataset."""

CHANNELS = (
    SeriesChannel("volts", "V", DRIVE, "drive voltage", lambda s: s.volts),
    SeriesChannel("command", "V", DRIVE, "voltage that the amplifier is commanded to give", lambda s: s.command),
    SeriesChannel("drive_force", "N", DRIVE, "drive force", lambda s: s.force),
    SeriesChannel("charge", "C", DRIVE, "electric charge on a drive's actuator", lambda s: s.charge),
    SeriesChannel("current", "A", DRIVE, "current into a drive's actuator", lambda s: s.current),
    SeriesChannel("displacement", "m", POINT, "displacement of a point along +z", lambda s: s.points @ s.state.x),
    SeriesChannel("velocity", "m/s", POINT, "velocity of a point along +z", lambda s: s.points @ s.state.v),
    SeriesChannel("gap", "m", FOOT, "clearance of a foot", lambda s: s.state.gap),
    SeriesChannel("gap_rate", "m/s", FOOT, "rate of the clearance, negative when approaching", lambda s: s.state.rate),
    SeriesChannel("contact", "1", FOOT, "foot held on the ground", lambda s: s.state.held),
    SeriesChannel("pull", "N", FOOT, "structure's pull on a held foot, away from the ground", lambda s: s.state.pull),
    SeriesChannel("adhesion_strength", "N", FOOT, "pull that the contact would hold", lambda s: s.strength),
    SeriesChannel("{}_force", "N", FOOT, "force of the {} on the foot along the normal", lambda s: s.laws),
    SeriesChannel(
        "contact_force", "N", FOOT, "reaction of the ground on a held foot, below 0 when it holds back",
        lambda s: s.contact,
    ),
    SeriesChannel("kinetic_energy", "J", "", "kinetic energy", lambda s: s.kinetic),
    SeriesChannel("elastic_energy", "J", "", "elastic energy", lambda s: s.elastic),
    SeriesChannel("work_in", "J", "", "work of drives and weight, from the start", lambda s: s.cumulative["work_in"]),
    SeriesChannel(
        "damping_loss", "J", "", "energy lost to structural damping, from the start", lambda s: s.cumulative["damping"]
    ),
    SeriesChannel("impact_loss", "J", "", "energy lost in impacts, from the start", lambda s: s.cumulative["impacts"]),
    SeriesChannel(
        "adhesion_loss", "J", "", "kinetic energy taken by adhesive capture, from the start",
        lambda s: s.cumulative["adhesion"],
    ),
    SeriesChannel("{}_work", "J", "", "work of the {} on the structure, from the start", lambda s: s.works),
    SeriesChannel("body", "m, rad", BODY, "coordinates of the body", lambda s: s.body),
    SeriesChannel("path_x", "m", "", "place of the body in the world, forward of its start", lambda s: s.path[0]),
    SeriesChannel("path_y", "m", "", "place of the body in the world, to the left of its start", lambda s: s.path[1]),
    SeriesChannel("foot_x", "m", FOOT, "displacement of a foot along the way", lambda s: s.foot_x),
    SeriesChannel("slipping", "1", FOOT, "foot in contact that slides", lambda s: s.slipping),
    SeriesChannel("friction_force", "N", FOOT, "friction on a foot, positive forward", lambda s: s.friction),
    SeriesChannel(
        "friction_loss", "J", "", "energy lost to friction along the ground, from the start",
        lambda s: None if s.foot_x is None else s.cumulative["friction"],
    ),
    SeriesChannel("foot_y", "m", FOOT, "displacement of a foot across the way, to the left", lambda s: s.foot_y),
    SeriesChannel(
        "friction_across", "N", FOOT, "friction on a foot across the way, positive to the left",
        lambda s: s.friction_across,
    ),
    SeriesChannel(TIME, "s", "", "time", lambda s: s.time),
)  # fmt: skip
"""All series of a run."""


def variables_of(scene: Scene, series: Series) -> dict[str, Variable]:
    """The channels of a run of a scene as plain arrays by name, with the names of drives, feet, points and coordinates
    of the body as coordinates."""
    robot, laws = scene.robot, scene.ground.acting_laws
    names = {FOOT: [*robot.feet], DRIVE: [*robot.drives], POINT: [*robot.structure.points]}
    if body := robot.structure.body_coordinates:
        names[BODY] = [*body]
    out: dict[str, Variable] = {}
    for one in CHANNELS:
        found = one.of(series)
        if found is None or (one.over == BODY and not body):
            continue
        unit = ", ".join("rad" if name in TURNS else "m" for name in body) if one.over == BODY else one.unit
        for law, rows in found.items() if isinstance(found, Mapping) else [("", found)]:
            said = {"units": unit, "long_name": one.words.format(laws[law].title if law else "")}
            out[one.name.format(law)] = Variable((one.over, TIME) if one.over else (TIME,), rows, said)
    return out | {dim: Variable((dim,), np.array(known, dtype=object), {}) for dim, known in names.items()}


def grid(run: Run) -> Floats:
    """Even sample times: enough for the drive period and the fastest mode, within bounds."""
    cycles = run.duration * run.plan.rate / (2.0 * np.pi)
    wanted = max(PER_PERIOD * run.duration / run.period, PER_CYCLE * cycles)
    kept = VALUES // (2 * len(run.scene.robot.structure.points) + 12 * len(run.foot_names) + 12)
    most = max(min(MOST, kept), FEWEST)
    return np.linspace(0.0, run.end_time, int(np.clip(np.ceil(wanted), FEWEST - 1, most - 1)) + 1)


def sample(run: Run, time: Floats) -> Series:
    """The series of a run at times (nt,) [s], increasing."""
    laws_of = run.motion.acting
    state, (terms, works), way = run.motion.seen(time)
    laws = laws_of.forces(state.gap, state.rate, state.held, time)
    smooth = laws_of.total(laws, "force", state.gap)
    strength = strength_of(run, time, state.held)
    along = {} if way is None else along_the_way(run, way, strength, strength - state.pull - smooth)
    system = laws_of.plan.system
    names, structure = list(run.scene.robot.drives), run.scene.robot.structure
    points = np.array([structure.row(one) for one in structure.points]).reshape(-1, structure.size)
    kinds = (Quantity.VOLTAGE, Quantity.CHARGE, Quantity.CURRENT)
    outputs = [Output(kind, name) for kind in kinds for name in names]
    volts, charge, current = (
        output_rows(run.scene, outputs, time).values(state).reshape(3, len(names), len(time))
    )
    return Series(
        time=time, state=state, points=points, force=laws_of.drives(time), volts=volts, charge=charge, current=current,
        laws=laws,
        contact=np.where(state.held, -(state.pull + smooth), 0.0), strength=strength,
        kinetic=quadratic(system.mass, state.v), elastic=quadratic(system.stiffness, state.x),
        cumulative=terms | event_losses(run, time), works=works, ledger=run.ledger,
        command=command_volts(run.scene, time), **along,
    )  # fmt: skip


def along_the_way(run: Run, way: Way, strength: Floats, margin: Floats) -> dict[str, Any]:
    """What series also have where feet know their way along the ground; margin (m, nt) [N]: what presses feet down."""

    def friction(of: Sliding) -> Floats:
        out, slides = np.where(of.held, -of.force, 0.0), of.slides
        if slides.any():
            for bound in run.motion.acting.on("friction").values():
                # the margin is below 0 by rounding where a foot has just let go
                given = {"margin": np.maximum(margin, 0.0), "strength": strength, "speed": of.speed}
                most = law_value(bound, *(given[name][slides] for name in bound.leading))
                out[slides] = -of.sense[slides] * most
        return out

    along, across = way.along, way.across
    body = dict(zip(run.scene.robot.structure.body_coordinates, way.body, strict=False))
    path = path_of(body["surge"], body["sway"], body["yaw"]) if "yaw" in body else (None, None)
    out = {"body": way.body, "path": path, "foot_x": along.place, "slipping": along.slides, "friction": friction(along)}
    if across is None:
        return out
    return out | {"foot_y": across.place, "friction_across": friction(across)}


def quadratic(matrix: Floats, z: Floats) -> Floats:
    """Energy (nt,) of states z (n, nt): z M z / 2."""
    return 0.5 * np.einsum("it,ij,jt->t", z, matrix, z)


def command_volts(scene: Scene, time: Floats) -> Floats | None:
    """Volts (nd, nt) that every drive's amplifier is commanded to give; None where all are ideal."""
    drives, commands = scene.robot.drives, scene.waveforms
    if all(drive.amplifier.ideal for drive in drives.values()):
        return None
    return np.array([commands[d].volts(time) if d in commands else np.zeros(len(time)) for d in drives])


def strength_of(run: Run, time: Floats, held: NDArray[np.bool_]) -> Floats:
    """f_a [N] of every held foot: from the contact's age, which it may have brought along, and the foot's volts."""
    strength = np.zeros(held.shape)
    laws = list(run.motion.acting.on("strength").values())
    if not laws:
        return strength
    volts = run.motion.acting.volts(time)
    for i in range(len(held)):
        begun, brought = _contacts(run.events[run.events["foot"] == i], laws[0])
        if not len(begun):
            continue
        present = np.clip(np.searchsorted(begun, time, side="right") - 1, 0, None)
        ages = np.maximum(time - begun[present], 0.0) + brought[present]
        strength[i, held[i]] = contact_strength(laws[0], ages[held[i]], volts[i, held[i]])
    return strength


def _contacts(events: NDArray[np.void], law: Law) -> tuple[Floats, Floats]:
    """When the contacts of a foot began, and the age that each brought along from those before [s]."""
    begins = np.isin(events["kind"], CONTACT_BEGINS)
    begun = events["time"][begins]
    brought = np.zeros(len(begun))
    if not isinstance(law, AdhesionLaw) or law.remaining is None:
        return begun, brought
    ended = events["time"][events["kind"] == EventKind.RELEASE]
    for k in range(1, len(begun)):
        end = ended[np.searchsorted(ended, begun[k - 1])]
        brought[k] = law_value(law, end - begun[k - 1] + brought[k - 1], begun[k] - end, hook="remaining")
    return begun, brought


def event_losses(run: Run, time: Floats) -> dict[str, Floats]:
    """Energies that impacts and captures have taken by the sample times [J]."""
    events = run.events
    passed = np.searchsorted(np.maximum.accumulate(events["time"]), time, side="right")
    adhesion = np.concatenate([[0.0], np.cumsum(events["adhesion_energy"])])
    lost = np.concatenate([[0.0], np.cumsum(events["energy"])])
    return {"adhesion": adhesion[passed], "impacts": lost[passed] - adhesion[passed]}


def ledger(run: Run) -> Ledger:
    """Where the energy of a whole run went."""
    row, first, last = run.motion.acting.rows, run.motion.acting.rows.initial[0], run.motion.last
    lost = (float(run.events["energy"].sum()), float(run.events["adhesion_energy"].sum()))
    resolved = _unresolved(run, first, last)
    return ledger_of(run.plan.system, row.scales[0], first, last, run.motion.account, lost, resolved)


def ledger_of(
    system: LinearSystem,
    scales: Floats,
    first: Floats,
    last: Floats,
    account: Account,
    lost: Sequence[float] | Floats,
    resolved: float = 1.0,
) -> Ledger:
    """That of a motion from a state to another (2n,), with its account; scales: length [m] and force [N]; lost [J]: in
    impacts, and of that to adhesion; resolved: how exactly the account can close."""
    terms, works = ({name: float(one) for name, one in some.items()} for some in account)
    n = len(system.mass)
    kinetic = [float(0.5 * z[n:] @ system.mass @ z[n:]) for z in (first, last)]
    elastic = [float(0.5 * z[:n] @ system.stiffness @ z[:n]) for z in (first, last)]
    adhesion = float(lost[1])
    impacts = float(lost[0]) - adhesion
    change_k, change_e = kinetic[1] - kinetic[0], elastic[1] - elastic[0]
    gained = terms["work_in"] + sum(works.values())
    spent = terms["damping"] + terms["friction"] + impacts + adhesion
    residual = gained - spent - change_k - change_e
    sizes = (*terms.values(), *works.values(), impacts, adhesion, change_k, change_e, *kinetic, *elastic)
    length, force = scales[:2]
    largest = max(map(abs, sizes))
    moved = largest > NOTHING * force * length
    return Ledger(
        **terms, kinetic=change_k, elastic=change_e, impacts=impacts, adhesion=adhesion, laws=works, residual=residual,
        closure=abs(residual) / (resolved * largest) if moved else 0.0,
    )  # fmt: skip


def electrical_energy(run: Run) -> float:
    """Energy [J] that the electrodes of all drives take in a run, the integral of V dq from just after its start; NaN
    where a law has a memory.

    What capacitances store and gains that go with the volts hold of the motion, and the work of the drives, which is
    all of the ledger's but that of the weight (docs/conventions.md, Charge and current).
    """
    drives = run.scene.robot.drives
    if any(drive.law.has_memory for drive in drives.values()):
        return np.nan
    row, system = run.motion.acting.rows, run.plan.system
    n = len(system.mass)
    ends = np.array([row.initial[0], run.motion.last])[:, :n]
    weight = float((ends[1] - ends[0]) @ system.weight @ row.sources[0, -2:])
    taken, times = run.ledger.work_in - weight, np.array([0.0, run.end_time])
    for drive, signal, load in zip(
        drives.values(), run.scene.actuator_volts.values(), system.loads.T, strict=True
    ):
        volts = signal.volts(times)
        gain = polyval(volts, drive.law.small_signal_gain())
        held = 0.5 * (drive.capacitance or 0.0) * volts**2 + (volts * gain - drive.law.force(volts)) * (
            ends @ load
        )
        taken += float(held[1] - held[0])
    return taken


def _unresolved(run: Run, first: Floats, last: Floats) -> float:
    """How many times less exactly than others the account closes where feet hardly move in a resistive law."""
    gap_range, row = run.motion.log.gap_range, run.motion.acting.rows
    if gap_range is None or not gap_range.size or not run.motion.acting.on("momentum"):
        return 1.0
    normals = run.plan.system.normals
    ends = np.ptp([z[: len(normals)] @ normals for z in (first, last)], axis=0)
    way = float(max(gap_range.max(), ends.max()))
    return max(1.0, RESOLVED / max(way / row.scales[0, 0], LEAST))
