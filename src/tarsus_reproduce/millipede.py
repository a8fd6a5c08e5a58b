"""The walking millipede against what the source says of its simulations (section 4.4.1, Figs. 4.7-4.11).

The source prints no numbers, only trends in words; `TRENDS` lists each. A trend is judged on the measure that the
figure shows and on the others that its words could mean, over the packaged study of the figure, by the rules of
`tarsus_reproduce.trends`; replicates are the restitutions of Table 4.2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tarsus.errors import InputError
from tarsus.files.library import load_scene
from tarsus.measure import STANDSTILL, Measure
from tarsus.scene import Scene
from tarsus.solve import Run, simulate
from tarsus.spec import float_paths, with_values
from tarsus.structure import Walker
from tarsus.study.scores import offered
from tarsus.study.studyfile import load_sweep
from tarsus.study.sweep import Sweep
from tarsus.study.sweeping import score_runs
from tarsus.study.workunit import OUTCOMES
from tarsus_reproduce.millipede_parameters import PAYLOAD_KNEE
from tarsus_reproduce.trends import (
    CRITERION,
    RELEVANT,
    Claim,
    Curve,
    Falls,
    Finding,
    HasExtrema,
    HasMaximum,
    Rises,
    Verdict,
)

__all__ = [
    "EXAMPLES",
    "TRENDS",
    "Comparison",
    "Example",
    "MillipedeValidation",
    "Outcome",
    "Swept",
    "Trend",
    "Variant",
    "damping_ratio",
    "validate_millipede",
    "variants_of",
]

RINGING = 0.05
"""Damping ratio of (4.3) in the variants that ring: assumed, the upper end of what thin-film structures have."""

Progress = Callable[[int, int, str], None]

ELECTROSTATICS, FILM, ADHESION, PAYLOAD = (
    "millipede-electrostatics",
    "millipede-film",
    "millipede-adhesion",
    "millipede-payload",
)


@dataclass(frozen=True)
class Trend:
    """One thing that the source says of a figure: of which quantity, over which packaged study, and what.

    measures: the one that the figure shows, then others that the words could mean.
    """

    figure: str
    study: str
    quantity: str
    claim: Claim
    measures: tuple[str, ...]

    @property
    def says(self) -> str:
        """What is said of the quantity: 'falls'."""
        return self.claim.words


_HEAVE = ("max_heave", "vertical_amplitude")
_TRAVEL = ("max_surge", "stride")
_BOUNCES = ("total_bounces", "impacts")
_CONTACT = ("longest_contact", "contact_duration")

TRENDS = (
    Trend("4.8", ELECTROSTATICS, "vertical amplitude of the body", Falls(), _HEAVE),
    Trend("4.8", ELECTROSTATICS, "vertical amplitude of the legs", Falls(), ("peak",)),
    Trend("4.8", ELECTROSTATICS, "travel", Falls(), _TRAVEL),
    Trend("4.8", ELECTROSTATICS, "number of bounces", Rises(), _BOUNCES),
    Trend("4.8", ELECTROSTATICS, "contact", Rises(), _CONTACT),
    Trend("4.8", ELECTROSTATICS, "vertical amplitude of the body", HasExtrema(), _HEAVE),
    Trend("4.8", ELECTROSTATICS, "number of bounces", HasExtrema(), _BOUNCES),
    Trend("4.8", ELECTROSTATICS, "contact", HasExtrema(), _CONTACT),
    Trend("4.9", FILM, "travel", HasMaximum(), _TRAVEL),
    Trend("4.10", ADHESION, "travel", HasMaximum(), _TRAVEL),
    Trend("4.10", ADHESION, "number of bounces", Falls(), _BOUNCES),
    Trend("4.11", PAYLOAD, "vertical amplitude of the body", Falls(), _HEAVE),
    Trend("4.11", PAYLOAD, "travel", Falls(), _TRAVEL),
    Trend("4.11", PAYLOAD, "number of bounces", Rises(), _BOUNCES),
    Trend("4.11", PAYLOAD, "contact beyond 0.2 mg", Falls(beyond=PAYLOAD_KNEE), _CONTACT),
)
"""Trends of section 4.4.1, in its order."""

EXAMPLES = {
    "a": {
        "ground.electrostatic.coefficient": 1e-17,
        "ground.film.coefficient": 1e-24,
        "ground.adhesion.rate": 1e-8,
        "ground.restitution.coefficient": 0.7,
    },
    "b": {
        "ground.electrostatic.coefficient": 1e-21,
        "ground.film.coefficient": 1e-24,
        "ground.adhesion.rate": 1e-2,
        "ground.restitution.coefficient": 0.7,
    },
}
"""Grounds of Fig. 4.7 in SI: C_e read as nN m^2/V^2 and C_sfd as uN m^2 s (E4), C_adh as N/s."""

MUCH = 2.0
"""A ratio that counts as 'much greater'."""


@dataclass(frozen=True)
class Variant:
    """One reading of the millipede: name, in what it differs, and its scene."""

    name: str
    about: str
    scene: Scene


@dataclass(frozen=True)
class Swept:
    """A figure's study run on one variant.

    path, unit, x (nx,): what varies; replicates (nr,): restitutions; values, spreads (nx, nr) by measure; about:
    unit and definition of each measure; codes: how many runs ended how.
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

    def curve(self, measure: str) -> Curve:
        """One measure over what varies."""
        return Curve(self.x, self.values[measure], self.spreads[measure])


