"""The verb `tarsus.explore`: a page with the engine inside, whose sliders change a scene's numbers."""

from __future__ import annotations

import base64
import gzip
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from tarsus.base.arguments import FilePath, Ranges
from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.events import EVENT_WORDS, IMPACTS, EventKind
from tarsus.base.spec import by_path, float_paths, paths_of, with_values
from tarsus.base.units import parse_quantity
from tarsus.base.verb import verb
from tarsus.files.draws import read_draws
from tarsus.files.library import SceneLike, as_scene, load_scene
from tarsus.measure import Counting
from tarsus.model.scene import Scene, seconds_of
from tarsus.plan.lowering import REFUSALS
from tarsus.report.figures import GROUND, MOST_FEET
from tarsus.report.motion import Held, Motion
from tarsus.report.packing import script_text
from tarsus.report.pages import Fold, Section, asset, marked, rendered, sections_page, sources, write_page
from tarsus.report.panels import Bars, DrawnLine, Sign, TimePanel, panels_html
from tarsus.report.player import walk_figure
from tarsus.report.style import BLUE, CONTACT, CYCLE, GREEN, INK, MUTED, PURPLE, VERMILION
from tarsus.report.walk_figures import contact_panel, distinct_drives
from tarsus.solve import Explored, Run, compiled_engine, engine_bytes, simulate
from tarsus.tables.numbers import amount, spaced

POINTS, POINTS_OF_MANY = 1000, 600
"""Samples of the figures, and of those of a robot with more feet than figures show."""
FILM = 240
"""Frames of the moving picture before the first run."""
OTHERS = """These are no sliders here. A number of a drive becomes one with
<code>tarsus explore {} -o explore.html --drive PATH</code>, three at most; all others are set with
<code>--set PATH=VALUE</code> before the page is made, as those that enter tables of the structure."""


ENDINGS = (".html",)
"""Of the file of a page."""


@verb
def explore(
    scene: SceneLike,
    output: str | os.PathLike[str] | None = None,
    *,
    duration: float | str | None = None,
    over: Ranges | FilePath | None = None,
    drive: Sequence[str] | None = None,
) -> Explorer:
    """Make an explorer of a scene: one page that works offline, with the engine inside and a slider for every number
    that is data of a run.

    Parameters
    ----------
    scene
        A device's name, a scene file's path, or a `Scene`.
    output
        The file, ending in .html; in Python nothing is written without it.
    duration
        How long each run is [s], or a text with a unit; the scene's own when left out.
    over
        Ends of sliders, (low, high) by path, numbers in SI or texts with units; or a ``draws.npz`` of
        `tarsus identify`, whose 95 % intervals they are. All others go over the interval of their
        provenance, or a factor to either side.
    drive
        Numbers of signals, gaits or drives that are sliders, three at most; by default amplitude, frequency and duty.

    Returns
    -------
    Explorer
        What was made: `html`, `write`, its sliders, `run` of values; in a notebook the page itself.

    Raises
    ------
    InputError
        As `tarsus.simulate`; for an unknown path or an empty range; for more contact modes than a page
        holds (nine feet of a robot that is no walker have 512); and, where a page is made, where the engine for
        pages can be neither found nor compiled.

    Examples
    --------
    >>> import tarsus as ts
    >>> knobs = ts.explore("cantilever", duration="20 ms", drive=["signals.pzt.amplitude"])
    >>> knobs
    <Explorer of cantilever: 8 sliders, 0.02 s>
    >>> value, low, high = knobs.sliders["ground.restitution.coefficient"]  # the interval of its provenance
    >>> low < value < high
    True
    >>> len(knobs.run({"robot.feet.tip.gap": 280e-6}).events)  # too far to be reached
    0
    """
    described = as_scene(scene)
    seconds = seconds_of(described, duration)
    turned = None if drive is None else [path for name in drive for path in paths_of(described, name)]
    explored = Explored.of(described, seconds, ranges=_ranges(described, over), drives=turned)
    found = Explorer(explored, scene if isinstance(scene, str) else "")
    if output is not None:
        found.write(output)
    return found


def _ranges(scene: Scene, over: Ranges | FilePath | None) -> dict[str, tuple[float, float]]:
    """Ends [SI] by path."""
    if over is None:
        return {}
    if not isinstance(over, Mapping):
        draws = read_draws(Path(over))
        return {
            path: (float(low), float(high))
            for path, column in draws.items()
            for low, high in [np.percentile(column, [2.5, 97.5])]
        }
    infos, found, faults = float_paths(scene), {}, []
    for path, ends in by_path(scene, over).items():
        if path not in infos:
            faults.append(f"{path}: the scene has no such number")
            continue
        low, high = (parse_quantity(end, infos[path].unit) for end in ends)
        if not low < high:
            faults.append(f"{path}: the range from {ends[0]} to {ends[1]} is empty")
        found[path] = low, high
    if faults:
        raise InputError(faults)
    return found


