"""The records of a campaign as evidence: every file read and checked, the ground that they show, what was left out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tarsus.base.errors import InputError
from tarsus.identify.campaign import Opened, RecordFile, read_records
from tarsus.identify.clock import clocks_of
from tarsus.identify.consistency import Relation, not_together, odd_ones
from tarsus.identify.influence import Influence, of_levels
from tarsus.identify.instruments import SOUND, Instruments, compared
from tarsus.identify.traces import Trace, contact_level, misplaced, stands_of, trace_of
from tarsus.model.drive.waveforms import SweptSine
from tarsus.records.excluded import Excluded, excluded_of
from tarsus.records.measurement import Measurement, Quantity
from tarsus.records.purpose import Purpose

_REPEATED = (Purpose.LOOPS, Purpose.RAMPS, Purpose.CLOSE, Purpose.AIR)
"""Records whose repeats show the same motion; bounces need not."""
_GROUND = (Purpose.RAMPS, Purpose.LOOPS, Purpose.BOUNCES)
_SLOW = (Purpose.RAMPS, Purpose.LOOPS)
_MOTION = (Quantity.DISPLACEMENT, Quantity.VELOCITY)
_FAR = 100.0
"""Gaps that no foot of these devices moves, or hundredth of one that ramps which should reach the ground do not exceed:
between a device that jumps ten gaps high and units that are wrong by a thousand."""
_APART = 0.02
"""Part by which levels of the ground may differ between records: gaps are set to a few percent of themselves."""
_SURE = 8.0
"""Share of the contact level, and standard errors, by which purposes may show the ground at different places."""


@dataclass
class Evidence:
    """Records read so far.

    opened: the campaign; readings: every file; left_out: data not used, with reasons; traces by purpose; level: of the
    contact from the rest, with its standard error [m]; remarks: what does not fit together, though it is used;
    instruments: what of the records is theirs, and was corrected; relations: by file and point, of displacement and
    velocity."""

    opened: Opened
    readings: list[RecordFile] = field(default_factory=list)
    left_out: list[Excluded] = field(default_factory=list)
    traces: dict[Purpose, list[Trace]] = field(default_factory=dict)
    level: tuple[float, float] | None = None
    remarks: list[str] = field(default_factory=list)
    instruments: Instruments = SOUND
    relations: dict[str, Mapping[str, Relation]] = field(default_factory=dict)

    def read(self, tell: Callable[[str], None]) -> None:
        """Read every file, and keep its faults."""
        for name in self.opened.campaign.records:
            tell(f"reading {name}")
            found = read_records(self.opened, name)
            self.readings += found
            for reading in found:
                self.left_out += reading.problems
        records = [r.record for r in self.readings if r.record is not None]
        if records:
            sweeps = [
                (r.record, signal)
                for r in self.readings
                if r.record is not None and isinstance(signal := self.opened.campaign.records[r.set].signal, SweptSine)
            ]
            clocks, found = clocks_of(sweeps), compared(records, self.opened.model.points)
            files = [r.file for r in self.readings if r.record is not None]
            self.relations = dict(zip(files, found.relations, strict=True))
            self.correct(replace(found, pace=clocks.pace, starts=clocks.starts, lost=clocks.lost))

    def perturbed(self) -> Iterator[Evidence]:
        """The same records with each number that was corrected of them moved by its standard error."""
        for instruments in self.instruments.uncertain():
            yield self._otherwise(instruments, self.readings)
        if shared := float(np.hypot(self.opened.campaign.calibration, self.instruments.shared)):
            yield self._otherwise(self.instruments, self._scaled(1.0 + shared))

    def _scaled(self, gain: float) -> list[RecordFile]:
        """The files with all motion as of channels with such a gain."""

        def scaled(record: Measurement) -> Measurement:
            values = record.values.copy()
            values[[k for k, one in enumerate(record.channels) if one.quantity in _MOTION]] *= gain
            return replace(record, values=values)

        return [replace(r, record=scaled(r.record)) if r.record else r for r in self.readings]

    def _otherwise(self, instruments: Instruments, readings: list[RecordFile]) -> Evidence:
        out = replace(self, readings=readings, remarks=[])
        out.correct(instruments)
        out.find_ground()
        return out

    def correct(self, instruments: Instruments) -> None:
        """Trace all records without what is their instruments'; what was formed of the records before is dropped."""
        self.instruments, self.traces = instruments, {}
        self.left_out = [one for r in self.readings for one in r.problems]
        for name, one in self.opened.campaign.records.items():
            if one.purpose is Purpose.MODAL or one.walks:
                continue
            traces = [trace for r in self.readings if r.set == name for trace in self._trace(r)]
            if one.purpose in _REPEATED:
                traces = self._without(traces, odd_ones(traces))
            self.traces.setdefault(one.purpose, []).extend(traces)

    def record(self, reading: RecordFile) -> Measurement | None:
        """The record of a file without what is its instruments'; a sweep also without its delay behind the drive."""
        if reading.record is None:
            return None
        swept = self.opened.campaign.records[reading.set].purpose is Purpose.MODAL
        return self.instruments.corrected(reading.record, swept)

    def as_seen(self, purposes: Sequence[Purpose]) -> list[Trace]:
        """Traces of the files that are used with the delays of their instruments: only gains are corrected."""
        used = [trace for purpose in purposes for trace in self.traces.get(purpose, [])]
        if not self.instruments.delaying:
            return used
        files, prompt = {one.file for one in used}, self.instruments.prompt
        return [
            self._traced(r, prompt.corrected(r.record, False), 0.0)
            for r in self.readings
            if r.file in files and r.record is not None
        ]

    def _trace(self, reading: RecordFile) -> list[Trace]:
        """The record of a file, if it has one whose channels belong together."""
        record = self.record(reading)
        if record is None or record.drive is None:
            return []
        try:
            trace = self._traced(reading, record, self.instruments.delay_time)
        except InputError as error:
            self.left_out += [excluded_of(reading.file, said) for said in error.problems]
            return []
        return self._without([trace], not_together(trace, self.relations.get(reading.file, {})))

    def _traced(self, reading: RecordFile, record: Measurement, late: float) -> Trace:
        """A record, so late [s] and by a clock as slow as its instruments', as a trace of its file."""
        one = self.opened.campaign.records[reading.set]
        points, drive = self.opened.model.points, record.drive or ""
        trace = trace_of(record, points, reading.set, drive, one.rest, one.gap, late, self.instruments.slow)
        order = next((k for k, one in enumerate(self.readings) if one.file == reading.file), 0)
        return replace(trace, file=reading.file, order=order)

    def _without(self, traces: Sequence[Trace], wrong: Sequence[Excluded]) -> list[Trace]:
        self.left_out += wrong
        files = {one.file for one in wrong}
        return [trace for trace in traces if trace.file not in files]

    def _check_sizes(self) -> None:
        """Leave out all records where the foot moves a thousand times too far, or too little, for the device's gap.

        Displacement and velocity of each record may agree when the unit of both is wrong; only the gap shows it then.
        """
        foot, own = self.opened.model.foot_point, self.opened.model.gap
        ramps = self.traces.get(Purpose.RAMPS, [])
        near = [t for purpose in _GROUND for t in self.traces.get(purpose, []) if (t.gap or own) < _FAR * own]
        if not near:
            return
        size = float(np.median([np.ptp(t.x[t.point(foot)]) for t in near]))
        least = float(np.max([np.ptp(t.x[t.point(foot)]) for t in ramps])) if ramps else own
        if size <= _FAR * own and least >= own / _FAR:
            return
        shown = size if size > _FAR * own else least
        said = (
            f"the foot moves {shown:.3g} m near a ground that the device has {own:.3g} m away, {shown / own:.3g} times "
            "as much: are its displacements and velocities in mm stated as m, or in um as mm, or the other way round?"
        )
        count = sum(len(found) for found in self.traces.values())
        self.remarks.append(f"all {count} records of displacement are left out: {said}")
        self.left_out += [Excluded(t.file, foot, said) for found in self.traces.values() for t in found]
        self.traces = {purpose: [] for purpose in self.traces}

    def find_ground(self) -> None:
        """The contact level of all records, and the records whose foot is not where it says."""
        self._check_sizes()
        foot = self.opened.model.foot_point
        near = {p: [t for t in self.traces.get(p, []) if t.gap is None] for p in _GROUND}
        levels = {p: contact_level(near[p], foot, p in _SLOW) for p in _GROUND}
        standing = [t for p in _SLOW for t in near[p]]
        self.level = contact_level(standing, foot, True) or levels[Purpose.BOUNCES]
        if self.level is None:
            return
        self._compare(levels)
        for purpose, found in self.traces.items():
            if purpose is Purpose.AIR:
                continue
            wrong = []
            for trace in found:
                said = None if trace.gap is not None else misplaced(trace, foot, self.level[0])
                if said is not None:
                    wrong.append(Excluded(trace.file, "", said))
            self.traces[purpose] = self._without(found, wrong)

    def ground(self) -> tuple[Influence, float] | None:
        """Where each file shows the ground, with the standard error of the level [m]; None where none does."""
        slow, fast = (
            [t for p in purposes for t in self.traces.get(p, []) if t.gap is None]
            for purposes in (_SLOW, [p for p in _GROUND if p not in _SLOW])
        )
        found = stands_of(slow, fast, self.opened.model.foot_point)
        return None if self.level is None or found is None else (of_levels(found), self.level[1])

    def _compare(self, levels: dict[Purpose, tuple[float, float] | None]) -> None:
        """Widen the level where purposes show the ground at different places, and say so."""
        assert self.level is not None
        value, error = self.level
        seen = {purpose: one for purpose, one in levels.items() if one is not None}
        ends = [one[0] for one in seen.values()]
        if len(seen) < 2:
            return
        apart, unsure = max(ends) - min(ends), float(np.sqrt(sum(one[1] ** 2 for one in seen.values())))
        if apart <= max(_APART * abs(value), _SURE * unsure):
            return
        places = ", ".join(f"{1e6 * one[0]:.4g} um in records of {p.value}" for p, one in seen.items())
        self.remarks.append(
            f"the ground lies at different places from the rest: {places}; the zero of some of them is wrong, and "
            "with it the constant of the drive's law and what depends on the gap"
        )
        self.level = value, float(np.hypot(error, apart))

    def close(self, used: set[str]) -> None:
        """Say of every file that was read and not left out, but of which nothing was used, that it was not."""
        named = used | {one.file for one in self.left_out}
        for purpose in Purpose:
            names = {name for name, _ in self.opened.sets(purpose)}
            files = [r.file for r in self.readings if r.set in names]
            idle = [file for file in files if file not in named]
            where = idle if len(idle) < max(len(files), 2) else [f"all {len(idle)} files"]
            said = f"read, but nothing of it was used (purpose '{purpose.value}')"
            self.left_out += [Excluded(file, "", said) for file in where]
