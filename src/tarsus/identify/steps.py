"""The table of steps: which records each is for, which do as well, what it needs, and the sentence that says so.

A step that lacks what it needs is not done, and says why; none stops the others. What a later step needs and no record
shows is a wide unknown (`wide_film`, `wide_attraction`), whose draws reach all that depends on it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.errors import InputError
from tarsus.identify.adhesion import identify_adhesion
from tarsus.identify.contact_film import film_by_impacts
from tarsus.identify.electrostatics import identify_close, wide_attraction
from tarsus.identify.film import identify_film, wide_film
from tarsus.identify.film_exponent import film_checked
from tarsus.identify.flight import ATTRACTION, FILM
from tarsus.identify.hysteresis import Shares, identify_hysteresis
from tarsus.identify.impact_column import Pair, identify_impact_column, map_from_pairs
from tarsus.identify.resonance import Resonances, identify_resonances, of_sweeps, shape_mismatch
from tarsus.identify.restitution import identify_restitution
from tarsus.identify.step import UNSOLVED, StepResult, Used
from tarsus.identify.straightened import straightened
from tarsus.identify.traces import Trace
from tarsus.model.drive.waveforms import SweptSine
from tarsus.records.purpose import Purpose

if TYPE_CHECKING:
    from tarsus.identify.chain import StepRunner


_SLOW = 0.01
"""Part of the drive's span that its slope over the first mode's angular frequency may be for a record to count as
static: what rings is a hundredth of the motion, and a mean over ways up and down takes most of that off."""


@dataclass(frozen=True)
class ChainStep:
    """One entry: name of its result; purpose: of the records that it is for, in words as well; find: what it finds;
    about: a sentence on what is fitted; needs: steps, or what the device file knows in their place, without which it
    is nothing; instead: purpose of records that do where none of its own can be used; when: whether it is to be tried,
    where it has records."""

    name: str
    purpose: Purpose
    records: str
    find: Callable[[StepRunner], StepResult]
    about: str
    needs: tuple[str, ...] = ()
    instead: tuple[Purpose, ...] = ()
    when: Callable[[StepRunner], bool] = lambda _: True


def _resonances(chain: StepRunner) -> StepResult:
    """Structure from the sweeps, whose delay behind the drive is corrected first."""
    sets = [one for _, one in chain.opened.sets(Purpose.MODAL)]
    if not any(r.record is not None for r in chain.files_of(Purpose.MODAL)):
        raise InputError(chain.nothing_for(Purpose.MODAL, "sweeps in the air"))
    signals = [one.signal for one in sets if isinstance(one.signal, SweptSine)]
    ends = [sorted((one.start_frequency, one.stop_frequency)) for one in signals]
    if not ends:
        raise InputError("the sets of sweeps state no swept sine as their signal, which gives the band to identify")
    band = max(low for low, _ in ends), min(high for _, high in ends)
    chain.resonances = _structure(chain, band)
    straight = "hysteresis" in chain.steps  # the second time the delay is corrected
    if not straight and (late := chain.evidence.instruments.behind(chain.resonances.fit)) is not None:
        chain.evidence.correct(late)
        chain.resonances = _structure(chain, band)
    out = {one.file for one in chain.resonances.step.left_out}
    records = {r.file: r.record for r in chain.files_of(Purpose.MODAL) if r.record is not None}
    place = {r.record.source: k for k, r in enumerate(chain.evidence.readings) if r.record is not None}
    volts = {one.source: float(np.abs(one[one.drive]).max()) for one in records.values() if one.drive is not None}
    influence = of_sweeps(chain.resonances, place, volts)
    return replace(chain.resonances.step, files=frozenset(records) - out, influence=influence)


def _structure(chain: StepRunner, band: tuple[float, float]) -> Resonances:
    """Resonances of the sweeps without what is their instruments'; of gains the channels are at fault without which
    the modes have the shapes of the structure, as the first time shows."""
    evidence, best, problems = chain.evidence, None, []
    known = chain.resonances
    for instruments in evidence.instruments.hypotheses() if known is None else (evidence.instruments,):
        taken = replace(evidence, instruments=instruments)
        read = [(r, one) for r in chain.files_of(Purpose.MODAL) if (one := taken.record(r)) is not None]
        sets, records = [chain.opened.campaign.records[r.set] for r, _ in read], [one for _, one in read]
        drives = [(one.rest, one.signal) for one in sets if one.signal is not None]
        if "hysteresis" in chain.steps and len(drives) == len(records):
            records = straightened(records, drives, chain.known.model())
        try:
            near = known or (None if best is None else best[0])
            found = identify_resonances(chain.opened.model, records, band, chain.seed, near and near.seen)
        except InputError as error:
            problems += error.problems
            continue
        if best is None or shape_mismatch(found) < shape_mismatch(best[0]):
            best = found, instruments
    if best is None:
        raise InputError(list(dict.fromkeys(problems)))
    if best[1] is not evidence.instruments:
        evidence.correct(best[1])
    return best[0]


def _hysteresis(chain: StepRunner) -> StepResult:
    """The drive's law from static loops, or from ramps that are slow enough."""
    traces = chain.traces(Purpose.LOOPS)
    slow = [] if traces else _static(chain, chain.traces(Purpose.RAMPS))
    if not traces and not slow:
        raise InputError(chain.nothing_for(Purpose.LOOPS, "static loops"))
    shares = Shares.none() if chain.resonances is None else chain.resonances.shares
    found = identify_hysteresis(chain.known, traces or slow, chain.evidence.level, shares, chain.seed + 1)
    if traces:
        return found
    return replace(
        found, notes=(*found.notes, "No static loops: slow ramped squares determine the law in their place.")
    )


