"""What is asked of a device after all steps: its landing rule, what it predicts, errors of what is given."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.identify.checks import GROUND, air_checks, gap_check, held_out_check, left_check, smeared_check, with_checks
from tarsus.identify.draws import DRAWS, NORMAL
from tarsus.identify.estimates import Estimates
from tarsus.identify.evidence import Evidence
from tarsus.identify.foot import FootModel
from tarsus.identify.free_motion import AirRecord, air_records
from tarsus.identify.heldout import Comparison, compare
from tarsus.identify.landing import LandingVerdict, judge_landing
from tarsus.identify.prediction import fit_air
from tarsus.identify.restitution import bounded
from tarsus.identify.step import StepResult, failures
from tarsus.identify.steps import CHECKS, GIVEN, IN_THE_AIR, LANDING_RULE, RESONANCES, STEPS, straighter
from tarsus.identify.surprises import with_surprises
from tarsus.records.excluded import Excluded
from tarsus.records.purpose import Purpose

if TYPE_CHECKING:
    from tarsus.identify.chain import StepRunner

_FILM = "ground.film.coefficient"
_ADHESION = next(one for one in STEPS if one.name == "adhesion")
_UNIT = ".load.participation.0"


def _unknown(chain: StepRunner) -> list[str]:
    """Numbers of the device that are placeholders still, or wide unknowns that no record shows. The first participation
    of a load is the unit of the drive's force, whose law goes with it: a placeholder does as well there."""
    known = set(chain.known.paths)
    for step in chain.steps.values():
        known -= {path for path in step.taken if path.startswith("ground.")}
    return [
        path
        for path in float_paths(chain.opened.model.scene)
        if path not in known and chain.placeholder(path) and not path.endswith(_UNIT)
    ]


def landing_rule(chain: StepRunner) -> LandingVerdict | None:
    """Try the landing rules on the records of ramps and bounces; another than the device file's is taken, and
    adhesion formed again with it, where they contradict that one."""
    if _unknown(chain) or not {"restitution", "adhesion"} <= set(chain.steps):
        return None
    chain.report(LANDING_RULE)
    near = Purpose.RAMPS, Purpose.BOUNCES
    found = judge_landing(chain.known.model(), chain.traces(*near), chain.signals(*near), chain.ground()[0])
    if found is not None and found.replaced:
        chain.opened = replace(chain.opened, model=chain.opened.model.changed({"ground.landing": found.chosen}))
        chain.known = replace(chain.known.without(chain.steps.pop("adhesion")), base=chain.opened.model)
        chain.attempt(_ADHESION)
    return found


def held_out(chain: StepRunner) -> list[Comparison]:
    """Held-out records against simulations of the identified device."""
    unknown = _unknown(chain)
    if chain.traces(Purpose.VALIDATION) and unknown:
        more = f" and {len(unknown) - 1} more numbers" if len(unknown) > 1 else ""
        chain.remark(f"held-out records are not simulated: {unknown[0]}{more} not known from these data")
        return []
    model, signals, out = chain.known.model(), chain.signals(Purpose.VALIDATION), list[Comparison]()
    for trace in chain.traces(Purpose.VALIDATION):
        chain.report(f"validating on {trace.set}")
        try:
            if trace.set not in signals:
                raise InputError("its set states no signal to simulate")
            out.append(compare(model, trace, signals[trace.set], chain.ground()[0]))
        except InputError as error:
            chain.evidence.left_out.extend(Excluded(trace.file, "", said) for said in error.problems)
    return out


def in_the_air(chain: StepRunner) -> list[AirRecord]:
    """Records in the air, and loops up to the ground, compared with the device as identified; those that cannot be
    simulated are remarked."""
    if "hysteresis" not in chain.steps:
        return []
    chain.report(IN_THE_AIR)
    # near the ground a film that no step has found would be taken for something else
    wide = {path for step in chain.steps.values() for path in step.taken}
    film_known = chain.opened.model.scene.ground.acting.film is None or _FILM in set(chain.known.paths) - wide
    purposes = (Purpose.LOOPS, Purpose.AIR) if film_known else (Purpose.AIR,)
    signals, level, instruments = chain.signals(*purposes), chain.ground()[0], chain.evidence.instruments
    found, said = air_records(chain.known, chain.evidence.as_seen(purposes), signals, level, instruments)
    chain.evidence.remarks += said
    return found