@dataclass(frozen=True)
class Explorer:
    """An explorer of a scene. name: of the device or scene file that it is, "" of a scene in memory; words: what was
    changed of it on a command line, by path."""

    explored: Explored
    name: str = ""
    words: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        one = self.explored
        return f"<Explorer of {one.scene.name}: {len(one.sliders)} sliders, {one.seconds:g} s>"

    @property
    def sliders(self) -> dict[str, tuple[float, float, float]]:
        """Value, low and high end [SI] of every slider, by the first of its paths."""
        return {one.paths[0]: (one.value, one.low, one.high) for one in self.explored.sliders}

    def run(self, values: Mapping[str, float] | None = None) -> Run:
        """The run that the page shows with values [SI] of its sliders, by their first paths."""
        one = self.explored
        return simulate(one.changed(values or {}), one.seconds, one.accuracy)

    def html(self) -> str:
        """The page. The first one compiles the engine for pages where nobody has, which takes a minute or two; raises
        InputError with the command to type where it cannot."""
        one = self.explored
        seconds = amount(one.seconds, "s")
        about = f"{seconds} of it, run anew by the engine in this page for every number that is turned."
        sections = [Section("The run", self.fragment()), self._left(), sources(one.scene.citations)]
        name, footer = one.scene.name, "Nothing is asked of any network."
        return sections_page(name, [about], sections, footer)

    def _left(self) -> Section | None:
        """The numbers that are no sliders, and how they are set."""
        left, scene = self.explored.left, self.name or "SCENE"
        if not left:
            return None
        paths = Markup(" ").join(Markup("<code>{}</code>").format(path) for path in left)
        return Section("Other numbers", marked(OTHERS, scene), Fold(f"{len(left)} numbers", marked("{}", paths)))

    def fragment(self) -> Markup:
        """The explorer as a part of a page."""
        wasm = compiled_engine()
        shown = Shown(self.explored)
        return rendered(
            "explorer.html",
            player=walk_figure(shown.motion),
            charts=shown.charts,
            info=script_text(self.info(shown)),
            wasm=_compressed(wasm),
            packet=_compressed(self.explored.packet),
            worker=Markup(asset("engine.js", "page", "tarsus.core") + asset("explorer_worker.js")),
        )

    def write(self, output: str | os.PathLike[str]) -> Path:
        """Write the page and return its path. Raises InputError for a name that does not end in .html, and where it
        cannot be written."""
        if Path(output).suffix.lower() not in ENDINGS:
            raise InputError(f"'{output}': expected a name ending in {', '.join(ENDINGS)}")
        return write_page(self.html(), Path(output))

    def widget(self) -> Any:
        """The page as a widget of a notebook (extra `notebook`). values [SI]: of the sliders that are turned, by the
        first path of each, read and set from here; measures [SI]: of the run that is shown, by name, None where there
        is none; ``run()``: that run, made here.

        Raises InputError without the package anywidget, and as `html`; the widget TraitError for values that the page
        cannot show.
        """
        try:
            import anywidget
            import traitlets
        except ModuleNotFoundError:
            raise InputError("a widget needs the package anywidget: pip install anywidget") from None
        whole = self

        class ExplorerWidget(anywidget.AnyWidget):
            _esm = asset("widget.js")
            page = traitlets.Unicode(self.html()).tag(sync=True)
            values = traitlets.Dict().tag(sync=True)
            measures = traitlets.Dict().tag(sync=True)

            @traitlets.validate("values")
            def _checked(self, proposal: Any) -> dict[str, float]:
                values = proposal["value"]
                try:
                    whole.explored.changed(values)
                    whole.explored.place(values)
                except InputError as error:
                    raise traitlets.TraitError(str(error)) from None
                return values

            def run(self) -> Run:
                return whole.run(self.values)

        return ExplorerWidget()

    def _repr_html_(self) -> str:
        """The page in a frame of its own, which a notebook keeps; without the engine for pages its words alone."""
        if engine_bytes() is None:
            return str(Markup.escape(repr(self)))
        text = Markup.escape(self.html())
        return f'<iframe srcdoc="{text}" style="width:100%;height:60rem;border:0" title="explorer"></iframe>'

    def info(self, shown: Shown) -> dict[str, Any]:
        """What the page's script knows of the scene."""
        one = self.explored
        load, given = self._loaded()
        command = f'tarsus simulate {self.name or "SCENE"} --duration "{one.seconds!r} s"'
        counted = Counting.of(float(one.rows.periods[0])).words()
        return {
            "sliders": [_slider(each) for each in one.sliders],
            "seconds": one.seconds,
            "feet": list(one.scene.robot.feet),
            "drives": list(one.scene.robot.drives),
            "legs": shown.legs,
            "panels": shown.panels,
            "body": list(shown.coordinates),
            "columns": one.columns,
            "points": shown.points,
            "kinds": [EVENT_WORDS.get(kind, "") for kind in range(max(EventKind) + 1)],
            "impacts": [int(kind) for kind in IMPACTS],
            "codes": list(one.sentences),
            "faults": [REFUSALS[word] for word in one.faults],
            "measures": [
                {
                    "name": name,
                    "words": spaced(name),
                    "unit": of.unit,
                    "definition": of.words.format(span="drive period", **counted),
                }
                for name, of in one.definitions.items()
            ],
            "falling": list(one.scene.ground.falling),
            "command": command,
            "words": dict(self.words),
            "load": load,
            "given": given,
        }

    def _loaded(self) -> tuple[str, dict[str, float]]:
        """How Python has the scene: an expression, and the numbers that differ from it."""
        scene = self.explored.scene
        if not self.name:
            return "scene", {}
        try:
            base = load_scene(self.name)
        except InputError:  # with laws of the user
            return "scene", {}
        own = {path: of.value for path, of in float_paths(base).items()}
        given = {path: of.value for path, of in float_paths(scene).items() if own.get(path, of.value) != of.value}
        if given and with_values(base, given).robot != scene.robot:
            return "scene", {}
        return f'ts.load_scene("{self.name}")', given


