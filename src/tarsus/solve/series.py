"""Series of a run: states, forces and energies at sample times, each with its name, unit and words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import CONTACT_BEGINS, EventKind
from tarsus.base.messages import Hinted, nearest
from tarsus.files.series import Variable
from tarsus.measure.path import path_of
from tarsus.model.laws.base import AdhesionLaw, Law
from tarsus.model.structure.walker import TURNS
from tarsus.plan.moving import shifts_of
from tarsus.solve import channels
from tarsus.solve.channels import BODY, DRIVE, FOOT, POINT, TIME
from tarsus.solve.ground_work import ground_work
from tarsus.solve.motion import contact_strength, law_value
from tarsus.solve.outputs import Output, Readings

if TYPE_CHECKING:
    from tarsus.files.ledger import Ledger
    from tarsus.solve.channels import RunChannel
    from tarsus.solve.motion import Sliding
    from tarsus.solve.run import Run

Floats = NDArray[np.float64]

FEWEST, MOST, PER_PERIOD, PER_CYCLE = 2001, 20001, 400, 6
VALUES = 4_000_000
"""Numbers that the series of a run have together, about, where that leaves them enough samples."""


class Series(Hinted):
    """A run at nt times [s]: what `tarsus.solve.channels.CHANNELS` has of it, by name (``series["gap"]``), worked out
    when it is asked for.

    state: of the structure, and forces on the feet; cumulative, works: energies of the ledger and works of the laws by
    name, from the start (nt,) [J].
    """

    _guesses: ClassVar[Mapping[str, str]] = {"t": "'time'", "gap": "state.gap", "x": "state.x", "v": "state.v"}

    def __init__(self, run: Run, time: Floats) -> None:
        self.run, self.time = run, time
        self.state, (terms, self.works), self._way = run.motion.seen(time)
        ground = ground_work(run, time, self.state.x, terms["work_in"])
        terms = terms | {"work_in": terms["work_in"] - ground, "ground": ground}
        self.cumulative = terms | _event_losses(run, time)

    def __getitem__(self, name: str) -> Any:
        """One of the channels, a row for each of what it is over; by law name where it is of laws. None of robots
        without it. Raises KeyError for a name that no channel has."""
        known = {one.name: one for one in channels.CHANNELS}
        if name not in known:
            raise KeyError(f"a run has no series '{name}'{nearest(name, known)}")
        return self.of(known[name])

    def __iter__(self) -> Iterator[str]:
        """Names of the channels."""
        return (one.name for one in channels.CHANNELS)

    def of(self, channel: RunChannel) -> Any:
        """A channel of the run."""
        if channel.of is not None:
            return channel.of(self)
        assert channel.quantity is not None
        robot = self.run.scene.robot
        names = robot.drives if channel.over == DRIVE else robot.structure.points
        outputs = [Output(channel.quantity, name, channel.motional) for name in names]
        rows = self._readings.rows(outputs)
        return rows.values(self.state, self.friction if rows.tangent.any() else None)

    @cached_property
    def _readings(self) -> Readings:
        return Readings(self.run.scene, self.time)

    @property
    def volts(self) -> Floats:
        """Volts (nd, nt) of the drives."""
        return self["volts"]

    @property
    def charge(self) -> Floats:
        """Charges (nd, nt) [C] on their actuators."""
        return self["charge"]

    @property
    def current(self) -> Floats:
        """Currents (nd, nt) [A] into them."""
        return self["current"]

    @property
    def force(self) -> Floats:
        """Forces (nd, nt) [N] of the drives."""
        return self.run.motion.acting.drives(self.time)[: len(self.run.scene.robot.drives)]

    @property
    def ground(self) -> Mapping[str, Floats]:
        """Displacements (nt,) [m] of ground that moves, by direction, normal to it or along it."""
        return {direction: one.at(self.time) for direction, one in shifts_of(self.run.scene).items()}

    @cached_property
    def laws(self) -> Mapping[str, Floats]:
        """Force (m, nt) [N] of every smooth law on the foot by name, positive along the normal."""
        state = self.state
        return self.run.motion.acting.forces(state.gap, state.rate, state.held, self.time)

    @cached_property
    def contact(self) -> Floats:
        """The ground's reaction (m, nt) [N] on a held foot, positive pushing."""
        return np.where(self.state.held, -(self.state.pull + self._smooth), 0.0)

    @property
    def _smooth(self) -> Floats:
        return self.run.motion.acting.total(self.laws, "force", self.state.gap)

    @cached_property
    def strength(self) -> Floats:
        """f_a (m, nt) [N] of a held foot: from the contact's age, which it may have brought along, and its volts."""
        return strength_of(self.run, self.time, self.state.held)

    @property
    def kinetic(self) -> Floats:
        """Kinetic energy (nt,) [J]."""
        return quadratic(self.run.plan.system.mass, self.state.v)

    @property
    def elastic(self) -> Floats:
        """Elastic energy (nt,) [J]."""
        return quadratic(self.run.plan.system.stiffness, self.state.x)

    @property
    def ledger(self) -> Ledger:
        """The energy ledger of the whole run."""
        return self.run.ledger

    @property
    def command(self) -> Floats | None:
        """Volts (nd, nt) that every drive's amplifier is commanded to give; None where all are ideal."""
        drives, commands = self.run.scene.robot.drives, self.run.scene.waveforms
        if all(drive.amplifier.ideal for drive in drives.values()):
            return None
        still = np.zeros(len(self.time))
        return np.array([commands[d].volts(self.time) if d in commands else still for d in drives])

    @property
    def body(self) -> Floats | None:
        """Coordinates (nb, nt) [m, rad] of a walker's body; None of other robots that know no way along the ground."""
        return None if self._way is None else self._way.body

    @property
    def path(self) -> Floats | None:
        """Where a body that turns is in the world (2, nt) [m]."""
        names = self.run.scene.robot.structure.body_coordinates
        if self._way is None or "yaw" not in names:
            return None
        body = dict(zip(names, self._way.body, strict=False))
        return path_of(body["surge"], body["sway"], body["yaw"])

    @property
    def foot_x(self) -> Floats | None:
        """Places (m, nt) [m] of the feet along the way, where friction acts."""
        return None if self._way is None else self._way.along.place

    @property
    def slipping(self) -> NDArray[np.bool_] | None:
        """Where they slide (m, nt)."""
        return None if self._way is None else self._way.along.slides

    @cached_property
    def friction(self) -> Floats | None:
        """Friction (m, nt) [N] on them, positive forward."""
        return None if self._way is None else self._friction(self._way.along)

    @property
    def foot_y(self) -> Floats | None:
        """Places (m, nt) [m] of feet that move across the way, positive to the left."""
        return None if self._way is None or self._way.across is None else self._way.across.place

    @cached_property
    def friction_across(self) -> Floats | None:
        """Friction (m, nt) [N] on them, positive to the left."""
        return None if self._way is None or self._way.across is None else self._friction(self._way.across)

    def _friction(self, of: Sliding) -> Floats:
        out, slides = np.where(of.held, -of.force, 0.0), of.slides
        if slides.any():
            # what presses feet down is below 0 by rounding where one was just released
            margin = np.maximum(self.strength - self.state.pull - self._smooth, 0.0)
            given = {"margin": margin, "strength": self.strength, "speed": of.speed}
            for feet, _, bound in self.run.motion.acting.on_feet("friction"):
                own = np.zeros_like(slides)
                own[feet] = slides[feet]
                most = law_value(bound, *(given[name][own] for name in bound.leading))
                out[own] = -of.sense[own] * most
        return out


