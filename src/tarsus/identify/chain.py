"""The chain: one loop over the table of steps, each given what the ones before it found; what is missing stops none."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.messages import together
from tarsus.base.progress import Progress
from tarsus.base.spec import float_paths
from tarsus.base.threads import single_threaded
from tarsus.identify.bounce import Bounces
from tarsus.identify.campaign import Opened, RecordFile, read_campaign
from tarsus.identify.estimates import PLACEHOLDER, Estimates
from tarsus.identify.evidence import Evidence
from tarsus.identify.film import FilmFit
from tarsus.identify.resonance import Resonances
from tarsus.identify.result import Identification
from tarsus.identify.step import UNSOLVED, NotDone, StepResult, Used
from tarsus.identify.steps import AFTERWARDS, GROUND_STEPS, STEPS, SWEEP_STEPS, ChainStep
from tarsus.identify.traces import Trace
from tarsus.model.drive.waveforms import Waveform
from tarsus.records.excluded import Excluded
from tarsus.records.purpose import Purpose
from tarsus.tables.numbers import amount

Kind = TypeVar("Kind")

_MESSAGES = len({one.name for one in STEPS}) + len(AFTERWARDS)
"""Of progress, without those of the files."""


@dataclass
class StepRunner:
    """Runs the steps; what it has found so far.

    opened: the campaign; evidence: its records; known: parameters found so far; seed: of all draws; progress: called as
    ``progress(done, total, what)``; steps: results by name; resonances, film, bounces: what later steps take besides.
    """

    opened: Opened
    evidence: Evidence
    known: Estimates
    seed: int = 1
    progress: Progress | None = None
    steps: dict[str, StepResult] = field(default_factory=dict)
    not_done: list[NotDone] = field(default_factory=list)
    resonances: Resonances | None = None
    film: FilmFit | None = None
    bounces: Bounces | None = None
    _reported: int = 0

    @classmethod
    def of(cls, opened: Opened, seed: int = 1, progress: Progress | None = None) -> StepRunner:
        """Before its first step."""
        return cls(opened, Evidence(opened), Estimates.nothing(opened.model), seed, progress)

    def run(self) -> Identification:
        """All steps, and what is asked of the device as a whole."""
        from tarsus.identify import validation

        begun = time.perf_counter()
        self.read()
        self.take(SWEEP_STEPS)  # which tell how late the records of the ground are
        self.find_ground()
        self.take(GROUND_STEPS)
        landing = self.guarded("landing rule", lambda: validation.landing_rule(self), None)
        self.guarded("errors of what is given", lambda: validation.draw_given(self), None)
        comparisons = self.guarded("held-out records", lambda: validation.held_out(self), [])
        air = self.guarded("records in the air", lambda: validation.in_the_air(self), [])
        self.guarded("checks", lambda: validation.check(self, comparisons, air), None)
        used = {file for step in self.steps.values() for file in step.files}
        sets = {one.set for one in air}
        used |= {r.file for r in self.evidence.readings if r.set in sets and r.record is not None}
        used |= {one.file for one in comparisons}
        self.evidence.close(used | {one.file for step in self.steps.values() for one in step.left_out})
        if not self.steps and not any(r.record is not None for r in self.evidence.readings):
            raise InputError(
                [
                    *(f"excluded: {one}" for one in together([str(one) for one in self.evidence.left_out])),
                    *(f"{one.name} was not done: {said}" for one in self.not_done for said in one.reasons),
                ]
                or ["no step could be done"]
            )
        return Identification(
            opened=self.opened,
            readings=tuple(self.evidence.readings),
            left_out=tuple(self.evidence.left_out),
            steps=self.steps,
            not_done=tuple(self.not_done),
            known=self.known,
            level=self.evidence.level,
            resonances=self.resonances,
            film=self.film,
            landing=landing,
            comparisons=tuple(comparisons),
            files_used=len(used),
            remarks=tuple(self.evidence.remarks),
            seconds=time.perf_counter() - begun,
        )

    def read(self) -> None:
        """Read and check every file."""
        self.evidence.read(self.report)

    def find_ground(self) -> None:
        """Find the ground that the records show, and report what was corrected of them."""
        for said in self.evidence.instruments.sentences():
            self.remark(said)
        self.evidence.find_ground()

    def take(self, steps: Sequence[ChainStep]) -> None:
        """Try steps in order: those with records whose time it is."""
        for step in steps:
            recorded = any(any(self.opened.sets(purpose)) for purpose in (step.purpose, *step.instead))
            if recorded and step.when(self):
                self.attempt(step)

    def attempt(self, step: ChainStep) -> None:
        """Run a step; what stops it is kept as its reasons, or remarked of one that was done already."""
        before = self.resonances, self.known
        self.report(step.name)
        try:
            # a result that is no number is asked for afterwards (`StepResult.unsound`)
            with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
                self._need(step)
                found = step.find(self)
            reasons = found.unsound()
        except InputError as error:
            reasons = error.problems
        except UNSOLVED as error:
            reasons = [f"its equations have no solution with these data ({error})"]
        earlier = [said for one in self.not_done if one.name == step.name for said in one.reasons]
        self.not_done = [one for one in self.not_done if one.name != step.name]
        if reasons:
            self.known = before[1]
        if reasons and step.name in self.steps:
            self.resonances = before[0]
            for said in reasons:
                self.remark(f"{step.name}, again: {said}")
            return
        if reasons:
            self._forget(step.name)
            self.not_done.append(NotDone(step.name, tuple(dict.fromkeys((*earlier, *reasons))), step.purpose))
            return
        if step.name in self.steps:
            self.known = self.known.without(self.steps.pop(step.name))
        for said in earlier:
            self.remark(f"{step.name} is from other records than asked for first: {said}")
        given = {step.purpose} if not step.instead else self._purposes(found)
        files = sum(len(one.files) for purpose in given for _, one in self.opened.sets(purpose))
        self.steps[step.name] = replace(
            found,
            used=(*found.used, Used("files", len(found.files), files)),
            about=step.about,
            records=step.records,
            notes=(*found.notes, *(f"Not from other records: {said}." for said in earlier)),
        )
        self.known = self.known.after(found)
        self.steps = {name: self.known.updated(one) for name, one in self.steps.items()}

    def guarded(self, what: str, find: Callable[[], Kind], otherwise: Kind) -> Kind:
        """What is found of the device as a whole; where that fails with these data a remark, and what stands for it."""
        try:
            return find()
        except UNSOLVED as error:
            self.remark(f"{what}: not from these data ({error})")
            return otherwise

    def _forget(self, name: str) -> None:
        """Drop what a step that was not done has left for later ones."""
        if name in (held := {"resonances": "resonances", "film": "film", "restitution": "bounces"}):
            setattr(self, held[name], None)

    def _purposes(self, found: StepResult) -> set[Purpose]:
        """Purposes of the records of which a step used something."""
        sets = {r.set for r in self.evidence.readings if r.file in found.files}
        return {self.opened.campaign.records[name].purpose for name in sets}

    def _need(self, step: ChainStep) -> None:
        """Raise InputError where a part of the device is needed that neither a step nor the device file states."""
        parts = {
            "resonances": ("structure", "robot.structure.frequencies", Purpose.MODAL, "sweeps in the air"),
            "hysteresis": ("drive's law", f"robot.drives.{self.opened.model.drive}.law", Purpose.LOOPS, "static loops"),
        }
        for name in step.needs:
            if name in self.steps:
                continue
            part, path, purpose, records = parts[name]
            recorded = any(self.opened.sets(purpose))
            why = f"the step {name} was not done" if recorded else f"the campaign has no {records}"
            if self.placeholder(path):
                shown = path.rpartition(".")[2]
                raise InputError(
                    f"it needs the {part}: {why}, and the {shown} of the device "
                    f"{'are placeholders' if shown.endswith('s') else 'is a placeholder'}; record {records} (purpose "
                    f"'{purpose.value}'), or state there what is known"
                )
            self.remark(f"{why}: the {part} is that of the device file, as if it were certain")

    def placeholder(self, path: str) -> bool:
        """Whether what the device file holds there is to be identified, and nothing that anyone knows."""
        paths = [one for one in float_paths(self.opened.model.scene) if one == path or one.startswith(f"{path}.")]
        origins = [self.opened.model.scene.origin(one) for one in paths]
        return any(one is not None and one.note == PLACEHOLDER for one in origins)

    def ground(self) -> tuple[float, float]:
        """Contact level from the rest with its standard error [m]: seen in the records, else by the gap of the device
        and the drive's force at rest."""
        if self.evidence.level is not None:
            return self.evidence.level
        model = self.known.model()
        rest = model.static_load * float(model.law.force(np.zeros(1), model.history)[0])
        return -model.normal * (model.gap + rest), 0.0

    def traces(self, *purposes: Purpose) -> list[Trace]:
        """Records of some purposes, without what is their instruments'."""
        return [trace for purpose in purposes for trace in self.evidence.traces.get(purpose, [])]

    def alike(self, purpose: Purpose) -> list[Trace]:
        """Records of a purpose that are sampled as most of them are, to be fitted together; others are left out."""
        traces = self.traces(purpose)
        steps = [round(one.step, 12) for one in traces]
        usual = Counter(steps).most_common(1)[0][0] if traces else 0.0
        for trace, step in zip(traces, steps, strict=True):
            if step != usual:
                rates = amount(1.0 / step, "Hz", 6), amount(1.0 / usual, "Hz", 6)
                said = f"is sampled at {rates[0]}, most records of its purpose at {rates[1]}: they are fitted together"
                one = Excluded(trace.file, "", said)
                self.evidence.left_out += [one] * (one not in self.evidence.left_out)
        return [trace for trace, step in zip(traces, steps, strict=True) if step == usual]

    def signals(self, *purposes: Purpose) -> dict[str, Waveform]:
        """Drive of every set of some purposes that states one."""
        sets = [one for purpose in purposes for one in self.opened.sets(purpose)]
        return {name: one.signal for name, one in sets if one.signal is not None}

    def files_of(self, purpose: Purpose) -> list[RecordFile]:
        """Files of a purpose, as read."""
        names = {name for name, _ in self.opened.sets(purpose)}
        return [one for one in self.evidence.readings if one.set in names]

    def nothing_for(self, purpose: Purpose, what: str) -> list[str]:
        """Why there is not one record of a purpose."""
        files = [one.file for one in self.files_of(purpose)]
        if not files:
            return [f"the campaign has no records of {what} (purpose '{purpose.value}')"]
        said = together([str(one) for one in self.evidence.left_out if one.file in files])
        return [f"none of the {len(files)} records of {what} can be used", *said]

    def remark(self, said: str) -> None:
        """Say something of the records or the result, once."""
        if said not in self.evidence.remarks:
            self.evidence.remarks.append(said)

    def report(self, what: str) -> None:
        """Tell progress."""
        total = len(self.opened.campaign.records) + _MESSAGES
        total += sum(len(one.files) for _, one in self.opened.sets(Purpose.VALIDATION))
        if self.progress is not None:
            self.progress(min(self._reported, total), total, what)
        self._reported += 1


@single_threaded
def identify(
    campaign: Opened | str | os.PathLike[str], seed: int = 1, progress: Progress | None = None
) -> Identification:
    """Identify a device from the records of one campaign, as the verb does (`tarsus.identify.verb.identify`)."""
    opened = campaign if isinstance(campaign, Opened) else read_campaign(campaign)
    return StepRunner.of(opened, seed, progress).run()
