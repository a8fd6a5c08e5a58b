"""What an agent may tell a robot: volts, phases of a gait, or when to switch; each a number between -1 and 1."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.units import parse_quantity
from tarsus.model.drive.gait import CustomGait
from tarsus.model.drive.waveforms.on_off import OnOff

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

Floats = NDArray[np.float64]
Value = float | str
"""SI, or a text with a unit."""


class Action(ABC):
    """Base of what an agent may command robots at every step."""

    @abstractmethod
    def size(self, scene: Scene) -> int:
        """How many numbers between -1 and 1 a robot of the scene takes."""

    @abstractmethod
    def commands(self, scene: Scene, action: Floats, seconds: float) -> dict[str, Any]:
        """Arguments of `tarsus.Session.step` for actions (nr, size) of a step of so many seconds, by name."""

    def prepared(self, scene: Scene) -> Scene:
        """The scene as it has to be for these actions. Raises InputError where it cannot be."""
        return scene


@dataclass(frozen=True)
class VoltageAction(Action):
    """Volts of the drives, held for the step, or reached by a ramp: -1 is ``low``, 1 is ``high`` [V]; drives: by name,
    all unless given."""

    low: Value
    high: Value
    drives: Sequence[str] | None = None
    ramp: bool = False

    def __post_init__(self) -> None:
        _read(self, low="V", high="V")

    def size(self, scene: Scene) -> int:
        return len(_drives(scene, self.drives))

    def commands(self, scene: Scene, action: Floats, seconds: float) -> dict[str, Any]:
        volts = _between(self.low, self.high, action)
        return {"drive": dict(zip(_drives(scene, self.drives), volts.T, strict=True)), "ramp": self.ramp}


@dataclass(frozen=True)
class SwitchingAction(Action):
    """When each drive is switched on and off within the step: two numbers a drive, of which the smaller is when it goes
    to ``high`` and the larger when it goes back to ``low`` [V]; -1 is the begin of the step, 1 its end."""

    low: Value
    high: Value
    drives: Sequence[str] | None = None

    def __post_init__(self) -> None:
        _read(self, low="V", high="V")

    def size(self, scene: Scene) -> int:
        return 2 * len(_drives(scene, self.drives))

    def commands(self, scene: Scene, action: Floats, seconds: float) -> dict[str, Any]:
        names = _drives(scene, self.drives)
        shares = np.sort(_between(0.0, 1.0, action).reshape(len(action), len(names), 2), axis=2)
        lasts = np.diff(shares, axis=2, prepend=0.0, append=1.0) * seconds
        lasts = np.maximum(lasts, SHORTEST * seconds)
        levels = (float(self.low), float(self.high), float(self.low))
        out = {}
        for k, name in enumerate(names):
            out[name] = [OnOff(levels=levels, durations=tuple(own)) for own in lasts[:, k].tolist()]
        return {"drive": out}


SHORTEST = 1e-6
"""Part of a step below which nothing is switched: a nanosecond of a millisecond moves no robot."""


@dataclass(frozen=True)
class PhaseAction(Action):
    """Phases of the legs' gait, in periods: 0 and 1, which are the same, at -1 and 1; frequency [Hz] and duty: between
    two bounds as well, where they are given."""

    frequency: tuple[Value, Value] | None = None
    duty: tuple[Value, Value] | None = None

    def __post_init__(self) -> None:
        _read(self, frequency="Hz", duty="1")

    def prepared(self, scene: Scene) -> Scene:
        layout = scene.robot.layout()
        if scene.gait is None or layout is None:
            raise InputError("phases: the scene has no gait; command volts of its drives")
        if isinstance(scene.gait, CustomGait):
            return scene
        own = {name: getattr(scene.gait, name) for name in ("frequency", "low", "high", "duty", "swing_lag")}
        return scene.model_copy(update={"gait": CustomGait(**own, phases=scene.gait.delays(layout))})

    def _groups(self, scene: Scene) -> list[tuple[str, ...]]:
        """Legs that move together: those that one drive moves, and every other by itself."""
        layout = scene.robot.layout()
        assert layout is not None
        return layout.groups

    def size(self, scene: Scene) -> int:
        return len(self._groups(scene)) + (self.frequency is not None) + (self.duty is not None)

    def commands(self, scene: Scene, action: Floats, seconds: float) -> dict[str, Any]:
        groups = self._groups(scene)
        late = _between(0.0, 1.0, action[:, : len(groups)])
        out = {f"phases.{leg}": late[:, k] for k, group in enumerate(groups) for leg in group}
        at = len(groups)
        for name in ("frequency", "duty"):
            bounds = getattr(self, name)
            if bounds is not None:
                low, high = bounds
                out[name] = _between(low, high, action[:, at])
                at += 1
        return {"gait": out}


def _read(action: Action, **units: str) -> None:
    """Values of an action, or pairs of them, in SI, by the units of their names."""
    for name, unit in units.items():
        given = getattr(action, name)
        try:
            if isinstance(given, tuple | list):
                low, high = given
                object.__setattr__(action, name, (parse_quantity(low, unit), parse_quantity(high, unit)))
            elif given is not None:
                object.__setattr__(action, name, parse_quantity(given, unit))
        except InputError as error:
            raise InputError([f"{name}: {text}" for text in error.problems]) from None


def _between(low: Value, high: Value, action: Floats) -> Floats:
    return float(low) + (float(high) - float(low)) * 0.5 * (np.clip(action, -1.0, 1.0) + 1.0)


def _drives(scene: Scene, names: Sequence[str] | None) -> list[str]:
    known = list(scene.robot.drives)
    if names is None:
        return known
    if wrong := [name for name in names if name not in known]:
        raise InputError([f"drives: there is no drive '{name}'{nearest(name, known)}" for name in wrong])
    return list(names)