def variables_of(series: Series) -> dict[str, Variable]:
    """The channels of a run as plain arrays by name, with the names of drives, feet, points and coordinates
    of the body as coordinates."""
    scene = series.run.scene
    robot, laws = scene.robot, scene.ground.acting_laws
    names = {FOOT: [*robot.feet], DRIVE: [*robot.drives], POINT: [*robot.structure.points]}
    if body := robot.structure.body_coordinates:
        names[BODY] = [*body]
    out: dict[str, Variable] = {}
    for one in channels.CHANNELS:
        found = series.of(one) if one.kept and (one.over != BODY or body) else None
        if found is None:
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


def quadratic(matrix: Floats, z: Floats) -> Floats:
    """Energy (nt,) of states z (n, nt): z M z / 2."""
    return 0.5 * np.einsum("it,ij,jt->t", z, matrix, z)


def strength_of(run: Run, time: Floats, held: NDArray[np.bool_]) -> Floats:
    """f_a [N] of every held foot: from the contact's age, which it may have brought along, and the foot's volts."""
    strength = np.zeros(held.shape)
    volts = run.motion.acting.volts(time)
    of_feet = run.motion.acting.on_feet("strength")
    for i, law in ((i, law) for feet, _, law in of_feet for i in feet):
        begun, brought = _contacts(run.events[run.events["foot"] == i], law)
        if not len(begun):
            continue
        present = np.clip(np.searchsorted(begun, time, side="right") - 1, 0, None)
        ages = np.maximum(time - begun[present], 0.0) + brought[present]
        strength[i, held[i]] = contact_strength(law, ages[held[i]], volts[i, held[i]])
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


def _event_losses(run: Run, time: Floats) -> dict[str, Floats]:
    """Energies that impacts and captures have taken by the sample times [J]."""
    events = run.events
    passed = np.searchsorted(np.maximum.accumulate(events["time"]), time, side="right")
    adhesion = np.concatenate([[0.0], np.cumsum(events["adhesion_energy"])])
    lost = np.concatenate([[0.0], np.cumsum(events["energy"])])
    return {"adhesion": adhesion[passed], "impacts": lost[passed] - adhesion[passed]}