@dataclass(frozen=True)
class Judged:
    """One trend, one measure, one verdict."""

    trend: Trend
    measure: str
    unit: str
    finding: Finding


@dataclass(frozen=True)
class Example:
    """One run of Fig. 4.7."""

    name: str
    run: Run

    @property
    def amplitude(self) -> float:
        """Vertical amplitude of the body after transients [m]."""
        return self.run.measures["vertical_amplitude"].value

    @property
    def stride(self) -> float:
        """Travel per drive period after transients [m]."""
        return self.run.measures["stride"].value


@dataclass(frozen=True)
class Comparison:
    """What the source says of two runs of Fig. 4.7, and the ratio of the body's vertical amplitudes [1]."""

    says: str
    verdict: Verdict
    ratio: float

    @property
    def words(self) -> str:
        """The ratio in words."""
        return f"{self.ratio:.3g} times" if np.isfinite(self.ratio) else "the other stands still"


@dataclass(frozen=True)
class Outcome:
    """Everything of one variant."""

    variant: Variant
    swept: tuple[Swept, ...]
    trends: tuple[Judged, ...]
    examples: tuple[Example, ...]
    comparisons: tuple[Comparison, ...]

    def count(self, verdict: Verdict) -> int:
        """How many trends, by the measure of the figure, have a verdict."""
        return sum(
            one.finding.verdict is verdict for one in self.trends if one.measure == one.trend.measures[0]
        )


@dataclass(frozen=True)
class MillipedeValidation:
    """All variants of a millipede."""

    device: str
    outcomes: tuple[Outcome, ...]

    @property
    def problems(self) -> list[str]:
        """Sentences about runs that did not reach their end."""
        bad = []
        for outcome in self.outcomes:
            for swept in outcome.swept:
                bad += [
                    f"{outcome.variant.name}, {swept.study}: {count} runs: {OUTCOMES[name]}"
                    for name, count in swept.codes.items()
                    if name != "DONE"
                ]
            bad += [
                f"{outcome.variant.name}, Fig. 4.7({one.name}): {one.run.code}"
                for one in outcome.examples
                if not one.run.ok
            ]
        return bad

    @property
    def ok(self) -> bool:
        """True when every run reached its end; contradictions are no failure."""
        return not self.problems

    def to_dict(self) -> dict[str, Any]:
        """Plain data in SI."""
        return {
            "experiment": "millipede",
            "device": self.device,
            "ok": self.ok,
            "criterion": CRITERION,
            "variants": [_plain(outcome) for outcome in self.outcomes],
        }


