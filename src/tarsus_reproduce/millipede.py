"""The walking millipede against what the dissertation says of its simulations (section 4.4.1, Figs. 4.7-4.11).

Each trend is judged on the measure that the figure shows and on the others that its words could mean, over the packaged
study of the figure, by the rules of `tarsus_reproduce.trends`; replicates are the restitutions of Table 4.2. Captions
say maximum: such measures are of an episode from rest, all others of the settled motion, means over attractors by their
share of several starts. The named variants are packaged devices, each one interpretation of what is not printed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths, with_values
from tarsus.files.library import device_names, load_scene
from tarsus.measure import Measure
from tarsus.measure.walking import OF_EPISODES
from tarsus.model.structure import Walker
from tarsus.orbits.motion import FromRest, Motion, SettledMotion
from tarsus.solve import Run
from tarsus.study.studyfile import load_sweep
from tarsus.study.sweep import Sweep
from tarsus.study.workunit import OUTCOMES
from tarsus_reproduce.claims import FROM_REST, GROUNDS, TRENDS, FilmUnit, Trend, examples, of_episode, scored_trends
from tarsus_reproduce.trends import Finding, TrendCurve, TrendVerdict

if TYPE_CHECKING:
    from tarsus.model.scene import Scene
    from tarsus_reproduce.reproduction import Progress

VARIANTS = ("millipede", "millipede-table", "millipede-printed")
"""Devices that are judged when none is named, those that are installed."""

CHOSEN = "Chosen within the range of random readings so that the trends of section 4.4.1 come out."
"""What the provenance of a number says that was found by its score."""


@dataclass(frozen=True)
class Coarse:
    """Fewer runs of every figure's study: values of what varies, and restitutions."""

    values: int
    restitutions: tuple[float, ...]


@dataclass(frozen=True)
class Swept:
    """A figure's study run on one device.

    path, unit, x (nx,): what varies; replicates (nr,): restitutions, of Fig. 4.7 growths of adhesion; values, spreads
    (nx, nr) by measure, spreads from period to period and, of a settled motion, the standard error from start to start;
    motions: what each measure is taken over; settled: share of the starts that repeat; about: unit and definition of
    each measure; codes: how many runs ended how.
    """

    study: str
    path: str
    unit: str
    x: np.ndarray
    replicates: np.ndarray
    values: dict[str, np.ndarray]
    spreads: dict[str, np.ndarray]
    about: dict[str, Measure]
    codes: dict[str, int]
    motions: dict[str, Motion]
    settled: float | None = None

    def curve(self, measure: str) -> TrendCurve:
        """One measure over what varies."""
        return TrendCurve(self.x, self.values[measure], self.spreads[measure])

    def to_dict(self) -> dict[str, Any]:
        """Plain data in SI."""
        return {
            "path": self.path,
            "unit": self.unit,
            "x": self.x.tolist(),
            "replicates": self.replicates.tolist(),
            "motions": {name: str(one) for name, one in self.motions.items()},
            "settled": self.settled,
            "measures": {name: values.tolist() for name, values in self.values.items()},
        }


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


@dataclass(frozen=True)
class Score:
    """How many of the 16 trends have each verdict, and of the directional ones how many agree."""

    agree: int
    contradict: int
    insensitive: int
    not_determined: int
    directional_agree: int
    directional_total: int

    @classmethod
    def of(cls, verdicts: Sequence[tuple[TrendVerdict, bool]]) -> Score:
        """From verdicts and whether each is of a directional trend."""
        plain = [verdict for verdict, _ in verdicts]
        return cls(
            *(plain.count(one) for one in TrendVerdict),
            directional_agree=sum(verdict is TrendVerdict.AGREES for verdict, way in verdicts if way),
            directional_total=sum(way for _, way in verdicts),
        )

    @property
    def total(self) -> int:
        """Number of trends."""
        return self.agree + self.contradict + self.insensitive + self.not_determined


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
        return Score.of([(one.finding.verdict, one.trend.directional) for one in judged if self.scores(one.trend)])

    @property
    def motions(self) -> tuple[str, str]:
        """What the two scores are of, in words."""
        told = [one for swept in self.swept for one in swept.motions.values()]
        kinds = (FromRest, SettledMotion)
        first, last = ([str(one) for one in told if isinstance(one, kind)] for kind in kinds)
        return next(iter(first), ""), next(iter(last), "")

    @property
    def about(self) -> str:
        """What the device is, in short."""
        start = "standing" if stands(self.scene) else "with springs relaxed"
        ratio = damping_ratio(self.scene)
        chosen = sum(CHOSEN in origin.note for origin in self.scene.provenance.values())
        told = (
            f"{chosen} of its numbers were chosen within the range of random readings so that these trends come out: "
            "its score is no validation"
        )
        return f"damping ratio of (4.3) {ratio:.2g}, film in the {self.film.value} reading, started {start}" + (
            f"; {told}" if chosen else ""
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

    def to_dict(self) -> dict[str, Any]:
        """Plain data in SI."""
        return {
            **vars(self.score),
            "motion": self.motions[0],
            "settled": None if self.lasting is None else {**vars(self.lasting), "motion": self.motions[1]},
            "about": self.about,
            "film_reading": self.film.value,
            "trends": [
                {
                    "figure": one.trend.figure,
                    "quantity": one.trend.quantity,
                    "says": one.trend.says,
                    "directional": one.trend.directional,
                    "scored": one.of_figure and self.scores(one.trend),
                    "measure": one.measure,
                    "unit": one.unit,
                    "motion": str(one.motion),
                    **one.finding.to_dict(),
                }
                for one in self.trends
            ],
            "curves": {one.study: one.to_dict() for one in self.swept},
        }


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
    devices: str | Sequence[str] | None = None,
    *,
    duration: float | None = None,
    coarse: Coarse | None = None,
    progress: Progress | None = None,
) -> tuple[DeviceTrends, ...]:
    """Run every figure's study on devices, and judge them.

    devices: names or files of walkers whose ground has film, electrostatics, adhesion and restitution, by default the
    variants of `VARIANTS` that are installed; duration: of every episode [s], by default that of the studies;
    coarse: fewer values than the studies have. Raises InputError for an unknown device, one that is no walker, and one
    without a law that varies.
    """
    if devices is None:
        devices = [name for name in VARIANTS if name in device_names()]
    names = (devices,) if isinstance(devices, str) else tuple(devices)
    scenes = {name: load_scene(name) for name in names}
    done = []
    for number, (name, scene) in enumerate(scenes.items()):

        def say(k: int, of: int, study: str, number: int = number, name: str = name) -> None:
            if progress is not None:
                progress(number * of + k, len(scenes) * of, f"{study}, {name}")

        done.append(judge_scene(name, scene, duration=duration, coarse=coarse, progress=say))
    return tuple(done)


