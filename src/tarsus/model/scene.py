"""Scene: everything a simulation needs to know, as one frozen description."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from enum import Enum
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field, field_validator, model_validator

from tarsus.base.errors import InputError
from tarsus.base.linear import product
from tarsus.base.messages import PathErrors, nearest
from tarsus.base.spec import Amount, Description, FrozenDict, Named, float_paths, get_value, quantity, with_values
from tarsus.base.units import format_quantity, parse_quantity
from tarsus.model.drive.gait import AnyGait, Gait
from tarsus.model.drive.signal import Signal
from tarsus.model.drive.waveforms import Constant, Waveform
from tarsus.model.ground import Ground
from tarsus.model.laws import ImpactMap, MassWeighted, PullAsPrinted
from tarsus.model.laws.impact_map import Body
from tarsus.model.motion import Base
from tarsus.model.robot import Drive, Foot, InertiaLoad, ModalLoad, PointLoad, Robot, reference_faults
from tarsus.model.structure import Walker
from tarsus.model.structure.base import Array
from tarsus.model.structure.walker import STRAIGHT_AHEAD
from tarsus.tables.table import Table

__all__ = [
    "Drive",
    "Foot",
    "Ground",
    "InertiaLoad",
    "Initial",
    "ModalLoad",
    "PointLoad",
    "Provenance",
    "Robot",
    "Scene",
    "Source",
    "Standing",
    "override",
    "provenance_faults",
    "provenance_problems",
    "reference_faults",
]


SHORT_WORDS = {"volts": ("amplitude", "high"), "hz": ("frequency", "frequency")}
"""Words that stand for numbers of a drive: their fields in a wave, and in a gait."""


class Standing(Description):
    """A walker's start in static equilibrium on its feet, whatever its payload, gravity and springs."""

    driven: bool = Field(default=False, description="with the drives' first volts; absent: at 0 V, after their history")


class Initial(Description):
    """State at time zero, in the structure's coordinates; zeros when absent.

    `standing` stands for the displacement of a walker that stands still on its feet.
    """

    standing: Standing | None = Field(default=None, description="start in static equilibrium on all feet")
    displacement: tuple[float, ...] | None = quantity("m", "initial coordinates", default=None)
    velocity: tuple[float, ...] | None = quantity("m/s", "initial rates of the coordinates", default=None)
    in_laboratory: bool = Field(
        default=False,
        description="whether the velocity, zero when absent, is that in the laboratory and not against moving ground",
    )
    lifted: bool = Field(
        default=False, description="whether a robot that would start below uneven ground is lifted onto it"
    )


class Source(Enum):
    """Where a value comes from."""

    PRINTED = "printed"
    DERIVED = "derived"
    CALIBRATED = "calibrated"
    ASSUMED = "assumed"
    DESIGNED = "designed"


class Provenance(Description):
    """Where a value comes from, in a sentence: which table, derived how, calibrated to what."""

    source: Source
    note: str = Field(min_length=1, description="a sentence")
    interval: tuple[tuple[float, float], ...] | None = Field(
        default=None, description="95 % interval (low, high) of the value in SI, or one for each value of a list"
    )

    @field_validator("interval", mode="before")
    @classmethod
    def _one_interval(cls, value: Any) -> Any:
        """One pair of numbers is the interval of one value."""
        flat = isinstance(value, (list, tuple)) and all(isinstance(v, (int, float)) for v in value)
        return (tuple(value),) if flat and value else value

    @field_validator("interval")
    @classmethod
    def _in_order(cls, value: tuple[tuple[float, float], ...] | None) -> Any:
        for low, high in value or ():
            if low > high:
                raise PathErrors([("", f"an interval starts at its lower end, got {low:g} to {high:g}")])
        return value


