"""The walking millipede against what the dissertation says of its simulations (section 4.4.1, Figs. 4.7-4.11).

Each trend is judged on the measure that the figure shows and on the others that its words could mean, over the packaged
study of the figure, by the rules of `tarsus_reproduce.trends`; replicates are the restitutions of Table 4.2. Captions
say maximum: such measures are of an episode from rest, all others of the settled motion, means over attractors by their
share of several starts. The named variants are packaged devices, each one interpretation of what is not printed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths, with_values
from tarsus.files.library import device_names, load_scene
from tarsus.measure.walking import OF_EPISODES
from tarsus.model.structure import Walker
from tarsus.orbits.motion import FromRest, Motion, SettledMotion
from tarsus.solve import Run
from tarsus.study.studyfile import load_sweep
from tarsus.study.sweep import Sweep
from tarsus.study.workunit import OUTCOMES
from tarsus_reproduce.claims import FROM_REST, GROUNDS, TRENDS, FilmUnit, Trend, examples, of_episode, scored_trends
from tarsus_reproduce.trends import Finding, TrendCurve, TrendVerdict, judge

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus_reproduce.reproduction import Progress

VARIANTS = ("millipede", "millipede-table", "millipede-printed")
"""Devices that are judged when none is named, those that are installed."""

CHOSEN = "Chosen within the range of random readings so that the trends of section 4.4.1 come out."
"""What the provenance of a number says that was found by its score."""

COUNTS = ("agree", "contradict", "insensitive", "not_determined", "directional_agree", "directional_total")
"""What a score counts: the 16 trends by verdict, and of the directional ones those that agree and all."""
Score = Mapping[str, int]
"""Numbers by the words of `COUNTS`."""


@dataclass(frozen=True)
class Coarse:
    """Fewer runs of every figure's study: values of what varies, and restitutions."""

    values: int
    restitutions: tuple[float, ...]


@dataclass(frozen=True)
class SweptMeasure:
    """A measure of a figure's study on one device: its unit, what it is taken over, and its curve; the spread is that
    from period to period and, of a settled motion, the standard error from start to start."""

    unit: str
    motion: Motion
    curve: TrendCurve


@dataclass(frozen=True)
class Swept:
    """A figure's study run on one device.

    path, unit, x (nx,): what varies; replicates (nr,): restitutions, of Fig. 4.7 growths of adhesion; codes: how many
    runs ended how; settled: share of the starts that repeat.
    """

    study: str
    path: str
    unit: str
    x: np.ndarray
    replicates: np.ndarray
    measures: Mapping[str, SweptMeasure]
    codes: Mapping[str, int]
    settled: float | None


@dataclass(frozen=True)
class JudgedTrend:
    """One trend, one measure, one verdict."""

    trend: Trend
    measure: str
    unit: str
    finding: Finding
    motion: Motion

    @property
    def lasting(self) -> bool:
        """Whether it is judged on the settled motion, by the first measure of it that the words could mean."""
        return self.measure == next(name for name in self.trend.measures if not of_episode(name))

    @property
    def of_figure(self) -> bool:
        """Whether the measure is the one that the figure shows."""
        return self.measure == self.trend.measures[0]


def score_of(verdicts: Sequence[tuple[TrendVerdict, bool]]) -> Score:
    """The score of verdicts, each with whether it is of a directional trend."""
    plain = [verdict for verdict, _ in verdicts]
    ways = [verdict for verdict, way in verdicts if way]
    counts = [*(plain.count(one) for one in TrendVerdict), ways.count(TrendVerdict.AGREES), len(ways)]
    return dict(zip(COUNTS, counts, strict=True))


