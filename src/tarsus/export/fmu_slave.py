"""The robot of scene.toml as a co-simulation slave of FMI 3.0, inside robot.fmu: needs tarsus where it runs."""

import atexit
import ctypes
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_OID, uuid5

import pythonfmu3 as fmi
from pythonfmu3 import Fmi3Causality, Fmi3Slave, Fmi3Status, Fmi3Variability

import tarsus as ts


class Real(fmi.Float64):
    """A number whose start is written to the last bit; 16 digits leave one out."""

    def get_start_str(self, value: Any, formatter: Any) -> str:
        return repr(float(value))


def _end_before_python(unit: Path) -> None:
    """Where the process is Python itself, let the unit's library give up Python with it: pythonfmu3 0.3.4 does so after
    its own state is gone, and now and then a process aborts as it ends."""
    if sys.platform == "linux" and sys.orig_argv:
        for file in unit.glob("binaries/*/robot.so"):
            library = ctypes.CDLL(str(file))  # loaded already
            if hasattr(library, "finalizePythonInterpreter"):
                atexit.register(library.finalizePythonInterpreter)


class RobotSlave(Fmi3Slave):
    """The one robot of a `tarsus.Session`, its volts held over each step."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        folder = Path(kwargs["resources"])
        _end_before_python(folder.parent)
        described = (folder / "scene.toml").read_text(encoding="utf-8")
        laws = [ts.load_laws(file) for file in sorted(folder.glob("laws/*.py"))]
        scene = ts.read_scene(folder / "scene.toml", laws={name: law for own in laws for name, law in own.items()})
        self.modelName, self.guid = "robot", uuid5(NAMESPACE_OID, described)
        self.description = scene.name.encode("unicode_escape").decode("ascii")
        proposed = json.loads((folder / "experiment.json").read_text(encoding="utf-8"))
        self.default_experiment = fmi.DefaultExperiment(0.0, **proposed)
        volt = fmi.Unit("V", kg=1, m=2, s=-3, A=-1)
        self.register_units([volt, fmi.Unit("m", m=1), fmi.Unit("rad", rad=1), fmi.Unit("s", s=1)])
        self.scene, self.session, self.begun = scene, ts.Session(scene), 0.0
        self.values: dict[str, float] = {}  # parameters that were set
        self.state = self.session.reset()
        self.volts = dict(zip(scene.robot.drives, map(float, self.state.volts), strict=True))
        self._declare()

    def _declare(self) -> None:
        """Variables: time, volts, parameters, outputs."""
        self._add(Real, ["time"], Fmi3Causality.independent, lambda: self.begun + self.state.time, unit="s")
        for name in self.volts:
            self._add(
                Real,
                ["volts", name],
                Fmi3Causality.input,
                lambda name=name: self.volts[name],
                unit="V",
                setter=lambda value, name=name: self.volts.update({name: value}),
            )
        for path in self.session.slots:
            if path.startswith(("ground.", "robot.feet.")):
                self._add(
                    Real,
                    path.split("."),
                    Fmi3Causality.parameter,
                    lambda path=path: self._value(path),
                    setter=lambda value, path=path: self._set_value(path, value),
                    variability=Fmi3Variability.fixed,
                )
        for kind, parts, unit, of in self._outputs():
            options = {"unit": unit} if unit else {}
            self._add(kind, parts, Fmi3Causality.output, lambda of=of: of(self.state), **options)

    def _outputs(self) -> Iterator[tuple[type, Sequence[str], str, Callable[[Any], Any]]]:
        """Types, names, units, and what they are of a state."""
        robot = self.scene.robot
        for i, name in enumerate(robot.feet):
            yield Real, ["gap", name], "m", lambda state, i=i: state.gaps[i]
            yield fmi.Boolean, ["contact", name], "", lambda state, i=i: state.contacts[i] != 0
            yield fmi.Boolean, ["slip", name], "", lambda state, i=i: state.contacts[i] == 2
        for point in robot.structure.points:
            yield Real, ["displacement", point], "m", lambda state, point=point: state.displacement(point)
        for name in robot.structure.body_coordinates:
            unit = "rad" if name in ("roll", "pitch") else "m"
            yield Real, ["body", name], unit, lambda state, name=name: state.body[name]
        yield fmi.Int32, ["code"], "", lambda state: state.code.number

    def _add(self, kind: Any, parts: Sequence[str], causality: Any, getter: Any, **options: Any) -> None:
        """A variable, its name structured by the standard's grammar: parts such as ``front-left`` in quotes."""
        name = ".".join(part if part.isidentifier() else f"'{part}'" for part in parts)
        options.setdefault("variability", Fmi3Variability.continuous if kind is Real else Fmi3Variability.discrete)
        self.register_variable(kind(name, causality=causality, getter=getter, **options))

    def _value(self, path: str) -> float:
        return self.values[path] if path in self.values else ts.get_value(self.scene, path)

    def _set_value(self, path: str, value: float) -> None:
        if value == self._value(path):
            return
        if self.state.time > 0.0:
            raise ts.InputError(f"{path}: a parameter is fixed once the robot has been stepped")
        self.values = {**self.values, path: value}
        self.session.vary = self.values
        self.state = self.session.reset()

    def setup_experiment(self, start_time: float) -> None:
        self.begun = start_time

    def do_step(self, current_time: float, step_size: float) -> fmi.Fmi3StepResult:
        try:
            self.state = self.session.step(self.volts, step_size)
        except ts.InputError as error:  # nothing has moved
            self.log(str(error), Fmi3Status.discard)
            return fmi.Fmi3StepResult(Fmi3Status.discard)
        if self.state.ok:
            return fmi.Fmi3StepResult(Fmi3Status.ok)
        self.log(str(self.state.code), Fmi3Status.warning)
        return fmi.Fmi3StepResult(Fmi3Status.warning, terminateSimulation=True)

    # what importers roll back to: a fork of the session

    def _get_fmu_state(self) -> dict[str, Any]:
        kept = {name: getattr(self, name) for name in ("state", "begun", "values")}
        return {**kept, "session": self.session.fork(), "volts": dict(self.volts)}

    def _set_fmu_state(self, state: Mapping[str, Any]) -> None:
        for name, of in {**state, "session": state["session"].fork(), "volts": dict(state["volts"])}.items():
            setattr(self, name, of)