class Scene(Description):
    """A robot above a ground, its drive signals and initial state.

    A walker's `gait` gives the volts of the drives that move its legs; `signals` adds to them and prevails over them.
    """

    name: str
    robot: Robot
    ground: Ground = Ground()
    grounds: Named[Ground] = Field(
        default=FrozenDict(),
        description="grounds of single feet by name, feet.NAME.ground: with other numbers of the laws of `ground`, or "
        "without some of them",
    )
    gait: AnyGait | None = Field(default=None, description="pattern of a walker's legs")
    signals: Named[Waveform] = Field(default=FrozenDict(), description="volts of each drive; absent is 0 V")
    initial: Initial = Initial()
    duration: Amount = quantity("s", "time to simulate unless another is asked for", gt=0)
    provenance: Annotated[dict[str, Provenance], AfterValidator(FrozenDict)] = Field(
        default=FrozenDict(), description="by path; '*' stands for any one name, as in robot.structure.legs.*.mass"
    )
    citations: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _check(self) -> Scene:
        structure = self.robot.structure
        faults = _signal_faults(self.signals, self.robot.drives)
        faults += self._standing_faults()
        for name in ("displacement", "velocity"):
            values = getattr(self.initial, name)
            if values is not None and len(values) != structure.size:
                text = f"expected {structure.size} values, one a coordinate, got {len(values)}"
                faults.append((f"initial.{name}", text))
            elif values is not None and name == "displacement" and self.ground.profile is None:
                faults += self._start_faults(np.array(values))
        if self.ground.gravity is not None and structure.vertical() is None:
            text = "needs to know which way is up: give upward, the coordinates of a unit upward translation"
            faults.append(("robot.structure.upward", f"gravity {text}"))
        if (
            self.ground.incline
            and structure.horizontal() is None
            and any(one.along for one in self.robot.feet.values())
        ):
            text = "needs to know the way along the ground: give forward, the coordinates of a unit translation on it"
            faults.append(("robot.structure.forward", f"gravity on an incline {text}"))
        if not any(foot.electrode for foot in self.robot.feet.values()):
            faults += [
                (f"ground.{path}", "acts on no foot: give a foot its electrode, the name of a drive")
                for path, law in self.ground.by_path().items()
                if law.needs_electrode
            ]
        if self.ground.profile is not None and not isinstance(structure, Walker):
            text = "is ground under the feet of a walker, which know their way along it: leave it out"
            faults.append(("ground.profile", text))
        elif self.ground.profile is not None:
            faults += [(f"ground.profile.{path}", text) for path, text in self.ground.profile.faults(self.across)]
        faults += _motion_faults(self)
        faults += _own_ground_faults(self)
        if self.gait is not None:
            faults += _gait_faults(self.gait, self.robot)
        if isinstance(structure, Walker):
            faults += _walker_ground_faults(self.ground)
            faults += _sideways_faults(structure, self.ground)
        elif self.slides:
            faults += _strength_faults(self.ground)
            if self.ground.impact is not None and not isinstance(self.ground.impact, MassWeighted):
                text = "needs the mass-weighted impact law: leave out ground.impact, or the friction"
                faults.append(("ground.friction", f"friction along the ground {text}"))
        elif self.ground.acting_on("friction"):
            text = "acts on no foot: give a foot its way along the ground, feet.NAME.along, a point of the structure"
            faults.append(("ground.friction", text))
        if not faults and self.ground.impact is not None:
            faults += self._impact_faults(self.ground.impact)
        if not faults and isinstance(self.ground.landing, PullAsPrinted):
            faults += self._landing_faults()
        if faults:
            raise PathErrors(faults)
        return self

    def short_words(self) -> Mapping[str, tuple[str, ...]]:
        """``volts`` and ``hz`` with the paths that they stand for: amplitude and frequency of every signal that has
        them, upper voltage and frequency of the gait."""
        found: dict[str, tuple[str, ...]] = {}
        for word, (of_wave, of_gait) in SHORT_WORDS.items():
            paths = [
                f"signals.{name}.{of_wave}"
                for name, signal in self.signals.items()
                if of_wave in type(signal).model_fields
            ]
            gait = [] if self.gait is None else [f"gait.{of_gait}"]
            if gait or paths:
                found[word] = (*gait, *paths)
        return found

    @property
    def slides(self) -> bool:
        """Whether friction acts on feet along the ground: of a walker, or of feet that say `Foot.along`."""
        feet = self.robot.feet.values()
        known = isinstance(self.robot.structure, Walker) or any(foot.along is not None for foot in feet)
        return known and bool(self.ground.acting_on("friction"))

    @property
    def foot_grounds(self) -> tuple[Ground, ...]:
        """The ground of every foot: its own, or that of all."""
        return tuple(
            self.ground if foot.ground is None else self.grounds[foot.ground] for foot in self.robot.feet.values()
        )

    @property
    def across(self) -> Mapping[str, float]:
        """Places [m] of a walker's feet to the left of its middle, by name; none of any other robot."""
        legs = self.robot.structure.legs if isinstance(self.robot.structure, Walker) else {}
        return {name: legs[foot.point].y for name, foot in self.robot.feet.items() if legs}

    @property
    def signal_remarks(self) -> tuple[str, ...]:
        """Sentences on signals that are played otherwise than their files may seem to say, with their paths."""
        return tuple(f"signals.{name}: {said}" for name, one in self.signals.items() for said in one.remarks)

    @property
    def waveforms(self) -> Mapping[str, Waveform]:
        """Commanded volts of each drive: those of the gait, and over them the signals; without any it is 0 V."""
        layout = None if self.gait is None else self.robot.layout()
        if self.gait is None or layout is None:
            return self.signals
        return FrozenDict({**self.gait.waveforms(layout), **self.signals})

    @property
    def waves(self) -> Mapping[str, Signal]:
        """Every waveform that acts, by its path: those of the drives, and those of ground that moves."""
        motion = self.ground.motion
        shifts = () if motion is None else motion.shifts()
        moving = {f"ground.motion.{name}.{one.word}": one.wave for name, one in shifts}
        return FrozenDict({**{f"signals.{name}": wave for name, wave in self.waveforms.items()}, **moving})

    @property
    def actuator_volts(self) -> Mapping[str, Signal]:
        """Volts at every drive's actuator: its waveform, 0 V without any, behind the drive's amplifier."""
        commands = self.waveforms
        return {
            name: drive.actuator_volts(commands.get(name) or Constant(level=0.0))
            for name, drive in self.robot.drives.items()
        }

    def _impact_faults(self, impact: ImpactMap) -> list[tuple[str, str]]:
        structure = self.robot.structure
        matrices = structure.matrices()
        body = Body(matrices.mass, matrices.stiffness, structure.row)
        faults: list[tuple[str, str]] = []
        for name, foot in self.robot.feet.items():
            try:
                impact.direction(name, foot.normal * structure.row(foot.point), body)
            except PathErrors as error:
                faults += [(f"ground.impact.{path}", text) for path, text in error.faults]
        return faults

    def _standing_faults(self) -> list[tuple[str, str]]:
        structure = self.robot.structure
        if self.initial.standing is None:
            return []
        if not isinstance(structure, Walker):
            text = f"only a walker stands on its feet; this structure is of kind '{structure.kind}'"
            return [("initial.standing", text)]
        if self.initial.displacement is not None:
            text = "takes the place of initial.displacement: give one of the two, the other as None"
            return [("initial.standing", text)]
        return []

    def _landing_faults(self) -> list[tuple[str, str]]:
        faults: list[tuple[str, str]] = []
        for foot in self.robot.feet.values():
            try:
                self.robot.structure.alone(foot.point)
            except InputError as error:
                said = f"the pull as printed takes K_pp and C_pp of a foot's displacement, but {error}"
                faults.append(("ground.landing", said))
        return list(dict.fromkeys(faults))

    def _start_faults(self, start: Array) -> list[tuple[str, str]]:
        faults: list[tuple[str, str]] = []
        for name, foot in self.robot.feet.items():
            moved = float(product(self.robot.structure.row(foot.point), start))
            gap = foot.gap + foot.normal * moved
            if gap < -1e-12 * max(foot.gap, abs(moved)):
                depth = format_quantity(float(f"{-gap:.6g}"), "m")
                faults.append(("initial.displacement", f"foot '{name}' would start {depth} below the ground"))
        return faults

    def __str__(self) -> str:
        """The numbers with their sources, a line each, without the sentences about them."""
        whole = self.table()
        return Table(whole.title, whole.columns[:3], [row[:3] for row in whole.rows]).text()

    def __repr__(self) -> str:
        return f"<Scene '{self.name}': {self.robot.structure.kind} with {', '.join(self.robot.feet) or 'no foot'}>"

    def _repr_html_(self) -> str:
        return self.table().html()

    def table(self) -> Table:
        """What makes this scene: its numbers, those of legs, feet and drives that are alike once, and their sources."""
        from tarsus.model.values import values_table

        return values_table(self)

    def origin(self, path: str) -> Provenance | None:
        """Provenance of a value: that of its own path, or of the nearest list or table it is in.

        A name goes before a ``*`` that stands for it.
        """
        found = self._origin(path)
        return None if found is None else found[1]

    def interval(self, path: str) -> tuple[float, float] | None:
        """95 % interval (low, high) of one number [SI], where its provenance gives one."""
        whole, origin = self._origin(path) or ("", None)
        if origin is None or origin.interval is None:
            return None
        inside = [one for one in float_paths(self) if one == whole or one.startswith(f"{whole}.")]
        return dict(zip(inside, origin.interval, strict=False)).get(path)

    def _origin(self, path: str) -> tuple[str, Provenance] | None:
        keys = path.split(".")
        for count in range(len(keys), 0, -1):
            whole = ".".join(keys[:count])
            if whole in self.provenance:
                return whole, self.provenance[whole]
            for path, origin in self.provenance.items():
                if "*" in path and _stands_for(path, keys[:count]):
                    return whole, origin
        return None


