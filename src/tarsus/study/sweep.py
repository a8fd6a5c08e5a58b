"""A ground sweep as a description: what varies, over which values, and what is scored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import (
    AfterValidator,
    Field,
    StringConstraints,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from tarsus.base.errors import InputError
from tarsus.base.messages import PathErrors, located_faults, nearest
from tarsus.base.spec import (
    Description,
    FloatInfo,
    FrozenDict,
    MaybeAmount,
    float_paths,
    get_value,
    quantity,
    with_values,
)
from tarsus.base.units import parse_quantity
from tarsus.measure.measure import no_measure
from tarsus.measure.walking import OF_EPISODES
from tarsus.model.scene import Scene
from tarsus.model.structure.walker import Walker
from tarsus.orbits.motion import FromRest, Motion, motion_asked
from tarsus.solve import Run, too_long
from tarsus.study.axes import AnyAxis, Floats, Grid, Sobol, SweepAxis
from tarsus.study.manufacture import Saltelli, Scattered

MOST_RUNS = 10_000_000
"""Largest sweep that is started."""

CHUNK = 64
"""Runs in a unit of work unless a study says otherwise."""

LONGEST_UNIT = 3600.0
"""Longest unit of work [s] that can be asked for: what is under way when a process dies is done again."""

FILED = {"run", "foot", "code", "settled"}
"""What else a sweep's file names."""

RESULTS = ("_spread", "_per_foot", "_over_starts")
"""What a measure has besides its value, as endings of its name."""

EPISODE = "an episode from the scene's own start is from_rest = '0.2 s'"
"""What to ask for instead of a settled motion."""

AnyDesign = Annotated[Grid | Sobol | Scattered | Saltelli, Field(discriminator="kind")]
"""How the runs of a sweep are spread over its axes."""

_AXIS: TypeAdapter[Any] = TypeAdapter(AnyAxis)
_AxisName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$")]


