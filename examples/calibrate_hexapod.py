"""Calibrate the packaged hexapod to the first two scenarios of Table 3.2, and say how well each unknown is determined.

    python examples/calibrate_hexapod.py [--seconds 300] [--device hexapod] [--seeds 2]

Not printed, and fitted here: the gain of the drive (how far 10 V move foot 1 at rest), the drive frequency of the
sine and of the square scenario, and the unit scale of the small forces (the printed C_e and b_sfd are taken in the
unit of the printed matrices, times this). Six measured numbers for four unknowns. Not fitted, and assumed: the
voltage swings between 0 and 10 V (with +-10 V the foot's mean height stays near its gap, far below the measured one),
thickness of the film and distance of the electrode (`FILM`, `ELECTRODE`), the dominant-mode impact map made passive.

The objective counts each of the three mean errors against the source's own model (28, 12 and 13 %). How well an unknown
is determined is the range, others kept, over which the objective stays within 10 % of the best; motion is chaotic, so
ranges are only as fine as the seeds allow.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import differential_evolution

import tarsus as ts
from tarsus.scene import Scene
from tarsus.study.seeds import foot_statistics
from tarsus_reproduce.robots import scenario_scene
from tarsus_reproduce.scenarios import Scenario, packaged_scenarios

SETTLE, OBSERVED = 0.3, 0.5
SOURCE_ERRORS = np.array([0.2788, 0.1170, 0.1311])
"""Mean errors of the source's model: bounces, peak, mean height."""
PRINTED_FILM, PRINTED_ELECTROSTATIC = 1e-12, 1e-9
"""b_sfd and C_e of Table 3.3, without a printed unit."""
FILM, ELECTRODE = 5e-6, 250e-6
"""Residual thickness of the film and distance of the electrode in contact [m]: assumed."""


@dataclass(frozen=True)
class Unknowns:
    """What is fitted. static [m]: displacement of foot 1 at rest for 10 V; sine_hz, square_hz [Hz]; scale [1]."""

    static: float
    sine_hz: float
    square_hz: float
    scale: float

    LOW = (4e-6, 20.0, 20.0, 1e-4)
    HIGH = (40e-6, 900.0, 900.0, 1.0)

    def array(self) -> np.ndarray:
        """Logarithms (4,)."""
        return np.log([self.static, self.sine_hz, self.square_hz, self.scale])

    @classmethod
    def of(cls, logarithms: np.ndarray) -> Unknowns:
        """From logarithms (4,)."""
        return cls(*np.exp(logarithms).tolist())


def targets() -> list[Scenario]:
    """The two scenarios with measured numbers."""
    return [scenario for scenario in packaged_scenarios("hexapod") if scenario.measured]


def unit_of(scene: Scene) -> float:
    """Kilograms per printed unit of mass: the modal mass, since the printed modes are mass-normalised."""
    structure = scene.robot.structure
    assert isinstance(structure, ts.Modal)
    return structure.modal_masses[0]


def described(device: str, scenario: Scenario, unknowns: Unknowns) -> Scene:
    """The scene of a scenario with these unknowns."""
    hz = unknowns.sine_hz if scenario.wave == "sine" else unknowns.square_hz
    scene = scenario_scene(device, replace(scenario, freq_hz=hz), hz)
    structure = scene.robot.structure
    row = structure.row("foot1")
    compliance = float(row @ np.linalg.solve(structure.matrices().stiffness, row))
    unit = unit_of(scene) * unknowns.scale
    return ts.with_values(
        scene,
        {
            "robot.drives.pzt.law.gain": unknowns.static / compliance / 10.0,
            "ground.film": ts.Film(coefficient=PRINTED_FILM * unit, thickness=FILM),
            "ground.electrostatic": ts.Electrostatic(
                coefficient=PRINTED_ELECTROSTATIC * unit, offset=ELECTRODE
            ),
        },
    )


def evaluate(device: str, unknowns: Unknowns, seeds: int) -> np.ndarray:
    """(bounces [1/s], peak [um], mean [um]) of both scenarios (2, 3)."""
    rows = []
    for scenario in targets():
        found = foot_statistics(
            described(device, scenario, unknowns), seeds, duration=OBSERVED, settle=SETTLE
        )
        if not found.ok:
            return np.full((2, 3), np.nan)
        rows.append([found.bounces.mean(), found.peak.mean() * 1e6, found.mean.mean() * 1e6])
    return np.array(rows)


def mean_errors(found: np.ndarray) -> np.ndarray:
    """Mean relative errors (3,) of bounces, peak and mean height against the measurement."""
    measured = np.array(
        [[s.measured.bounces_per_s, s.measured.peak_um, s.measured.mean_um] for s in targets()]
    )
    return np.abs(found / measured - 1.0).mean(axis=0)


def objective(device: str, unknowns: Unknowns, seeds: int) -> float:
    """Sum over the three quantities of error over the source's, with what exceeds it counted four times."""
    errors = mean_errors(evaluate(device, unknowns, seeds)) / SOURCE_ERRORS
    return 30.0 if np.isnan(errors).any() else float(errors.sum() + 3.0 * np.maximum(errors - 1.0, 0.0).sum())


def calibrate(device: str, seconds: float, seeds: int) -> Unknowns:
    """Differential evolution for about so long, from a random population with fixed seed."""
    end = time.monotonic() + seconds
    bounds = list(zip(np.log(Unknowns.LOW), np.log(Unknowns.HIGH), strict=True))
    result = differential_evolution(
        lambda x: objective(device, Unknowns.of(x), seeds),
        bounds,
        popsize=12,
        maxiter=1000,
        tol=0.0,
        polish=False,
        rng=np.random.default_rng(1),
        callback=lambda intermediate_result: time.monotonic() > end,
    )
    return Unknowns.of(result.x)


def determined(
    device: str, best: Unknowns, seeds: int, *, excess: float = 0.10
) -> dict[str, tuple[float, float]]:
    """Range of each unknown, others kept, over which the objective stays within ``excess`` of the best."""
    start = objective(device, best, seeds)
    ranges = {}
    for index, name in enumerate(("static", "sine_hz", "square_hz", "scale")):
        ends = []
        for direction in (-1.0, 1.0):
            reach = 0.0
            for step in (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 2.0):
                moved = best.array()
                moved[index] += direction * step
                if objective(device, Unknowns.of(moved), seeds) > (1.0 + excess) * start:
                    break
                reach = step
            ends.append(float(np.exp(best.array()[index] + direction * reach)))
        ranges[name] = (ends[0], ends[1])
    return ranges


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=300.0)
    parser.add_argument("--device", default="hexapod")
    parser.add_argument("--seeds", type=int, default=2)
    options = parser.parse_args()
    best = calibrate(options.device, options.seconds, options.seeds)
    found = evaluate(options.device, best, 16)
    print(best)
    for scenario, row in zip(targets(), found, strict=True):
        print(f"{scenario.wave}: {row[0]:.0f} bounces/s, peak {row[1]:.1f} um, mean {row[2]:.1f} um")
    for name, ours, source in zip(
        ("bounces", "peak", "mean"), mean_errors(found), SOURCE_ERRORS, strict=True
    ):
        print(f"{name}: mean error {ours:.1%}, the source's model {source:.1%}")
    for name, (low, high) in determined(options.device, best, options.seeds).items():
        print(f"{name}: {getattr(best, name):.4g}, good from {low:.4g} to {high:.4g}")


if __name__ == "__main__":
    main()
