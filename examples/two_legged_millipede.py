"""The source's three masses walk: stride, speed and cost over the frequency of the gait."""

from __future__ import annotations

import math

import tarsus as ts
from tarsus.solve import Run

PERIODS = 10
"""Drive periods of every run; measures leave out the first four."""


def walk(hz: float, volts: float = 14.0) -> Run:
    """The millipede of Table 4.1 walking at a frequency [Hz]."""
    scene = ts.load_scene("millipede-table", hz=hz, volts=volts)
    return ts.simulate(scene, duration=PERIODS / hz)


def stride_by_hand(run: Run) -> float:
    """Stride [m] of a foot that spends its stroke along the way in the air until it lands; what is left moves the body.

    The stroke is ``G_l V / k_l``, spent with the time constant ``c_l / k_l``; each of the two legs lands once a period.
    """
    scene = run.scene
    drive, leg = (next(iter(one.values())) for one in (scene.robot.drives, scene.robot.structure.legs))
    landings = run.events["time"][(run.events["kind"] == 2) & (run.events["foot"] == 0)]
    delay = landings[-1] % run.period  # the first leg's volts rise as the period begins
    stroke = drive.law.gain * drive.load.weights["L1_hip_x"] * scene.gait.high / leg.stiffness_l
    return 2.0 * stroke * math.exp(-delay * leg.stiffness_l / leg.damping_l)


if __name__ == "__main__":
    print("   Hz  stride [um]  speed [mm/s]  body lengths/s  energy/step [uJ]  cost of transport")
    for hz in (20.0, 50.0, 100.0, 200.0, 400.0):
        found = walk(hz).measures
        print(
            f"{hz:5.0f}  {found.stride.value * 1e6:11.3f}  {found.mean_speed.value * 1e3:12.4f}  "
            f"{found.body_lengths_per_second.value:14.4f}  {found.electrical_energy.value * 1e6:16.3f}  "
            f"{found.cost_of_transport.value:17.3g}"
        )
    print(
        f"at 50 Hz, by hand from the instant a foot lands: {stride_by_hand(walk(50.0)) * 1e6:.3f} um; the rest of the "
        "stroke is spent in the air"
    )