@dataclass(frozen=True)
class DeviceTrends:
    """Everything of one device; trends: of all measures, and of the film's other unit, which is not scored."""

    name: str
    scene: Scene
    film: FilmUnit
    swept: tuple[Swept, ...]
    trends: tuple[JudgedTrend, ...]

    def scores(self, trend: Trend) -> bool:
        """Whether a trend is scored: no cause, and Fig. 4.9 in the device's own interpretation of the film's unit."""
        return trend in scored_trends(self.film)

    @property
    def score(self) -> Score:
        """By the measure of each figure."""
        return self._counted([one for one in self.trends if one.of_figure])

    @property
    def lasting(self) -> Score | None:
        """By the settled motion; None where that was not judged."""
        found = [one for one in self.trends if one.lasting]
        return self._counted(found) if found else None

    def _counted(self, judged: Sequence[JudgedTrend]) -> Score:
        return score_of([(one.finding.verdict, one.trend.directional) for one in judged if self.scores(one.trend)])

    @property
    def motions(self) -> tuple[str, str]:
        """What the two scores are of, in words."""
        motions = [one.motion for one in self.trends]
        first, last = ([str(one) for one in motions if isinstance(one, kind)] for kind in (FromRest, SettledMotion))
        return next(iter(first), ""), next(iter(last), "")

    @property
    def about(self) -> str:
        """What the device is, in short."""
        start = "standing" if stands(self.scene) else "with springs relaxed"
        ratio = damping_ratio(self.scene)
        chosen = sum(CHOSEN in origin.note for origin in self.scene.provenance.values())
        caution = (
            f"{chosen} of its numbers were chosen within the range of random readings so that these trends come out: "
            "its score is no validation"
        )
        return f"damping ratio of (4.3) {ratio:.2g}, film in the {self.film.value} reading, started {start}" + (
            f"; {caution}" if chosen else ""
        )

    @property
    def problems(self) -> list[str]:
        """Sentences about runs that did not reach their end."""
        return [
            f"{self.name}, {swept.study}: {count} runs: {OUTCOMES[name]}"
            for swept in self.swept
            for name, count in swept.codes.items()
            if name != "DONE"
        ]


def walker_of(scene: Scene) -> Walker:
    """The walker of a scene; InputError if it has none."""
    walker = scene.robot.structure
    if not isinstance(walker, Walker):
        raise InputError(f"{scene.name}: a millipede is a walker; this structure is of kind '{walker.kind}'")
    return walker


def damping_ratio(scene: Scene) -> float:
    """Damping ratio of (4.3): the body's share of two legs on one leg. Raises InputError for a scene without walker."""
    walker = walker_of(scene)
    leg = next(iter(walker.legs.values()))
    mass = 2.0 * walker.body.mass / len(walker.legs)
    return leg.damping_v / (2.0 * np.sqrt(leg.stiffness_v * mass))


def stands(scene: Scene) -> bool:
    """Whether the walker starts in equilibrium on its feet, for every payload anew, not with springs relaxed."""
    return scene.initial.standing is not None


def judge_devices(
    devices: str | Sequence[str] | None = None, *, progress: Progress | None = None
) -> tuple[DeviceTrends, ...]:
    """Run every figure's study on devices, and judge them.

    devices: names or files of walkers whose ground has film, electrostatics, adhesion and restitution, by default the
    variants of `VARIANTS` that are installed. Raises InputError for an unknown device, one that is no walker, and one
    without a law that varies.
    """
    if devices is None:
        devices = [name for name in VARIANTS if name in device_names()]
    names = (devices,) if isinstance(devices, str) else tuple(devices)
    scenes = {name: load_scene(name) for name in names}
    return tuple(judge_scene(name, scene, progress=progress) for name, scene in scenes.items())


def judge_scene(
    name: str,
    scene: Scene,
    *,
    duration: float | None = None,
    coarse: Coarse | None = None,
    scored_only: bool = False,
    progress: Progress | None = None,
) -> DeviceTrends:
    """Run and judge all figures on one scene; errors as for `judge_devices`.

    duration: of every episode [s], by default that of the studies; coarse: fewer values than the studies have;
    `scored_only` leaves out what does not enter the score of episodes: the film's other unit, other measures of a
    figure, and settled motions.
    """
    walker_of(scene)
    film = FilmUnit.of(scene)
    said = scored_trends(film) if scored_only else TRENDS
    pairs = [(trend, name) for trend in said for name in trend.measures[: 1 if scored_only else None]]
    wanted = {trend.study: {name: None for one, name in pairs if one.study == trend.study} for trend in said}
    sweeps = _sweeps(
        scene, film, {study: [*names] if scored_only else [] for study, names in wanted.items()}, duration, coarse
    )
    swept: dict[str, Swept] = {}
    for number, (study, each) in enumerate(sweeps.items()):
        if progress is not None:
            progress(number, len(sweeps), f"{study}, {name}")
        swept[study] = _swept(study, each)
    trends = []
    for trend, measure in pairs:
        one = swept[trend.study].measures[measure]
        trends.append(JudgedTrend(trend, measure, one.unit, judge(trend.claim, one.curve, trend.beyond), one.motion))
    return DeviceTrends(name, scene, film, tuple(swept.values()), tuple(trends))


