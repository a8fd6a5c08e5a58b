"""Whether `identify` will find in a campaign what it asks for: records, channels and signals of every purpose."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from tarsus.base.errors import InputError
from tarsus.identify.campaign import Opened, RecordFile, RecordSet, guessed_purpose
from tarsus.identify.evidence import Evidence
from tarsus.model.drive.waveforms import SweptSine
from tarsus.model.structure import Walker
from tarsus.modes.agreement import sampled_alike
from tarsus.records.purpose import Purpose

TOLD_BY = {
    Purpose.MODAL: "the resonances",
    Purpose.LOOPS: "the drive's hysteresis",
    Purpose.RAMPS: "film and adhesion",
    Purpose.BOUNCES: "restitution and impact law",
    Purpose.CLOSE: "electrostatics",
    Purpose.WALKING: "ground and legs of a walker",
}
"""What records of a purpose tell; of the others no number comes."""
_LAWS = {Purpose.RAMPS: ("film", "adhesion"), Purpose.BOUNCES: ("restitution",)}
"""Laws of the ground, by their slots, whose numbers come from records of a purpose."""


@dataclass(frozen=True)
class Readiness:
    """Every file as read; problems: what `identify` will leave out or not do; remarks: what it will not try, and what
    looks odd."""

    readings: tuple[RecordFile, ...]
    problems: tuple[str, ...]
    remarks: tuple[str, ...]


def serves(purpose: Purpose, opened: Opened) -> bool:
    """Whether records of a purpose are for devices like this one: those of a walker are walks, of others all else."""
    return isinstance(opened.model.scene.robot.structure, Walker) == (purpose is Purpose.WALKING)


def readiness_of(opened: Opened) -> Readiness:
    """Read all records as `identify` does and ask of each set what its purpose needs."""
    evidence = Evidence(opened)
    evidence.read(lambda _: None)
    problems = list(dict.fromkeys(str(one) for one in evidence.left_out))
    remarks: list[str] = []
    for name, one in opened.campaign.records.items():
        amiss = _of_signal(name, one)
        problems += amiss
        guess = guessed_purpose(name)
        if not amiss and guess is not None and guess is not one.purpose:
            remarks.append(
                f"records.{name}: its purpose is '{one.purpose.value}', its name sounds like '{guess.value}'"
            )
    sweeps = {name for name, _ in opened.sets(Purpose.MODAL)}
    swept = [one.record for one in evidence.readings if one.set in sweeps and one.record is not None]
    try:
        problems += [str(one) for one in sampled_alike(swept, opened.model.points)[2]] if swept else []
    except InputError as error:
        problems += error.problems
    used = Counter(one.purpose for one in opened.campaign.records.values())
    if not any(purpose in used for purpose in TOLD_BY):
        problems.append(
            f"no set of records determines a number: all are for {', '.join(p.value for p in used)}; purposes that do "
            f"are {', '.join(p.value for p in TOLD_BY)}"
        )
    else:
        remarks += [
            f"no records are for '{purpose.value}': {what} will not be identified"
            for purpose, what in TOLD_BY.items()
            if purpose not in used and purpose is not Purpose.CLOSE and serves(purpose, opened)
        ]
    remarks += _without_law(opened)
    return Readiness(tuple(evidence.readings), tuple(problems), tuple(remarks))


def _without_law(opened: Opened) -> list[str]:
    """Laws of the ground that the records would tell, but the device has not."""
    acting = opened.model.scene.ground.acting
    return [
        f"the device has no ground.{law}, which will not be identified: add [ground.{law}] to the device file "
        "if it acts"
        for purpose, laws in _LAWS.items()
        if any(opened.sets(purpose))
        for law in laws
        if getattr(acting, law) is None
    ]


def _of_signal(name: str, one: RecordSet) -> list[str]:
    """Sentences on a signal that does not fit the purpose, or is needed and missing."""
    swept = isinstance(one.signal, SweptSine)
    if one.purpose is Purpose.MODAL and not swept:
        given = "none" if one.signal is None else f"'{getattr(one.signal, 'kind', '')}'"
        return [
            f"records.{name}.signal: sweeps (purpose 'modal') need the swept sine that drove them, which gives the "
            f"band; got {given}"
        ]
    if swept and one.purpose is not Purpose.MODAL:
        return [f"records.{name}.purpose: a swept sine serves 'modal', got '{one.purpose.value}'"]
    if one.signal is None and not one.walks and one.purpose in (Purpose.VALIDATION, Purpose.AIR):
        return [f"records.{name}.signal: records of purpose '{one.purpose.value}' are compared with a simulation of it"]
    return []
