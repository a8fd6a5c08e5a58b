"""The millipede's leg after a 14 V step: the nonlinear multi-body model beside its single mode (4.3), as Fig. 4.4.

python examples/leg_step.py [FIGURE.svg]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.signal import StateSpace, step

from tarsus.model.structure.leg import Leg, SingleMode
from tarsus.model.structure.leg_motion import LegMotion, step_response
from tarsus_reproduce.legs import millipede_leg


@dataclass(frozen=True)
class Comparison:
    """Both answers at the same times."""

    motion: LegMotion
    mode: SingleMode
    single: NDArray[np.float64]


def single_mode_step(mode: SingleMode, times: NDArray[np.float64], volts: float) -> NDArray[np.float64]:
    """Lift (n,) of ``m y'' + c y' + k y = G V`` after a step [m]."""
    flow = [[0.0, 1.0], [-mode.stiffness / mode.mass, -mode.damping / mode.mass]]
    system = StateSpace(flow, [[0.0], [mode.gain * volts / mode.mass]], [[1.0, 0.0]], [[0.0]])
    return step(system, T=times)[1]


def compare(leg: Leg, duration: float = 0.02, samples: int = 801) -> Comparison:
    """The leg and its slow mode after a step to the rated voltage."""
    times = np.linspace(0.0, duration, samples)
    mode = SingleMode.of(leg)
    return Comparison(step_response(leg, times), mode, single_mode_step(mode, times, leg.rated_volts))


def figure(found: Comparison) -> Figure:
    """Lift of the body after the step, by both."""
    drawn = Figure(figsize=(6.4, 3.2), layout="constrained")
    axes, times = drawn.subplots(), found.motion.time * 1e3
    axes.plot(times, found.motion.lift * 1e6, label="multi-body leg (Fig. 4.3)")
    axes.plot(times, found.single * 1e6, "--", label="single mode (4.3)")
    axes.set(xlabel="time (ms)", ylabel="lift of the body (µm)", xlim=(times[0], times[-1]))
    axes.legend(frameon=False)
    return drawn


if __name__ == "__main__":
    leg = millipede_leg().leg
    found = compare(leg)
    mode, motion = found.mode, found.motion
    print(f"single mode: {mode.frequency:.1f} Hz, damping ratio {mode.damping_ratio:.3f}, gain {mode.gain:.3g} N/V")
    for name, lift in (("multi-body", motion.lift), ("single mode", found.single)):
        peak = int(np.argmax(lift))
        when, end = motion.time[peak] * 1e3, lift[-1] * 1e6
        print(f"{name:>12}: peak {lift[peak] * 1e6:.2f} um at {when:.2f} ms, then {end:.2f} um")
    print(f"energy balance of the nonlinear leg closed to {motion.closure:.1e}")
    if len(sys.argv) > 1:
        figure(found).savefig(sys.argv[1])