def _sweeps(
    scene: Scene, film: FilmUnit, studies: Mapping[str, Sequence[str]], duration: float | None, coarse: Coarse | None
) -> dict[str, list[Sweep]]:
    """Studies on a scene, by name, with the measures given there, or all their own where none are: those of a whole
    run from rest, and those of a drive period over the settled motion."""
    sweeps: dict[str, list[Sweep]] = {}
    problems: list[str] = []
    for study, measures in studies.items():
        try:
            table = _grounds(scene, film) if study == GROUNDS else _packaged(study, scene, coarse)
            table["from_rest"] = duration or table["from_rest"]
            every = measures or table["measures"]
            whole = tuple(name.removesuffix(FROM_REST) for name in every if of_episode(name))
            rest = tuple(name for name in every if not of_episode(name))
            parts = [{"measures": whole}, {"measures": rest, "from_rest": None}]
            sweeps[study] = [Sweep(**{**table, **own}) for own in parts if own["measures"]]
        except InputError as error:
            problems += [f"{study}: {text.removeprefix('Sweep.vary.')}" for text in error.problems]
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    return sweeps


def _packaged(study: str, scene: Scene, coarse: Coarse | None) -> dict[str, Any]:
    """Fields of a packaged study on a scene."""
    packaged = load_sweep(study)
    table: dict[str, Any] = {name: getattr(packaged, name) for name in type(packaged).model_fields} | {"scene": scene}
    if coarse is not None:
        path, restitution = packaged.vary
        axis = packaged.vary[path].model_copy(update={"count": coarse.values})
        table["vary"] = {path: axis, restitution: list(coarse.restitutions)}
    return table


def _grounds(scene: Scene, film: FilmUnit) -> dict[str, Any]:
    """Fields of the study of Fig. 4.7 on a scene: ground (a), (b), and (a) with one number of (b)."""
    first, second = examples(film).values()
    names = ("vertical_amplitude", "stride")
    return {
        "name": GROUNDS,
        "scene": with_values(scene, first),
        "from_rest": scene.duration,
        "vary": {path: [value, second[path]] for path, value in first.items() if value != second[path]},
        "measures": (*(name + FROM_REST for name in names), *names),
    }


def _swept(study: str, sweeps: Sequence[Sweep]) -> Swept:
    """A study run over all that its measures are taken over."""
    from tarsus.study.sweeping import score_runs

    first = sweeps[0]
    path, other = first.vary
    x, replicates = (first.vary[name].values_on_grid() for name in (path, other))
    measures, codes, settled = dict[str, SweptMeasure](), dict[str, int](), None
    for sweep in sweeps:
        arrays, about, motion = score_runs(sweep), Run.offered(sweep.scene, sweep.seconds), sweep.motion
        spread = arrays["spread"]
        if isinstance(motion, SettledMotion):
            settled = float(arrays["settled"].mean())
            spread = np.hypot(np.nan_to_num(spread), arrays["over_starts"] / np.sqrt(motion.starts))
        for measure, *columns in zip(sweep.measures, arrays["value"].T, spread.T, strict=True):
            whole = isinstance(motion, FromRest) and measure not in OF_EPISODES
            y, own = (column.reshape(len(x), len(replicates)) for column in columns)
            named = measure + FROM_REST if whole else measure
            measures[named] = SweptMeasure(about[measure].unit, motion, TrendCurve(x, y, own))
        counts = np.bincount(arrays["code"], minlength=len(OUTCOMES)).tolist()
        codes |= {name: codes.get(name, 0) + n for name, n in zip(OUTCOMES, counts, strict=True) if n}
    return Swept(study, path, float_paths(first.scene)[path].unit, x, replicates, measures, codes, settled)