_SHARED = ("gravity", "impact", "incline", "profile", "motion")
"""What of a ground all feet share."""


def _own_ground_faults(scene: Scene) -> list[tuple[str, str]]:
    """Grounds of single feet that there are not, and what they have beyond the laws of the ground of all."""
    faults = [
        (f"robot.feet.{name}.ground", f"there is no '{foot.ground}' in grounds{nearest(foot.ground, scene.grounds)}")
        for name, foot in scene.robot.feet.items()
        if foot.ground is not None and foot.ground not in scene.grounds
    ]
    acting = scene.ground.acting_laws
    for name, own in scene.grounds.items():
        faults += [
            (f"grounds.{name}.{field}", "is of all feet alike: give it in ground alone")
            for field in _SHARED
            if getattr(own, field) is not None
        ]
        for law, one in own.acting_laws.items():
            if law not in acting:
                text = f"ground has no {law}: give it there, and leave it out of the grounds of feet without it"
                faults.append((f"grounds.{name}.{law}", text))
            elif type(one) is not type(acting[law]):
                faults.append((f"grounds.{name}.{law}", f"is another kind of law than ground.{law}"))
    if scene.grounds and isinstance(scene.ground.landing, PullAsPrinted):
        faults.append(("ground.landing", "the pull as printed is of all feet alike: leave out grounds"))
    return faults