def small_explorer(run: Any) -> Markup:
    """An explorer of five sliders of the ground and the drive for the page of a run; nothing where the
    engine for pages was not built, or cannot hold the scene."""
    if engine_bytes() is None or not run.ok:
        return Markup("")
    try:
        return Explorer(Explored.of(run.scene, float(run.duration), few=True)).fragment()
    except InputError:  # more contact modes than a page holds, or none to begin with
        return Markup("")


def _slider(one: Any) -> dict[str, Any]:
    """What the page's script knows of a slider; what it has not is left out."""
    names = ("paths", "value", "unit", "doc", "low", "high", "log", "array", "stops", "turned")
    about = {name: getattr(one, name) for name in names if getattr(one, name) not in (None, ())}
    return about | {"name": _name(one.paths), "group": _group(one.paths[0]), "places": one.at}


def _name(paths: Sequence[str]) -> str:
    """A slider's name: of several alike numbers without the name of whom they belong to."""
    keys = [key for k, key in enumerate(paths[0].split(".")) if k > 0 and key not in ("feet", "drives", "laws")]
    if len(paths) > 1 and len(keys) > 1:
        return f"{spaced(keys[-1])} of {len(paths)}"
    return spaced(" ".join(keys))


def _group(path: str) -> str:
    head = path.split(".")[0]
    groups = {"ground": "Ground", "signals": "Drive", "gait": "Gait", "initial": "Start"}
    return groups.get(head, "Feet" if path.startswith("robot.feet.") else "Drive")


LEVEL = 5
"""How hard gzip tries. A report takes 44 ms for it in place of 148 at level 9, and is 1 % longer; a packet of thirty
legs takes 47 ms in place of 842, and a page of them is 6 % longer."""


def _compressed(data: bytes) -> Markup:
    return Markup(base64.b64encode(gzip.compress(data, LEVEL, mtime=0)).decode())


