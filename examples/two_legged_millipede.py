"""The source's three masses walk: stride, speed and cost over the frequency of the gait."""

from __future__ import annotations

import tarsus as ts
from tarsus.measure import Measures

PERIODS = 10
"""Drive periods of every run; measures leave out the first four."""


def walk(hz: float, volts: float = 14.0) -> Measures:
    """Measures of the packaged millipede walking at a frequency [Hz]."""
    scene = ts.load_scene("millipede", hz=hz, volts=volts)
    return ts.simulate(scene, duration=PERIODS / hz).measures


if __name__ == "__main__":
    print("   Hz  stride [um]  speed [mm/s]  body lengths/s  energy/step [uJ]  cost of transport")
    for hz in (20.0, 50.0, 100.0, 200.0, 400.0):
        found = walk(hz)
        print(
            f"{hz:5.0f}  {found.stride.value * 1e6:11.3f}  {found.mean_speed.value * 1e3:12.4f}  "
            f"{found.body_lengths_per_second.value:14.4f}  {found.electrical_energy.value * 1e6:16.3f}  "
            f"{found.cost_of_transport.value:17.3g}"
        )
    print(
        "a step costs the same at any frequency; how far it takes depends on how long feet hold while the body moves"
    )