def _motion_faults(scene: Scene) -> list[tuple[str, str]]:
    motion = scene.ground.motion
    if motion is None:
        text = "the ground does not move: give ground.motion, or leave it out"
        return [("initial.in_laboratory", text)] if scene.initial.in_laboratory else []
    faults = [(f"ground.motion.{path}", text) for path, text in motion.faults(scene.duration)]
    for direction, _ in motion.shifts():
        if scene.robot.structure.translation(direction) is None:
            field = "upward" if direction == "normal" else "forward"
            text = f"needs to know how it moves with the ground: give {field}, the coordinates of a unit translation"
            faults.append((f"robot.structure.{field}", f"the structure {text}"))
    if motion.base is Base.STAYS and isinstance(scene.robot.structure, Walker):
        faults.append(("ground.motion.base", "a walker has no base that could stay: leave it out"))
    return faults


def _gait_faults(gait: Gait, robot: Robot) -> list[tuple[str, str]]:
    layout = robot.layout()
    if layout is None:
        kind = robot.structure.kind
        return [("gait", f"needs the legs of a walker; this structure is of kind '{kind}'")]
    return [(f"gait.{path}" if path else "gait", text) for path, text in gait.faults(layout)]


def _strength_faults(ground: Ground) -> list[tuple[str, str]]:
    """Friction that adhesion alone bears, without adhesion."""
    if ground.holds:
        return []
    text = "needs adhesion: give ground.adhesion or an adhesion law of your own"
    return [(f"ground.{path}", f"{law.title} {text}") for path, law in ground.by_path().items() if law.needs_strength]


def _walker_ground_faults(ground: Ground) -> list[tuple[str, str]]:
    faults = _strength_faults(ground)
    if ground.impact is not None and not isinstance(ground.impact, MassWeighted):
        text = "the feet of a walker are point masses, for which the mass-weighted map is exact: leave it out, got"
        faults.append(("ground.impact", f"{text} '{ground.impact.kind}'"))
    return faults


def _sideways_faults(walker: Walker, ground: Ground) -> list[tuple[str, str]]:
    """Ground that is not alike in all directions, under a walker that sways: its shape goes by the way along alone."""
    if not walker.sways:
        return []
    named = (("profile", ground.profile is not None), ("incline", bool(np.any(ground.incline))))
    return [(f"ground.{name}", STRAIGHT_AHEAD) for name, given in named if given]


