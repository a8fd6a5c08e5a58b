"""A scene to be turned by sliders: its packet with what drives do at all their stops, and what a page shows of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.core import _native
from tarsus.core import arrays as a
from tarsus.measure.measure import Definition, Scope
from tarsus.measure.periods import PER_WINDOW
from tarsus.measure.walking import WALK
from tarsus.measure.whole import WHOLE_RUN
from tarsus.model.structure import Walker
from tarsus.plan.lowering import gravity_on
from tarsus.solve.channels import BODY, DRIVE, FOOT, ON_A_PAGE, channel
from tarsus.solve.codes import SENTENCES
from tarsus.solve.engine import SINGLE_RUN, Accuracy, Engine
from tarsus.solve.packet import on_a_page, packed, packet_arrays
from tarsus.solve.run import prepared
from tarsus.solve.shared import Shared
from tarsus.solve.sliders import Lattice, Slider, lattice_of, sliders_of

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus.plan.rows import Rows

_DEFINITIONS = {**WALK, **PER_WINDOW, **WHOLE_RUN}
"""Measures of runs by name."""
FEW, FEW_DRIVES = 5, 2
"""Sliders of a small explorer, and those of them that are of the drives."""


@dataclass(frozen=True)
class Explored:
    """A scene over some seconds, its sliders and their lattice; left: paths of numbers without a slider."""

    sentences = SENTENCES
    """What each of the engine's codes says."""

    scene: Scene
    seconds: float
    engine: Engine
    rows: Rows
    sliders: tuple[Slider, ...]
    left: tuple[str, ...]
    lattice: Lattice
    accuracy: Accuracy

    @classmethod
    def of(
        cls,
        scene: Scene,
        seconds: float,
        accuracy: Accuracy | None = None,
        *,
        ranges: Mapping[str, tuple[float, float]] | None = None,
        drives: Sequence[str] | None = None,
        few: bool = False,
    ) -> Explored:
        """Of a scene; ranges, drives: see `tarsus.solve.sliders.sliders_of`; few: five sliders alone.

        Raises InputError as `tarsus.simulate` and `sliders_of` do.
        """
        engine, rows = prepared(scene, {}, seconds, Shared())
        on_a_page(engine.plan)
        most = FEW_DRIVES if few else None
        sliders, left = sliders_of(scene, engine.plan, ranges or {}, drives, most)
        if few:
            sliders = _few(sliders)
        lattice = lattice_of(scene, engine.plan, rows, sliders, seconds)
        return cls(scene, seconds, engine, rows, tuple(sliders), tuple(left), lattice, accuracy or SINGLE_RUN)

    @property
    def body(self) -> int:
        """Coordinates of the structure that are those of a body."""
        structure = self.scene.robot.structure
        return structure.body_size if isinstance(structure, Walker) else 0

    @property
    def measures(self) -> tuple[str, ...]:
        """Names of the measures that a page shows."""
        return _native.WALK_MEASURES if self.body else _native.FOOT_MEASURES

    @property
    def definitions(self) -> dict[str, Definition]:
        """What they are, by name."""
        return {name: _DEFINITIONS[name] for name in self.measures}

    @cached_property
    def arrays(self) -> dict[str, Any]:
        """What the packet holds, by name. Raises InputError for more contact modes than a packet holds."""
        arrays = packet_arrays(self.scene, self.engine, self.rows, self.accuracy)
        system, lattice = self.engine.plan.system, self.lattice
        arrays |= {f"signals.{name}": of for name, of in lattice.pool.arrays.items()}
        structure = self.scene.robot.structure
        length = structure.length if isinstance(structure, Walker) else 0.0
        worst = [_DEFINITIONS[name].scope is Scope.WORST for name in self.measures]
        mass = structure.total_mass if isinstance(structure, Walker) else 0.0
        arrays |= {
            "measure.mass": [float(mass)],
            "measure.length": [float(length)],
            "measure.worst": np.array(worst, dtype=np.int64),
        }
        arrays |= {"seen.mass": system.mass, "seen.damping": system.damping, "seen.body": self.body}
        arrays |= {f"lattice.{name}": getattr(lattice, name) for name in ("channels", "shown", "periods", "drawn")}
        return arrays | self.row({})

    @cached_property
    def packet(self) -> bytes:
        """What the engine for pages runs."""
        return packed(self.arrays)

    @property
    def faults(self) -> tuple[str, ...]:
        """The engine's words for what a run cannot start with."""
        return tuple(_native.FAULTS)

    def shown(self, times: Floats, values: Mapping[str, float] | None = None) -> tuple[int, Floats, Floats, Floats]:
        """As the page's engine runs the packet with values of sliders: code, event rows, rows of what is shown at times
        [s], and measures (nq, 3): value, spread and n of each of `measures`."""
        packet = packed(self.arrays | self.row(values)) if values else self.packet
        found: tuple[int, Floats, Floats, Floats] = _native.Packaged(packet).show(times)
        return found

    @property
    def columns(self) -> list[tuple[str, int, bool]]:
        """Names of the channels that a page shows, how many columns each has in the rows of `shown`, and whether it has
        a row for each of several things."""
        counts = {"": 1, DRIVE: len(self.scene.robot.drives), FOOT: len(self.scene.robot.feet), BODY: self.body}
        each = [(name, channel(name).over) for name in ON_A_PAGE]
        return [(name, counts[over], bool(over)) for name, over in each]

    def unit(self, name: str) -> str:
        """Unit of what a page shows."""
        return channel(name).unit

    def seen(self, times: Floats) -> dict[str, Floats]:
        """What the page shows of the scene's own run at times (nt,) [s], by name of the channel, and ``lost`` [J]: at
        impacts up to then."""
        _, events, rows, _ = self.shown(times)
        names, counts, many = zip(*self.columns, strict=True)
        parts = zip(names, many, np.split(rows.T, np.cumsum(counts)[:-1]), strict=True)
        passed = np.searchsorted(np.maximum.accumulate(events[:, a.E_TIME]), rows[:, 0], side="right")
        lost = np.concatenate([[0.0], np.cumsum(events[:, a.E_ENERGY])])[passed]
        return {name: of if each else of[0] for name, each, of in parts} | {"lost": lost}

    def place(self, values: Mapping[str, float]) -> int:
        """Number of the combination of the drives' stops with values by path in place of the scene's own.

        Raises InputError for a value that is no stop.
        """
        at = 0
        for one in self.sliders:
            if one.stops:
                value = next((values[path] for path in one.paths if path in values), one.value)
                if value not in one.stops:
                    raise InputError(f"{one.paths[0]}: {value:g} {one.unit} is none of the values that were lowered")
                at = at * len(one.stops) + one.stops.index(value)
        return at

    def changed(self, values: Mapping[str, float]) -> Scene:
        """The scene with values of sliders, by the first path of each."""
        paths = {one.paths[0]: one.paths for one in self.sliders}
        if unknown := [path for path in values if path not in paths]:
            raise InputError([f"{path}: there is no such slider" for path in unknown])
        every = {own: value for path, value in values.items() for own in paths[path]}
        return with_values(self.scene, every) if every else self.scene

    def row(self, values: Mapping[str, float]) -> dict[str, Any]:
        """The numbers of the packet's row, by name, as a page writes them for values of sliders, by the first path of
        each."""
        names = ("parameters", "initial", "sources", "scales")
        out = {f"rows.{name}": np.array(getattr(self.rows, name)[0], dtype=float).ravel() for name in names}
        for one in self.sliders:
            if one.array and one.turned is None and one.paths[0] in values:
                out[one.array][list(one.at)] = values[one.paths[0]]
        if turning := [one for one in self.sliders if one.turned is not None]:
            falling = list(self.scene.ground.falling)
            for one in turning:
                falling[one.turned or 0] = values.get(one.paths[0], one.value)
            out["rows.sources"][list(turning[0].at)] = gravity_on(*falling)
        at = self.place(values)
        out["rows.scales"][2] = self.lattice.periods[at]
        lattice = self.lattice
        return out | {
            "rows.channels": lattice.channels[at],
            "rows.shown": lattice.shown[at],
            "rows.drawn": lattice.drawn[at : at + 1],
        }


def _few(sliders: Sequence[Slider]) -> list[Slider]:
    """The five that matter most: of the drives two, of the ground the rest."""
    drives = [one for one in sliders if one.stops]
    rest = [one for one in sliders if not one.stops and any(word in one.paths[0] for word in ("ground.", ".gap"))]
    first = sorted(rest, key=lambda one: next((k for k, word in enumerate(_GROUND) if word in one.paths[0]), 9))
    return [*first[: FEW - len(drives)], *drives]


_GROUND = (".gap", "restitution.coefficient", "film.coefficient", "friction.coefficient", "adhesion.initial")