class Sweep(Description):
    """Runs of one scene over many values of some of its floats, and the measures that each is scored by.

    Axes are given as a list of values, as one of `Values`, `Linspace` and `Logspace` (or its table), or, in a design
    that draws values, as the `tarsus.fit.Unknown` that a fit takes; unit strings are read in the unit of the float they
    are for.

    Raises
    ------
    InputError
        With every problem: unknown paths and measures (and the nearest valid ones), values that the scene refuses,
        more runs than `MOST_RUNS`.
    """

    name: str = Field(min_length=1, description="what the sweep is called")
    scene: Scene
    duration: MaybeAmount = quantity(
        "s", "model time of every run; the scene's own when absent, of a settled motion 1 s or more", default=None, gt=0
    )
    starts: int | None = Field(
        default=None, ge=1, description="of every settled motion, which walkers are measured by; 4 unless given"
    )
    from_rest: MaybeAmount = quantity(
        "s",
        "measure an episode of so long from the scene's own start, what is counted by drive period without the first "
        "third of them",
        default=None,
        gt=0,
    )
    vary: Annotated[dict[_AxisName, AnyAxis], AfterValidator(FrozenDict)] = Field(
        description="axes by name: the path of a float, or any name for several paths together"
    )
    design: AnyDesign = Grid()
    measures: tuple[str, ...] = Field(description="measures that are scored")
    chunk: int | str = Field(
        default=CHUNK,
        description="runs in a unit of work, which is kept or done again whole; or the time that one takes, `2 s`",
    )
    draw: tuple[str, ...] = Field(
        default=(),
        description="what an atlas over its two axes draws on the map: studies by name, tables in the file's folder",
    )

    @field_validator("chunk")
    @classmethod
    def _unit(cls, value: int | str) -> int | str:
        if isinstance(value, int):
            if value < 1:
                raise PathErrors([("", f"expected a number of runs of at least 1, or a time, got {value}")])
            return value
        try:
            seconds = parse_quantity(value, "s")
        except InputError as error:
            raise PathErrors([("", f"expected a number of runs, or a time: {error}")]) from None
        if not 0.0 < seconds <= LONGEST_UNIT:
            raise PathErrors([("", f"expected a time above 0 and at most {LONGEST_UNIT:g} s, got {value}")])
        return f"{seconds!r} s"

    @field_validator("vary", mode="before")
    @classmethod
    def _axes(cls, value: Any, info: ValidationInfo) -> Any:
        """Axes in SI, checked against the scene."""
        scene = info.data.get("scene")
        if scene is None or not isinstance(value, Mapping):
            return value
        if not value:
            raise PathErrors([("", "expected at least one path with its values, got none")])
        known = float_paths(scene)
        axes: dict[str, SweepAxis] = {}
        owner: dict[str, str] = {}
        faults: list[tuple[str, str]] = []
        for name, item in value.items():
            paths = _paths(scene, name, item)
            wrong = [fault for path in paths for fault in _path_faults(scene, known, name, path)]
            wrong += [(name, f"'{path}' varies on axis '{owner[path]}' already") for path in paths if path in owner]
            owner.update({path: name for path in paths})
            if not wrong and len({known[path].unit for path in paths}) > 1:
                wrong = [(name, "paths that vary together must be of one unit")]
            if wrong:
                faults += wrong
                continue
            try:
                moved = () if paths == (name,) else paths
                axes[name] = _AXIS.validate_python(_in_si(item, known[paths[0]].unit, moved))
            except ValidationError as error:
                faults += [(_join(name, path), text) for path, text in located_faults(AnyAxis, error)]
            except PathErrors as error:
                faults += [(_join(name, path), text) for path, text in error.faults]
        if not _ends_are_taken(scene, value, axes):
            for name, axis in axes.items():
                faults += _bound_faults(scene, name, _paths(scene, name, value[name]), axis)
        if faults:
            order = list(value)
            raise PathErrors(
                sorted(faults, key=lambda one: min(i for i, name in enumerate(order) if one[0].startswith(name)))
            )
        return axes

    @field_validator("measures")
    @classmethod
    def _known_measures(cls, value: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        scene = info.data.get("scene")
        if scene is None:
            return value
        names = Run.offered(scene, scene.duration)
        if not value:
            raise PathErrors([("", f"expected at least one measure, got none{nearest('', names)}")])
        faults = [(str(i), no_measure(name, names)) for i, name in enumerate(value) if name not in names]
        faults += [(str(i), f"'{name}' is named twice") for i, name in enumerate(value) if name in value[:i]]
        if faults:
            raise PathErrors(faults)
        return value

    @model_validator(mode="after")
    def _check(self) -> Sweep:
        taken = {*FILED, *(f"{name}{of}" for name in self.measures for of in ("", *RESULTS))}
        faults = self._motion_faults()
        if faults:
            raise PathErrors(faults)
        faults = [
            (f"vary.{name}", "is a name of the results; give the axis another one")
            for name in self.vary
            if name in taken
        ]
        faults += [(f"vary.{path}", text) for path, text in self.design.faults(self.vary)]
        if not faults and self.runs > MOST_RUNS:
            faults = [("vary", f"{self.runs} runs are asked for, and at most {MOST_RUNS:.0e} are allowed")]
        if said := too_long(self.scene, self.seconds):
            faults.append(("duration", said))
        if faults:
            raise PathErrors(faults)
        return self

    def _motion_faults(self) -> list[tuple[str, str]]:
        """Why measures cannot be taken over what is asked for."""
        try:
            motion = self.motion
        except InputError as error:
            return [(problem.path, problem.said) for problem in error.problems]
        if isinstance(motion, FromRest):
            return []
        paths = [path for name in self.vary for path in self.paths(name) if path.startswith("initial.")]
        return [(f"vary.{path}", f"a settled motion has starts of its own; {EPISODE}") for path in paths] + [
            (f"measures.{i}", f"'{name}' is of a whole run from its start, which a settled motion has not; {EPISODE}")
            for i, name in enumerate(self.measures)
            if name in OF_EPISODES
        ]

    @property
    def motion(self) -> Motion:
        """What measures are taken over: of a walker, and where starts are given, the settled motion from these; else,
        or with `from_rest`, an episode from the scene's own start."""
        walks = isinstance(self.scene.robot.structure, Walker)
        if not walks and self.starts is None and self.from_rest is None:
            return FromRest(self.scene.duration if self.duration is None else self.duration)
        if self.from_rest is not None:
            return motion_asked(0.0, self.starts, self.duration, self.from_rest)
        return motion_asked(self._slowest(), self.starts, self.duration)

    def _slowest(self) -> float:
        """The longest drive period [s] that occurs: of a scene without one no motion settles."""
        from tarsus.orbits.returns import drive_period

        timed = {
            path: axis.ends[0]
            for name, axis in self.vary.items()
            for path in self.paths(name)
            if path.endswith(".frequency")
        }
        try:
            return drive_period(with_values(self.scene, timed) if timed else self.scene)
        except InputError as error:
            raise InputError([f"{one}; {EPISODE}" for one in error.problems]) from None

    @property
    def seconds(self) -> float:
        """Longest model time of a run [s]."""
        return self.motion.duration

    @property
    def runs(self) -> int:
        """Number of runs, nr."""
        return self.design.runs(self.vary)

    def points(self, part: slice | None = None) -> dict[str, Floats]:
        """Values (k,) of the runs of a part, by axis; without one of all runs."""
        return self.design.points(self.vary, part if part is not None else slice(0, self.runs))

    def paths(self, axis: str) -> tuple[str, ...]:
        """Paths that take the values of an axis."""
        return self.vary[axis].paths or (axis,)


def _join(name: str, path: str) -> str:
    return f"{name}.{path}" if path else name


def _is_unknown(item: Any) -> bool:
    """Whether an axis is given as a `tarsus.fit.Unknown`, which is not loaded for that: a fit needs scipy, and a short
    task of an array notices."""
    return all(hasattr(item, name) for name in ("low", "high", "scale", "targets"))


def _paths(scene: Scene, name: str, item: Any) -> tuple[str, ...]:
    """Paths that an axis is over: those given, or of its name; a short word is all that it stands for."""
    given: Any = ()
    if _is_unknown(item):
        given = item.targets
    elif isinstance(item, SweepAxis):
        given = item.paths
    elif isinstance(item, Mapping):
        given = item.get("paths", ())
    words = scene.short_words()
    asked = tuple(map(str, given)) if isinstance(given, (list, tuple)) and given else (name,)
    return tuple(path for one in asked for path in words.get(one, (one,)))


def _path_faults(scene: Scene, known: Mapping[str, FloatInfo], name: str, path: str) -> list[tuple[str, str]]:
    """Why a path cannot vary."""
    where = name if path == name else f"{name}.paths"
    if path == "duration":
        return [(where, "every run of a sweep has one duration; give it as the sweep's own")]
    if path in known:
        return []
    try:
        found = get_value(scene, path)
    except InputError as error:
        text = str(error)
        return [(where, text.removeprefix(f"{path}: ") if path == name else text)]
    if found is None:
        return [(where, f"'{path}' is not set in the scene, so it has no value to vary: set it first")]
    return [(where, f"'{path}' is no single number with a fraction; only such values vary")]


def _in_si(item: Any, unit: str, paths: tuple[str, ...]) -> Any:
    """An axis as given, with its quantities as SI floats; an unknown's range is one, on its scale."""
    if _is_unknown(item):
        item = {"kind": "logspace" if item.scale == "log" else "linspace", "start": item.low, "stop": item.high}
    if isinstance(item, SweepAxis):
        return with_values(item, {"paths": paths})
    if isinstance(item, np.ndarray):
        item = item.tolist()
    if isinstance(item, (list, tuple)):
        item = {"kind": "list", "values": item}
    if not isinstance(item, Mapping):
        raise PathErrors([("", f"expected a list of values, or a table with a 'kind', got {item!r}")])
    out = {**item, "paths": paths} if paths else dict(item)
    faults: list[tuple[str, str]] = []

    def convert(value: Any, path: str) -> Any:
        try:
            return parse_quantity(value, unit)
        except InputError as error:
            faults.append((path, str(error)))

    for key in ("start", "stop", "mean", "deviation"):
        if key in out:
            out[key] = convert(out[key], key)
    if isinstance(out.get("values"), (list, tuple)):
        if not out["values"]:
            faults.append(("", "expected at least one value, got an empty list"))
        out["values"] = [convert(value, str(i)) for i, value in enumerate(out["values"])]
    if faults:
        raise PathErrors(faults)
    return out


def _ends_are_taken(scene: Scene, asked: Mapping[str, Any], axes: Mapping[str, SweepAxis]) -> bool:
    """Whether the scene takes the ends of all axes at once: then each needs no check of its own, which for hundreds
    of axes takes seconds."""
    if len(axes) < 2:
        return False
    for end in (0, -1):
        every = {path: axis.ends[end] for name, axis in axes.items() for path in _paths(scene, name, asked[name])}
        try:
            with_values(scene, every)
        except InputError:
            return False
    return True


def _bound_faults(scene: Scene, name: str, paths: tuple[str, ...], axis: SweepAxis) -> list[tuple[str, str]]:
    """What the scene says against the ends of an axis; bounds are intervals, so the ends suffice."""
    problems: dict[str, None] = {}
    for end in dict.fromkeys(axis.ends):
        try:
            with_values(scene, dict.fromkeys(paths, end))
        except InputError as error:
            problems |= dict.fromkeys(error.problems)
    return [(name, text.removeprefix(f"{name}: ")) for text in problems]