def check(chain: StepRunner, comparisons: Sequence[Comparison], air: Sequence[AirRecord]) -> None:
    """Compare what was found with what it predicts; what fails is remarked, and verdicts know of it."""
    chain.report(CHECKS)
    known, steps = chain.known, chain.steps
    for name, step in steps.items():
        steps[name] = with_checks(step, left_check(step, known))
    if "hysteresis" in steps:
        fit = fit_air(air, known)
        fitted, smeared = air_checks(fit, known), smeared_check(chain.evidence.instruments, known)
        steps["hysteresis"] = with_checks(steps["hysteresis"], (*fitted, *smeared))
        if fit is not None and fit.widens:
            steps.update({name: fit.widened(step) for name, step in steps.items()})
    steps.update(with_surprises(steps, chain.known, chain.evidence.ground(), chain.seed))
    if "restitution" in steps:
        steps["restitution"] = bounded(steps["restitution"])
    for step in steps.values():
        chain.known = chain.known.redrawn(step)
    last = next(reversed(steps), None)
    if last is not None:
        steps[last] = with_checks(steps[last], held_out_check(comparisons, known))
    if "hysteresis" in steps:
        steps["hysteresis"] = with_checks(steps["hysteresis"], gap_check(steps["hysteresis"], known))
    chain.evidence.remarks += failures(one for step in steps.values() for one in step.checks)


def draw_given(chain: StepRunner) -> None:
    """Draw all numbers along with what was corrected of the records, and with what the device file states with an
    interval: each is moved by its standard error, and what the steps find with it shows how far the numbers go along;
    those of the ground go by factors."""
    for number, (model, evidence) in enumerate(_perturbed(chain)):
        chain.report(GIVEN)
        there = _again(chain, model, evidence)
        drawn = np.random.default_rng([chain.seed, 53, number]).standard_normal(DRAWS)
        for name, step in chain.steps.items():
            if name in there:
                chain.steps[name] = _along(step, there[name], drawn)
                chain.known = chain.known.redrawn(chain.steps[name])


def _perturbed(chain: StepRunner) -> Iterator[tuple[FootModel, Evidence]]:
    """Device and records with one number that no step finds moved by its standard error."""
    model = chain.opened.model
    yield from ((model, evidence) for evidence in chain.evidence.perturbed())
    for path, one in float_paths(model.scene).items():
        ends = model.scene.interval(path)
        stated = path.startswith(("robot.structure.", f"robot.feet.{model.foot}.")) and path not in chain.known.paths
        if stated and ends is not None and ends[1] > ends[0]:
            moved = model.changed({path: one.value + (ends[1] - ends[0]) / (2.0 * NORMAL)})
            yield moved, replace(chain.evidence, remarks=[])


def _along(step: StepResult, there: StepResult, drawn: Floats) -> StepResult:
    """A step whose numbers move, by draws (draws,), with another result of it at one standard deviation."""
    samples = step.samples.copy()
    for k, path in enumerate(step.paths):
        if path in there.paths:
            value, other = step.values[k], there.values[there.paths.index(path)]
            if path.startswith(GROUND) and value * other > 0.0:
                samples[:, k] *= (other / value) ** drawn
            else:
                samples[:, k] += (other - value) * drawn
    both = {
        name: (one[0], one[1] + (there.combinations[name][0] - one[0]) * drawn, one[2])
        for name, one in step.combinations.items()
        if name in there.combinations
    }
    return replace(step, samples=samples, combinations={**step.combinations, **both})


def _again(chain: StepRunner, model: FootModel, evidence: Evidence) -> dict[str, StepResult]:
    """Results of the steps with another model, or with records otherwise corrected, none with draws of what was before
    it."""
    other = replace(
        chain,
        opened=replace(chain.opened, model=model),
        evidence=evidence,
        progress=None,
        not_done=[],
        bounces=None,
        steps=dict(chain.steps),
    )
    # a gain that all channels share turns no shape
    shaped = model.scene.robot.structure != chain.opened.model.scene.robot.structure
    if shaped or evidence.instruments is not chain.evidence.instruments:
        other.take((RESONANCES,))
    other.steps = {name: one for name, one in other.steps.items() if name == "resonances"}
    other.known = Estimates.nothing(model)
    for one in other.steps.values():
        other.known = other.known.after(one).certain()
    for step in STEPS:
        if step.name not in chain.steps or step.name in ("resonances", "impact map") or step.when is straighter:
            continue
        other.take((step,))
        other.known = other.known.certain()
    return other.steps