def _static(chain: StepRunner, traces: Sequence[Trace]) -> list[Trace]:
    """Records whose drive is so slow that the structure follows it."""
    first, out = chain.known.model().slowest, []
    for trace in traces:
        span, slope = float(np.ptp(trace.volts)), float(np.abs(np.diff(trace.volts)).max()) / trace.step
        if slope < _SLOW * span * first:
            out.append(trace)
    return out


def _film(chain: StepRunner) -> StepResult:
    """The film from the flights after detachments, whose pulls adhesion takes."""
    traces = chain.alike(Purpose.RAMPS)
    if not traces:
        raise InputError(chain.nothing_for(Purpose.RAMPS, "ramped squares"))
    if chain.evidence.level is None:
        raise InputError("no record of ramped squares shows a foot standing on the ground")
    model, seed = chain.known.model(), chain.seed + 2
    film = identify_film(model, chain.known, traces, chain.evidence.level, seed, chain.film)
    # the steps again: of hypotheses the first time
    known = chain.film is not None or chain.opened.campaign.even_film
    chain.film = film if known else film_checked(film, seed)
    return chain.film.step


def _electrostatics(chain: StepRunner) -> StepResult:
    traces = chain.alike(Purpose.CLOSE)
    if not traces:
        raise InputError(chain.nothing_for(Purpose.CLOSE, "a foot close to the ground"))
    return identify_close(chain.known.model(), chain.known, traces, chain.seed + 6)


def _wide_attraction(chain: StepRunner) -> StepResult:
    volts = max((float(np.abs(one.volts).max()) for one in chain.traces(Purpose.BOUNCES)), default=1.0)
    return wide_attraction(chain.known.model(), volts, chain.seed + 6)


def _close_with_impacts(chain: StepRunner) -> StepResult:
    """The film that was seen from above, with what the impacts say of it."""
    chain.known, step = film_by_impacts(
        chain.known,
        chain.steps["electrostatics"],
        chain.alike(Purpose.BOUNCES),
        chain.alike(Purpose.CLOSE),
        chain.ground(),
    )
    return step


def _film_by_impacts(chain: StepRunner) -> StepResult:
    """The film as a wide unknown, with what the impacts say of it."""
    wide = wide_film(chain.known.model(), chain.seed + 2)
    try:
        known, step = film_by_impacts(chain.known.after(wide), wide, chain.alike(Purpose.BOUNCES), (), chain.ground())
    except UNSOLVED as error:
        return replace(wide, notes=(*wide.notes, f"The impacts do not determine it: {error}."))
    if not step.used or step.unsound():
        return replace(step, taken=FILM) if not step.used else wide
    chain.known = known.without(step)
    return replace(step, taken=())