def damping_ratio(scene: Scene) -> float:
    """Damping ratio of (4.3): the body's share of two legs on one leg.

    Raises
    ------
    InputError
        If the scene has no walker.
    """
    walker = _walker(scene)
    leg = next(iter(walker.legs.values()))
    mass = 2.0 * walker.body.mass / len(walker.legs)
    return leg.damping_v / (2.0 * np.sqrt(leg.stiffness_v * mass))


def variants_of(scene: Scene) -> tuple[Variant, ...]:
    """A millipede as described; where (4.3) does not ring, one that does; and that one without adhesion.

    Raises
    ------
    InputError
        If the scene has no walker.
    """
    ratio = damping_ratio(scene)
    found = [Variant("as described", f"the device as it is; damping ratio of (4.3) {ratio:.2g}", scene)]
    rings = scene
    if ratio > RINGING:
        factor = RINGING / ratio
        legs = _walker(scene).legs
        rings = with_values(
            scene,
            {f"robot.structure.legs.{name}.damping_v": factor * leg.damping_v for name, leg in legs.items()},
        )
        about = (
            f"vertical damping of every leg times {factor:.2g}, so that (4.3) has the damping ratio {RINGING:g} and "
            "rings, as an answer with a governing frequency (Fig. 4.4) does; an assumption against Table 4.1"
        )
        found.append(Variant("ringing", about, rings))
    if scene.ground.adhesion is not None:
        about = (
            "the ringing one on a ground without adhesion, where feet that are pressed down bounce too: with adhesion "
            "they are caught at once, whatever the restitution"
        )
        found.append(Variant("ringing, no adhesion", about, with_values(rings, {"ground.adhesion": None})))
    return tuple(found)


def validate_millipede(
    device: str = "millipede", *, duration: float | None = None, progress: Progress | None = None
) -> MillipedeValidation:
    """Run every figure's study and the two grounds of Fig. 4.7 on all variants of a millipede, and judge them.

    Parameters
    ----------
    device
        Name or file of a walker whose ground has film, electrostatics, adhesion and restitution.
    duration
        Model time of every run [s]; that of the studies when absent.
    progress
        Called as ``progress(done, total, what)``.

    Raises
    ------
    InputError
        For an unknown device, one that is no walker, and one without a law that varies.
    """
    variants = variants_of(load_scene(device))
    jobs = [(variant, study, sweep) for variant in variants for study, sweep in _sweeps(variant, duration)]
    swept: dict[str, list[Swept]] = {variant.name: [] for variant in variants}
    for number, (variant, study, sweep) in enumerate(jobs):
        if progress is not None:
            progress(number, len(jobs), f"{study}, {variant.name}")
        swept[variant.name].append(_swept(study, sweep))
    return MillipedeValidation(
        device, tuple(_outcome(one, tuple(swept[one.name]), duration) for one in variants)
    )


def _walker(scene: Scene) -> Walker:
    walker = scene.robot.structure
    if not isinstance(walker, Walker):
        raise InputError(f"{scene.name}: a millipede is a walker; this structure is of kind '{walker.kind}'")
    return walker


def _sweeps(variant: Variant, duration: float | None) -> list[tuple[str, Sweep]]:
    """The packaged studies on a variant, by name; that of adhesion only where there is any."""
    sweeps: list[tuple[str, Sweep]] = []
    problems: list[str] = []
    for study in dict.fromkeys(trend.study for trend in TRENDS):
        if study == ADHESION and variant.scene.ground.adhesion is None:
            continue
        packaged = load_sweep(study)
        table = {name: getattr(packaged, name) for name in type(packaged).model_fields}
        try:
            own = {"scene": variant.scene, "duration": duration or packaged.duration}
            sweeps.append((study, Sweep(**{**table, **own})))
        except InputError as error:
            problems += [f"{study}: {text.removeprefix('Sweep.vary.')}" for text in error.problems]
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    return sweeps


