"""A landing design: what was found, as a table, as data, and as files for a scene and a microcontroller."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.design.energy import energy_of
from tarsus.design.headers import digest, header_text, in_comment
from tarsus.design.results import DesignResult, csv_text
from tarsus.design.trials import SAME
from tarsus.files.jsontext import json_text
from tarsus.files.toml import description_text, scene_text
from tarsus.files.version import package_version
from tarsus.measure.shares import share_of
from tarsus.model.scene import Scene, Source, override
from tarsus.tables.numbers import amount
from tarsus.tables.table import Column, Table

if TYPE_CHECKING:
    from tarsus.design.grounds import Grounds
    from tarsus.design.judge import Attack, Round
    from tarsus.design.landing_request import LandingRequest
    from tarsus.design.learning import Learning
    from tarsus.design.percents import Percents
    from tarsus.design.trials import Landings, Regime
    from tarsus.model.drive.waveforms import OnOff

LANDING_FILES = ("landing.json", "signal.toml", "scene.toml", "landing.h", "scenarios.csv", "report.html")
"""Names of everything that `tarsus design landing` writes."""


@dataclass(frozen=True)
class FrontPoint:
    """A design on the front: pairs of switchings, nominal speed [m/s], plain energy a period and that with charge
    recovery [J], and its signal."""

    pairs: int
    speed: float
    energy: float
    recovered: float
    signal: OnOff


@dataclass(frozen=True, repr=False)
class LandingDesign(DesignResult):
    """A soft landing and why to believe it.

    signal: rounded to the timer; exact: before rounding. before, after (1, 1): what the foot does on the nominal ground
    with the plain step and with the design. grounds: those that the design was judged on, and the worst of a box that
    were found; on_grounds, before_on_grounds (1, ng). attack: the search for the worst ground of a box; rounds: of
    cutting planes. worst [m/s]: hardest touchdown on any of these grounds, NaN without any; nominal_worst: the same of
    the design for the nominal ground alone. loss [m/s]: of rounding. put_down (nr,) [m/s]: hardest touchdown of the
    motion that other starts settle to on the nominal ground, NaN of runs that did not reach their end. percents: what
    one percent of each number costs. runs: made in all; settle: periods of a run.
    """

    request: LandingRequest
    signal: OnOff
    exact: OnOff
    pairs: int
    before: Landings
    after: Landings
    regime: Regime
    grounds: Grounds
    on_grounds: Landings
    before_on_grounds: Landings
    worst: float
    nominal_worst: float
    attack: Attack | None
    rounds: tuple[Round, ...]
    loss: float
    front: tuple[FrontPoint, ...]
    put_down: Floats
    percents: Percents
    runs: int
    settle: int
    learning: Learning | None = None

    @property
    def speed(self) -> float:
        """Hardest touchdown of the whole period on the nominal ground [m/s]."""
        return float(self.after.speed[0, 0])

    @property
    def touchdowns(self) -> float:
        """Touchdowns a step on the nominal ground."""
        return float(self.after.touchdowns[0, 0])

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
        return energy_of(self.request.actuator, self.signal)

    @property
    def scene(self) -> Scene:
        """The scene with the designed signal, whose provenance says so."""
        scene = self.request.scene
        signals = {**scene.signals, self.request.drive: self.signal}
        return override(scene, {"signals": signals}, by="`tarsus design landing`", source=Source.DESIGNED)

    @property
    def plain_signal(self) -> OnOff:
        """The step without pairs, the picture's before."""
        return self.request.step.waveform(self.request.step.plain()[0])

    @property
    def volts(self) -> str:
        """Between which volts the design lies, in words, and how to ask for others."""
        levels = self.request.step.levels
        low, high = (amount(one, "V") for one in (levels.low, levels.high))
        return f"from {low} to {high}, whatever the scene's own signal has; others: levels=free=LOW:HIGH"

    def table(self) -> Table:
        """The plateaus of the signal under what they are for."""
        before, (energy, recovered) = self.before, self.energies
        notes = [
            f"volts: {self.volts}",
            f"plain step: {amount(float(before.speed[0, 0]), 'm/s')}, {_touchdowns(before.touchdowns[0, 0])}",
            f"designed: {amount(self.speed, 'm/s')}, {_touchdowns(self.touchdowns)}, {self.regime.words}",
        ]
        if len(self.put_down):
            hardest = amount(float(np.nanmax(self.put_down, initial=0.0)), "m/s")
            notes.append(
                f"placed differently: {self.as_stated[0]} of {len(self.put_down)} starts settle to touchdowns no "
                f"harder; the hardest is {hardest}"
            )
        if math.isfinite(self.worst):
            looked = "" if self.attack is None else f", {self.attack.tried} looked at"
            rival = amount(self.nominal_worst, "m/s")
            notes.append(
                f"worst: {amount(self.worst, 'm/s')} on {len(self.grounds)} grounds{looked}; the nominal design's "
                f"worst {rival}"
            )
        if self.request.over is not None:
            notes.append(f"borne: {', '.join(self.request.over.names)}")
        notes.append(self.percents.words)
        if math.isfinite(energy):
            notes.append(f"energy: {amount(energy, 'J')} a period, {amount(recovered, 'J')} with charge recovery")
        signal = zip(self.switching_times, self.signal.levels, self.signal.durations, strict=True)
        columns = (Column("from", "s", 6), Column("voltage", "V", 5), Column("for", "s", 6))
        plain, softer = (amount(float(one.speed[0, 0]), "m/s") for one in (before, self.after))
        pairs = f"{self.pairs} pair{'s' * (self.pairs != 1)}"
        title = f"LandingDesign of '{self.request.scene.name}': {softer} instead of {plain}, {pairs}"
        return Table(title, columns, signal, notes)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI units; NaN where there is none.

        speed [m/s]: hardest nominal touchdown of the whole period; touchdowns: a step; worst [m/s]: over the grounds;
        switching_times [s]; energy [J] a period; scenarios: what the foot does on every ground.
        """
        energy, recovered = self.energies
        request, step, found, learned = self.request, self.request.step, self.attack, self.learning
        worst = (
            None
            if found is None
            else {
                "ground": dict(zip(self.grounds.names, found.grounds[0, 0].tolist(), strict=True)),
                "score": float(found.costs[0, 0]),
                "tried": found.tried,
            }
        )
        return {
            "scene": request.scene.name,
            "foot": request.foot,
            "drive": request.drive,
            "risk": request.risk.name,
            "objective": request.options.objective.value,
            "speed": self.speed,
            "touchdowns": self.touchdowns,
            "worst": self.worst,
            "nominal_worst": self.nominal_worst,
            "pairs": self.pairs,
            "switching_times": list(self.switching_times),
            "levels": list(self.signal.levels),
            "durations": list(self.signal.durations),
            "period": step.period,
            "tick": step.period / request.ticks,
            "rounding_loss": self.loss,
            "energy": energy,
            "energy_recovered": recovered,
            "plain": _landed(self.before, 0),
            "nominal": _landed(self.after, 0),
            "regime": self.regime.words,
            "put_down": {
                "starts": len(self.put_down),
                "share": self.as_stated[1],
                "share_95": list(self.as_stated[2:]),
                "speeds": self.put_down.tolist(),
            },
            "percents": self.percents.to_dict(),
            "periods_to_settle": self.settle - 1,
            "scenarios": _scenarios(self),
            "rounds": [{"grounds": one.grounds, "score": one.score, "worst": one.worst} for one in self.rounds],
            "worst_ground": worst,
            "front": [
                {
                    "pairs": one.pairs,
                    "speed": one.speed,
                    "energy": one.energy,
                    "energy_recovered": one.recovered,
                    "levels": list(one.signal.levels),
                    "durations": list(one.signal.durations),
                }
                for one in self.front
            ],
            "runs": self.runs,
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
            "notes": [],
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


def signal_text(design: LandingDesign) -> str:
    """The signal as a table of a scene file: in the place of the scene's own ``[signals.NAME]``."""
    return (
        f"# `tarsus design landing`: foot '{design.request.foot}' of {in_comment(design.request.scene.name)}, "
        f"{design.speed:.4g} m/s; digest {digest(design.signal)}\n"
        f"[signals.{design.request.drive}]\n{description_text(design.signal)}"
    )