class Shown:
    """What is drawn of a scene's own run, by the same rows of the engine that the page draws later ones by."""

    def __init__(self, explored: Explored) -> None:
        self.explored = explored
        scene = explored.scene
        self.walks = explored.body > 0
        self.coordinates = scene.robot.structure.body_coordinates if self.walks else ()
        self.feet = list(scene.robot.feet)
        self.points = POINTS if len(self.feet) <= MOST_FEET else POINTS_OF_MANY
        names = [foot.point for foot in scene.robot.feet.values()]
        structure: Any = scene.robot.structure
        self.leg_names = list(structure.legs) if self.walks else self.feet
        self.legs = (
            [names.index(leg) if leg in names else -1 for leg in self.leg_names]
            if self.walks
            else list(range(len(self.feet)))
        )
        self.panels: list[dict[str, Any]] = []

    @cached_property
    def motion(self) -> Motion:
        one = self.explored
        structure: Any = one.scene.robot.structure
        period = float(one.rows.periods[0])
        repeats = period < one.seconds
        whole = int(one.seconds / period * (1.0 + 1e-9))
        last = (max(whole - 8, 0) * period, whole * period) if repeats else (0.0, one.seconds)
        seen = one.seen(np.linspace(*last, FILM))
        hips = (
            [[leg.x, leg.y, leg.z] for leg in structure.legs.values()]
            if self.walks
            else [[0.0, 0.0, 0.0]] * len(self.feet)
        )
        places = np.array(hips, dtype=float).reshape(-1, 3)

        def of_legs(series: Floats) -> Floats:
            none = np.zeros(series.shape[1])
            return np.stack([series[foot] if foot >= 0 else none for foot in self.legs])

        return Motion(
            time=seen["time"],
            body=dict(zip(self.coordinates, seen["body"], strict=True)),
            legs=tuple(self.leg_names),
            hips=places,
            foot_x=of_legs(seen["foot_x"]) + places[:, :1],
            foot_z=of_legs(seen["gap"]),
            state=of_legs(seen["contact"]).astype(np.uint8),
            normal=of_legs(seen["contact_force"]),
            friction=of_legs(seen["friction_force"]),
            drives=tuple(one.scene.robot.drives),
            volts=seen["volts"],
            period=period if repeats else None,
            held=Held.LEGS if self.walks else Held.SPRINGS,
        )

    @cached_property
    def charts(self) -> Markup:
        """Figures of the whole run; `panels` says what their lines are."""
        end = self.explored.seconds
        seen = self.explored.seen(np.linspace(0.0, end, 2 * self.points // 3))
        made: list[TimePanel] = []

        def panel(height: float, words: str, of_unit: str, lines: Sequence[_Drawn], **others: Any) -> None:
            drawn = []
            for of, k, label, color, frozen in lines:
                values = np.full(len(seen["time"]), np.nan) if frozen else seen[of] if k is None else seen[of][k]
                drawn.append(DrawnLine(seen["time"], values, color, label, 1.0, GROUND if frozen else ()))
            made.append(TimePanel(height, words, self.explored.unit(of_unit), drawn, **others))
            self.panels.append({"lines": [[of, k, frozen] for of, k, _, _, frozen in lines]})

        drives, few = distinct_drives(self.motion), range(min(len(self.feet), MOST_FEET))
        colors = [INK] if len(drives) == 1 else CYCLE
        volts = [(label, row, colors[k]) for k, (label, row) in enumerate(drives)]
        panel(0.55, "drive", "volts", [("volts", row, label, color, False) for label, row, color in volts])
        if self.walks:
            panel(1.0, "travel", "foot_x", [("body", 0, "body", BLUE, False), ("body", 0, "A", MUTED, True)])
        feet = [(k, self.feet[k], CYCLE[k % len(CYCLE)]) for k in few]
        gaps: list[_Drawn] = [("gap", k, name, color, False) for k, name, color in feet]
        contact = [Sign("contact", CONTACT, area=True)] * (len(self.feet) == 1)
        panel(1.5, "gap", "gap", [*gaps, ("gap", 0, "A", MUTED, True)] if feet else [], signs=contact)
        if len(self.feet) > 1:
            bars = [Bars([], k - 0.35, k + 0.35, INK) for k in range(len(self.feet))]
            made.append(contact_panel(self.feet, bars, words="contact"))
            self.panels.append({"lines": [], "bars": True})
        named = [(k, name if len(feet) > 1 else "", color) for k, name, color in feet]
        forces: list[_Drawn] = [("contact_force", k, name, color, False) for k, name, color in named]
        panel(0.9, "force of ground", "contact_force", forces)
        energies = (
            ("kinetic_energy", "kinetic", VERMILION),
            ("elastic_energy", "elastic", GREEN),
            ("lost", "lost at impacts", PURPLE),
        )
        panel(1.0, "energy", "kinetic_energy", [(of, None, label, color, False) for of, label, color in energies])
        return panels_html(made, "Volts, gaps, forces and energies over time", (0.0, end))


_Drawn = tuple[str, int | None, str, str, bool]
"""A line of the explorer: of which series, which row of it, its name and colour, and whether it is of a frozen run."""