def _swept(study: str, sweep: Sweep) -> Swept:
    arrays = score_runs(sweep)
    path, other = sweep.vary
    x, replicates = (sweep.vary[name].values_on_grid() for name in (path, other))
    shape = (len(x), len(replicates))
    counts = np.bincount(arrays["code"], minlength=len(OUTCOMES)).tolist()
    about = offered(sweep.scene, sweep.seconds)
    return Swept(
        study, path, float_paths(sweep.scene)[path].unit, x, replicates,
        {name: arrays["value"][:, j].reshape(shape) for j, name in enumerate(sweep.measures)},
        {name: arrays["spread"][:, j].reshape(shape) for j, name in enumerate(sweep.measures)},
        {name: about[name] for name in sweep.measures},
        {name: count for name, count in zip(OUTCOMES, counts, strict=True) if count},
    )  # fmt: skip


def _outcome(variant: Variant, swept: tuple[Swept, ...], duration: float | None) -> Outcome:
    by_study = {one.study: one for one in swept}
    trends = tuple(
        Judged(
            trend,
            name,
            by_study[trend.study].about[name].unit,
            trend.claim.judge(by_study[trend.study].curve(name)),
        )
        for trend in TRENDS
        if trend.study in by_study
        for name in trend.measures
    )
    if variant.scene.ground.adhesion is None:
        return Outcome(variant, swept, trends, (), ())

    def example(name: str, ground: dict[str, float]) -> Example:
        return Example(name, simulate(with_values(variant.scene, ground), duration))

    examples = tuple(example(name, ground) for name, ground in EXAMPLES.items())
    coefficient = "ground.electrostatic.coefficient"
    only = {**EXAMPLES["a"], coefficient: EXAMPLES["b"][coefficient]}
    weaker = example("a with the electrostatics of b", only)
    first, second = examples
    comparisons = (
        _compare("the body oscillates much more on ground (a) than on (b)", first, second),
        _compare("that is because of electrostatics: (a) against (a) with those of (b)", first, weaker),
    )
    return Outcome(variant, swept, trends, examples, comparisons)


def _compare(says: str, one: Example, other: Example) -> Comparison:
    ratio = one.amplitude / other.amplitude if other.amplitude > STANDSTILL else np.inf
    if not one.amplitude > STANDSTILL or ratio <= 1.0 + RELEVANT:
        verdict = Verdict.CONTRADICTS
    else:
        verdict = Verdict.AGREES if ratio >= MUCH else Verdict.NOT_DETERMINED
    return Comparison(says, verdict, float(ratio))


def _plain(outcome: Outcome) -> dict[str, Any]:
    return {
        "name": outcome.variant.name,
        "about": outcome.variant.about,
        "verdicts": {verdict.value: outcome.count(verdict) for verdict in Verdict},
        "trends": [
            {
                "figure": one.trend.figure,
                "quantity": one.trend.quantity,
                "says": one.trend.says,
                "measure": one.measure,
                "unit": one.unit,
                **one.finding.to_dict(),
            }
            for one in outcome.trends
        ],
        "examples": [
            {
                "name": one.name,
                **EXAMPLES[one.name],
                "vertical_amplitude_m": one.amplitude,
                "stride_m": one.stride,
            }
            for one in outcome.examples
        ],
        "comparisons": [
            {"says": one.says, "verdict": one.verdict.value, "ratio": one.ratio}
            for one in outcome.comparisons
        ],
        "curves": {one.study: _plain_curves(one) for one in outcome.swept},
    }


def _plain_curves(swept: Swept) -> dict[str, Any]:
    return {
        "path": swept.path,
        "unit": swept.unit,
        "x": swept.x.tolist(),
        "restitution": swept.replicates.tolist(),
        "measures": {name: values.tolist() for name, values in swept.values.items()},
    }
