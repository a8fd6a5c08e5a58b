"""What a user writes, for type checkers: `mypy --strict` and pyright accept all of it."""

from __future__ import annotations

import numpy as np

import tarsus as ts
from tarsus.design import landing


class Magnet(ts.SmoothLaw):
    """An attraction that falls with the fourth power of the gap."""

    strength: float = ts.quantity("N m^4", "strength", default=1e-24, ge=0.0)
    uses_rate = False

    @staticmethod
    def force(gap: float, gap_rate: float, volts: float, time: float, strength: float) -> float:
        return -strength / (gap * gap * gap * gap)


def described() -> ts.Scene:
    """Texts with units where numbers are asked for, tuples or lists for rows."""
    return ts.Scene(
        name="ball",
        duration="50 ms",
        robot=ts.Robot(
            structure=ts.Lumped(coordinates=("ball",), mass=((1e-6,),), stiffness=((0.0,),)),
            drives={},
            feet={"ball": ts.Foot(point="ball", gap="70 um")},
        ),
        ground=ts.Ground(
            restitution=ts.Restitution(coefficient="38 %"),
            film=ts.Film(coefficient="1.7e-21 N m^2 s", thickness="3 um"),
            gravity=ts.Gravity(acceleration=9.81),
        ),
        signals={},
    )


def simulated(scene: ts.Scene) -> float:
    """A run, its measures and its series."""
    run = ts.simulate(scene, "20 ms")
    speed: float = run.measures["hardest_impact"].value
    series = run.at(["1 ms", "2 ms"])
    heights: float = float(np.max(series.state.gap))
    return speed + heights + run.ledger.closure


def batched() -> float:
    """Many runs, by name."""
    batch: ts.Batch = ts.simulate_batch("cantilever", {"robot.feet.tip.gap": ["60 um", "70 um"]}, "10 ms")
    peaks = batch.measure("peak")
    return float(np.nanmax(peaks))


def designed(scene: ts.Scene) -> str:
    """A design, and derivatives."""
    slope = ts.gradient("hardest_impact", scene, ["robot.feet.tip.gap"], "10 ms")
    found = landing("mems-switch", "beam", pairs=1, levels="0 V, 40 V")
    return f"{slope} {found.speed}"


def looked_at(name: str) -> str:
    """Verbs that look at files, and further names by their rooms."""
    sine = ts.Sine(amplitude="8 V", frequency="50 Hz")
    waves: list[ts.waveforms.Waveform] = [sine, ts.waveforms.Ramp(stop=1.0, duration="1 s")]
    table: ts.Table = ts.show(name).table()
    rule = ts.laws.RestituteFirst(speed="20 mm/s")
    return f"{table} {ts.check(name)} {rule} {len(waves)} {ts.report(name)}"


def fitted() -> str:
    """Rooms that are verbs."""
    calibrated = ts.calibrate("cantilever", seed=1)
    identified = ts.identify("lab")
    return f"{calibrated} {identified}"


def changed(scene: ts.Scene) -> ts.Scene:
    """A copy with other values."""
    return ts.with_values(scene, {"robot.feet.ball.gap": "60 um"})