def judge_scene(
    name: str,
    scene: Scene,
    *,
    duration: float | None = None,
    coarse: Coarse | None = None,
    scored_only: bool = False,
    progress: Progress | None = None,
) -> DeviceTrends:
    """Run and judge all figures on one scene; arguments and errors as for `judge_devices`.

    `scored_only` leaves out what does not enter the score of episodes: the film's other unit, other measures of a
    figure, and settled motions.
    """
    walker_of(scene)
    film = FilmUnit.of(scene)
    said = scored_trends(film) if scored_only else TRENDS
    sweeps = _sweeps(scene, film, _measured(said, scored_only), duration, coarse)
    swept: dict[str, Swept] = {}
    for number, (study, each) in enumerate(sweeps.items()):
        if progress is not None:
            progress(number, len(sweeps), study)
        swept[study] = _swept(study, each)
    trends = tuple(
        _judged(trend, measure, swept[trend.study])
        for trend in said
        for measure in trend.measures[: 1 if scored_only else None]
    )
    return DeviceTrends(name, scene, film, tuple(swept.values()), trends)


def _judged(trend: Trend, measure: str, swept: Swept) -> JudgedTrend:
    found = trend.claim.judge(swept.curve(measure))
    return JudgedTrend(trend, measure, swept.about[measure].unit, found, swept.motions[measure])


def _measured(said: Sequence[Trend], scored_only: bool) -> dict[str, tuple[str, ...]]:
    """The studies of trends, each with the measures that it is run for: all that it has, which is the empty tuple, or
    those that are scored."""
    needed: dict[str, tuple[str, ...]] = {}
    for trend in said:
        own = needed.get(trend.study, ())
        new = scored_only and trend.measures[0] not in own
        needed[trend.study] = (*own, trend.measures[0]) if new else own
    return needed


def _sweeps(
    scene: Scene, film: FilmUnit, studies: Mapping[str, tuple[str, ...]], duration: float | None, coarse: Coarse | None
) -> dict[str, list[Sweep]]:
    """Studies on a scene, by name, with the measures given there, or their own: those of a whole run from rest, and
    those of a drive period over the settled motion."""
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
    found = Swept(study, path, float_paths(first.scene)[path].unit, x, replicates, {}, {}, {}, {}, {})
    settled = None
    for sweep in sweeps:
        arrays, about, motion = score_runs(sweep), Run.offered(sweep.scene, sweep.seconds), sweep.motion
        spread = arrays["spread"]
        if isinstance(motion, SettledMotion):
            settled = float(arrays["settled"].mean())
            spread = np.hypot(np.nan_to_num(spread), arrays["over_starts"] / np.sqrt(motion.starts))
        for j, measure in enumerate(sweep.measures):
            whole = isinstance(motion, FromRest) and measure not in OF_EPISODES
            name = measure + FROM_REST if whole else measure
            found.values[name] = arrays["value"][:, j].reshape(len(x), len(replicates))
            found.spreads[name] = spread[:, j].reshape(len(x), len(replicates))
            found.about[name], found.motions[name] = about[measure], motion
        counts = np.bincount(arrays["code"], minlength=len(OUTCOMES)).tolist()
        for name, count in zip(OUTCOMES, counts, strict=True):
            if count:
                found.codes[name] = found.codes.get(name, 0) + count
    return replace(found, settled=settled)