def _restitution(chain: StepRunner) -> StepResult:
    traces = chain.alike(Purpose.BOUNCES)
    if not traces:
        raise InputError(chain.nothing_for(Purpose.BOUNCES, "bounces"))
    model = chain.known.model()
    found, chain.bounces = identify_restitution(model, chain.known, traces, chain.ground(), chain.seed + 4)
    return found


def _impact_map(chain: StepRunner) -> StepResult:
    if chain.bounces is None:
        raise InputError("it needs the impacts of the step restitution, which was not done")
    model = chain.known.model()
    step = identify_impact_column(model, chain.known, chain.bounces, chain.seed + 5)
    pairs = _pairs(chain)
    if not pairs:
        return step
    found, left = map_from_pairs(chain.known, model.foot_point, pairs, chain.seed + 5)
    return replace(
        step,
        combinations={**step.combinations, **found},
        used=(*step.used, Used("pairs with the air", len(pairs) - len(left), len(pairs))),
        left_out=(*step.left_out, *left),
    )


def _pairs(chain: StepRunner) -> list[Pair]:
    """Sets of bounces with the sets of the same drive in the air, as far as their files can be used."""
    whole = {one.file for one in chain.evidence.left_out}
    out = []
    for name, one in chain.opened.sets(Purpose.BOUNCES):
        near, far = (
            tuple(
                record
                for r in chain.evidence.readings
                if r.set == which and r.file not in whole and (record := chain.evidence.record(r)) is not None
            )
            for which in (name, one.air)
        )
        if one.air is not None and near and far:
            out.append(Pair(name, one.air, near, far))
    return out


def _adhesion(chain: StepRunner) -> StepResult:
    if chain.film is None:
        raise InputError("it needs the detachments of the step film, which was not done")
    signals = chain.signals(Purpose.RAMPS)
    return identify_adhesion(chain.film, chain.known, signals, "restitution" in chain.steps, chain.seed + 3)


def _walking(chain: StepRunner) -> StepResult:
    """The ground from walks on it."""
    from tarsus.identify.walk_step import identify_walking, walk_records
    from tarsus.identify.walking import WalkRecord

    purposes = Purpose.WALKING, Purpose.VALIDATION
    records, files, scene = {one: list[WalkRecord]() for one in purposes}, set[str](), chain.known.model().scene
    for purpose in purposes:
        for name, one in chain.opened.sets(purpose):
            mine = [r for r in chain.files_of(purpose) if r.set == name and r.record is not None]
            records[purpose] += walk_records(scene, name, one, [r.record for r in mine if r.record is not None])
            files |= {r.file for r in mine}
    if not records[Purpose.WALKING]:
        raise InputError(chain.nothing_for(Purpose.WALKING, "walks"))
    by_foot = chain.opened.campaign.ground_by_foot
    found = identify_walking(scene, records[Purpose.WALKING], chain.seed + 7, by_foot, records[Purpose.VALIDATION])
    return replace(found, files=frozenset(files))


def straighter(chain: StepRunner) -> bool:
    """Once the law of the drive is known, the sweeps tell the structure better, and that the law."""
    return {"resonances", "hysteresis"} <= set(chain.steps)


def _has(law: str) -> Callable[[StepRunner], bool]:
    """Whether a law, by its slot, acts on the ground of the device: of one that does not no number is fitted."""
    return lambda chain: getattr(chain.opened.model.scene.ground.acting, law) is not None


def _film_open(chain: StepRunner) -> bool:
    return chain.opened.model.scene.ground.acting.film is not None and FILM[0] not in chain.known.paths


def _film_from_above(chain: StepRunner) -> bool:
    return "electrostatics" in chain.steps and FILM[0] in chain.steps["electrostatics"].paths


