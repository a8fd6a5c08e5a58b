"""A landing design: what was found, as a table, as data, and as files for a scene and a microcontroller."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.design.energy import energy_of
from tarsus.design.grounds import Grounds
from tarsus.design.headers import digest, header_text, in_comment
from tarsus.design.motion import WATCHED
from tarsus.design.results import DesignResult, csv_text
from tarsus.design.trials import Landings, Trials
from tarsus.files.jsontext import json_text
from tarsus.files.toml import description_text, scene_text
from tarsus.files.version import package_version
from tarsus.measure.shares import share_of
from tarsus.model.scene import Scene, Source, override
from tarsus.orbits.starts import Box
from tarsus.plan.lowering import lower_scene
from tarsus.solve import Session
from tarsus.tables.numbers import amount
from tarsus.tables.table import Column, Table

if TYPE_CHECKING:
    from tarsus.design.front import Design
    from tarsus.design.learning import Learning, Sensor
    from tarsus.design.percents import Percents
    from tarsus.design.problem import DesignProblem
    from tarsus.design.pulse_train import PulseTrain
    from tarsus.model.drive.waveforms import OnOff

LANDING_FILES = ("landing.json", "signal.toml", "scene.toml", "landing.h", "scenarios.csv", "report.html")
"""Names of everything that `tarsus design landing` writes."""
STARTS, SEEN, SAME = 48, 8, 0.01
"""Other starts of a design (a motion that a twentieth of them lead to is missed once in ten), the
last periods that are looked at, and the share within which touchdowns are as hard as stated: a tenth of the scatter of
a measured coefficient of restitution."""


@dataclass(frozen=True, repr=False)
class LandingDesign(DesignResult):
    """A soft landing and why to believe it: a `Design` whose robust candidate is compared with the plain step.

    before, after (1, 1): what the foot does on the nominal ground with the plain step and with the design. grounds:
    those that it was judged on, and the worst of a box; on_grounds, before_on_grounds (1, ng). put_down (nr,) [m/s]:
    hardest touchdown of the motion that other starts settle to on the nominal ground, NaN of runs that did not reach
    their end.
    """

    found: Design
    seed: int
    sensor: Sensor
    before: Landings
    after: Landings
    grounds: Grounds
    on_grounds: Landings
    before_on_grounds: Landings
    put_down: Floats
    learning: Learning | None = None

    @classmethod
    def of(cls, found: Design, seed: int, sensor: Sensor) -> LandingDesign:
        """Of a design of pulses alone."""
        request, row = found.request, found.robust.row[None]
        trials = Trials(request.runs())
        grounds = found.grounds
        if found.robust.worst_ground and found.certificate is not None:
            worst = [found.robust.worst_ground[path] for path in grounds.names]
            grounds = grounds.with_more(np.array([worst]))
        own = Grounds.nominal(request.scene, grounds.names)
        plain = request.free.as_it_is()
        return cls(
            found,
            seed,
            sensor,
            trials.on(plain, own),
            trials.on(row, own),
            grounds,
            trials.on(row, grounds),
            trials.on(plain, grounds),
            _put_down(found),
        )

    @property
    def request(self) -> DesignProblem:
        """What was asked for, in the words of `tarsus.design`."""
        return self.found.request

    @property
    def train(self) -> PulseTrain:
        """The signals that it was chosen among."""
        assert self.request.free.pulses is not None
        return self.request.free.pulses

    @property
    def signal(self) -> OnOff:
        """In whole ticks of the timer and whole millivolts."""
        return self.train.step.waveform(self.found.robust.row)

    @property
    def percents(self) -> Percents:
        """What one percent of each number costs."""
        return self.found.percents

    @property
    def speed(self) -> float:
        """Hardest touchdown of the whole period on the nominal ground [m/s]."""
        return float(self.after.speed[0, 0])

    @property
    def touchdowns(self) -> float:
        """Touchdowns a step on the nominal ground."""
        return float(self.after.touchdowns[0, 0])

    @property
    def worst(self) -> float:
        """Hardest touchdown on any of the grounds [m/s], NaN without any but the scene's own."""
        return np.nan if self.request.over is None else float(self.on_grounds.speed.max())

    @property
    def nominal_worst(self) -> float:
        """The same of the design that is best on the nominal ground alone; NaN without a box."""
        return np.nan if self.found.certificate is None else self.found.optimum.worst[0]

    @property
    def as_stated(self) -> tuple[int, float, float, float]:
        """How many other starts settle to touchdowns no harder than stated, their share and its 95 % interval."""
        count = int((self.put_down <= (1.0 + SAME) * self.speed).sum())
        return count, *share_of(count, len(self.put_down))

    @property
    def switching_times(self) -> tuple[float, ...]:
        """When each voltage begins [s], from the landing edge on; the period follows from the last duration."""
        return tuple(np.concatenate([[0.0], np.cumsum(self.signal.durations)[:-1]]).tolist())

    @property
    def energies(self) -> tuple[float, float]:
        """Energy a period, plain and with charge recovery [J]; NaN where the drive has no capacitance."""
        return energy_of(self.request.scene.robot.drives[self.train.drive], self.signal)

    @property
    def scene(self) -> Scene:
        """The scene with the designed signal, whose provenance says so."""
        scene = self.request.scene
        signals = {**scene.signals, self.train.drive: self.signal}
        return override(scene, {"signals": signals}, by="`tarsus design landing`", source=Source.DESIGNED)

    @property
    def plain_signal(self) -> OnOff:
        """The step without pairs, the picture's before."""
        return self.train.step.waveform(self.train.step.plain()[0])

    @property
    def volts(self) -> str:
        """Between which volts the design lies, in words, and how to ask for others."""
        levels = self.train.step.levels
        low, high = (amount(one, "V") for one in (levels.low, levels.high))
        return f"from {low} to {high}, whatever the scene's own signal has; others: levels=free=LOW:HIGH"

    def table(self) -> Table:
        """The plateaus of the signal under what they are for."""
        before, (energy, recovered) = self.before, self.energies
        notes = [
            f"volts: {self.volts}",
            f"plain step: {amount(float(before.speed[0, 0]), 'm/s')}, {_touchdowns(before.touchdowns[0, 0])}",
            f"designed: {amount(self.speed, 'm/s')}, {_touchdowns(self.touchdowns)}, {self.found.robust.motion.words}",
        ]
        if len(self.put_down):
            hardest = amount(float(np.nanmax(self.put_down, initial=0.0)), "m/s")
            notes.append(
                f"placed differently: {self.as_stated[0]} of {len(self.put_down)} starts settle to touchdowns no "
                f"harder; the hardest is {hardest}"
            )
        if math.isfinite(self.worst):
            rival = amount(self.nominal_worst, "m/s")
            nominal = f"; the nominal design's worst {rival}" if math.isfinite(self.nominal_worst) else ""
            notes.append(f"worst: {amount(self.worst, 'm/s')} on {len(self.grounds)} grounds{nominal}")
        if self.request.over is not None:
            notes.append(f"borne: {', '.join(self.request.over.names)}")
        notes.append(self.percents.words)
        if math.isfinite(energy):
            notes.append(f"energy: {amount(energy, 'J')} a period, {amount(recovered, 'J')} with charge recovery")
        signal = zip(self.switching_times, self.signal.levels, self.signal.durations, strict=True)
        columns = (Column("from", "s", 6), Column("voltage", "V", 5), Column("for", "s", 6))
        plain, softer = (amount(float(one.speed[0, 0]), "m/s") for one in (before, self.after))
        title = f"LandingDesign of '{self.request.scene.name}': {softer} instead of {plain}"
        return Table(title, columns, signal, notes + self.found.remarks)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI units; NaN where there is none.

        design: what `tarsus design` says of it; speed [m/s]: hardest nominal touchdown of the whole period;
        touchdowns: a step; worst [m/s]: over the grounds; switching_times [s]; energy [J] a period; scenarios: what the
        foot does on every ground.
        """
        energy, recovered = self.energies
        step, learned = self.train.step, self.learning
        return {
            "scene": self.request.scene.name,
            "foot": self.train.foot,
            "drive": self.train.drive,
            "risk": self.request.risk.name,
            "speed": self.speed,
            "touchdowns": self.touchdowns,
            "worst": self.worst,
            "nominal_worst": self.nominal_worst,
            "switching_times": list(self.switching_times),
            "levels": list(self.signal.levels),
            "durations": list(self.signal.durations),
            "period": step.period,
            "tick": step.period / self.train.ticks,
            "energy": energy,
            "energy_recovered": recovered,
            "plain": _landed(self.before, 0),
            "nominal": _landed(self.after, 0),
            "put_down": {
                "starts": len(self.put_down),
                "share": self.as_stated[1],
                "share_95": list(self.as_stated[2:]),
                "speeds": self.put_down.tolist(),
            },
            "percents": self.percents.to_dict(),
            "scenarios": _scenarios(self),
            "digest": digest(self.signal),
            "learning": learned
            and {
                "steps": learned.speeds.shape[1] - 1,
                "grounds": len(learned.grounds),
                "halved_in_ten": learned.halved,
                "median_speed": np.median(learned.speeds, axis=0).tolist(),
                "plain_speed": float(np.median(learned.plain)),
                "median_regret": np.median(learned.regret, axis=0).tolist(),
                "sensor": learned.sensor.value,
            },
            "design": self.found.to_dict(),
            "version": package_version(),
        }

    def texts(self) -> dict[str, str]:
        """The signal for any scene, a header for a microcontroller, the table of grounds, and the data."""
        rows = _scenarios(self)
        names = [name for name in rows[0] if name != "ground"]
        table = [(*row["ground"].values(), *(row[name] for name in names)) for row in rows]
        return {
            "scene.toml": scene_text(self.scene),
            "signal.toml": signal_text(self),
            "landing.h": header_text(self),
            "scenarios.csv": csv_text((*self.grounds.names, *names), table),
            "landing.json": json_text(self.to_dict()) + "\n",
        }


def _touchdowns(count: float) -> str:
    return f"{count:g} touchdown{'' if count == 1 else 's'} a step"


def _landed(found: Landings, at: int) -> dict[str, float]:
    names = ("speed", "impulse", "touchdowns", "contact", "peak", "lifted")
    return {name: float(getattr(found, name)[0, at]) for name in names}


def _scenarios(design: LandingDesign) -> list[dict[str, Any]]:
    plain = design.before_on_grounds.speed[0].tolist()
    return [
        {"ground": ground, **_landed(design.on_grounds, i), "plain_speed": plain[i]}
        for i, ground in enumerate(design.grounds.each())
    ]


def _put_down(found: Design) -> Floats:
    """Hardest touchdown [m/s] in the last `SEEN` of `WATCHED` periods (`STARTS`,) from as many starts that are spread
    evenly over the usual box of `tarsus.orbits.starts`; NaN where a run did not reach its end, and none at all where
    feet remember their contacts, whose box is not known."""
    scene = found.scene_of(found.robust)
    if lower_scene(scene).laws.remembers:
        return np.zeros(0)
    box, train = Box.of(scene, None), found.request.free.pulses
    assert train is not None
    starts = box.values(box.drawn(STARTS, 0))
    batch = Session(box.scene).batch(starts, WATCHED * train.step.period, threads=found.request.threads)
    seen = batch.measured(("hardest_impact",), period=train.step.period, skip=WATCHED - SEEN)["hardest_impact"]
    assert seen.per_foot is not None
    return np.asarray(seen.per_foot)[:, list(scene.robot.feet).index(train.foot)]


def signal_text(design: LandingDesign) -> str:
    """The signal as a table of a scene file: in the place of the scene's own ``[signals.NAME]``."""
    train = design.train
    return (
        f"# `tarsus design landing`: foot '{train.foot}' of {in_comment(design.request.scene.name)}, "
        f"{design.speed:.4g} m/s; digest {digest(design.signal)}\n"
        f"[signals.{train.drive}]\n{description_text(design.signal)}"
    )