def _signal_faults(signals: Iterable[str], drives: Collection[str]) -> list[tuple[str, str]]:
    return [
        (f"signals.{name}", f"the robot has no drive '{name}' for this signal{nearest(name, drives)}")
        for name in signals
        if name not in drives
    ]


def provenance_problems(scene: Scene) -> list[str]:
    """Provenance that does not fit the scene, one sentence each: unknown paths, intervals for other values."""
    return [text for problems in provenance_faults(scene).values() for text in problems]


def provenance_faults(scene: Scene) -> dict[str, list[str]]:
    """`provenance_problems` by the path of the provenance."""
    found: dict[str, list[str]] = {}
    floats = float_paths(scene) if any(origin.interval for origin in scene.provenance.values()) else {}
    for path, origin in scene.provenance.items():
        problems = found.setdefault(path, [])
        try:
            places = _places(scene, path)
        except InputError as error:
            problems.append(f"provenance.{error}")
            continue
        if not places:
            problems.append(f"provenance.{path}: stands for no path of the scene")
        if origin.interval is not None:
            counts = {sum(one == at or one.startswith(f"{at}.") for one in floats) for at in places}
            wrong = counts - {len(origin.interval)}
            if wrong:
                text = f"expected {min(wrong)} (low, high), one for each number, got {len(origin.interval)}"
                problems.append(f"provenance.{path}.interval: {text}")
    return {path: problems for path, problems in found.items() if problems}


def _places(scene: Scene, path: str) -> list[str]:
    """Paths that a path of provenance stands for: itself, or, with a ``*``, those it fits; `InputError` for none."""
    if "*" not in path:
        get_value(scene, path)
        return [path]
    depth = path.count(".") + 1
    wholes = dict.fromkeys(".".join(one.split(".")[:depth]) for one in float_paths(scene))
    return [whole for whole in wholes if _stands_for(path, whole.split("."))]


def _stands_for(pattern: str, keys: Sequence[str]) -> bool:
    """Whether a path with ``*`` in place of names fits a path given as its names."""
    own = pattern.split(".")
    return len(own) == len(keys) and all(one in ("*", key) for one, key in zip(own, keys, strict=True))


def override(
    scene: Scene, values: Mapping[str, Any], *, by: str = "the user", source: Source = Source.ASSUMED
) -> Scene:
    """`with_values` with the provenance that follows, so that a changed value no longer counts as printed.

    Parameters
    ----------
    scene
        Any scene.
    values
        As in `tarsus.base.spec.with_values`.
    by, source
        Who set them, for the note, and what such values are.

    Raises
    ------
    InputError
        As `tarsus.base.spec.with_values`.
    """
    changed = with_values(scene, values)
    before, after = float_paths(scene), float_paths(changed)
    provenance = {path: origin for path, origin in scene.provenance.items() if _has(changed, path)}
    for path, info in after.items():
        old = before.get(path)
        if old is not None and old.value == info.value:
            continue
        origin = scene.origin(path)
        was = ""
        if old is not None and origin is not None:
            was = f"; was {format_quantity(old.value, old.unit)} ({origin.source.value})"
        provenance[path] = Provenance(source=source, note=f"Set by {by}{was}.")
    return with_values(changed, {"provenance": provenance})


def _has(scene: Scene, path: str) -> bool:
    try:
        return any(get_value(scene, place) is not None for place in _places(scene, path))
    except InputError:
        return False


def seconds_of(scene: Scene, duration: float | str | None, name: str = "duration") -> float:
    """The duration [s] given under a name, or the scene's own. Raises InputError unless it is positive and finite."""
    if not isinstance(duration, int | float | str | np.number | None):
        said = f"{name}: expected a time [s] or a text with a unit, got {duration!r:.60}"
        raise InputError([f"{said}; values of the scene are named, as in volts=6"])
    try:
        given = scene.duration if duration is None else duration
        seconds = parse_quantity(given, "s") if isinstance(given, str) else float(given)
    except InputError as error:
        raise InputError([f"{name}: {said}" for said in error.problems]) from None
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise InputError([f"{name}: expected a time above 0 s, got {seconds:g} s"])
    return seconds
