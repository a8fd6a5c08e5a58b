"""The chain: all steps of an identification in order, each given what earlier ones found."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.messages import together
from tarsus.base.threads import single_threaded
from tarsus.identify.adhesion import identify_adhesion
from tarsus.identify.airborne import AirRecord, air_records
from tarsus.identify.alternatives import fit_air
from tarsus.identify.campaign import Opened, RecordFile, read_campaign
from tarsus.identify.checks import (
    air_checks,
    held_out_check,
    line_check,
    speed_check,
    step_checks,
    with_checks,
)
from tarsus.identify.contact_film import film_by_impacts
from tarsus.identify.draws import DRAWS
from tarsus.identify.electrostatics import identify_close
from tarsus.identify.estimates import PLACEHOLDER, Estimates
from tarsus.identify.evidence import Evidence
from tarsus.identify.film import FilmFit, identify_film
from tarsus.identify.film_exponent import film_exponent, with_exponent
from tarsus.identify.foot import FootModel
from tarsus.identify.heldout import Comparison, compare
from tarsus.identify.hysteresis import identify_hysteresis
from tarsus.identify.impact_column import identify_impact_column
from tarsus.identify.landing import LandingVerdict, judge_landing
from tarsus.identify.pairs import InAir, Pair, compare_in_air, from_pairs, map_from_pairs
from tarsus.identify.resonance import (
    Resonances,
    identify_resonances,
    rounding_of,
    shape_mismatch,
    static_response,
)
from tarsus.identify.restitution import BounceStudy, identify_restitution
from tarsus.identify.step import NotDone, Shift, StepResult, Trouble, Used, failures
from tarsus.identify.straightened import straightened
from tarsus.identify.traces import Trace
from tarsus.model.drive.waveforms import SweptSine
from tarsus.records.excluded import Excluded
from tarsus.records.purpose import Purpose
from tarsus.tables.table import Table

Floats = NDArray[np.float64]
Progress = Callable[[int, int, str], None]

_STEPS = 10
"""Messages of progress beside those of the files: eight steps, the landing rule and the checks."""
_FILM = "ground.film.coefficient"
_STRUCTURE = "robot.structure.frequencies"


@dataclass(frozen=True, repr=False)
class Identification:
    """Everything that a campaign determines.

    opened: the campaign; readings: every file; left_out: data not used, with reasons; steps: results by name; not_done;
    known: all parameters, with draws; level: of the contact from the rest, with its standard error [m]; resonances:
    the modal fit; film: the detachments; landing: what records say of the landing rule, None where it is assumed;
    comparisons: held-out records; in_air: those with the drive of the bounces; shifts of the zero; remarks; seconds."""

    opened: Opened
    readings: tuple[RecordFile, ...]
    left_out: tuple[Excluded, ...]
    steps: dict[str, StepResult]
    not_done: tuple[NotDone, ...]
    known: Estimates
    level: tuple[float, float] | None
    resonances: Resonances | None
    film: FilmFit | None
    landing: LandingVerdict | None
    comparisons: tuple[Comparison, ...]
    in_air: tuple[InAir, ...]
    shifts: tuple[Shift, ...]
    remarks: tuple[str, ...]
    seconds: float

    def table(self) -> Table:
        """Every number with its interval and verdict, and what the data were used for."""
        from tarsus.identify.tables import identification_table

        return identification_table(self)

    def to_dict(self) -> dict[str, Any]:
        """Everything found as plain data."""
        from tarsus.identify.result import summary_of

        return summary_of(self)

    def __repr__(self) -> str:
        numbers = sum(len(step.paths) for step in self.steps.values())
        return (
            f"<Identification of '{self.opened.campaign.name}': {numbers} numbers in {len(self.steps)} steps>"
        )

    def __str__(self) -> str:
        return self.table().text()

    def _repr_html_(self) -> str:
        return self.table().html()

    @property
    def model(self) -> FootModel:
        """The device as identified."""
        return self.known.model()

    @property
    def files_used(self) -> int:
        """Number of files of which a step or a comparison used something."""
        used = {file for step in self.steps.values() for file in step.files}
        used |= {one.file for one in (*self.comparisons, *self.in_air)}
        return len(used)

    @property
    def all_left_out(self) -> tuple[Excluded, ...]:
        """Data that were not used anywhere, with reasons."""
        return (*self.left_out, *(one for step in self.steps.values() for one in step.left_out))


@dataclass
class StepRunner:
    """Runs the steps; what it has found so far.

    opened: the campaign; evidence: its records; known: parameters found so far; seed: of all draws; progress: called as
    ``progress(done, total, what)``.
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
    bounces: BounceStudy | None = None
    _reported: int = 0

    @classmethod
    def of(cls, opened: Opened, seed: int = 1, progress: Progress | None = None) -> StepRunner:
        """Before its first step."""
        return cls(opened, Evidence(opened), Estimates.nothing(opened.model), seed, progress)

    def run(self) -> Identification:
        """All steps, the validation and the shifted zero."""
        begun = time.perf_counter()
        self.read()
        for number, (name, purpose, step) in enumerate(self.planned()):
            again = (
                name in self.steps and "hysteresis" not in self.steps
            )  # without a law there is nothing new
            if (
                any(self.opened.sets(purpose))
                and not again
                and name not in [one.name for one in self.not_done]
            ):
                self.attempt(name, step)
            if number == 0:  # the sweeps, which tell how late the records of the ground are
                self.find_ground()
        landing = self.judge_landing()
        comparisons, in_air = self.validate(), self.look_in_the_air()
        self.check(comparisons)
        shifts = self.shifted()
        used = {file for step in self.steps.values() for file in step.files}
        used |= {one.file for step in self.steps.values() for one in step.left_out}
        self.evidence.close(used | {one.file for one in (*comparisons, *in_air)})
        if not self.steps:
            raise InputError(
                [f"{one.name} was not done: {said}" for one in self.not_done for said in one.reasons]
                or ["no step could be done"]
            )
        return Identification(
            opened=self.opened, readings=tuple(self.evidence.readings), left_out=tuple(self.evidence.left_out),
            steps=self.steps, not_done=tuple(self.not_done), known=self.known, level=self.evidence.level,
            resonances=self.resonances, film=self.film, landing=landing, comparisons=tuple(comparisons),
            in_air=tuple(in_air), shifts=shifts, remarks=tuple(self.evidence.remarks),
            seconds=time.perf_counter() - begun,
        )  # fmt: skip

    def planned(self) -> tuple[tuple[str, Purpose, Callable[[], StepResult]], ...]:
        """Steps in order, with the records that each is for; one without such records in the campaign is not
        tried. Once the law of the drive is known, the sweeps tell the structure better, and that the law."""
        return (
            ("resonances", Purpose.MODAL, self._resonances),
            ("hysteresis", Purpose.LOOPS, self._hysteresis),
            ("resonances", Purpose.MODAL, self._resonances),
            ("hysteresis", Purpose.LOOPS, self._hysteresis),
            ("film", Purpose.RAMPS, self._film),
            ("electrostatics", Purpose.CLOSE, self._electrostatics),
            ("restitution", Purpose.BOUNCES, self._restitution),
            ("impact map", Purpose.BOUNCES, self._impact_map),
            ("adhesion", Purpose.RAMPS, self._adhesion),
            ("walking", Purpose.WALKING, self._walking),
        )

    def read(self) -> None:
        """Read and check every file."""
        self.evidence.read(self._report)

    def find_ground(self) -> None:
        """Find the ground that the records show, and report what was taken off them."""
        if self.evidence.instruments is not None:
            said = self.evidence.instruments.sentences()
            self.evidence.remarks += [one for one in said if one not in self.evidence.remarks]
        self.evidence.find_ground()

    def attempt(self, name: str, step: Callable[[], StepResult]) -> None:
        """Run a step; what stops it is kept as its reasons, or remarked of one that was done already."""
        before = self.resonances
        self._report(name)
        trouble = Trouble()
        try:
            with trouble.heard():
                found = step()
            reasons = found.unsound()
        except InputError as error:
            reasons = error.problems
        except np.linalg.LinAlgError as error:
            reasons = [f"its equations have no solution with these data ({error})"]
        if reasons and name in self.steps:
            self.resonances = before
            self.evidence.remarks += [f"{name}, with the law of the drive: {said}" for said in reasons]
            return
        if reasons:
            self._forget(name)
            self.not_done.append(NotDone(name, (*reasons, *trouble.sentences())))
            return
        if name in self.steps:
            self.known = self.known.without(self.steps.pop(name))
        purpose = next(purpose for other, purpose, _ in self.planned() if other == name)
        count = Used("files", len(found.files), sum(len(one.files) for _, one in self.opened.sets(purpose)))
        self.steps[name] = replace(found, used=(*found.used, count))
        self.evidence.remarks += [f"{name}: {said}" for said in trouble.sentences()]
        self.known = self.known.after(found)

    def _forget(self, name: str) -> None:
        """Drop what a step that was not done has left for later ones."""
        if name in (held := {"resonances": "resonances", "film": "film", "restitution": "bounces"}):
            setattr(self, held[name], None)

    def _resonances(self) -> StepResult:
        sets = [one for _, one in self.opened.sets(Purpose.MODAL)]
        if not any(r.record is not None for r in self._of(Purpose.MODAL)):
            raise InputError(self._nothing_for(Purpose.MODAL, "sweeps in the air"))
        signals = [one.signal for one in sets if isinstance(one.signal, SweptSine)]
        ends = [sorted((one.start_frequency, one.stop_frequency)) for one in signals]
        if not ends:
            raise InputError(
                "the sets of sweeps state no swept sine as their signal, which tells the band to identify"
            )
        band = max(low for low, _ in ends), min(high for _, high in ends)
        self.resonances = self._structure(band)
        assert self.evidence.instruments is not None  # there are records
        late = None
        if "hysteresis" not in self.steps:  # the second time it is taken off
            late = self.evidence.instruments.behind(self.resonances.fit)
        if late is not None:
            self.evidence.take_off(late)
            self.resonances = self._structure(band)
        out = {one.file for one in self.resonances.step.left_out}
        files = frozenset(r.file for r in self._of(Purpose.MODAL) if r.record is not None) - out
        return replace(self.resonances.step, files=files)

    def _structure(self, band: tuple[float, float]) -> Resonances:
        """Resonances of the sweeps without what is their instruments'; of gains the channels are at fault without which
        the modes have the shapes of the structure."""
        evidence, best, problems = self.evidence, None, []
        assert evidence.instruments is not None  # there are records
        for instruments in evidence.instruments.hypotheses():
            taken = replace(evidence, instruments=instruments)
            records = [one for r in self._of(Purpose.MODAL) if (one := taken.record(r)) is not None]
            rounded = rounding_of(records)
            if "hysteresis" in self.steps:
                records = [straightened(record, self.known.model()) for record in records]
            try:
                found = identify_resonances(self.opened.model, records, band, self.seed, rounded)
            except InputError as error:
                problems += error.problems
                continue
            if best is None or shape_mismatch(found) < shape_mismatch(best[0]):
                best = found, instruments
        if best is None:
            raise InputError(list(dict.fromkeys(problems)))
        if best[1] is not evidence.instruments:
            evidence.take_off(best[1])
        return best[0]

    def _hysteresis(self) -> StepResult:
        traces = self.evidence.traces.get(Purpose.LOOPS, [])
        if not traces:
            raise InputError(self._nothing_for(Purpose.LOOPS, "static loops"))
        self._need_structure()
        self._compare_signs(traces)
        shares = None if self.resonances is None else self.resonances.shares
        draws = np.zeros((DRAWS, 0)) if self.resonances is None else self.resonances.share_draws
        return identify_hysteresis(self.known, traces, self.evidence.level, shares, draws, self.seed + 1)

    def _compare_signs(self, traces: Sequence[Trace]) -> None:
        """Remark where the sweeps move the foot the other way than the loops do: participations, ratios, stay."""
        if self.resonances is None or "hysteresis" in self.steps:  # said already
            return
        foot = self.opened.model.foot_point
        slow = sum(float(np.cov(t.volts, t.x[t.point(foot)])[0, 1]) for t in traces)
        if slow * static_response(self.resonances, foot) < 0.0:
            self.evidence.remarks.append(
                f"in the sweeps point '{foot}' moves the other way with the voltage than in the static loops: the sign "
                "of their drive, or of all their channels, is flipped; no number depends on it"
            )

    def _film(self) -> StepResult:
        traces = self.evidence.traces.get(Purpose.RAMPS, [])
        if not traces:
            raise InputError(self._nothing_for(Purpose.RAMPS, "ramped squares"))
        self._need("hysteresis")
        if self.evidence.level is None:
            raise InputError("no record of ramped squares shows a foot standing on the ground")
        model = self.known.model()
        film = identify_film(model, self.known, traces, self.evidence.level[0], self.seed + 2, self.film)
        exponent = film_exponent(model, film, self.seed + 2)
        self.film = film if exponent is None else with_exponent(film, exponent, self.seed + 2)
        return self.film.step

    def _adhesion(self) -> StepResult:
        if self.film is None:
            raise InputError("it needs the detachments of the step film, which was not done")
        signals = {
            name: one.signal for name, one in self.opened.sets(Purpose.RAMPS) if one.signal is not None
        }
        return identify_adhesion(self.film, self.known, signals, "restitution" in self.steps, self.seed + 3)

    def _electrostatics(self) -> StepResult:
        traces = self.evidence.traces.get(Purpose.CLOSE, [])
        if not traces:
            raise InputError(self._nothing_for(Purpose.CLOSE, "a foot close to the ground"))
        self._need("hysteresis")
        return identify_close(self.known.model(), self.known, traces, self.seed + 6)

    def _restitution(self) -> StepResult:
        traces = self.evidence.traces.get(Purpose.BOUNCES, [])
        if not traces:
            raise InputError(self._nothing_for(Purpose.BOUNCES, "bounces"))
        self._need("hysteresis")
        if self.opened.model.scene.ground.acting.film is not None and _FILM not in self.known.paths:
            raise InputError("it needs the film, which no step has found")
        level = self._ground(), 0.0 if self.evidence.level is None else self.evidence.level[1]
        if (close := self.steps.get("electrostatics")) is not None:
            near = self.evidence.traces[Purpose.CLOSE]
            self.known, self.steps["electrostatics"] = film_by_impacts(self.known, close, traces, near, level)
        self.bounces = identify_restitution(self.known.model(), self.known, traces, level, self.seed + 4)
        return self.bounces.step

    def _impact_map(self) -> StepResult:
        if self.bounces is None:
            raise InputError("it needs the impacts of the step restitution, which was not done")
        step = identify_impact_column(self.known.model(), self.bounces, self.seed + 5)
        pairs = self._pairs()
        if not pairs:
            return step
        found, left = map_from_pairs(self.known.model(), pairs)
        return replace(
            step,
            combinations={**step.combinations, **from_pairs(found, self.seed + 5)},
            used=(*step.used, Used("pairs with the air", len(found), len(pairs))),
            left_out=(*step.left_out, *left),
        )

    def _walking(self) -> StepResult:
        from tarsus.identify.walk_step import identify_walking, walk_records

        records, files, scene = [], set(), self.known.model().scene
        for name, one in self.opened.sets(Purpose.WALKING):
            mine = [r for r in self.evidence.readings if r.set == name and r.record is not None]
            records += walk_records(scene, name, one, [r.record for r in mine if r.record is not None])
            files |= {r.file for r in mine}
        if not records:
            raise InputError(self._nothing_for(Purpose.WALKING, "walks"))
        return replace(identify_walking(scene, records, self.seed + 7), files=frozenset(files))

    def _pairs(self) -> list[Pair]:
        """Sets of bounces with the sets of the same drive in the air, as far as their files can be used."""
        whole = {one.file for one in self.evidence.left_out}
        out = []
        for name, one in self.opened.sets(Purpose.BOUNCES):
            near, far = (
                tuple(
                    record
                    for r in self.evidence.readings
                    if r.set == which
                    and r.file not in whole
                    and (record := self.evidence.record(r)) is not None
                )
                for which in (name, one.air)
            )
            if one.air is not None and near and far:
                out.append(Pair(name, one.air, near, far))
        return out

    def check(self, comparisons: Sequence[Comparison]) -> None:
        """Compare what was found with what it predicts; what fails is remarked, and verdicts know of it."""
        self._report("checks")
        known, steps = self.known, self.steps
        for name, step in steps.items():
            steps[name] = with_checks(step, step_checks(step, known))
        if "hysteresis" in steps:
            steps["hysteresis"] = with_checks(
                steps["hysteresis"], *air_checks(fit_air(self._air_records, known), known)
            )
        if self.bounces is not None and "restitution" in steps:
            steps["restitution"] = with_checks(steps["restitution"], speed_check(self.bounces, known))
        if "adhesion" in steps:
            steps["adhesion"] = with_checks(steps["adhesion"], line_check(steps["adhesion"], known))
        last = next(reversed(steps), None)
        if last is not None:
            foot = self.opened.model.foot_point
            noise = {
                t.file: float(t.noise_x[k] / t.x[k].std())
                for t in self.evidence.traces.get(Purpose.VALIDATION, [])
                for k in (t.point(foot),)
            }
            steps[last] = with_checks(steps[last], held_out_check(comparisons, noise, known))
        self.evidence.remarks += failures(one for step in steps.values() for one in step.checks)

    def _air_records(self, known: Estimates) -> list[AirRecord]:
        """Records in the air, and loops up to the ground, beside the device with some values."""
        film = self.opened.model.scene.ground.acting.film
        # near the ground a film that no step has found would be taken for something else
        purposes = (Purpose.LOOPS, Purpose.AIR) if film is None or _FILM in known.paths else (Purpose.AIR,)
        sets = [(name, one) for purpose in purposes for name, one in self.opened.sets(purpose)]
        signals = {name: one.signal for name, one in sets if one.signal is not None}
        traces = [trace for purpose in purposes for trace in self.evidence.traces.get(purpose, [])]
        found, said = air_records(known, traces, signals, self._ground())
        if known is self.known:  # of the device as identified, not of those about alternatives
            self.evidence.remarks += said
        return found

    def judge_landing(self) -> LandingVerdict | None:
        """Try the landing rules on the records of ramps and bounces; another than the device file's is taken, and
        adhesion formed again with it, where they contradict that one."""
        if self.not_done or not {"restitution", "adhesion"} <= set(self.steps):
            return None
        self._report("landing rule")
        sets = [(name, one) for p in (Purpose.RAMPS, Purpose.BOUNCES) for name, one in self.opened.sets(p)]
        signals = {name: one.signal for name, one in sets if one.signal is not None}
        traces = [
            trace for p in (Purpose.RAMPS, Purpose.BOUNCES) for trace in self.evidence.traces.get(p, [])
        ]
        found = judge_landing(self.known.model(), traces, signals, self._ground())
        if found is not None and found.replaced:
            self.opened = replace(
                self.opened, model=self.opened.model.changed({"ground.landing": found.chosen})
            )
            self.known = replace(self.known.without(self.steps.pop("adhesion")), base=self.opened.model)
            self.attempt("adhesion", self._adhesion)
        return found

    def validate(self) -> list[Comparison]:
        """Held-out records against simulations of the identified device."""
        out: list[Comparison] = []
        if "hysteresis" not in self.steps or self.not_done:
            return out
        model = self.known.model()
        for trace in self.evidence.traces.get(Purpose.VALIDATION, []):
            self._report(f"validating on {trace.set}")
            signal = self.opened.campaign.records[trace.set].signal
            if signal is None:
                self.evidence.left_out.append(
                    Excluded(trace.file, "", "its set states no signal to simulate")
                )
                continue
            try:
                out.append(compare(model, trace, signal, self._ground()))
            except InputError as error:
                self.evidence.left_out.extend(Excluded(trace.file, "", said) for said in error.problems)
        return out

    def look_in_the_air(self) -> list[InAir]:
        """Records in the air against the identified structure and drive."""
        out: list[InAir] = []
        if "hysteresis" not in self.steps:
            return out
        for trace in self.evidence.traces.get(Purpose.AIR, []):
            self._report(f"in the air, {trace.set}")
            signal = self.opened.campaign.records[trace.set].signal
            try:
                if signal is None:
                    raise InputError("its set states no signal to simulate")
                out.append(compare_in_air(self.known.model(), trace, signal))
            except InputError as error:
                self.evidence.left_out.extend(Excluded(trace.file, "", said) for said in error.problems)
        return out

    def shifted(self) -> tuple[Shift, ...]:
        """The steps again with the campaign's other gap, without draws (Table 2.2): as if the foot had been that
        far from the ground, and with the drive's force alone moved by as much."""
        model = self.opened.model
        gap = self.opened.campaign.other_gap
        if gap is None or self.not_done or self.evidence.level is None or "film" not in self.steps:
            return ()
        self._report("with the other zero position")
        moved = model.changed({f"robot.feet.{model.foot}.gap": gap})
        offset = next((p for p in self.known.paths if p.endswith((".law.constant", ".law.offset"))), None)
        out = [Shift(f"gap of {1e6 * gap:.4g} um", self._again(moved, None, 0.0))]
        if offset is not None:
            force = (model.gap - gap) / self.known.model().static_load
            title = f"force moved by {1e6 * (gap - model.gap):.4g} um"
            out.append(Shift(title, self._again(model, offset, force)))
        return tuple(out)

    def _again(self, model: FootModel, path: str | None, force: float) -> dict[str, float]:
        """Parameters with another model, and the drive's force at one path moved after the loops."""
        opened = replace(self.opened, model=model)
        other = replace(
            self, opened=opened, evidence=replace(self.evidence, opened=opened, remarks=[]), progress=None,
            known=Estimates.nothing(model).after(self.steps["resonances"]).certain(),
            steps={"resonances": self.steps["resonances"]}, not_done=[], bounces=None,
        )  # fmt: skip
        for name, _, step in other.planned():
            if name not in self.steps or name in other.steps or name in ("resonances", "impact map"):
                continue
            other.attempt(name, step)
            if name == "hysteresis" and path is not None:
                values = other.known.values.copy()
                values[other.known.paths.index(path)] += force
                other.known = replace(other.known, values=values)
            other.known = other.known.certain()
        return dict(zip(other.known.paths, other.known.values.tolist(), strict=True))

    def _ground(self) -> float:
        """Contact level from the rest [m]: seen in the records, else by the gap of the device and the drive's force
        at rest."""
        if self.evidence.level is not None:
            return self.evidence.level[0]
        model = self.known.model()
        rest = model.static_load * float(model.law.force(np.zeros(1), model.history)[0])
        return -model.normal * (model.gap + rest)

    def _of(self, purpose: Purpose) -> list[RecordFile]:
        names = {name for name, _ in self.opened.sets(purpose)}
        return [one for one in self.evidence.readings if one.set in names]

    def _nothing_for(self, purpose: Purpose, what: str) -> list[str]:
        files = [one.file for one in self._of(purpose)]
        if not files:
            return [f"the campaign has no records of {what} (purpose '{purpose.value}')"]
        return [f"none of the {len(files)} records of {what} can be used", *self._said(files)]

    def _said(self, files: Sequence[str]) -> list[str]:
        return together([str(one) for one in self.evidence.left_out if one.file in files])

    def _need(self, *names: str) -> None:
        missing = [name for name in names if name not in self.steps]
        if missing:
            raise InputError(f"it needs what the step {missing[0]} finds, which was not done")

    def _need_structure(self) -> None:
        """Raise InputError without a structure: neither identified, nor known beforehand."""
        if "resonances" in self.steps:
            return
        if any(self.opened.sets(Purpose.MODAL)):
            self._need("resonances")
        origin = self.opened.model.scene.origin(_STRUCTURE)
        if origin is not None and origin.note == PLACEHOLDER:
            raise InputError(
                "it needs the structure: the campaign has no sweeps in the air (purpose 'modal'), and the "
                "frequencies of the device are placeholders"
            )
        said = "no sweeps in the air: the structure is that of the device file, as if it were certain"
        if said not in self.evidence.remarks:
            self.evidence.remarks.append(said)

    def _report(self, what: str) -> None:
        total = len(self.opened.campaign.records) + _STEPS + 1
        for purpose in (Purpose.VALIDATION, Purpose.AIR):
            total += sum(len(one.files) for _, one in self.opened.sets(purpose))
        if self.progress is not None:
            self.progress(min(self._reported, total), total, what)
        self._reported += 1


@single_threaded
def identify(
    campaign: Opened | str | os.PathLike[str], seed: int = 1, progress: Progress | None = None
) -> Identification:
    """Identify a device from the records of a campaign.

    Parameters
    ----------
    campaign
        Its file (campaign.toml) or the folder that holds it, or what `tarsus.identify.campaign.read_campaign` gave.
    seed
        Of the draws.
    progress
        Called as ``progress(done, total, what)``.

    Raises
    ------
    InputError
        With every problem of the campaign; if no step could be done at all, with every reason.
    """
    opened = campaign if isinstance(campaign, Opened) else read_campaign(campaign)
    return StepRunner.of(opened, seed, progress).run()