def _attraction_open(chain: StepRunner) -> bool:
    scene, model = chain.opened.model.scene, chain.opened.model
    law = scene.ground.acting.electrostatic is not None and scene.robot.feet[model.foot].electrode is not None
    return law and ATTRACTION[0] not in chain.known.paths and chain.placeholder(ATTRACTION[0])


RESONANCES = ChainStep(
    "resonances",
    Purpose.MODAL,
    "sweeps in the air",
    _resonances,
    "Sweeps in the air: natural frequencies and damping ratios, by poly-reference least squares and a "
    "local maximum-likelihood finish.",
)
HYSTERESIS = ChainStep(
    "hysteresis",
    Purpose.LOOPS,
    "static loops",
    _hysteresis,
    "Static loops: K x = load F(V), equation (2.8), with a Prandtl-Ishlinskii operator F; on the ground "
    "the combination of points that its force does not move.",
    ("resonances",),
    (Purpose.RAMPS,),
)
_DEVICE = ("resonances", "hysteresis")
FILM_STEP = ChainStep(
    "film",
    Purpose.RAMPS,
    "the flights after detachment",
    _film,
    "Ring-down after detachment: F = −C g′ / (g + g₀)³, equation (2.10) with the sign of E2, fitted to all "
    "flights at once; the moment of each release, the state at it and a drift of the drive are free.",
    _DEVICE,
)
CLOSE = ChainStep(
    "electrostatics",
    Purpose.CLOSE,
    "records close to the ground",
    _electrostatics,
    "Records close to the ground, (3.25) and (3.26).",
    _DEVICE,
)
RESTITUTION = ChainStep(
    "restitution",
    Purpose.BOUNCES,
    "bounces",
    _restitution,
    "Velocities before and after impacts (2.12), from the flights on both sides; a ratio with errors in both.",
    _DEVICE,
    when=_has("restitution"),
)
SWEEP_STEPS = (RESONANCES,)
"""Steps that need no ground."""
GROUND_STEPS = (
    HYSTERESIS,
    replace(RESONANCES, when=straighter),
    replace(HYSTERESIS, when=straighter),
    FILM_STEP,
    CLOSE,
    ChainStep(
        "electrostatics",
        Purpose.BOUNCES,
        "nothing",
        _wide_attraction,
        "No record close to the ground: the attraction (3.25) is a wide unknown.",
        _DEVICE,
        when=_attraction_open,
    ),
    replace(CLOSE, purpose=Purpose.BOUNCES, find=_close_with_impacts, when=_film_from_above),
    ChainStep(
        "film",
        Purpose.BOUNCES,
        "the flights around impacts",
        _film_by_impacts,
        "The film as a wide unknown of the flights around all impacts: F = −C g′ / (g + g₀)³, equation (2.10), with "
        "the zeros of the displacements.",
        _DEVICE,
        when=_film_open,
    ),
    RESTITUTION,
    ChainStep(
        "impact map",
        Purpose.BOUNCES,
        "bounces",
        _impact_map,
        "Changes of the points' velocities at impacts per change of the foot's: a column of the map (3.22), "
        "with the velocities of all coordinates free to jump.",
        when=_has("restitution"),
    ),
    ChainStep(
        "adhesion",
        Purpose.RAMPS,
        "pull-off forces over contact times",
        _adhesion,
        "Pull-off force (2.13) at the moment of release over contact time: f_a = C_a0 + C_a (t − t_c), equation "
        "(2.14).",
        when=_has("adhesion"),
    ),
    ChainStep(
        "walking",
        Purpose.WALKING,
        "walks",
        _walking,
        "Walks: windows between contacts with starts of their own, numbers of ground and legs that all share, and in "
        "the end every start tied to the end of the window before.",
    ),
)
"""All other steps in order; one without records in the campaign is not tried."""
STEPS = (*SWEEP_STEPS, *GROUND_STEPS)
"""All steps in order."""
AFTERWARDS = (LANDING_RULE, GIVEN, IN_THE_AIR, CHECKS) = (
    "landing rule",
    "errors of what is given",
    "in the air",
    "checks",
)
"""What is done with the device as a whole, in words of progress."""
