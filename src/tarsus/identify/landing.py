"""The landing rule: which rule moves the identified device as the records do.

No step but the adhesion's touchdowns depends on the rule, so that it can be judged afterwards: the device as identified
is simulated with the drive of each set of ramps and bounces under every rule, and compared with the record. A record
*contradicts* a rule where the foot moves off it more than `WORSE` times as much as under the rule that meets it best.
Held-out records take no part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.identify.foot import FootModel
from tarsus.identify.heldout import moved
from tarsus.identify.traces import Trace
from tarsus.impacts.detection import STILL
from tarsus.model.drive.waveforms import Waveform
from tarsus.model.laws.landing import AnyLanding, CaptureUnlessPulled, PullAsPrinted, RestituteFirst

WORSE = 2.0
"""The right rule leaves what numbers and noise leave, which differs by some per cent between records; a foot that is
held where it should have flown misses its whole flight."""
SURE = 2
"""Records more than under the best rule that must contradict another one: a single one may be a landing at the edge of
being held, which an uncertain number decides."""
UNTIL = 0.25
"""Seconds of each record that are compared: several landings of every drive, and no run takes long."""
FACTOR = 2.0
"""Between the speeds that are tried of `RestituteFirst`: landings depart at speeds that spread over far more."""


@dataclass(frozen=True)
class LandingFit:
    """A rule, and how far the foot then moves off each record (nr,), as a share of its motion; infinite where the
    device cannot be simulated under the rule."""

    rule: AnyLanding
    off: Floats


@dataclass(frozen=True)
class LandingVerdict:
    """What records say of the landing rule.

    assumed: the device file's rule; chosen: the one that is used; fits of all rules that were tried; sets: names of the
    sets (nr,) that were compared; contradicted: by rule, how many of them contradict it."""

    assumed: AnyLanding
    chosen: AnyLanding
    fits: tuple[LandingFit, ...]
    sets: tuple[str, ...]
    contradicted: tuple[int, ...]

    @property
    def fewest(self) -> int:
        """Records that contradict the rule that is contradicted least."""
        return min(self.contradicted)

    @property
    def possible(self) -> tuple[AnyLanding, ...]:
        """Rules that the records do not rule out."""
        pairs = zip(self.fits, self.contradicted, strict=True)
        return tuple(one.rule for one, count in pairs if count < self.fewest + SURE)

    @property
    def decided(self) -> bool:
        """Whether one kind of rule is left."""
        return len({one.kind for one in self.possible}) == 1

    @property
    def replaced(self) -> bool:
        """Whether the device file's rule was given up."""
        return self.chosen != self.assumed

    def sentences(self) -> list[str]:
        """In words: what was decided, and what a reader should know with it."""
        count = len(self.sets)
        if self.decided:
            wrong: dict[str, list[int]] = {}
            for one, number in zip(self.fits, self.contradicted, strict=True):
                wrong.setdefault(one.rule.kind, []).append(number)
            others = ", ".join(f"{kind} by {min(n)}" for kind, n in wrong.items() if kind != self.chosen.kind)
            said = [
                f"landing rule: {_words(self.chosen)} is preferred; of {count} sets of records contradicted: {others}"
            ]
        else:
            kinds = dict.fromkeys(one.kind for one in self.possible)
            said = [
                f"landing rule: undecided between {' and '.join(kinds)} by {count} sets; {_words(self.chosen)} is used"
            ]
        speeds = [one.speed for one in self.possible if isinstance(one, RestituteFirst)]
        if isinstance(self.chosen, RestituteFirst) and len(speeds) > 1:
            said[0] += f" (of the speeds tried {1e3 * min(speeds):.3g} to {1e3 * max(speeds):.3g} mm/s fit)"
        if self.replaced:
            said.append(f"the device file's landing rule, {_words(self.assumed)}, is contradicted and was replaced")
        if self.fewest >= SURE:
            said.append(
                f"no landing rule meets all records: {self.fewest} of {count} contradict even the best; what rests on "
                "landings (adhesion, held-out signals) is not known as well as its intervals say"
            )
        return said


def judge_landing(
    model: FootModel, traces: Sequence[Trace], signals: Mapping[str, Waveform], level: float
) -> LandingVerdict | None:
    """Try every landing rule on one record of each set with a drive; None where there is no such record.

    Parameters
    ----------
    model
        The device as identified.
    traces
        Records near the ground.
    signals
        Drive of each set, by name.
    level
        Contact level from the rest [m].
    """
    firsts = list({one.set: one for one in reversed(traces) if one.set in signals}.values())[::-1]
    if not firsts:
        return None
    assumed = model.scene.ground.landing_rule
    fits = [_fit(model, one, firsts, signals, level) for one in _rules(model, firsts)]
    fits = [one for one in fits if np.isfinite(one.off).any() or one.rule == assumed]
    off = np.array([one.off for one in fits])
    wrong = (off > WORSE * off.min(axis=0)).sum(axis=1)
    order = sorted(range(len(fits)), key=lambda i: (wrong[i], float(np.log(off[i]).mean())))
    own = next(i for i, one in enumerate(fits) if one.rule == assumed)
    chosen = own if wrong[own] < wrong[order[0]] + SURE else order[0]
    return LandingVerdict(
        assumed, fits[chosen].rule, tuple(fits), tuple(one.set for one in firsts), tuple(wrong.tolist())
    )


def _rules(model: FootModel, traces: Sequence[Trace]) -> list[AnyLanding]:
    """The device file's rule first, then every other; speeds from what the noise lets see to the fastest that the foot
    departs with."""
    e = model.scene.ground.restitution.coefficient if model.scene.ground.restitution else 0.0
    fast = e * max(float(np.abs(one.v[one.point(model.foot_point)]).max()) for one in traces)
    slow = STILL * max(float(one.noise_v[one.point(model.foot_point)]) for one in traces)
    count = int(np.ceil(np.log(max(fast / slow, 1.0)) / np.log(FACTOR)))
    speeds = [float(f"{fast / FACTOR**k:.3g}") for k in range(1, count + 1)]
    rules = [model.scene.ground.landing_rule, CaptureUnlessPulled(), PullAsPrinted()]
    rules += [RestituteFirst(speed=one) for one in speeds]
    return list(dict.fromkeys(rules))


def _fit(
    model: FootModel, rule: AnyLanding, traces: Sequence[Trace], signals: Mapping[str, Waveform], level: float
) -> LandingFit:
    out = np.full(len(traces), np.inf)
    with suppress(InputError):  # a rule that this structure has not
        chosen = model.changed({"ground.landing": rule})
        for k, trace in enumerate(traces):
            with suppress(InputError):  # a run that does not end
                out[k] = moved(chosen, trace, signals[trace.set], level, UNTIL).off
    return LandingFit(rule, out)


def _words(rule: AnyLanding) -> str:
    return f"{rule.kind} at {1e3 * rule.speed:.3g} mm/s" if isinstance(rule, RestituteFirst) else rule.kind
